//! Segmentation against the true masks of real footage, where that footage is there.

use crate::data::data_folder;
use crate::davis::{CLIPS, Clip, Overlap};

/// For each clip the mean overlap (Jaccard, frame 0 left out) it must reach from two rectangles and
/// with three corrected frames: a little under what was measured.
const FLOORS: [(f64, f64); 4] = [(0.90, 0.91), (0.87, 0.91), (0.77, 0.84), (0.81, 0.90)];

/// What is asked of the mean over the clips: whole and legs, from two rectangles and with three
/// corrected frames.
const ASKED: [Overlap; 2] =
    [Overlap { whole: 0.80, legs: 0.58 }, Overlap { whole: 0.87, legs: 0.75 }];

/// Two rectangles alone, then up to three frames corrected, each the one the segmenter is least sure
/// of. `examples/silhouettes.rs` prints the figures in full.
#[test]
fn silhouettes_of_real_animals_overlap_the_true_ones() {
    let Some(data) = data_folder() else { return };
    let mean = |overlaps: &[(usize, Overlap)]| Overlap::mean(overlaps.iter().map(|o| &o.1));
    let mut cases = [Vec::new(), Vec::new()];
    for (name, (floor, corrected_floor)) in CLIPS.into_iter().zip(FLOORS) {
        let mut clip = Clip::observed(&data, name);
        let mut found = clip.outlined();
        let first = mean(&clip.overlaps(&found));
        assert!(first.whole >= floor, "{name}: {first:?}");
        for _ in 0..3 {
            if clip.correct_least_sure(&found).is_none() {
                break;
            }
            found = clip.outlined();
        }
        let last = mean(&clip.overlaps(&found));
        eprintln!("{name}: {first:.3?}, three frames corrected {last:.3?}");
        assert!(last.whole >= corrected_floor, "{name}: {last:?}");
        cases[0].push(first);
        cases[1].push(last);
    }
    for (case, asked) in cases.iter().zip(ASKED) {
        let mean = Overlap::mean(case.iter());
        assert!(mean.whole >= asked.whole && mean.legs >= asked.legs, "{mean:?} of {asked:?}");
    }
}
