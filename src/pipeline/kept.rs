//! Which frames a change of corrections can change, and what is kept of the others.
//!
//! A frame's silhouette depends on the footage and the settings (the *basis*) and on the nearest
//! corrections on either side within its stretch, nothing else. What is the same in all of these comes
//! out the same, so it is taken from the folder.

use std::collections::BTreeMap;
use std::ops::Range;

use crate::error::Result;
use crate::shot::{KeptDrafts, KeptFrame, Shot, hash_value, paths};
use crate::silhouette::{BaseDrafts, FrameReport, Labels};

/// What a person said of a frame, and a hash of it.
pub(super) struct Said {
    pub(super) labels: Labels,
    pub(super) hash: String,
}

/// What the last run left, and what this one will leave.
pub(super) struct Kept {
    before: KeptDrafts,
    now: KeptDrafts,
    hashes: BTreeMap<usize, String>,
    whole: Vec<usize>,
}

/// What is to be done with the frames of a stretch.
pub(super) struct StretchPlan {
    /// Frames whose drafts are wanted.
    pub(super) drafts: Vec<bool>,
    /// The mask files of frames that stay as they are.
    pub(super) stay: Vec<Option<Vec<u8>>>,
    /// What was known of the stretch without corrections.
    pub(super) base: Option<BaseDrafts>,
}

impl Kept {
    /// Looks up what the last run kept; nothing when all is to be made again.
    pub(super) fn load(shot: &Shot, said: &BTreeMap<usize, Said>, again: bool) -> Result<Self> {
        let settings = (&shot.settings.source, &shot.settings.silhouette);
        let basis =
            hash_value(&(shot.footage_hash()?, settings, shot.fps(), env!("CARGO_PKG_VERSION")));
        let before = if again { None } else { KeptDrafts::load(shot, &basis) };
        Ok(Self {
            before: before.unwrap_or_default(),
            now: KeptDrafts { basis, ..KeptDrafts::default() },
            hashes: said.iter().map(|(t, said)| (*t, said.hash.clone())).collect(),
            whole: said.iter().filter(|(_, s)| s.labels.is_whole()).map(|(t, _)| *t).collect(),
        })
    }

    /// What the frames of the next stretch need.
    pub(super) fn plan(&mut self, shot: &Shot, stretch: Range<usize>) -> StretchPlan {
        let number = self.now.stretches.len();
        let base = self.before.stretches.get_mut(number).and_then(Option::take);
        let mut plan = StretchPlan { drafts: Vec::new(), stay: Vec::new(), base };
        for t in stretch.clone() {
            let same = self.before.frames.get(t).filter(|kept| {
                kept.corrections == self.corrections(t, &stretch) && kept.report.frame == t
            });
            let file = same.and_then(|kept| {
                let bytes = std::fs::read(shot.path(&paths::mask(t))).ok()?;
                (blake3::hash(&bytes).to_hex().as_str() == kept.mask).then_some(bytes)
            });
            // A frame that is painted as a whole needs no draft of its own.
            let painted = same.is_some() && self.whole.binary_search(&t).is_ok();
            plan.drafts.push(file.is_none() && !painted);
            plan.stay.push(file);
        }
        plan
    }

    /// What was known of a frame that stays.
    pub(super) fn report(&self, t: usize) -> Option<FrameReport> {
        self.before.frames.get(t).map(|kept| kept.report)
    }

    /// Notes what was made of the next frame.
    pub(super) fn note(&mut self, stretch: &Range<usize>, png: &[u8], report: FrameReport) {
        let corrections = self.corrections(self.now.frames.len(), stretch);
        let mask = blake3::hash(png).to_hex().to_string();
        self.now.frames.push(KeptFrame { corrections, mask, report });
    }

    /// Notes that a stretch is done.
    pub(super) fn finish_stretch(&mut self, base: Option<BaseDrafts>) {
        self.now.stretches.push(base);
    }

    /// What the next run can keep.
    pub(super) fn now(&self) -> &KeptDrafts {
        &self.now
    }

    /// Hash of the corrections that frame `t` depends on: the nearest before it and the nearest from it
    /// on, within its stretch.
    fn corrections(&self, t: usize, stretch: &Range<usize>) -> String {
        let before = self.hashes.range(stretch.start..t).next_back();
        let after = self.hashes.range(t..stretch.end).next();
        hash_value(&(stretch.start, stretch.end, before, after))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kept(corrections: &[(usize, &str)]) -> Kept {
        Kept {
            before: KeptDrafts::default(),
            now: KeptDrafts::default(),
            hashes: corrections.iter().map(|(t, h)| (*t, (*h).to_owned())).collect(),
            whole: Vec::new(),
        }
    }

    #[test]
    fn a_correction_reaches_to_its_neighbours_and_to_the_ends_of_its_stretch() {
        let before = kept(&[(10, "a"), (30, "b"), (70, "c")]);
        let changed = |now: Kept| -> Vec<usize> {
            let same = |t: usize, stretch: &Range<usize>| {
                now.corrections(t, stretch) == before.corrections(t, stretch)
            };
            let stretches = [0..50, 50..100];
            let all = |s: Range<usize>| s.clone().filter(|t| !same(*t, &s)).collect::<Vec<_>>();
            stretches.into_iter().flat_map(all).collect()
        };
        let none: Vec<usize> = Vec::new();
        assert_eq!(changed(kept(&[(10, "a"), (30, "b"), (70, "c")])), none);
        // Another stroke on frame 30: from behind frame 10 to the stretch's end.
        let again = kept(&[(10, "a"), (30, "B"), (70, "c")]);
        assert_eq!(changed(again), (11..50).collect::<Vec<_>>());
        // A new one between 10 and 30 changes what lies between them, their own frames last.
        let new = kept(&[(10, "a"), (20, "n"), (30, "b"), (70, "c")]);
        assert_eq!(changed(new), (11..31).collect::<Vec<_>>());
        assert_eq!(changed(kept(&[(10, "a"), (30, "b")])), (50..100).collect::<Vec<_>>());
    }
}
