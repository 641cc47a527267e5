//! `muybridge completions`.

use clap::CommandFactory;

use crate::Ending;
use crate::args::{Cli, Completions};

pub(crate) fn execute(args: &Completions) -> anyhow::Result<Ending> {
    clap_complete::generate(args.shell, &mut Cli::command(), "muybridge", &mut std::io::stdout());
    Ok(Ending::Done)
}
