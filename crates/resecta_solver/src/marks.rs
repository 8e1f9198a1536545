//! Marks on elements that cost nothing to clear: what a cut has met, without a map and without a pass over the organ.

/// Which of a number of elements are marked, and where each stands in a list that goes with the marks.
#[derive(Debug, Clone)]
pub(crate) struct Marks {
    round: u32,
    /// The round in which an element was last marked, and its place in the list.
    marked: Vec<(u32, u32)>,
}

impl Marks {
    pub fn new(count: usize) -> Marks {
        Marks {
            round: 0,
            marked: vec![(0, 0); count],
        }
    }

    /// Forgets all marks.
    pub fn clear(&mut self) {
        self.round = match self.round.checked_add(1) {
            Some(round) => round,
            None => {
                self.marked.fill((0, 0));
                1
            }
        };
    }

    /// The entry of an element in the list: a new one at its end, if the element was not marked yet.
    pub fn entry<'a, T>(&mut self, element: u32, list: &'a mut Vec<T>, new: impl FnOnce() -> T) -> &'a mut T {
        let (round, place) = &mut self.marked[element as usize];
        if *round != self.round {
            (*round, *place) = (self.round, list.len() as u32);
            list.push(new());
        }
        &mut list[*place as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_element_has_one_entry_a_round() {
        let mut marks = Marks::new(4);
        for _ in 0..3 {
            marks.clear();
            let mut list = Vec::new();
            for element in [2, 0, 2, 2, 3] {
                marks.entry(element, &mut list, || (element, 0)).1 += 1;
            }
            assert_eq!(list, [(2, 3), (0, 1), (3, 1)]);
        }
    }
}
