//! `muybridge validate`.
use crate::Ending;
use crate::args::Validate;
use crate::output::Output;
use crate::terminal::Bars;
pub(crate) fn execute(_args: &Validate, _output: &Output, _bars: &Bars) -> anyhow::Result<Ending> {
    anyhow::bail!("to come")
}
