//! What each stage read and wrote, so that running again redoes only what changed, a killed run
//! leaves nothing half-made, and a file edited by hand is never overwritten unasked.
//!
//! A stage's files are first written to a staging folder. Then a *pending* record with the hash
//! of every staged file is stored, the files are renamed into place, and the record becomes
//! *done*. A file in place whose hash is in no record of the stage was made or edited by hand.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::Stage;
use super::store::{hash_file, write_atomically};
use crate::error::{Error, Result};

/// The folder inside a shot that holds records, staging areas and the lock.
pub(super) const STATE_FOLDER: &str = ".muybridge";

/// Stands for the hash of a file that is left to its maker; no file has it.
const BY_HAND: &str = "by hand";

/// What a stage depends on: a name ("settings", "masks") and the BLAKE3 hash of its content.
pub type Reads = BTreeMap<String, String>;

#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
struct Record {
    /// Version of the program that made the files: another version may compute other bytes.
    program: String,
    reads: Reads,
    /// Hash of each file as this stage made it, by its path relative to the shot.
    files: BTreeMap<String, String>,
    /// While a commit is under way, every hash a file of this stage may have: from before, from
    /// commits that were killed, and from this one.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pending: BTreeMap<String, BTreeSet<String>>,
}

impl Record {
    fn made_here(&self, file: &str, hash: &str) -> bool {
        self.files.get(file).is_some_and(|h| h == hash)
            || self.pending.get(file).is_some_and(|h| h.contains(hash))
    }

    /// Every file the stage has made, with every hash it may have, `made` included.
    fn with_pending(&self, made: &BTreeMap<String, String>) -> Self {
        let mut pending = self.pending.clone();
        for (file, hash) in self.files.iter().chain(made) {
            pending.entry(file.clone()).or_default().insert(hash.clone());
        }
        Self { pending, ..self.clone() }
    }
}

fn record_path(shot: &Path, stage: Stage) -> PathBuf {
    shot.join(STATE_FOLDER).join(format!("{}.json", stage.name()))
}

/// A record that cannot be read is as good as none: the stage runs again, and files that are
/// there count as made by hand, so nothing is lost.
fn load(shot: &Path, stage: Stage) -> Record {
    fs::read(record_path(shot, stage))
        .ok()
        .and_then(|bytes| serde_json::from_slice(&bytes).ok())
        .unwrap_or_default()
}

fn save(shot: &Path, stage: Stage, record: &Record) -> Result<()> {
    let mut text = serde_json::to_vec_pretty(record).map_err(|e| Error::Io {
        path: record_path(shot, stage),
        action: "encode",
        source: e.into(),
    })?;
    text.push(b'\n');
    write_atomically(&record_path(shot, stage), &text)
}

/// Whether a stage has to run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Freshness {
    /// It ran on exactly these inputs and all its files are there.
    UpToDate,
    /// It never ran, its inputs changed, or a file is missing.
    Stale,
}

/// Compares a stage's record with what it would read now.
pub(super) fn freshness(shot: &Path, stage: Stage, reads: &Reads) -> Freshness {
    let record = load(shot, stage);
    let same = record.program == env!("CARGO_PKG_VERSION")
        && record.reads == *reads
        && record.pending.is_empty()
        && !record.files.is_empty()
        && record.files.keys().all(|f| shot.join(f).is_file());
    if same { Freshness::UpToDate } else { Freshness::Stale }
}

/// The files a stage made, sorted; none when it never ran.
pub(super) fn made_files(shot: &Path, stage: Stage) -> Vec<String> {
    load(shot, stage).files.into_keys().collect()
}

/// What a stage read when it last ran.
pub(super) fn recorded_reads(shot: &Path, stage: Stage) -> Reads {
    load(shot, stage).reads
}

/// The files of a stage that were edited or made by hand since the stage wrote them.
pub(super) fn edited_files(shot: &Path, stage: Stage) -> Result<Vec<String>> {
    let record = load(shot, stage);
    let mut edited = Vec::new();
    for file in record.files.keys() {
        let path = shot.join(file);
        if path.is_file() && !record.made_here(file, &hash_file(&path)?) {
            edited.push(file.clone());
        }
    }
    Ok(edited)
}

/// Collects a stage's files and puts them in place in one step.
#[derive(Debug)]
pub struct StageWriter {
    shot: PathBuf,
    stage: Stage,
    reads: Reads,
    force: bool,
    staging: PathBuf,
    made: BTreeMap<String, String>,
}

/// What a finished stage did to the folder.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Written {
    /// Files in place, relative to the shot, sorted.
    pub files: Vec<String>,
    /// Files that were edited by hand and therefore kept as they are, sorted.
    pub kept: Vec<String>,
}

impl StageWriter {
    pub(super) fn new(shot: &Path, stage: Stage, reads: Reads, force: bool) -> Result<Self> {
        let staging = shot.join(STATE_FOLDER).join("staging").join(stage.name());
        if staging.exists() {
            fs::remove_dir_all(&staging).map_err(Error::io(&staging, "clear"))?;
        }
        fs::create_dir_all(&staging).map_err(Error::io(&staging, "create the folder"))?;
        Ok(Self { shot: shot.to_owned(), stage, reads, force, staging, made: BTreeMap::new() })
    }

    /// Stages one file; `file` is its path relative to the shot, with `/` between folders.
    ///
    /// # Errors
    /// When it cannot be written (disk full, no permission).
    pub fn put(&mut self, file: &str, bytes: &[u8]) -> Result<()> {
        let path = self.staging.join(file);
        if let Some(parent) = path.parent() {
            fs::create_dir_all(parent).map_err(Error::io(parent, "create the folder"))?;
        }
        fs::write(&path, bytes).map_err(Error::io(&path, "write"))?;
        self.made.insert(file.to_owned(), blake3::hash(bytes).to_hex().to_string());
        Ok(())
    }

    /// A file without a name on the shot's disk, gone with the process at the latest: for what does
    /// not fit into memory while the stage runs.
    ///
    /// # Errors
    /// When none can be made.
    pub fn scratch(&self) -> Result<fs::File> {
        tempfile::tempfile_in(&self.staging).map_err(Error::io(&self.staging, "write in"))
    }

    /// The folder that holds the staged files.
    #[must_use]
    pub fn staging(&self) -> &Path {
        &self.staging
    }

    /// Leaves a file that a person made as it is, and by hand: even when the stage would have made the
    /// same.
    pub fn leave(&mut self, file: &str) {
        self.made.insert(file.to_owned(), BY_HAND.to_owned());
    }

    /// Puts all staged files in place, removes those an earlier run made and this one did not,
    /// and records what was read.
    ///
    /// # Errors
    /// When a file cannot be renamed or the record cannot be stored. Running the stage again
    /// mends it.
    pub fn commit(self) -> Result<Written> {
        let known = load(&self.shot, self.stage).with_pending(&self.made);
        save(&self.shot, self.stage, &known)?;

        let mut written = Written::default();
        for (file, hash) in &self.made {
            let target = self.shot.join(file);
            if hash == BY_HAND || self.is_by_hand(&known, file)? {
                written.kept.push(file.clone());
                continue;
            }
            if let Some(parent) = target.parent() {
                fs::create_dir_all(parent).map_err(Error::io(parent, "create the folder"))?;
            }
            fs::rename(self.staging.join(file), &target)
                .map_err(Error::io(&target, "put in place"))?;
            written.files.push(file.clone());
        }
        self.remove_leftovers(&known)?;
        let done = Record {
            program: env!("CARGO_PKG_VERSION").to_owned(),
            reads: self.reads.clone(),
            files: self.made.clone(),
            pending: BTreeMap::new(),
        };
        save(&self.shot, self.stage, &done)?;
        fs::remove_dir_all(&self.staging).map_err(Error::io(&self.staging, "clear"))?;
        Ok(written)
    }

    /// The new hash is among the known ones, so a file that already is as wanted is not by hand.
    fn is_by_hand(&self, known: &Record, file: &str) -> Result<bool> {
        let target = self.shot.join(file);
        if self.force || !target.is_file() {
            return Ok(false);
        }
        Ok(!known.made_here(file, &hash_file(&target)?))
    }

    fn remove_leftovers(&self, known: &Record) -> Result<()> {
        for file in known.pending.keys().filter(|f| !self.made.contains_key(*f)) {
            let path = self.shot.join(file);
            if path.is_file() && known.made_here(file, &hash_file(&path)?) {
                fs::remove_file(&path).map_err(Error::io(&path, "remove"))?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reads(value: &str) -> Reads {
        Reads::from([("settings".to_owned(), value.to_owned())])
    }

    fn run(shot: &Path, value: &str, files: &[(&str, &str)], force: bool) -> Written {
        let mut writer = StageWriter::new(shot, Stage::Segment, reads(value), force).unwrap();
        for (file, text) in files {
            writer.put(file, text.as_bytes()).unwrap();
        }
        writer.commit().unwrap()
    }

    fn text(shot: &Path, file: &str) -> String {
        fs::read_to_string(shot.join(file)).unwrap()
    }

    #[test]
    fn a_stage_is_fresh_until_what_it_read_changes_or_a_file_goes() {
        let dir = tempfile::tempdir().unwrap();
        let shot = dir.path();
        assert_eq!(freshness(shot, Stage::Segment, &reads("a")), Freshness::Stale);
        run(shot, "a", &[("masks/0", "zero")], false);
        assert_eq!(freshness(shot, Stage::Segment, &reads("a")), Freshness::UpToDate);
        assert_eq!(freshness(shot, Stage::Segment, &reads("b")), Freshness::Stale);
        fs::remove_file(shot.join("masks/0")).unwrap();
        assert_eq!(freshness(shot, Stage::Segment, &reads("a")), Freshness::Stale);
    }

    #[test]
    fn a_file_edited_by_hand_is_kept_and_the_others_are_replaced() {
        let dir = tempfile::tempdir().unwrap();
        let shot = dir.path();
        run(shot, "a", &[("masks/0", "zero"), ("masks/1", "one")], false);
        fs::write(shot.join("masks/1"), "painted").unwrap();
        assert_eq!(edited_files(shot, Stage::Segment).unwrap(), ["masks/1"]);
        let written = run(shot, "b", &[("masks/0", "zero b"), ("masks/1", "one b")], false);
        assert_eq!(written.kept, ["masks/1"]);
        assert_eq!(text(shot, "masks/0"), "zero b");
        assert_eq!(text(shot, "masks/1"), "painted");
        // Still known as edited after two more runs, and replaced only when forced.
        assert_eq!(run(shot, "c", &[("masks/1", "one c")], false).kept, ["masks/1"]);
        assert!(run(shot, "d", &[("masks/1", "one d")], true).kept.is_empty());
        assert_eq!(text(shot, "masks/1"), "one d");
    }

    #[test]
    fn a_file_left_to_its_maker_stays_by_hand_whatever_the_stage_would_make() {
        let dir = tempfile::tempdir().unwrap();
        let shot = dir.path();
        run(shot, "a", &[("masks/0", "zero"), ("masks/1", "one")], false);
        fs::write(shot.join("masks/1"), "painted").unwrap();
        for value in ["b", "c"] {
            let mut writer = StageWriter::new(shot, Stage::Segment, reads(value), false).unwrap();
            writer.put("masks/0", b"painted").unwrap();
            writer.leave("masks/1");
            assert_eq!(writer.commit().unwrap().kept, ["masks/1"]);
            assert_eq!(text(shot, "masks/1"), "painted");
            assert_eq!(edited_files(shot, Stage::Segment).unwrap(), ["masks/1"]);
            assert_eq!(freshness(shot, Stage::Segment, &reads(value)), Freshness::UpToDate);
        }
        assert!(run(shot, "d", &[("masks/1", "one")], true).kept.is_empty());
        assert_eq!(text(shot, "masks/1"), "one");
    }

    #[test]
    fn a_file_of_the_users_own_is_not_replaced() {
        let dir = tempfile::tempdir().unwrap();
        let shot = dir.path();
        fs::create_dir(shot.join("masks")).unwrap();
        fs::write(shot.join("masks/0"), "mine").unwrap();
        assert_eq!(run(shot, "a", &[("masks/0", "theirs")], false).kept, ["masks/0"]);
        assert_eq!(text(shot, "masks/0"), "mine");
    }

    #[test]
    fn files_no_longer_made_are_removed_unless_edited() {
        let dir = tempfile::tempdir().unwrap();
        let shot = dir.path();
        run(shot, "a", &[("k/1", "one"), ("k/2", "two"), ("k/3", "three")], false);
        fs::write(shot.join("k/3"), "painted").unwrap();
        run(shot, "b", &[("k/1", "one")], false);
        assert!(!shot.join("k/2").exists());
        assert_eq!(text(shot, "k/3"), "painted");
    }

    #[test]
    fn a_commit_killed_half_way_is_taken_up_and_its_files_are_not_mistaken_for_edits() {
        let dir = tempfile::tempdir().unwrap();
        let shot = dir.path();
        run(shot, "a", &[("k/1", "one"), ("k/2", "two")], false);
        // What a kill after the first rename leaves: a pending record, one new file, one old.
        let mut record = load(shot, Stage::Segment);
        for (file, text) in [("k/1", "one b"), ("k/2", "two b")] {
            let hash = blake3::hash(text.as_bytes()).to_hex().to_string();
            record.pending.entry(file.into()).or_default().insert(hash);
        }
        save(shot, Stage::Segment, &record).unwrap();
        fs::write(shot.join("k/1"), "one b").unwrap();
        assert_eq!(freshness(shot, Stage::Segment, &reads("a")), Freshness::Stale);
        let written = run(shot, "c", &[("k/1", "one c"), ("k/2", "two c")], false);
        assert!(written.kept.is_empty(), "{written:?}");
        assert_eq!(text(shot, "k/1"), "one c");
        assert_eq!(text(shot, "k/2"), "two c");
    }
}
