//! The command line: flags only. Nothing of the library is imported here, and nothing is done
//! while parsing.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};

/// Footage of an animal becomes 3D animation on your own rig.
#[derive(Debug, Parser)]
#[command(name = "muybridge", version, max_term_width = 100, arg_required_else_help = true)]
#[command(after_help = "A shot is a folder. To begin:\n  muybridge demo\n  \
    muybridge new cheetah --from cheetah.mp4 --foreground 420,152,128,65 --background 0,0,325,480\n  \
    muybridge run cheetah")]
pub(crate) struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub(crate) command: Command,
    /// Flags every command takes.
    #[command(flatten)]
    pub(crate) global: Global,
}

/// Flags every command takes.
#[derive(Debug, Args)]
pub(crate) struct Global {
    /// Print one JSON document on standard output instead of text.
    #[arg(long, global = true)]
    pub(crate) json: bool,
    /// Say only results and errors.
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    pub(crate) quiet: bool,
    /// Say more; twice, say everything.
    #[arg(short, long, global = true, action = clap::ArgAction::Count)]
    pub(crate) verbose: u8,
    /// Threads to use; every number gives the same result. Default: one a core.
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) threads: Option<u16>,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// The whole way on a built-in synthetic horse; needs no file.
    Demo(Demo),
    /// Make a shot folder from footage, mattes or strokes.
    New(New),
    /// Footage (and strokes) to masks.
    Segment(Segment),
    /// Image PCA, spectrum, and the verdict whether the clip carries a usable gait.
    Analyze(Analyze),
    /// The frames worth posing, with a contact sheet.
    Keys(Keys),
    /// Your poses for the key images become the whole animation, in your rig's own file.
    Animate(Animate),
    /// The page about the shot.
    Report(Report),
    /// Every stage that can run, in order; redoes only what changed.
    Run(Run),
    /// The studio: a page in your browser to draw, look and decide in.
    Studio(Studio),
    /// Render a clip whose motion is known, run the method blind, compare with the truth.
    Validate(Validate),
    /// A clip's silhouettes as PNG.
    Render(Render),
    /// Remake the sample sequences and rigs that come with the project.
    #[command(hide = true)]
    Samples(Samples),
    /// Shell completions on standard output.
    Completions(Completions),
}

/// `demo`.
#[derive(Debug, Args)]
pub(crate) struct Demo {
    /// The folder to make.
    #[arg(long, value_name = "DIR", default_value = "muybridge-demo")]
    pub(crate) out: PathBuf,
    /// Replace the folder's hand-edited files too.
    #[arg(long)]
    pub(crate) force: bool,
}

/// `new`.
#[derive(Debug, Args)]
#[command(group = clap::ArgGroup::new("input").required(true).multiple(true).args(["from", "mattes", "strokes"]))]
pub(crate) struct New {
    /// The folder to make.
    pub(crate) shot: PathBuf,
    /// A video file, a folder of images, a pattern (`dir/img_%04d.png`, `dir/*.png`), or `synthetic:gallop`.
    #[arg(long, value_name = "SOURCE")]
    pub(crate) from: Option<String>,
    /// A folder or pattern of ready mattes: alpha if there is one, else luminance over one half.
    #[arg(long, value_name = "DIR", conflicts_with = "strokes")]
    pub(crate) mattes: Option<String>,
    /// The mattes are black where the animal is.
    #[arg(long, requires = "mattes")]
    pub(crate) invert: bool,
    /// A folder of sketched strokes, white on black or on transparency.
    #[arg(long, value_name = "DIR")]
    pub(crate) strokes: Option<String>,
    /// Frames a second; a video brings its own, image sequences default to 25.
    #[arg(long, value_name = "HZ")]
    pub(crate) fps: Option<f64>,
    /// Only the frames from A to B, counted from 0, both included.
    #[arg(long, value_name = "A-B")]
    pub(crate) frames: Option<String>,
    /// A rectangle inside the animal on the first frame: left, top, width, height in pixels.
    #[arg(long, value_name = "X,Y,W,H")]
    pub(crate) foreground: Option<String>,
    /// A rectangle clear of the animal on the first frame.
    #[arg(long, value_name = "X,Y,W,H")]
    pub(crate) background: Option<String>,
    /// Replace the shot.toml that is there.
    #[arg(long)]
    pub(crate) force: bool,
}

/// What every stage takes.
#[derive(Debug, Args)]
pub(crate) struct Stage {
    /// The shot folder.
    pub(crate) shot: PathBuf,
    /// Do it again, and overwrite files that were edited by hand.
    #[arg(long)]
    pub(crate) force: bool,
}

/// `segment`.
#[derive(Debug, Args)]
pub(crate) struct Segment {
    /// The shot and how to treat it.
    #[command(flatten)]
    pub(crate) stage: Stage,
    /// Also draw the outlines over frames of the footage, flagged ones among them, as
    /// analysis/overlay.png.
    #[arg(long)]
    pub(crate) overlay: bool,
}

/// `report`.
#[derive(Debug, Args)]
pub(crate) struct Report {
    /// The shot and how to treat it.
    #[command(flatten)]
    pub(crate) stage: Stage,
    /// Also write footage and animated rig side by side as a movie, through ffmpeg: FILE ends in .mp4
    /// or .gif. Default: animation.mp4 in the shot.
    #[arg(long, value_name = "FILE", num_args = 0..=1)]
    pub(crate) movie: Option<Option<PathBuf>>,
}

/// `analyze`.
#[derive(Debug, Args)]
pub(crate) struct Analyze {
    /// The shot and how to treat it.
    #[command(flatten)]
    pub(crate) stage: Stage,
    /// Whether left and right do the same half a stride apart (walk, trot, pace) or not (canter, gallop).
    #[arg(long, value_enum)]
    pub(crate) gait: Option<GaitSymmetry>,
    /// Whether frames whose silhouette is flagged are left out and bridged, or used as they are. Default: leave-out.
    #[arg(long, value_enum, value_name = "WHAT")]
    pub(crate) flagged: Option<Flagged>,
    /// Which stretch between stops, jumps and changes of gait is analysed and animated: `auto` (the best), a number
    /// from 1, or `whole` for the clip as it is. Default: auto.
    #[arg(long, value_name = "auto|K|whole")]
    pub(crate) segment: Option<String>,
    /// Exit with 3 when the clip is unusable.
    #[arg(long)]
    pub(crate) strict: bool,
}

/// What becomes of frames whose silhouette is flagged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Flagged {
    /// Left out of the PCA and bridged, unless most of the clip is flagged.
    LeaveOut,
    /// Used as they are.
    Use,
}

/// What is known of the gait's symmetry.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum GaitSymmetry {
    /// To be told from the footage, if it can be.
    Unknown,
    /// Walk, trot, pace, amble: the silhouette repeats every half stride.
    Symmetric,
    /// Canter, gallop, bound: the silhouette repeats every stride.
    Asymmetric,
    /// Symmetric.
    Walk,
    /// Symmetric.
    Trot,
    /// Symmetric.
    Pace,
    /// Symmetric.
    Amble,
    /// Asymmetric.
    Canter,
    /// Asymmetric.
    Gallop,
    /// Asymmetric.
    Bound,
}

/// `keys`.
#[derive(Debug, Args)]
pub(crate) struct Keys {
    /// The shot and how to treat it.
    #[command(flatten)]
    pub(crate) stage: Stage,
    /// How many key images. Default 4.
    #[arg(short = 'm', long, value_name = "N")]
    pub(crate) count: Option<usize>,
    /// Components to measure distances with. Default 2.
    #[arg(short, long, value_name = "C")]
    pub(crate) components: Option<usize>,
    /// Propose a partner for each key: the same silhouette in the other half of the stride.
    #[arg(long, overrides_with = "no_partners")]
    pub(crate) partners: bool,
    /// No partners.
    #[arg(long)]
    pub(crate) no_partners: bool,
    /// Use frame F as the partner of key K instead of the one proposed. May be repeated.
    #[arg(long, value_name = "K=F")]
    pub(crate) partner: Vec<String>,
    /// Frames that must not be keys: `3,7,20-25`.
    #[arg(long, value_name = "FRAMES")]
    pub(crate) exclude: Option<String>,
    /// Frames that must be keys.
    #[arg(long, value_name = "FRAMES")]
    pub(crate) include: Option<String>,
    /// Keys are at least this many frames apart.
    #[arg(long, value_name = "FRAMES")]
    pub(crate) spacing: Option<usize>,
    /// Stop looking for a proof after so many seconds.
    #[arg(long, value_name = "S")]
    pub(crate) time_limit: Option<f64>,
    /// Choose keys whose poses count half a stride later too, with left and right exchanged. Default: auto.
    #[arg(long, value_enum)]
    pub(crate) mirror: Option<Mirroring>,
}

/// `animate`.
#[derive(Debug, Args)]
pub(crate) struct Animate {
    /// The shot and how to treat it.
    #[command(flatten)]
    pub(crate) stage: Stage,
    /// The rig with the key poses, glTF or GLB.
    #[arg(long, value_name = "FILE")]
    pub(crate) rig: Option<String>,
    /// The pose of a key: `1=KeyPoses#3` frame 3 of a clip, `2=Walk@0.25` a clip at 0.25 s. May be repeated.
    #[arg(long, value_name = "KEY=CLIP#FRAME|KEY=CLIP@SECONDS")]
    pub(crate) pose: Vec<String>,
    /// Where to write the animated rig. Default: `animation.glb` (or .gltf) in the shot.
    #[arg(long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
    /// `phase`, `rbf`, or `switching` between the halves of the stride (needs partners). Keys are chosen anew when it
    /// changes between `phase` and the others. Default: auto.
    #[arg(long, value_enum)]
    pub(crate) method: Option<Method>,
    /// Use every pose half a stride later too, with left and right exchanged. Keys are chosen anew when it changes.
    /// Default: auto.
    #[arg(long, value_enum)]
    pub(crate) mirror: Option<Mirroring>,
    /// Frames a second of the animation, resampled: frame i is at i/fps. Default: the shot's.
    #[arg(long, value_name = "HZ")]
    pub(crate) fps: Option<f64>,
    /// Play so many times as fast as the footage: 4 undoes a slow motion of four times. Default: 1.
    #[arg(long, value_name = "FACTOR")]
    pub(crate) retime: Option<f64>,
    /// Write a seamless loop of N strides (1 when N is left out), averaged over all strides of the
    /// clip, instead of the whole clip. 0 writes the whole clip again.
    #[arg(long = "loop", value_name = "N", num_args = 0..=1, default_missing_value = "1")]
    pub(crate) loop_strides: Option<usize>,
    /// Whether the animal stays in its place or travels at the speed its feet push it. Default: in-place.
    #[arg(long, value_enum)]
    pub(crate) root: Option<Root>,
    /// What the ground's speed is taken from: the feet that are down, the animal's way against the background of the
    /// footage, or the latter where the two agree. Default: auto.
    #[arg(long, value_enum)]
    pub(crate) speed: Option<Speed>,
    /// Hold feet that are down in their place (the default).
    #[arg(long, overrides_with = "no_plant")]
    pub(crate) plant: bool,
    /// Leave the feet as the poses put them.
    #[arg(long, overrides_with = "plant")]
    pub(crate) no_plant: bool,
    /// Keep every weight within 0 and 1.
    #[arg(long)]
    pub(crate) clamp: bool,
    /// Make the weights of every frame sum to one.
    #[arg(long)]
    pub(crate) normalize: bool,
}

/// Whether the animated rig stays where it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Root {
    /// The ground passes below the animal.
    InPlace,
    /// The animal goes over the ground.
    Travel,
}

/// Whether poses are used with left and right exchanged too.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Mirroring {
    /// Where the gait is symmetric, by name or as seen.
    Auto,
    /// Always.
    On,
    /// Never.
    Off,
}

/// What the ground's speed is taken from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Speed {
    /// The footage where the feet agree to 30 %, else the feet.
    Auto,
    /// The feet that are down.
    Feet,
    /// The footage's pan.
    Pan,
}

/// How poses are interpolated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Method {
    /// `switching` where the keys have partners, else `phase` where the silhouette repeats.
    Auto,
    /// A periodic cubic spline over the measured gait phase.
    Phase,
    /// One Gaussian radial basis over all key images.
    Rbf,
    /// Models over half-strides, switched in order.
    Switching,
}

/// `run`.
#[derive(Debug, Args)]
pub(crate) struct Run {
    /// The shot and how to treat it.
    #[command(flatten)]
    pub(crate) stage: Stage,
    /// Exit with 3 when the clip is unusable.
    #[arg(long)]
    pub(crate) strict: bool,
}

/// `studio`.
#[derive(Debug, Args)]
pub(crate) struct Studio {
    /// A shot to open at once.
    pub(crate) shot: Option<PathBuf>,
    /// The folder below which shots, footage and rigs can be chosen. Default: the working folder, or
    /// the shot's parent when the shot is elsewhere.
    #[arg(long, value_name = "DIR")]
    pub(crate) root: Option<PathBuf>,
    /// The port to listen on; 0 takes any that is free.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) port: u16,
    /// The address to listen on. Anything but a loopback address lets other computers try.
    #[arg(long, value_name = "ADDR", default_value = "127.0.0.1")]
    pub(crate) bind: std::net::IpAddr,
    /// Only print the address; do not open a browser.
    #[arg(long)]
    pub(crate) no_browser: bool,
}

/// Which model, clip and view to render.
#[derive(Debug, Args)]
pub(crate) struct View {
    /// A rigged glTF or GLB file; default the built-in horse.
    #[arg(long, value_name = "FILE")]
    pub(crate) model: Option<PathBuf>,
    /// The clip; for the built-in horse walk, trot, canter or gallop.
    #[arg(long, value_name = "NAME")]
    pub(crate) clip: Option<String>,
    /// Number of frames.
    #[arg(long, value_name = "N", default_value_t = 100)]
    pub(crate) frames: usize,
    /// Frames a cycle of the clip.
    #[arg(long, value_name = "F", default_value_t = 24.3)]
    pub(crate) frames_per_cycle: f64,
    /// Camera yaw in degrees; 0 is the pure side view.
    #[arg(long, value_name = "DEG", default_value_t = 0.0, allow_negative_numbers = true)]
    pub(crate) yaw: f64,
    /// Share of edge pixels flipped, 0 to 1.
    #[arg(long, value_name = "SHARE", default_value_t = 0.15)]
    pub(crate) noise: f64,
    /// Seed of the noise.
    #[arg(long, value_name = "N", default_value_t = 42)]
    pub(crate) seed: u64,
    /// Picture size.
    #[arg(long, value_name = "WxH", default_value = "320x240")]
    pub(crate) size: String,
    /// Change of the speed from the first frame to the last, as a share of the mean speed.
    #[arg(long, value_name = "SHARE", default_value_t = 0.0, allow_negative_numbers = true)]
    pub(crate) speed_drift: f64,
    /// Standard deviation of the strides' durations, as a share.
    #[arg(long, value_name = "SHARE", default_value_t = 0.0)]
    pub(crate) stride_variation: f64,
    /// Change of the motion's size from the first frame to the last, as a share of the mean size.
    #[arg(long, value_name = "SHARE", default_value_t = 0.0, allow_negative_numbers = true)]
    pub(crate) amplitude_drift: f64,
    /// Standard deviation of the strides' size, as a share.
    #[arg(long, value_name = "SHARE", default_value_t = 0.0)]
    pub(crate) amplitude_variation: f64,
    /// Share of frames whose mask is broken.
    #[arg(long, value_name = "SHARE", default_value_t = 0.0)]
    pub(crate) broken_masks: f64,
}

/// `validate`.
#[derive(Debug, Args)]
pub(crate) struct Validate {
    /// What to render.
    #[command(flatten)]
    pub(crate) view: View,
    /// Numbers of key poses, rows of the error table: `4` or `2-5` or `4,8`.
    #[arg(long, value_name = "N[,N…]", default_value = "2-5")]
    pub(crate) keys: String,
    /// What is known of the gait.
    #[arg(long, value_enum, default_value_t = GaitSymmetry::Unknown)]
    pub(crate) gait: GaitSymmetry,
    /// Numbers of components, columns of the error table.
    #[arg(long, value_name = "N[,N…]", default_value = "1-5")]
    pub(crate) components: String,
    /// Pose the ambiguous partners too: every key of a row is one silhouette with two poses.
    #[arg(long)]
    pub(crate) partners: bool,
    /// `phase`, `rbf`, `switching`, or `auto`: switching with partners, else phase. Over the phase the numbers of components
    /// change nothing.
    #[arg(long, value_enum, default_value_t = Method::Auto)]
    pub(crate) method: Method,
    /// Use every pose half a stride later too, with left and right exchanged. Default: auto.
    #[arg(long, value_enum)]
    pub(crate) mirror: Option<Mirroring>,
    /// Use the raw scores instead of the band-passed ones.
    #[arg(long)]
    pub(crate) raw: bool,
    /// Write the tables as CSV and the error curves as SVG into this folder.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
}

/// `render`.
#[derive(Debug, Args)]
pub(crate) struct Render {
    /// What to render.
    #[command(flatten)]
    pub(crate) view: View,
    /// The folder for the pictures.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Shaded colour pictures over a moving background instead of silhouettes (built-in horse only).
    #[arg(long)]
    pub(crate) color: bool,
}

/// `samples`.
#[derive(Debug, Args)]
pub(crate) struct Samples {
    /// Where `sequences/` and `poses/` are written.
    #[arg(long, value_name = "DIR", default_value = ".")]
    pub(crate) out: PathBuf,
}

/// `completions`.
#[derive(Debug, Args)]
pub(crate) struct Completions {
    /// The shell.
    #[arg(value_enum)]
    pub(crate) shell: clap_complete::Shell,
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    #[test]
    fn the_arguments_are_consistent() {
        super::Cli::command().debug_assert();
    }
}
