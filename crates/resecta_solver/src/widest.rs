//! The widest vector instructions that the processor has, asked for at run time.
//!
//! Hot loops are written for registers of eight numbers and compiled for three instruction sets on x86-64: AVX-512 (its
//! registers of 256 bits, of which there are twice as many as before; springs take those of 512, see `pairs.rs`), AVX2 with FMA,
//! and SSE2 for all that lacks those.
//! Results have the same bits with each: what is fused is written so, and nothing is reordered.

#[cfg(not(target_arch = "x86_64"))]
use fearless_simd::dispatch;
use fearless_simd::{Level, Simd, f32x8, prelude::*};

/// Work that is compiled for several instruction sets. `run` and all that its hot loops call must be inlined into it.
pub(crate) trait Widened {
    type Output;

    fn run<S: Simd>(self, simd: S) -> Self::Output;
}

/// Runs the work with the widest instructions there are.
#[inline]
pub(crate) fn with_widest<W: Widened>(work: W) -> W::Output {
    with_level(Level::new(), work)
}

/// Runs work made of plain loops, and all that is inlined into it, compiled for the widest vector instructions that the processor
/// has. Results have the same bits with each. The closure must be inlined by force.
#[inline(always)]
pub fn with_widest_registers<R>(work: impl FnOnce() -> R) -> R {
    with_widest(Plain(work))
}

/// Work that names no registers.
struct Plain<W>(W);

impl<R, W: FnOnce() -> R> Widened for Plain<W> {
    type Output = R;

    #[inline(always)]
    fn run<S: Simd>(self, _: S) -> R {
        (self.0)()
    }
}

/// Runs it with instructions that the processor has.
#[inline]
pub(crate) fn with_level<W: Widened>(level: Level, work: W) -> W::Output {
    match level {
        #[cfg(target_arch = "x86_64")]
        Level::Avx512(simd) => simd.vectorize(
            #[inline(always)]
            || work.run(simd),
        ),
        #[cfg(target_arch = "x86_64")]
        Level::Avx2(simd) => simd.vectorize(
            #[inline(always)]
            || work.run(simd),
        ),
        // What lies between has no fused instructions either: its loops would take as long.
        #[cfg(target_arch = "x86_64")]
        _ => {
            let simd = level.as_sse2().expect("every x86-64 has SSE2");
            simd.vectorize(
                #[inline(always)]
                || work.run(simd),
            )
        }
        #[cfg(not(target_arch = "x86_64"))]
        _ => dispatch!(level, simd => work.run(simd)),
    }
}

/// `a * b + c`, rounded once: on processors without such an instruction, slowly.
#[inline(always)]
pub(crate) fn fused<S: Simd>(a: f32x8<S>, b: f32x8<S>, c: f32x8<S>) -> f32x8<S> {
    #[cfg(target_arch = "x86_64")]
    if matches!(a.simd.level(), Level::Sse2(_)) {
        return fused_slowly(a.into(), b.into(), c.into()).simd_into(a.simd);
    }
    a.mul_add_precise(b, c)
}

/// Not inlined: it is long, and called from everywhere.
#[cfg(target_arch = "x86_64")]
#[inline(never)]
fn fused_slowly(a: [f32; 8], b: [f32; 8], c: [f32; 8]) -> [f32; 8] {
    std::array::from_fn(|n| a[n].mul_add(b[n], c[n]))
}
