//! The widest vector instructions that the processor has, asked for at run time.
//!
//! Loops are written plainly and compiled several times; results have the same bits with each: what is fused is written
//! so (`mul_add`), and nothing is reordered.

/// Work that is compiled for several widths. `run` and all that its hot loops call must be inlined into it.
pub(crate) trait Widened {
    type Output;

    fn run(self) -> Self::Output;
}

/// Runs the work with the widest instructions there are.
pub(crate) fn with_widest<W: Widened>(work: W) -> W::Output {
    #[cfg(target_arch = "x86_64")]
    {
        let fused = is_x86_feature_detected!("fma");
        if fused && is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512vl") {
            // SAFETY: the processor has been asked for these instructions.
            return unsafe { with_avx512(work) };
        }
        if fused && is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has been asked for these instructions.
            return unsafe { with_avx2(work) };
        }
    }
    work.run()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512vl,avx2,fma")]
fn with_avx512<W: Widened>(work: W) -> W::Output {
    work.run()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn with_avx2<W: Widened>(work: W) -> W::Output {
    work.run()
}
