//! Which instructions the processor has, found out at run time: one binary for all of them.
//!
//! Kernels are safe code, compiled once for each set of instructions. A function that may use instructions
//! beyond those of the target can only be called from ordinary code as `unsafe`; the two such calls
//! here are the only ones in the crate, and each follows the test for the instructions.
#![allow(unsafe_code, reason = "calls of functions compiled for instructions found at run time")]

/// Vector instructions that a kernel can be computed with. No result depends on them: they are the same
/// operations on more values at once, and none that rounds otherwise (a product and a sum in one) is made
/// of two that were written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InstructionSet {
    /// Those every processor of the target has.
    Plain,
    /// AVX2 of x86-64: twice the width; with POPCNT, which every processor with AVX2 has.
    Avx2,
    /// The same and AVX-512 with instructions for bytes and words: four times the width.
    Avx512,
}

impl InstructionSet {
    /// All, the fastest first.
    pub const ALL: [Self; 3] = [Self::Avx512, Self::Avx2, Self::Plain];

    /// Whether this processor has them.
    #[must_use]
    pub fn is_available(self) -> bool {
        match self {
            Self::Plain => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => is_x86_feature_detected!("avx2") && is_x86_feature_detected!("popcnt"),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => {
                Self::Avx2.is_available()
                    && is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx512bw")
                    && is_x86_feature_detected!("avx512vl")
            }
            #[cfg(not(target_arch = "x86_64"))]
            Self::Avx2 | Self::Avx512 => false,
        }
    }

    /// The fastest that this processor has.
    #[must_use]
    pub fn best() -> Self {
        Self::ALL.into_iter().find(|set| set.is_available()).unwrap_or(Self::Plain)
    }

    /// Runs a kernel with these instructions, or with plain ones where the processor lacks them.
    #[inline]
    pub(crate) fn run<K: Kernel>(self, kernel: K) -> K::Result {
        match self {
            #[cfg(target_arch = "x86_64")]
            // SAFETY: the processor has all of these, as has just been tested.
            Self::Avx512 if self.is_available() => unsafe { x86::with_avx512(kernel) },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: the processor has AVX2 and POPCNT, as has just been tested.
            Self::Avx2 if self.is_available() => unsafe { x86::with_avx2(kernel) },
            _ => kernel.run(),
        }
    }
}

/// Work in loops that the compiler makes vectors of, as wide as the instructions it may use. What
/// [`run`](Self::run) calls must be compiled into it, so it is `#[inline(always)]` all the way down.
pub(crate) trait Kernel {
    type Result;

    /// Does the work; to be marked `#[inline(always)]`.
    fn run(self) -> Self::Result;
}

/// The whole part of 0 ≤ `value` < 2²², exactly. A cast minds values beyond the integers, one by one; this
/// is made of operations on vectors.
#[inline(always)]
pub(crate) fn whole_part(value: f32) -> u32 {
    // At this size floats are whole numbers, whose lowest 22 bits are what was added.
    const TO_WHOLE: f32 = 12_582_912.0;
    let nearest = (value + TO_WHOLE) - TO_WHOLE;
    let whole = if nearest > value { nearest - 1.0 } else { nearest };
    (whole + TO_WHOLE).to_bits() & 0x3F_FFFF
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::Kernel;

    #[target_feature(enable = "avx2,popcnt")]
    pub(super) fn with_avx2<K: Kernel>(kernel: K) -> K::Result {
        kernel.run()
    }

    #[target_feature(enable = "avx2,popcnt,avx512f,avx512bw,avx512vl")]
    pub(super) fn with_avx512<K: Kernel>(kernel: K) -> K::Result {
        kernel.run()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Sum<'a>(&'a [u16]);

    impl Kernel for Sum<'_> {
        type Result = u32;

        #[inline(always)]
        fn run(self) -> u32 {
            self.0.iter().map(|v| u32::from(*v)).sum()
        }
    }

    #[test]
    fn plain_instructions_are_everywhere_and_the_best_are_available() {
        assert!(InstructionSet::Plain.is_available());
        assert!(InstructionSet::best().is_available());
    }

    #[test]
    fn the_whole_part_is_that_of_a_cast() {
        for at in 0..4_000_000_u32 {
            let value = at as f32 * 0.37;
            for value in [value, value.next_up(), value.next_down().max(0.0), at as f32] {
                assert_eq!(whole_part(value), value as u32, "{value}");
            }
        }
    }

    #[test]
    fn all_instructions_give_one_result() {
        let values: Vec<u16> = (0..999).collect();
        for set in InstructionSet::ALL {
            // Those that the processor lacks are replaced.
            assert_eq!(set.run(Sum(&values)), 999 * 998 / 2, "{set:?}");
        }
    }
}
