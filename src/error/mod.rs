//! The one error type of the library.
//!
//! A variant holds data, its message says what went wrong and where (file, frame, line), and
//! [`Error::remedy`] says what to do about it. Callers match on variants, never on prose.

mod remedy;

use std::path::{Path, PathBuf};

/// Result of everything in this library that can fail.
pub type Result<T> = std::result::Result<T, Error>;

/// What went wrong, with the place it went wrong in.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    // ---- files -------------------------------------------------------------------------------
    /// A file or folder could not be read, written, created or renamed.
    #[error("{}: cannot {action}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What was tried, an infinitive: "read", "create the folder".
        action: &'static str,
        /// The operating system's reason.
        source: std::io::Error,
    },
    /// A table in the shot cannot be understood.
    #[error("{}, line {line}: {what}", path.display())]
    Table {
        /// The CSV file.
        path: PathBuf,
        /// Counted from 1, the header included.
        line: usize,
        /// What is wrong with the line.
        what: String,
    },
    /// There is no shot in a folder.
    #[error("{}: there is no shot here (no shot.toml)", folder.display())]
    NoShot {
        /// The folder.
        folder: PathBuf,
    },
    /// There is a shot already.
    #[error("{}: there is a shot here already", folder.display())]
    ShotExists {
        /// The folder.
        folder: PathBuf,
    },
    /// `shot.toml` cannot be understood; the text names line and column.
    #[error("{}: {what}", path.display())]
    ShotFile {
        /// The file.
        path: PathBuf,
        /// The parser's message.
        what: String,
    },
    /// A JSON document of the shot cannot be understood.
    #[error("{}: {what}", path.display())]
    Document {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        what: String,
    },
    /// The shot names neither footage nor mattes nor strokes.
    #[error("{}: the shot names neither footage nor mattes nor strokes", folder.display())]
    NoSource {
        /// The shot folder.
        folder: PathBuf,
    },
    /// Footage has to be segmented, but a rectangle is missing.
    #[error("{}: segmenting footage needs a rectangle inside the animal and one clear of it", folder.display())]
    NoRectangles {
        /// The shot folder.
        folder: PathBuf,
    },
    /// A synthetic source of no known gait.
    #[error("synthetic:{name}: there is no such gait")]
    UnknownGait {
        /// The name.
        name: String,
    },
    /// A mask is missing.
    #[error("{}: the mask of frame {frame} is missing", folder.display())]
    MaskMissing {
        /// The folder of masks.
        folder: PathBuf,
        /// The frame.
        frame: usize,
    },
    /// The source brought no frame at all.
    #[error("{}: the source has no frames", folder.display())]
    NoFrames {
        /// The shot folder.
        folder: PathBuf,
    },
    /// Strokes are to be the binary images, but a frame has none.
    #[error("{}: frame {frame} has no strokes", folder.display())]
    StrokesMissing {
        /// The folder of strokes.
        folder: PathBuf,
        /// The frame.
        frame: usize,
    },
    /// No rig or not every pose is named.
    #[error("{}: {what}", shot.display())]
    PosesMissing {
        /// The shot folder.
        shot: PathBuf,
        /// What is missing.
        what: String,
    },
    /// Another process works in the shot.
    #[error("{}: another muybridge is at work in this shot", shot.display())]
    ShotBusy {
        /// The shot folder.
        shot: PathBuf,
    },

    /// The studio cannot take the address it was given.
    #[error("cannot listen on {address}: {source}")]
    Listen {
        /// Address and port.
        address: std::net::SocketAddr,
        /// The operating system's reason.
        source: std::io::Error,
    },

    // ---- pictures ----------------------------------------------------------------------------
    /// A picture could not be decoded, or is not one that can be used.
    #[error("{}{}: {what}", path.display(), frame.map(|f| format!(" (frame {f})")).unwrap_or_default())]
    Picture {
        /// The file.
        path: PathBuf,
        /// The frame it should be, where there is a sequence.
        frame: Option<usize>,
        /// What is wrong with it.
        what: String,
    },

    /// A rectangle that cannot be used.
    #[error(
        "the {which} rectangle {},{},{},{} must lie within the picture of {} × {} pixels and hold at least {least_px} of them",
        rectangle[0], rectangle[1], rectangle[2], rectangle[3], picture.0, picture.1
    )]
    Rectangle {
        /// "foreground" or "background".
        which: &'static str,
        /// Left, top, width, height, pixels.
        rectangle: [usize; 4],
        /// Width and height of the picture.
        picture: (usize, usize),
        /// Fewest pixels it must hold.
        least_px: usize,
    },
    /// A setting outside its range.
    #[error("{name} must be a value that {rule}")]
    Setting {
        /// The setting.
        name: String,
        /// "lies between 0 and 1".
        rule: String,
    },

    // ---- analysis ----------------------------------------------------------------------------
    /// There are not enough masks to analyse.
    #[error("{frames} usable masks are too few to analyse; 4 or more are needed")]
    TooFewMasks {
        /// How many there are.
        frames: usize,
    },
    /// A mask has another size than the first.
    #[error("frame {frame}: the mask is {} × {} pixels, the others {} × {}", found.0, found.1, expected.0, expected.1)]
    MaskSize {
        /// The frame.
        frame: usize,
        /// Its width and height.
        found: (usize, usize),
        /// Width and height of the first mask.
        expected: (usize, usize),
    },
    /// No mask has a single pixel.
    #[error("all {frames} masks are empty: no animal was found")]
    MasksEmpty {
        /// How many masks.
        frames: usize,
    },
    /// All masks are the same.
    #[error("all {frames} masks are the same: nothing moves")]
    MasksConstant {
        /// How many masks.
        frames: usize,
    },

    // ---- frames: pictures, video, mattes, strokes ----------------------------------------------
    /// Nothing exists at the place footage should come from.
    #[error("{}: there is no such file, folder or pattern of files", location.display())]
    SourceMissing {
        /// The place as the user gave it.
        location: PathBuf,
    },
    /// A folder or pattern holds no picture that can be read.
    #[error(
        "{}: no picture found ({ignored} other {} left out)",
        location.display(),
        if *ignored == 1 { "file" } else { "files" }
    )]
    NoPictures {
        /// The folder or pattern.
        location: PathBuf,
        /// Files that were there and are no pictures.
        ignored: usize,
    },
    /// A glob or printf pattern that cannot be understood.
    #[error("{pattern}: not a pattern of file names: {reason}")]
    BadPattern {
        /// The pattern as given.
        pattern: String,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// A choice of frames that is not of the form `A-B` with `A ≤ B`.
    #[error("{text:?} is not a range of frames")]
    BadFrameRange {
        /// The text as given.
        text: String,
    },
    /// A choice of frames that reaches past the end of the footage.
    #[error("{}: frames {first}-{last} asked for, but there are {available} frames (the last is frame {})",
        location.display(), available.saturating_sub(1))]
    FrameRangeOutside {
        /// The footage.
        location: PathBuf,
        /// First frame asked for, from 0.
        first: usize,
        /// Last frame asked for, inclusive.
        last: usize,
        /// Frames there are.
        available: usize,
    },
    /// A frame rate that is zero, negative, infinite or not a number.
    #[error("{fps} frames a second is not a frame rate")]
    BadFrameRate {
        /// The rate as given.
        fps: f64,
    },
    /// A file of zero bytes.
    #[error("{}: frame {frame}: the file is empty", path.display())]
    EmptyFile {
        /// The file.
        path: PathBuf,
        /// Frame of the source it should be, from 0.
        frame: usize,
    },
    /// A file whose first bytes are those of no picture format this program reads.
    #[error("{}: frame {frame}: not a picture of a kind that can be read", path.display())]
    NotAPicture {
        /// The file.
        path: PathBuf,
        /// Frame of the source it should be, from 0.
        frame: usize,
    },
    /// A picture file that ends too early.
    #[error("{}: frame {frame}: the file is cut short", path.display())]
    PictureTruncated {
        /// The file.
        path: PathBuf,
        /// Frame of the source, from 0.
        frame: usize,
    },
    /// A picture file that is damaged, or of a variant that cannot be read.
    #[error("{}: frame {frame}: the picture cannot be decoded: {source}", path.display())]
    PictureUndecodable {
        /// The file.
        path: PathBuf,
        /// Frame of the source, from 0.
        frame: usize,
        /// The decoder's reason.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// A picture larger than this program takes.
    #[error(
        "{}: frame {frame}: {width}×{height} pixels; the limit is {max_side} pixels a side and \
         {max_pixels} pixels in all",
        path.display()
    )]
    PictureTooLarge {
        /// The file.
        path: PathBuf,
        /// Frame of the source, from 0.
        frame: usize,
        /// Width it has, pixels.
        width: usize,
        /// Height it has, pixels.
        height: usize,
        /// Longest side taken, pixels.
        max_side: usize,
        /// Most pixels taken.
        max_pixels: usize,
    },
    /// A picture of another size than the footage it belongs to.
    #[error(
        "{}: frame {frame}: {width}×{height} pixels, but the footage is {expected_width}×{expected_height}",
        path.display()
    )]
    SizeMismatch {
        /// The file.
        path: PathBuf,
        /// Frame of the source, from 0.
        frame: usize,
        /// Width it has, pixels.
        width: usize,
        /// Height it has, pixels.
        height: usize,
        /// Width it should have, pixels.
        expected_width: usize,
        /// Height it should have, pixels.
        expected_height: usize,
    },
    /// The ffmpeg program, which reads video files, is not there or does not start.
    #[error("{}: reading video needs the ffmpeg program, and {} was not found", path.display(), program.display())]
    FfmpegMissing {
        /// The video that should be read.
        path: PathBuf,
        /// The program that was looked for.
        program: PathBuf,
    },
    /// ffmpeg cannot make sense of a file.
    #[error("{}: frame 0: ffmpeg cannot read this file as video:\n{log}", path.display())]
    VideoUnreadable {
        /// The file.
        path: PathBuf,
        /// The last lines ffmpeg wrote.
        log: String,
    },
    /// A file ffmpeg reads, without moving pictures in it (sound only, say).
    #[error("{}: frame 0: there is no video in this file", path.display())]
    NoVideoStream {
        /// The file.
        path: PathBuf,
    },
    /// A video that is cut short or damaged.
    #[error("{}: frame {frame} or near it: the video is cut short or damaged:\n{log}", path.display())]
    VideoDamaged {
        /// The file.
        path: PathBuf,
        /// Frames that came out whole before the damage was noticed.
        frame: usize,
        /// The last lines ffmpeg wrote, or what is missing.
        log: String,
    },
    /// A movie was asked for under a name that says neither MP4 nor GIF.
    #[error("{}: a movie is written as .mp4 or .gif", path.display())]
    MovieFormat {
        /// The name.
        path: PathBuf,
    },
    /// The ffmpeg program, which writes movies, is not there or does not start.
    #[error("{}: writing a movie needs the ffmpeg program, and {} was not found", path.display(), program.display())]
    MovieNeedsFfmpeg {
        /// The movie.
        path: PathBuf,
        /// The program that was looked for.
        program: PathBuf,
    },
    /// ffmpeg could not write a movie.
    #[error("{}: ffmpeg could not write the movie:\n{log}", path.display())]
    MovieFailed {
        /// The movie.
        path: PathBuf,
        /// The last lines ffmpeg wrote.
        log: String,
    },
    /// A stroke picture without a frame number at the end of its name.
    #[error("{}: the file name does not end in a frame number", path.display())]
    UnnumberedStrokes {
        /// The file.
        path: PathBuf,
    },
    /// Two stroke pictures for one frame.
    #[error("{}: frame {frame}: {} is for the same frame", second.display(), first.display())]
    DuplicateStrokes {
        /// The frame both are for.
        frame: usize,
        /// The file that comes first in natural order.
        first: PathBuf,
        /// The other file.
        second: PathBuf,
    },
    /// A picture that cannot be written as PNG.
    #[error("a picture of {width}×{height} pixels cannot be encoded as PNG: {source}")]
    PngEncoding {
        /// Width, pixels.
        width: usize,
        /// Height, pixels.
        height: usize,
        /// The encoder's reason.
        source: Box<dyn std::error::Error + Send + Sync>,
    },

    // ---- control -------------------------------------------------------------------------------
    // ---- report ------------------------------------------------------------------------------
    /// A plot, a sheet or the page could not be drawn.
    #[error("cannot draw \"{what}\": {reason}")]
    Drawing {
        /// What was to be drawn.
        what: String,
        /// The drawing library's reason.
        reason: String,
    },
    /// The footage ended sooner when it was read a second time.
    #[error("the footage ends before frame {frame}, which was there a moment ago")]
    SourceChanged {
        /// The first frame that is gone.
        frame: usize,
    },
    // ---- work --------------------------------------------------------------------------------
    /// The work was stopped by the user (Ctrl-C or a progress callback that said stop).
    #[error("interrupted")]
    Interrupted,
    // ---- keys --------------------------------------------------------------------------------
    /// A number of keys of zero or beyond what the search is made for.
    #[error("{keys} keys were asked for: from 1 to {most} are possible")]
    KeyCountOutOfRange {
        /// What was asked for.
        keys: usize,
        /// The largest number possible.
        most: usize,
    },
    /// After excluding, spacing and merging of equal frames there are not enough left.
    #[error("{keys} keys were asked for, but only {possible} can be chosen from these frames")]
    TooFewFramesForKeys {
        /// What was asked for.
        keys: usize,
        /// The most that can be chosen together.
        possible: usize,
    },
    /// Every admissible set of frames found has a singular kernel matrix.
    #[error("no {keys} frames differ enough to be keys: their kernel matrix is singular")]
    NoRegularKeys {
        /// What was asked for.
        keys: usize,
    },
    /// A frame number beyond the clip.
    #[error("frame {frame} was named as a key, a partner or to be left out: the clip has frames 0 to {}", frames.saturating_sub(1))]
    KeyFrameOutOfRange {
        /// The frame, counted from 0.
        frame: usize,
        /// Number of frames of the clip.
        frames: usize,
    },
    /// A frame that is both forced and excluded.
    #[error("frame {frame} is both forced and excluded")]
    ForcedKeyExcluded {
        /// The frame, counted from 0.
        frame: usize,
    },
    /// More forced frames than keys.
    #[error("{forced} frames are forced, but only {keys} keys were asked for")]
    TooManyForcedKeys {
        /// Number of forced frames.
        forced: usize,
        /// Number of keys.
        keys: usize,
    },
    /// Two forced frames are closer in time than the minimum spacing.
    #[error("the forced frames {first} and {second} are less than {spacing} frames apart")]
    ForcedKeysTooClose {
        /// The earlier frame.
        first: usize,
        /// The later frame.
        second: usize,
        /// The minimum spacing, frames.
        spacing: usize,
    },
    /// Two keys with the same silhouette as far as the components tell.
    #[error(
        "the keys at frames {first} and {second} coincide: interpolation between them is singular"
    )]
    CoincidingKeys {
        /// One frame.
        first: usize,
        /// The other frame.
        second: usize,
    },
    /// A coefficient that is NaN or infinite.
    #[error("frame {frame}: the coefficient of component {} is not a finite number", component + 1)]
    CoefficientNotFinite {
        /// The frame, counted from 0.
        frame: usize,
        /// The component, counted from 0.
        component: usize,
    },
    /// A setting of key choice or interpolation outside its range.
    #[error("{name} is {value}: it must be {allowed}")]
    KernelSetting {
        /// The setting's name.
        name: &'static str,
        /// What was given.
        value: f64,
        /// What is allowed, in words.
        allowed: &'static str,
    },
    /// No frame can be the partner of a key.
    #[error("key frame {key_frame}: no frame is left that could be its partner")]
    NoPartner {
        /// The key's frame.
        key_frame: usize,
    },
    /// A partner given by the user cannot be used.
    #[error("frame {partner} cannot be the partner of key frame {key_frame}: {reason}")]
    PartnerRefused {
        /// The key's frame.
        key_frame: usize,
        /// The partner's frame.
        partner: usize,
        /// Why not.
        reason: &'static str,
    },
    /// A partner given for a key that does not exist.
    #[error("a partner was named for key {}, but there are {keys} keys", position + 1)]
    PartnerForNoKey {
        /// Position in the list of keys, counted from 0.
        position: usize,
        /// Number of keys.
        keys: usize,
    },
    // ---- interpolate -------------------------------------------------------------------------
    /// A frame that is listed twice among keys and partners.
    #[error("frame {frame} is in the list of keys and partners twice")]
    KeyListedTwice {
        /// The frame, counted from 0.
        frame: usize,
    },
    /// An empty list of keys.
    #[error("the list of keys is empty")]
    NoKeys,
    /// Switching models for a number of keys that cannot be halved.
    #[error(
        "{keys} keys cannot be split into overlapping halves: switching models need an even number"
    )]
    OddKeysForSwitching {
        /// Number of keys.
        keys: usize,
    },
    /// Not one partner for each key.
    #[error("{keys} keys, but {partners} partners: switching models need one partner for each key")]
    PartnerCount {
        /// Number of keys.
        keys: usize,
        /// Number of partners.
        partners: usize,
    },

    // ---- rig ---------------------------------------------------------------------------------
    /// A rig file breaks the glTF 2.0 specification in a way that leaves its content unknown.
    #[error("{}: {place}: {reason}", path.display())]
    RigBroken {
        /// The glTF or GLB file.
        path: PathBuf,
        /// The part of the file: "accessor 12", "animation 3, channel 0".
        place: String,
        /// What is wrong with it.
        reason: String,
    },
    /// A rig file uses a valid feature that is not read here.
    #[error("{}: {what} cannot be read", path.display())]
    RigUnsupported {
        /// The glTF or GLB file.
        path: PathBuf,
        /// The feature, with its place.
        what: String,
        /// How to save the file without it, an imperative sentence.
        remedy: &'static str,
    },
    /// A rig file names a buffer file that cannot be read.
    #[error("{}: buffer {buffer} is in {}, which cannot be read: {source}", path.display(), file.display())]
    RigBuffer {
        /// The glTF or GLB file.
        path: PathBuf,
        /// Index of the buffer in the file.
        buffer: usize,
        /// The file that should hold the buffer.
        file: PathBuf,
        /// The operating system's reason.
        source: std::io::Error,
    },
    /// No animation of a rig file has the name asked for.
    #[error("{}: no animation named \"{name}\"; the file has {}", path.display(), quoted(available))]
    AnimationNotFound {
        /// The glTF or GLB file.
        path: PathBuf,
        /// The name asked for.
        name: String,
        /// The names in the file.
        available: Vec<String>,
    },
    /// Several animations of a rig file answer to the name asked for.
    #[error("{}: \"{name}\" names several animations: {}", path.display(), quoted(matches))]
    AnimationAmbiguous {
        /// The glTF or GLB file.
        path: PathBuf,
        /// The name asked for.
        name: String,
        /// The full names that match.
        matches: Vec<String>,
    },
    /// An animation drives a node whose transform is given as a matrix, which glTF forbids.
    #[error("{}: node \"{node}\" has a matrix, so it cannot be animated", path.display())]
    MatrixNodeDriven {
        /// The glTF or GLB file.
        path: PathBuf,
        /// Name of the node.
        node: String,
    },
    /// An animation of a rig file is too long to be sampled.
    #[error("the animation \"{name}\" lasts {duration_s} s, too long to be sampled")]
    AnimationTooLong {
        /// The animation's name.
        name: String,
        /// Time of its last key, seconds.
        duration_s: f64,
    },
    /// A pose was asked for at a time its clip does not reach.
    #[error(
        "key {key}: {time_s:.4} s is outside the clip \"{clip}\", which ends at {duration_s:.4} s"
    )]
    PoseOutsideClip {
        /// Number of the key image, from 1.
        key: usize,
        /// Name of the clip.
        clip: String,
        /// The time asked for, seconds.
        time_s: f64,
        /// The end of the clip, seconds.
        duration_s: f64,
    },
    /// A pose was not given in the form `KEY=CLIP#FRAME` or `KEY=CLIP@SECONDS`.
    #[error("\"{text}\" does not name a pose")]
    PoseForm {
        /// What was given.
        text: String,
    },
    /// The poses do not cover the keys 1 to K once each.
    #[error("of the {keys} poses, {count} are for key {key}")]
    PoseKeys {
        /// How many poses were given.
        keys: usize,
        /// The key with no pose, or with more than one.
        key: usize,
        /// How many poses it has.
        count: usize,
    },

    // ---- interpolate/blend -------------------------------------------------------------------
    /// A weight is NaN or infinite.
    #[error("frame {frame}: the weight of key {key} is not a finite number")]
    WeightNotFinite {
        /// Frame of the clip, from 0.
        frame: usize,
        /// Number of the key, from 1.
        key: usize,
    },

    /// The clip holds fewer strides than a loop should have, or its motion does not advance.
    #[error("a loop of {strides} strides from a clip of {seen:.1}")]
    LoopTooShort {
        /// Strides of the loop.
        strides: usize,
        /// Strides in the clip.
        seen: f64,
    },

    // ---- export ------------------------------------------------------------------------------
    /// A clip drives no channel of any node, so there is no animation to write.
    #[error("the animation \"{name}\" drives no node")]
    NothingDriven {
        /// Name of the animation.
        name: String,
    },
    /// The result would not fit the 4 GiB that a GLB file can hold.
    #[error("{}: with the animation the file would have {bytes} bytes, over the limit of GLB", path.display())]
    GlbTooLarge {
        /// The artist's file.
        path: PathBuf,
        /// Size the file would have.
        bytes: u64,
    },
}

/// The names in quotes, separated by commas; "none" when there are none.
fn quoted(names: &[String]) -> String {
    if names.is_empty() {
        return "none".to_owned();
    }
    names.iter().map(|n| format!("\"{n}\"")).collect::<Vec<_>>().join(", ")
}

impl Error {
    /// An [`Error::Io`]; made for `map_err(Error::io(path, "read"))`.
    pub fn io(path: &Path, action: &'static str) -> impl FnOnce(std::io::Error) -> Error {
        let path = path.to_owned();
        move |source| Error::Io { path, action, source }
    }

    /// An [`Error::Table`].
    pub(crate) fn table(path: &Path, line: usize, what: &str) -> Error {
        Error::Table { path: path.to_owned(), line, what: what.to_owned() }
    }

    /// An [`Error::Setting`].
    pub(crate) fn setting(name: &str, rule: &str) -> Error {
        Error::Setting { name: name.to_owned(), rule: rule.to_owned() }
    }
}
