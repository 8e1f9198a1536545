//! Room in the lists that grow as a tissue is cut, made and given back between strokes.
//!
//! A list that is full is copied to a larger place when the next entry comes, in the middle of a stroke, and the more has
//! been cut the longer that takes. So room is made ahead where a stroke ends; one that needs more finds it as before.

/// Makes room for as many entries as a stroke adds where much was cut before: an eighth at least, and then half.
pub fn make<T>(list: &mut Vec<T>) {
    if list.capacity() - list.len() < list.len() / 8 {
        list.reserve_exact(list.len() / 2);
    }
}

/// Cuts a list off, and keeps room for half as many entries again.
pub fn cut_off<T>(list: &mut Vec<T>, count: usize) {
    list.truncate(count);
    list.shrink_to(count + count / 2);
}
