//! Tables that are only looked up in, never walked: small whole numbers by a multiplication instead of the standard
//! hash, which guards against chosen keys and takes most of the time of a look-up here.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

pub type Lookup<K, V> = HashMap<K, V, BuildHasherDefault<Multiply>>;

#[derive(Debug, Clone, Default)]
pub struct Multiply(u64);

impl Hasher for Multiply {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        for chunk in bytes.chunks(8) {
            let mut word = [0; 8];
            word[..chunk.len()].copy_from_slice(chunk);
            self.write_u64(u64::from_le_bytes(word));
        }
    }

    fn write_u32(&mut self, value: u32) {
        self.write_u64(value.into());
    }

    fn write_usize(&mut self, value: usize) {
        self.write_u64(value as u64);
    }

    fn write_u64(&mut self, value: u64) {
        // An odd number near 2^64 divided by the golden ratio; the upper half of the product mixes best.
        let product = u128::from(self.0.rotate_left(5) ^ value ^ 0x5bd1_e995) * 0x9e37_79b9_7f4a_7c15;
        self.0 = (product as u64) ^ (product >> 64) as u64;
    }
}
