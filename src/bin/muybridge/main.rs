//! The command line of muybridge. Each command is one file in `commands/`; there is no arithmetic
//! here.

mod args;
mod commands;
mod output;
mod terminal;
mod usage;

use std::process::ExitCode;

use clap::Parser;

use args::{Cli, Command};
use output::Output;
use terminal::Bars;

/// Done; failed; wrong usage; unusable under `--strict`; ended by Ctrl-C (128 + SIGINT).
const FAILED: u8 = 1;
const WRONG_USAGE: u8 = 2;
const UNUSABLE: u8 = 3;
const INTERRUPTED: u8 = 130;

/// How a command that did not fail ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Ending {
    /// Done.
    Done,
    /// The clip was judged unusable and `--strict` was given.
    Unusable,
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    terminal::start_log(cli.global.verbose, cli.global.quiet);
    terminal::catch_interrupts();
    if let Some(threads) = cli.global.threads
        && let Err(error) =
            rayon::ThreadPoolBuilder::new().num_threads(usize::from(threads)).build_global()
    {
        tracing::warn!(%error, "the number of threads stays as it was");
    }
    let bars = Bars::new(cli.global.quiet);
    let output = Output { json: cli.global.json, quiet: cli.global.quiet };
    let result = run(cli.command, &output, &bars);
    bars.finish();
    match result {
        Ok(Ending::Done) => ExitCode::SUCCESS,
        Ok(Ending::Unusable) => ExitCode::from(UNUSABLE),
        Err(error) => ExitCode::from(explain(&error)),
    }
}

fn run(command: Command, output: &Output, bars: &Bars) -> anyhow::Result<Ending> {
    match command {
        Command::Demo(args) => commands::demo::execute(&args, output, bars),
        Command::New(args) => commands::new::execute(&args, output),
        Command::Segment(args) => commands::segment::execute(&args, output, bars),
        Command::Analyze(args) => commands::analyze::execute(&args, output, bars),
        Command::Keys(args) => commands::keys::execute(&args, output, bars),
        Command::Animate(args) => commands::animate::execute(&args, output, bars),
        Command::Report(args) => commands::report::execute(&args, output, bars),
        Command::Run(args) => commands::run::execute(&args, output, bars),
        Command::Studio(args) => commands::studio::execute(&args, output),
        Command::Validate(args) => commands::validate::execute(&args, output, bars),
        Command::Render(args) => commands::render::execute(&args, output),
        Command::Samples(args) => commands::samples::execute(&args, output),
        Command::Completions(args) => commands::completions::execute(&args),
    }
}

/// Says what failed and what to do about it; the exit code.
fn explain(error: &anyhow::Error) -> u8 {
    let ours = error.downcast_ref::<muybridge::Error>();
    let mut lines = vec![format!("muybridge: {error:#}")];
    if let Some(remedy) = ours.and_then(muybridge::Error::remedy) {
        lines.push(format!("  hint: {remedy}"));
    }
    terminal::say(&lines.join("\n"));
    match ours {
        Some(muybridge::Error::Interrupted) => INTERRUPTED,
        _ if error.is::<usage::WrongUsage>() => WRONG_USAGE,
        _ => FAILED,
    }
}
