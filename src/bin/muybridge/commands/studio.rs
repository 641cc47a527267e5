//! `muybridge studio`.

/// This program was built without the page.
#[cfg(not(feature = "studio"))]
pub(crate) fn execute(
    _args: &crate::args::Studio,
    _output: &crate::output::Output,
) -> anyhow::Result<crate::Ending> {
    anyhow::bail!(
        "this build has no studio; `make studio` builds the page and a program that has it"
    )
}

#[cfg(feature = "studio")]
pub(crate) use with_page::execute;

#[cfg(feature = "studio")]
mod with_page {
    use std::net::SocketAddr;
    use std::path::PathBuf;
    use std::process::{Command, Stdio};

    use anyhow::Context;
    use muybridge::studio::{self, Options};
    use serde_json::json;

    use crate::Ending;
    use crate::args::Studio;
    use crate::output::Output;
    use crate::terminal;

    pub(crate) fn execute(args: &Studio, output: &Output) -> anyhow::Result<Ending> {
        if !args.bind.is_loopback() {
            terminal::say(&format!(
                "WARNING: listening on {}: every computer that reaches this one can try to open the studio, and what is \
                 sent, the token included, can be read on the way. Whoever has the token can change your shots.",
                args.bind
            ));
        }
        let options = Options {
            root: root(args)?,
            shot: args.shot.clone(),
            address: SocketAddr::new(args.bind, args.port),
        };
        let ready = |url: &str| {
            output.result(&json!({"url": url}), url)?;
            if !args.no_browser {
                open_browser(url);
            }
            Ok::<(), anyhow::Error>(())
        };
        studio::run(&options, ready, &terminal::interrupted)?;
        Ok(Ending::Done)
    }

    /// The working folder, unless the shot lies outside it.
    fn root(args: &Studio) -> anyhow::Result<PathBuf> {
        if let Some(root) = &args.root {
            return Ok(root.clone());
        }
        let here = std::env::current_dir().context("the working folder is gone")?;
        let Some(shot) = &args.shot else { return Ok(here) };
        let inside = match (shot.canonicalize(), here.canonicalize()) {
            (Ok(shot), Ok(here)) => shot.starts_with(&here) && shot != here,
            _ => true,
        };
        let above = if inside { None } else { shot.canonicalize()?.parent().map(PathBuf::from) };
        Ok(above.unwrap_or(here))
    }

    /// Without a browser the address on the terminal still works, so failing is only told.
    fn open_browser(url: &str) {
        let mut command = if cfg!(target_os = "macos") {
            Command::new("open")
        } else if cfg!(windows) {
            let mut command = Command::new("rundll32");
            command.arg("url.dll,FileProtocolHandler");
            command
        } else {
            Command::new("xdg-open")
        };
        command.arg(url).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        if let Err(error) = command.spawn() {
            tracing::warn!(%error, "no browser could be opened; open the address above in one");
        }
    }
}
