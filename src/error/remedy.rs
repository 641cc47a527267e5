//! What the user can do about each error.

use super::Error;

impl Error {
    /// What the user can do about it, one imperative sentence, or `None` where the message
    /// already says all there is.
    pub fn remedy(&self) -> Option<String> {
        match self {
            Error::Io { .. } => None,
            Error::Table { .. } => {
                Some("mend the line, or delete the file and run the stage again".to_owned())
            }
            Error::NoShot { .. } => Some("make one with `muybridge new`".to_owned()),
            Error::ShotExists { .. } => {
                Some("go on with `muybridge run`, or add --force to begin its shot.toml anew".to_owned())
            }
            Error::ShotFile { .. } => None,
            Error::Document { .. } => {
                Some("mend the file, or delete it and run its stage again".to_owned())
            }
            Error::NoSource { .. } => {
                Some("name one in [source] of shot.toml: from, mattes or strokes".to_owned())
            }
            Error::NoRectangles { .. } => Some(
                "set foreground and background in [source] of shot.toml (or give --foreground and --background to `new`), or bring mattes or strokes"
                    .to_owned(),
            ),
            Error::UnknownGait { .. } => Some("walk, trot, canter and gallop are built in".to_owned()),
            Error::MaskMissing { .. } => Some("run `muybridge segment`".to_owned()),
            Error::NoFrames { .. } => Some("check the source and the range of frames".to_owned()),
            Error::StrokesMissing { .. } => {
                Some("draw them, or give rectangles so that the footage is segmented".to_owned())
            }
            Error::PosesMissing { .. } => Some(
                "give `animate --rig FILE --pose 1=CLIP#FRAME --pose 2=CLIP@SECONDS …`, or fill [poses] and [[pose]] in shot.toml"
                    .to_owned(),
            ),
            Error::Listen { .. } => {
                Some("give another --port, or none to take any that is free".to_owned())
            }
            Error::ShotBusy { .. } => Some("wait for it to end".to_owned()),
            Error::Picture { .. } => {
                Some("export the picture again, or leave its frame out with --frames".to_owned())
            }
            Error::Setting { .. } => None,
            Error::Rectangle { which, .. } => Some(format!(
                "give --{which} as left,top,width,height in pixels of the first frame"
            )),
            Error::TooFewMasks { .. } => Some("take more frames of the clip".to_owned()),
            Error::MaskSize { .. } => Some(
                "save the mask at the size of the footage, or run `segment --force`".to_owned(),
            ),
            Error::MasksEmpty { .. } => Some(
                "place the two rectangles on the animal and clear of it, or paint masks or strokes"
                    .to_owned(),
            ),
            Error::MasksConstant { .. } => Some("take footage of a moving animal".to_owned()),
            Error::SourceMissing { .. } => Some(
                "check the spelling; a pattern looks like `frames/*.png` or `frames/%04d.png`"
                    .to_owned(),
            ),
            Error::NoPictures { .. } => Some(
                "give a folder or pattern of PNG, JPEG, TIFF, OpenEXR, WebP, BMP or GIF files, \
                 or name a video file itself"
                    .to_owned(),
            ),
            Error::BadPattern { .. } => {
                Some("write it like `frames/*.png` or `frames/img_%04d.png`".to_owned())
            }
            Error::BadFrameRange { .. } => {
                Some("write the first and the last frame, counted from 0, as in `0-99`".to_owned())
            }
            Error::FrameRangeOutside { available, .. } => match available {
                0 => None,
                n => Some(format!("choose frames within 0-{}", n - 1)),
            },
            Error::BadFrameRate { .. } => {
                Some("give a number above zero, as in `--fps 25`".to_owned())
            }
            Error::EmptyFile { .. } => {
                Some("export or copy the file again, or leave it out".to_owned())
            }
            Error::NotAPicture { .. } => Some(
                "convert it to PNG, JPEG, TIFF, OpenEXR, WebP, BMP or GIF, or leave it out"
                    .to_owned(),
            ),
            Error::PictureTruncated { .. } => {
                Some("export or copy the file again; half a picture is not used".to_owned())
            }
            Error::PictureUndecodable { .. } => {
                Some("open it in a paint program and save it as PNG".to_owned())
            }
            Error::PictureTooLarge { max_side, .. } => Some(format!(
                "scale the footage down below {max_side} pixels; a silhouette about 500 pixels \
                 high is plenty"
            )),
            Error::SizeMismatch { expected_width, expected_height, .. } => Some(format!(
                "export every picture at {expected_width}×{expected_height}, or leave this one out"
            )),
            Error::FfmpegMissing { .. } => Some(
                "install ffmpeg (https://ffmpeg.org, or your system's package `ffmpeg`), or point \
                 MUYBRIDGE_FFMPEG at the program; image sequences need nothing"
                    .to_owned(),
            ),
            Error::MovieFormat { .. } => {
                Some("end the name in .mp4, or in .gif for an animated picture".to_owned())
            }
            Error::MovieNeedsFfmpeg { .. } => Some(
                "install ffmpeg (https://ffmpeg.org, or your system's package `ffmpeg`), or point \
                 MUYBRIDGE_FFMPEG at the program; report.html plays the animation without it"
                    .to_owned(),
            ),
            Error::MovieFailed { .. } => Some(
                "see whether the disk is full, or whether ffmpeg was built without libx264 (a name \
                 that ends in .gif does without)"
                    .to_owned(),
            ),
            Error::VideoUnreadable { .. } => Some(
                "play the file to see whether it is whole, or export it as an image sequence"
                    .to_owned(),
            ),
            Error::NoVideoStream { .. } => Some("name a file with moving pictures".to_owned()),
            Error::VideoDamaged { .. } => Some(
                "choose the whole part with `--frames A-B`, or repair the file \
                 (`ffmpeg -i FILE -c:v ffv1 repaired.mkv`) and look at the result"
                    .to_owned(),
            ),
            Error::UnnumberedStrokes { .. } => Some(
                "name stroke pictures by their frame, counted from 0, as in `000012.png`"
                    .to_owned(),
            ),
            Error::DuplicateStrokes { .. } => Some("keep one of the two".to_owned()),
            Error::PngEncoding { .. } => None,
            Error::Drawing { .. } => Some(
                "check the numbers in the shot's analysis folder, or make them anew with \
                 `muybridge analyze --force`"
                    .to_owned(),
            ),
            Error::SourceChanged { .. } => {
                Some("leave the footage as it is while it is worked on, and run the command again".to_owned())
            }
            Error::Interrupted => Some("run the same command again to go on".to_owned()),
            // ---- keys, interpolate
            Error::KeyCountOutOfRange { .. }
            | Error::KeyFrameOutOfRange { .. }
            | Error::KernelSetting { .. }
            | Error::PartnerForNoKey { .. } => None,
            Error::NoKeys => Some("choose keys first (`muybridge keys SHOT`)".to_owned()),
            Error::KeyListedTwice { .. } => Some("list every frame once".to_owned()),
            Error::OddKeysForSwitching { keys } => {
                Some(format!("choose {} keys, or turn switching models off", keys + 1))
            }
            Error::PartnerCount { .. } => {
                Some("let the tool propose partners (`muybridge keys SHOT --partners`)".to_owned())
            }
            Error::TooFewFramesForKeys { possible, .. } => Some(format!(
                "ask for at most {possible} keys, exclude fewer frames, or lower the spacing"
            )),
            Error::NoRegularKeys { .. } => {
                Some("ask for fewer keys, or use more components".to_owned())
            }
            Error::ForcedKeyExcluded { frame } => {
                Some(format!("take frame {frame} off one of the two lists"))
            }
            Error::TooManyForcedKeys { forced, .. } => {
                Some(format!("ask for {forced} keys or more, or force fewer frames"))
            }
            Error::ForcedKeysTooClose { .. } => {
                Some("force only one of them, or lower the spacing".to_owned())
            }
            Error::CoincidingKeys { first, second } => Some(format!(
                "replace frame {first} or {second} by another frame, use more components, or set a ridge above 0"
            )),
            Error::CoefficientNotFinite { .. } => {
                Some("run the analysis again; the coefficients file is damaged".to_owned())
            }
            Error::NoPartner { .. } => Some(
                "use a longer clip, or name the partner yourself (any frame of the other half of the stride)"
                    .to_owned(),
            ),
            Error::PartnerRefused { .. } => Some("name another frame".to_owned()),

            // ---- rig
            Error::RigBroken { .. } => Some(
                "open the file in the program that made it and export it again, or run the Khronos glTF validator on it".to_owned(),
            ),
            Error::RigUnsupported { remedy, .. } => Some((*remedy).to_owned()),
            Error::RigBuffer { .. } => Some(
                "keep the .bin files where the .gltf expects them, or export the rig as one .glb file".to_owned(),
            ),
            Error::AnimationNotFound { .. } => {
                Some("name one of the file's animations, or the part of its name after the last \"|\"".to_owned())
            }
            Error::AnimationAmbiguous { .. } => {
                Some("give the full name, and rename animations that share one".to_owned())
            }
            Error::MatrixNodeDriven { .. } => Some(
                "export the node with translation, rotation and scale instead of a matrix".to_owned(),
            ),
            Error::AnimationTooLong { .. } => {
                Some("check the times of the animation's keys, or take a lower frame rate".to_owned())
            }
            Error::PoseOutsideClip { .. } => Some(
                "frames count from 0 at the shot's frame rate; check the rate, or give the time in seconds".to_owned(),
            ),
            Error::PoseForm { .. } => Some(
                "write KEY=CLIP#FRAME or KEY=CLIP@SECONDS, for example 1=KeyPoses#1 or 2=Walk@0.25".to_owned(),
            ),
            Error::PoseKeys { .. } => Some("give exactly one pose for each key, numbered from 1".to_owned()),

            // ---- interpolate/blend
            Error::WeightNotFinite { .. } => None,
            Error::LoopTooShort { strides, .. } => Some(if *strides > 1 {
                "ask for a loop of fewer strides (--loop 1), or bring a longer clip".to_owned()
            } else {
                "bring a clip of at least one stride, or leave out --loop (--loop 0)".to_owned()
            }),

            // ---- export
            Error::NothingDriven { .. } => {
                Some("pose the rig in a clip that has channels for its bones".to_owned())
            }
            Error::GlbTooLarge { .. } => {
                Some("save the rig as .gltf with separate buffers, or shrink its textures".to_owned())
            }
        }
    }
}
