//! The studio: a local web server with the page an artist works in. Every action is one the command
//! line has, on the same shot folder, through the same functions.
//!
//! `docs/studio.md` lists the requests and says what protects the user's files: the server listens
//! on loopback, wants a token, knows no other name for itself than its address, and touches nothing
//! outside one root folder.

mod answer;
mod clips;
mod desk;
mod events;
mod files;
mod folders;
mod footage;
mod guard;
mod jobs;
mod jpeg;
mod names;
mod new_shot;
mod page;
mod pictures;
mod refusal;
mod rigs;
mod root;
mod routes;
mod server;
mod settings;
mod shot_state;
mod state;
mod versions;

use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::error::{Error, Result};
use crate::shot::{Shot, paths};
use guard::Guard;
use root::Root;
use state::Studio;

/// How often it is asked whether to stop.
const ASK_EVERY: Duration = Duration::from_millis(100);

/// How long jobs are given to come to their next step after they were told to stop.
const END_TIME: Duration = Duration::from_secs(20);

/// Where the studio works.
#[derive(Clone, Debug)]
pub struct Options {
    /// The folder below which shots, footage and rigs are.
    pub root: PathBuf,
    /// The shot to open at once.
    pub shot: Option<PathBuf>,
    /// Address to listen on; port 0 takes any that is free.
    pub address: SocketAddr,
}

/// Runs the studio until `stop` says so or the page ends it. `ready` is told the address to open,
/// with the token in it.
///
/// # Errors
/// When the root is no folder, there is no shot where one is named ([`Error::NoShot`]), or the
/// address is taken ([`Error::Listen`]); whatever `ready` fails with.
pub fn run<E: From<Error>>(
    options: &Options,
    ready: impl FnOnce(&str) -> std::result::Result<(), E>,
    stop: &(dyn Fn() -> bool + Sync),
) -> std::result::Result<(), E> {
    let root = Root::new(&options.root)?;
    let first = options.shot.as_deref().map(|shot| first_shot(&root, shot)).transpose()?;
    let listen = |source| Error::Listen { address: options.address, source };
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()
        .map_err(listen)?;
    let (listener, address) = runtime.block_on(async {
        let listener = tokio::net::TcpListener::bind(options.address).await.map_err(listen)?;
        let address = listener.local_addr().map_err(listen)?;
        Ok::<_, Error>((listener, address))
    })?;
    let studio = Arc::new(Studio::new(root, Guard::new(address).map_err(listen)?, first));
    ready(&studio.guard.invitation().map_err(listen)?)?;
    runtime.block_on(async {
        tokio::select! {
            () = server::serve(Arc::clone(&studio), listener) => {}
            () = asked_to_stop(stop) => {
                studio.stop();
            }
        }
    });
    end(&studio);
    runtime.shutdown_timeout(ASK_EVERY);
    Ok(())
}

/// The named shot as the page knows it.
fn first_shot(root: &Root, shot: &Path) -> Result<String> {
    let folder = std::fs::canonicalize(shot).map_err(|_| no_shot(shot))?;
    if !folder.join(paths::SETTINGS).is_file() || !folder.starts_with(root.folder()) {
        return Err(no_shot(shot));
    }
    Shot::open(&folder)?;
    Ok(root.name(&folder))
}

fn no_shot(folder: &Path) -> Error {
    Error::NoShot { folder: folder.to_owned() }
}

async fn asked_to_stop(stop: &(dyn Fn() -> bool + Sync)) {
    while !stop() {
        tokio::time::sleep(ASK_EVERY).await;
    }
}

/// Lets jobs come to an orderly end, so that nothing half-made is left.
fn end(studio: &Studio) {
    studio.clips.close();
    let until = Instant::now() + END_TIME;
    let running = || studio.desks().into_iter().filter_map(|desk| desk.job()).collect::<Vec<_>>();
    loop {
        let jobs = running();
        if jobs.is_empty() || Instant::now() > until {
            return;
        }
        jobs.iter().for_each(|job| job.cancel());
        std::thread::sleep(ASK_EVERY);
    }
}
