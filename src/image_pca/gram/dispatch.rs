//! Which instructions the processor has, found out at run time: one binary for all of them.
//!
//! The kernels are safe code, compiled once for each instruction set. A function that may use
//! instructions beyond those of the target can only be called from ordinary code as `unsafe`;
//! those two calls are the only ones in the crate, and each follows the test for the instructions.
#![allow(unsafe_code, reason = "calls of functions compiled for instructions found at run time")]

use super::super::changes::Changes;
use super::tables::HalfBytes;
use super::{TileSums, popcount, tables};

/// Vector instructions that a Gram matrix can be computed with. The result does not depend on them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InstructionSet {
    /// Those every processor of the target has.
    Plain,
    /// AVX2 of x86-64: twice the width.
    Avx2,
    /// AVX-512 of x86-64 with VPOPCNTDQ, which counts the bits of eight words at once.
    Avx512,
}

impl InstructionSet {
    /// All, the fastest first. Tables of half-bytes pass over what does not change, counting does not:
    /// on the one processor with both that was measured they are more than twice as fast.
    pub const ALL: [Self; 3] = [Self::Avx2, Self::Avx512, Self::Plain];

    /// Whether this processor has them.
    #[must_use]
    pub fn is_available(self) -> bool {
        match self {
            Self::Plain => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => is_x86_feature_detected!("avx2"),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => {
                is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512vpopcntdq")
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

    /// Whether popcounts of vectors are one instruction.
    pub(super) fn counts_vectors(self) -> bool {
        self == Self::Avx512
    }
}

/// The sums of one tile. Without tables of half-bytes it is the popcount kernel's.
pub(super) fn tile_sums(
    instructions: InstructionSet,
    changes: &Changes,
    half_bytes: Option<&HalfBytes>,
    tile: usize,
) -> Vec<TileSums> {
    let has = |set: InstructionSet| instructions == set && set.is_available();
    match half_bytes {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the processor has AVX2, as has just been tested.
        Some(half_bytes) if has(InstructionSet::Avx2) => unsafe {
            x86::tables_avx2(changes, half_bytes, tile)
        },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the processor has AVX-512F and VPOPCNTDQ, as has just been tested.
        None if has(InstructionSet::Avx512) => unsafe { x86::popcount_avx512(changes, tile) },
        Some(half_bytes) => tables::tile_sums(changes, half_bytes, tile),
        None => popcount::tile_sums(changes, tile),
    }
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::{Changes, HalfBytes, TileSums, popcount, tables};

    #[target_feature(enable = "avx2")]
    pub(super) fn tables_avx2(
        changes: &Changes,
        half_bytes: &HalfBytes,
        tile: usize,
    ) -> Vec<TileSums> {
        tables::tile_sums(changes, half_bytes, tile)
    }

    #[target_feature(enable = "avx512f,avx512vpopcntdq")]
    pub(super) fn popcount_avx512(changes: &Changes, tile: usize) -> Vec<TileSums> {
        popcount::tile_sums(changes, tile)
    }
}
