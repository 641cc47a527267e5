//! `muybridge samples`.

use muybridge::shot::write_atomically;
use muybridge::synthetic::samples;
use serde_json::json;

use crate::Ending;
use crate::args::Samples;
use crate::output::Output;

pub(crate) fn execute(args: &Samples, output: &Output) -> anyhow::Result<Ending> {
    let all = samples()?;
    for sample in &all {
        write_atomically(&args.out.join(&sample.path), &sample.bytes)?;
    }
    let paths: Vec<&str> = all.iter().map(|s| s.path.as_str()).collect();
    let text = format!("{} files written", paths.len());
    output.result(&json!({"files": paths}), &text)?;
    Ok(Ending::Done)
}
