//! The widest vector instructions that the processor has, asked for at run time.
//!
//! Hot loops are written for registers of eight numbers and compiled for several instruction sets. Results have the same
//! bits with each: what is fused is written so, and nothing is reordered.

use fearless_simd::{Level, Simd, dispatch, f32x8, prelude::*};

use crate::sites::LANES;

/// Work that is compiled for several instruction sets. `run` and all that its hot loops call must be inlined into it.
pub(crate) trait Widened {
    type Output;

    fn run<S: Simd>(self, simd: S) -> Self::Output;
}

/// Runs the work with the widest instructions there are.
pub(crate) fn with_widest<W: Widened>(work: W) -> W::Output {
    dispatch!(Level::new(), simd => work.run(simd))
}

/// `a * b + c`, rounded once: on processors without such an instruction, slowly.
#[inline(always)]
pub(crate) fn fused<S: Simd>(a: f32x8<S>, b: f32x8<S>, c: f32x8<S>) -> f32x8<S> {
    match a.witness().level() {
        #[cfg(target_arch = "x86_64")]
        Level::Avx2(_) => a.mul_add(b, c),
        #[cfg(target_arch = "aarch64")]
        Level::Neon(_) => a.mul_add(b, c),
        _ => {
            let mut sums = [0.0f32; LANES];
            for n in 0..LANES {
                sums[n] = a[n].mul_add(b[n], c[n]);
            }
            sums.simd_into(a.witness())
        }
    }
}
