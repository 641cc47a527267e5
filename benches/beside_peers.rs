//! Our side of `side_by_side.py`: the peers' own masks through our Gram matrix and PCA, one JSON line
//! a job. Usage: `beside_peers MASKS.npy JOB`, the job one of `gram-plain`, `gram-avx2`, `gram-avx512`,
//! `gram`, `gram-cropped` (to the box of all silhouettes, before the clock), `pca`. The clock starts with the packed masks in memory, as the peers' does;
//! of Gram matrices the median of five.

#![allow(clippy::print_stdout, reason = "its result is what it prints")]

use std::time::Instant;

use anyhow::{Context, bail};
use muybridge::image_pca::{Changes, ImagePca, InstructionSet};
use muybridge::mask::Mask;

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    // `cargo bench` runs every bench; without masks there is nothing to compare.
    let [path, job] = arguments.as_slice() else { return Ok(()) };
    let masks = masks(&std::fs::read(path).with_context(|| path.clone())?)?;
    let masks = if job == "gram-cropped" { cropped(&masks) } else { masks };
    let masks: Vec<&Mask> = masks.iter().collect();
    let mut seconds = Vec::new();
    let mut result = 0.0;
    // As often as the bit libraries' matrix is made in one process; a whole PCA once, as the peers' are.
    for _ in 0..if job == "pca" { 1 } else { 5 } {
        let start = Instant::now();
        result = done(job, &masks)?;
        seconds.push(start.elapsed().as_secs_f64());
    }
    seconds.sort_by(f64::total_cmp);
    let seconds = seconds[seconds.len() / 2];
    println!("{{\"job\": \"{job}\", \"wall_s\": {seconds:.4}, \"result\": {result}}}");
    Ok(())
}

/// The sum of what a job makes, to be compared with the peers'.
fn done(job: &str, masks: &[&Mask]) -> anyhow::Result<f64> {
    Ok(match job {
        "gram" | "gram-cropped" => gram(masks, InstructionSet::best())?,
        "gram-plain" => gram(masks, InstructionSet::Plain)?,
        "gram-avx2" => gram(masks, InstructionSet::Avx2)?,
        "gram-avx512" => gram(masks, InstructionSet::Avx512)?,
        "pca" => {
            let changes = Changes::of(masks)?;
            let pca = ImagePca::of(&changes, 5)?;
            let images = pca.images(&changes);
            pca.variance_shares().iter().sum::<f64>() + 0.0 * images.mean.values[0]
        }
        _ => bail!("no such job: {job}"),
    })
}

/// The matrix' sum of entries, to be compared with the peers'.
fn gram(masks: &[&Mask], set: InstructionSet) -> anyhow::Result<f64> {
    if !set.is_available() {
        bail!("this processor lacks {set:?}");
    }
    Ok(Changes::of(masks)?.gram(set).iter().map(|&k| f64::from(k)).sum())
}

fn cropped(masks: &[Mask]) -> Vec<Mask> {
    let union = masks.iter().cloned().reduce(|a, b| a.or(&b));
    let Some(bounds) = union.and_then(|m| m.bounds()) else { return masks.to_vec() };
    let crop = |mask: &Mask| {
        Mask::from_fn(bounds.width(), bounds.height(), |x, y| {
            mask.get(bounds.left + x, bounds.top + y)
        })
    };
    masks.iter().map(crop).collect()
}

/// numpy's array of frames × height × width/8 bytes, the leftmost pixel the highest bit.
fn masks(file: &[u8]) -> anyhow::Result<Vec<Mask>> {
    let header = usize::from(*file.get(8).context("a .npy file")?)
        + 256 * usize::from(*file.get(9).context("a .npy file")?);
    let text = String::from_utf8_lossy(file.get(10..10 + header).context("a header")?);
    let shape = text.split_once("'shape': (").and_then(|(_, rest)| rest.split_once(')'));
    let sizes: Vec<usize> = shape
        .context("a shape")?
        .0
        .split(',')
        .filter_map(|size| size.trim().parse().ok())
        .collect();
    let &[_, height, bytes] = sizes.as_slice() else { bail!("three dimensions, not {sizes:?}") };
    let pixel = |frame: &[u8], x: usize, y: usize| frame[y * bytes + x / 8] >> (7 - x % 8) & 1 == 1;
    Ok(file[10 + header..]
        .chunks_exact(height * bytes)
        .map(|frame| Mask::from_fn(8 * bytes, height, |x, y| pixel(frame, x, y)))
        .collect())
}
