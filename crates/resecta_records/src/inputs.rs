//! The instrument's states as bytes, bit for bit.
//!
//! Column by column: of each number the bits that changed since the step before, its four bytes apart from each other, so that
//! what stands still is zeros and packs to almost nothing; last a byte of pedals a step.

use resecta_instrument::{InstrumentField, InstrumentState};

/// Most steps of a record: six hours.
pub const MAX_STEPS: u64 = 6 * 3600 * 60;

/// Bytes of a state.
pub(crate) const STATE_BYTES: usize = 4 * InstrumentField::ALL.len() + 1;

const CUT: u8 = 1;
const COAGULATE: u8 = 2;

/// The states' bytes.
pub(crate) fn write(states: &[InstrumentState]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(states.len() * STATE_BYTES);
    for field in InstrumentField::ALL {
        let bits = || states.iter().map(|state| state.get(field).to_bits());
        let before = || std::iter::once(0).chain(bits());
        for byte in 0..4 {
            bytes.extend(
                bits()
                    .zip(before())
                    .map(|(now, before)| (now ^ before).to_le_bytes()[byte]),
            );
        }
    }
    let pedals = |state: &InstrumentState| {
        let cut = if state.cut { CUT } else { 0 };
        cut | if state.coagulate { COAGULATE } else { 0 }
    };
    bytes.extend(states.iter().map(pedals));
    bytes
}

/// Reads what [`write`] wrote.
pub(crate) fn read(bytes: &[u8]) -> Result<Vec<InstrumentState>, String> {
    let count = bytes.len() / STATE_BYTES;
    if bytes.len() != count * STATE_BYTES {
        return Err(format!(
            "{} bytes of instrument are no whole number of steps",
            bytes.len()
        ));
    }
    let mut states = vec![InstrumentState::default(); count];
    for (column, field) in InstrumentField::ALL.into_iter().enumerate() {
        let planes: [&[u8]; 4] = std::array::from_fn(|byte| &bytes[(4 * column + byte) * count..][..count]);
        let mut bits = 0;
        for (step, state) in states.iter_mut().enumerate() {
            bits ^= u32::from_le_bytes(planes.map(|plane| plane[step]));
            let value = f32::from_bits(bits);
            if !value.is_finite() {
                return Err(format!("{} of step {step} is {value}, expected a number", field.name()));
            }
            state.set(field, value);
        }
    }
    for (step, (state, &pedals)) in states.iter_mut().zip(&bytes[count * (STATE_BYTES - 1)..]).enumerate() {
        if pedals > CUT | COAGULATE {
            return Err(format!("the pedals of step {step} are {pedals}, expected 0 to 3"));
        }
        (state.cut, state.coagulate) = (pedals & CUT != 0, pedals & COAGULATE != 0);
    }
    Ok(states)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn bits(state: &InstrumentState) -> ([u32; 7], bool, bool) {
        let numbers = InstrumentField::ALL.map(|field| state.get(field).to_bits());
        (numbers, state.cut, state.coagulate)
    }

    proptest! {
        #[test]
        fn every_bit_comes_back(rows in prop::collection::vec((prop::array::uniform7(any::<f32>()), 0..4u8), 0..50)) {
            let states: Vec<InstrumentState> = rows.iter().map(|(numbers, pedals)| {
                let mut state = InstrumentState { cut: pedals & 1 != 0, coagulate: pedals & 2 != 0, ..Default::default() };
                for (field, &number) in InstrumentField::ALL.into_iter().zip(numbers) {
                    state.set(field, if number.is_finite() { number } else { -0.0 });
                }
                state
            }).collect();
            let read = read(&write(&states)).unwrap();
            prop_assert!(states.iter().map(bits).eq(read.iter().map(bits)));
        }

        #[test]
        fn any_bytes_are_read_or_refused(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
            if let Ok(states) = read(&bytes) {
                prop_assert_eq!(write(&states), bytes);
            }
        }
    }
}
