//! The same loops, compiled once for each instruction set, and the choice among them.

use super::Query;
use crate::field::Placed;

/// What is worth compiling for every instruction set: a function with its arguments.
pub(crate) trait Kernel {
    /// What it gives.
    type Output;

    /// Does it, in registers of `W` numbers. It, and all that it calls in its loops, must be `inline(always)`: what is not
    /// compiled inside the function that enables the instructions does not use them.
    fn run<const W: usize>(self) -> Self::Output;
}

/// An instruction set that this processor has: a value of this type is the proof that it does.
///
/// All give the same bits. To choose one is for tests and benchmarks; [`evaluate`](super::evaluate) takes the widest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dispatch(InstructionSet);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum InstructionSet {
    /// What the crate is compiled for.
    Baseline,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl Dispatch {
    /// The widest instruction set of this processor.
    #[inline]
    pub fn best() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            if is_x86_feature_detected!("avx512f") {
                return Self(InstructionSet::Avx512);
            }
            if is_x86_feature_detected!("avx2") {
                return Self(InstructionSet::Avx2);
            }
        }
        Self(InstructionSet::Baseline)
    }

    /// Every instruction set of this processor, from the narrowest to [`Dispatch::best`].
    pub fn available() -> impl Iterator<Item = Self> {
        let baseline = std::iter::once(InstructionSet::Baseline);
        #[cfg(target_arch = "x86_64")]
        let wider = [
            is_x86_feature_detected!("avx2").then_some(InstructionSet::Avx2),
            is_x86_feature_detected!("avx512f").then_some(InstructionSet::Avx512),
        ];
        #[cfg(not(target_arch = "x86_64"))]
        let wider: [Option<InstructionSet>; 0] = [];
        baseline.chain(wider.into_iter().flatten()).map(Self)
    }

    /// "baseline", "avx2" or "avx512".
    pub fn name(self) -> &'static str {
        match self.0 {
            InstructionSet::Baseline => "baseline",
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx2 => "avx2",
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx512 => "avx512",
        }
    }

    /// [`evaluate`](super::evaluate) with this instruction set.
    ///
    /// # Panics
    ///
    /// When `values` or `gradients` is not as long as `points`.
    pub fn evaluate(
        self,
        skeletons: &[Placed],
        points: &[[f64; 3]],
        values: Option<&mut [f64]>,
        gradients: Option<&mut [[f64; 3]]>,
    ) {
        self.run(Query { skeletons, some: None, points, values, gradients });
    }

    #[inline]
    pub(crate) fn run<K: Kernel>(self, kernel: K) -> K::Output {
        match self.0 {
            // Two numbers a register: SSE2 and NEON.
            InstructionSet::Baseline => kernel.run::<2>(),
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `best` and `available` alone make this variant, after they have seen that the processor has AVX2.
            InstructionSet::Avx2 => unsafe { run_avx2(kernel) },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: as above, with AVX-512F.
            InstructionSet::Avx512 => unsafe { run_avx512(kernel) },
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn run_avx2<K: Kernel>(kernel: K) -> K::Output {
    kernel.run::<4>()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn run_avx512<K: Kernel>(kernel: K) -> K::Output {
    kernel.run::<8>()
}
