//! Time of the Gram matrix, of the leading eigenpairs and of a whole image PCA, on silhouettes of a
//! walking animal that drifts in the picture.

#[path = "support/walker.rs"]
mod walker;

use divan::Bencher;
use muybridge::image_pca::{Changes, ImagePca, InstructionSet};
use muybridge::mask::Mask;
use muybridge::numeric::leading_eigenpairs;
use nalgebra::DMatrix;
use walker::walker;

fn main() {
    divan::main();
}

/// Frames, width, height.
const FRAMES: [(usize, usize, usize); 6] = [
    (250, 960, 540),
    (500, 960, 540),
    (1000, 960, 540),
    (2000, 960, 540),
    (4000, 960, 540),
    (8000, 960, 540),
];

const PIXELS: [(usize, usize, usize); 4] =
    [(500, 320, 240), (500, 960, 540), (500, 1920, 1080), (500, 3840, 2160)];

fn packed(masks: &[Mask]) -> Changes {
    let masks: Vec<&Mask> = masks.iter().collect();
    Changes::of(&masks).unwrap_or_else(|_| unreachable!("masks of one size that differ"))
}

fn instructions(bencher: Bencher<'_, '_>, set: InstructionSet) {
    if !set.is_available() {
        return;
    }
    let masks = walker(1000, 960, 540);
    bencher.bench(|| packed(&masks).gram(set));
}

#[divan::bench(sample_count = 9)]
fn gram_1000_plain(bencher: Bencher<'_, '_>) {
    instructions(bencher, InstructionSet::Plain);
}

#[divan::bench(sample_count = 9)]
fn gram_1000_avx2(bencher: Bencher<'_, '_>) {
    instructions(bencher, InstructionSet::Avx2);
}

#[divan::bench(sample_count = 9)]
fn gram_1000_avx512(bencher: Bencher<'_, '_>) {
    instructions(bencher, InstructionSet::Avx512);
}

fn gram_of(bencher: Bencher<'_, '_>, (frames, width, height): (usize, usize, usize)) {
    let masks = walker(frames, width, height);
    bencher.bench(|| packed(&masks).gram(InstructionSet::best()));
}

#[divan::bench(sample_count = 3, args = FRAMES)]
fn gram_by_frames(bencher: Bencher<'_, '_>, size: (usize, usize, usize)) {
    gram_of(bencher, size);
}

#[divan::bench(sample_count = 3, args = PIXELS)]
fn gram_by_pixels(bencher: Bencher<'_, '_>, size: (usize, usize, usize)) {
    gram_of(bencher, size);
}

/// Gram matrix, five components, scores and component images.
#[divan::bench(sample_count = 5, args = [250, 500, 1000, 2000])]
fn complete_pca(bencher: Bencher<'_, '_>, frames: usize) {
    let masks = walker(frames, 960, 540);
    bencher.bench(|| {
        let changes = packed(&masks);
        let pca = ImagePca::of(&changes, 5);
        pca.map(|pca| pca.images(&changes))
    });
}

/// Five eigenpairs of a matrix with the falling spectrum of a gait and a noisy tail.
#[divan::bench(sample_count = 5, args = [250, 500, 1000, 2000])]
fn eigenpairs(bencher: Bencher<'_, '_>, order: usize) {
    let masks = walker(order, 320, 240);
    let gram = packed(&masks).gram(InstructionSet::best());
    let matrix = DMatrix::from_fn(order, order, |i, j| f64::from(gram[i * order + j]));
    bencher.bench(|| leading_eigenpairs(&matrix, 5));
}
