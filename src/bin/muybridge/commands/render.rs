//! `muybridge render`.
use crate::Ending;
use crate::args::Render;
use crate::output::Output;
pub(crate) fn execute(_args: &Render, _output: &Output) -> anyhow::Result<Ending> {
    anyhow::bail!("to come")
}
