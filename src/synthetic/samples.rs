//! The samples that come with the project: `sequences/` and `poses/`, made here and remade by
//! `muybridge samples`.

use std::io::Cursor;

use ::image::codecs::jpeg::JpegEncoder;

use super::footage::{SyntheticFootage, SyntheticSettings};
use super::gaits::Gait;
use super::glb::{NamedClip, to_glb};
use super::horse::horse;
use super::sketch::sketch_strokes;
use crate::error::{Error, Result};
use crate::mask::Mask;
use crate::rig::Pose;

/// A file of the samples.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Sample {
    /// Its path relative to the project, with `/`.
    pub path: String,
    /// Its content.
    pub bytes: Vec<u8>,
}

/// Frames of each sample: a little over two strides.
const FRAMES: usize = 50;

/// All samples. The same on every run.
///
/// # Errors
/// When a picture cannot be encoded, which would be a defect of ours.
pub fn samples() -> Result<Vec<Sample>> {
    let mut all = Vec::new();
    gallop_frames(&mut all)?;
    walk_mattes(&mut all)?;
    canter_strokes(&mut all)?;
    poses(&mut all);
    Ok(all)
}

fn footage(gait: Gait) -> SyntheticFootage {
    SyntheticFootage::new(gait, SyntheticSettings { frames: FRAMES, ..Default::default() })
}

fn gallop_frames(all: &mut Vec<Sample>) -> Result<()> {
    let footage = footage(Gait::Gallop);
    for frame in 0..FRAMES {
        let picture = footage.picture(frame);
        let mut bytes = Cursor::new(Vec::new());
        JpegEncoder::new_with_quality(&mut bytes, 88)
            .encode(
                picture.rgb(),
                picture.width() as u32,
                picture.height() as u32,
                ::image::ExtendedColorType::Rgb8,
            )
            .map_err(|e| Error::PngEncoding {
                width: picture.width(),
                height: picture.height(),
                source: Box::new(e),
            })?;
        let path = format!("sequences/gallop/frame_{frame:04}.jpg");
        all.push(Sample { path, bytes: bytes.into_inner() });
    }
    let (inside, clear) = footage.rectangles();
    all.push(readme(
        "sequences/gallop",
        &format!(
            "The synthetic horse at a gallop: {FRAMES} colour frames of 320 × 240 at 25 frames a second, 24.3 frames a stride.\n\n\
             Rectangles on the first frame: `--foreground {},{},{},{} --background {},{},{},{}`.\n",
            inside.x, inside.y, inside.width, inside.height, clear.x, clear.y, clear.width, clear.height
        ),
    ));
    Ok(())
}

fn walk_mattes(all: &mut Vec<Sample>) -> Result<()> {
    let footage = footage(Gait::Walk);
    for frame in 0..FRAMES {
        let path = format!("sequences/walk_mattes/matte_{frame:04}.png");
        all.push(Sample { path, bytes: footage.true_mask(frame).to_png()? });
    }
    all.push(readme(
        "sequences/walk_mattes",
        &format!("Ready mattes of the synthetic horse at a walk: {FRAMES} frames of 320 × 240, 24.3 frames a stride.\n\nUse: `muybridge new walk --mattes sequences/walk_mattes --fps 25`.\n"),
    ));
    Ok(())
}

fn canter_strokes(all: &mut Vec<Sample>) -> Result<()> {
    let footage = footage(Gait::Canter);
    for frame in 0..FRAMES {
        let pose = footage.truth(frame).pose;
        let mut mask = Mask::new(320, 240);
        for stroke in sketch_strokes(footage.model(), &pose, footage.camera(), 42, frame) {
            mask.draw_stroke(&stroke, 1.5);
        }
        let path = format!("sequences/canter_strokes/{frame:06}.png");
        all.push(Sample { path, bytes: mask.to_png()? });
    }
    all.push(readme(
        "sequences/canter_strokes",
        &format!("Rough strokes over the synthetic horse at a canter, white on black: {FRAMES} frames of 320 × 240, 24.3 frames a stride.\nThe hand that drew them errs by 0.6 % of the diagonal at each point.\n\nUse: `muybridge new canter --strokes sequences/canter_strokes --fps 25`.\n"),
    ));
    Ok(())
}

fn poses(all: &mut Vec<Sample>) {
    let model = horse();
    let strides: Vec<(&str, f64, Vec<Pose>)> = [
        ("Walk", Gait::Walk),
        ("Trot", Gait::Trot),
        ("Canter", Gait::Canter),
        ("Gallop", Gait::Gallop),
    ]
    .into_iter()
    .map(|(name, gait)| {
        // 24 intervals a stride; the last pose is the first again.
        let poses =
            (0..=24).map(|i| gait.pose(&model.skeleton, f64::from(i) / 24.0).pose).collect();
        (name, 24.0 / gait.stride_s(), poses)
    })
    .collect();
    let clips: Vec<NamedClip> =
        strides.iter().map(|(name, fps, poses)| NamedClip { name, fps: *fps, poses }).collect();
    all.push(Sample { path: "poses/horse.glb".to_owned(), bytes: to_glb(&model, &clips, "horse") });
    all.push(readme(
        "poses",
        "`horse.glb`: the skeleton horse of ellipsoids with one stride each of Walk, Trot, Canter and Gallop. Y up, facing +Z, metres.\n",
    ));
}

fn readme(folder: &str, about: &str) -> Sample {
    let name = folder.rsplit('/').next().unwrap_or(folder);
    let text = format!(
        "# {name}\n\n{about}\nProvenance: made by this project's own generator (`muybridge samples`, `src/synthetic/`), seed 42; no footage or rig of others\nis contained. Licence: that of the project, MIT OR Apache-2.0.\n"
    );
    Sample { path: format!("{folder}/README.md"), bytes: text.into_bytes() }
}
