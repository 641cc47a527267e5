//! Connected components by runs and union-find.

use super::{Bounds, Mask};

/// Which neighbours count as connected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Connectivity {
    /// Left, right, above, below.
    Four,
    /// Those and the diagonals.
    Eight,
}

/// A run of set pixels in one row: columns `start..end` of row `y`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Run {
    pub(crate) y: usize,
    pub(crate) start: usize,
    pub(crate) end: usize,
}

impl Mask {
    /// The set pixels, row by row.
    pub(crate) fn runs(&self) -> Vec<Run> {
        let mut runs = Vec::new();
        for y in 0..self.height() {
            runs_of_row(self, y, &mut runs);
        }
        runs
    }

    /// Sets the pixels of a run.
    pub(crate) fn fill(&mut self, run: Run) {
        let row = self.row_mut(run.y);
        let mut x = run.start;
        while x < run.end {
            let until = run.end.min((x / 64 + 1) * 64);
            let bits =
                if until - x == 64 { u64::MAX } else { ((1 << (until - x)) - 1) << (x % 64) };
            row[x / 64] |= bits;
            x = until;
        }
    }
}

/// One connected component.
#[derive(Clone, Debug, PartialEq)]
pub struct Component {
    /// Number of pixels.
    pub area_px: usize,
    /// Centre of mass, pixels.
    pub centre_px: (f64, f64),
    /// Smallest rectangle about it.
    pub bounds: Bounds,
    runs: Vec<Run>,
}

impl Component {
    /// Its pixels, row by row.
    pub(crate) fn runs(&self) -> &[Run] {
        &self.runs
    }

    /// Sets the component's pixels in a mask of the size it was found in.
    pub fn draw(&self, mask: &mut Mask) {
        for run in &self.runs {
            mask.fill(*run);
        }
    }

    /// The component alone, in a picture of the given size.
    #[must_use]
    pub fn to_mask(&self, width: usize, height: usize) -> Mask {
        let mut mask = Mask::new(width, height);
        self.draw(&mut mask);
        mask
    }

    /// Pixels of the component that `mask` sets too.
    #[must_use]
    pub fn common_area(&self, mask: &Mask) -> usize {
        self.to_mask(mask.width(), mask.height()).common_area(mask)
    }
}

/// All components of a mask, in the order of their first pixel (rows from the top, columns from
/// the left).
#[must_use]
pub fn components(mask: &Mask, connectivity: Connectivity) -> Vec<Component> {
    let mut runs: Vec<Run> = Vec::new();
    let mut row_start = vec![0; mask.height() + 1];
    for y in 0..mask.height() {
        runs_of_row(mask, y, &mut runs);
        row_start[y + 1] = runs.len();
    }
    let mut parent: Vec<usize> = (0..runs.len()).collect();
    let reach = usize::from(connectivity == Connectivity::Eight);
    for y in 1..mask.height() {
        let mut above = row_start[y - 1];
        for at in row_start[y]..row_start[y + 1] {
            let run = runs[at];
            while above < row_start[y] && runs[above].end + reach <= run.start {
                above += 1;
            }
            let mut touching = above;
            while touching < row_start[y] && runs[touching].start < run.end + reach {
                unite(&mut parent, touching, at);
                touching += 1;
            }
        }
    }
    gather(&runs, &mut parent)
}

/// Components of a mask, 8-connected, where pieces with a gap of at most `gap_px` pixels between
/// them count as one: they are joined when the discs of half the gap about them touch. In the order
/// of their first pixel.
#[must_use]
pub fn linked_components(mask: &Mask, gap_px: usize) -> Vec<Component> {
    let pieces = components(mask, Connectivity::Eight);
    if gap_px == 0 || pieces.len() < 2 {
        return pieces;
    }
    let wide = components(&mask.dilated(gap_px.div_ceil(2)), Connectivity::Eight);
    let mut members: Vec<Vec<Run>> = vec![Vec::new(); wide.len()];
    let mut wide_runs: Vec<(Run, usize)> =
        wide.iter().enumerate().flat_map(|(at, w)| w.runs.iter().map(move |&r| (r, at))).collect();
    wide_runs.sort_by_key(|(r, _)| (r.y, r.start));
    for piece in pieces {
        // The wide run that holds the piece's first is the last to begin no later.
        let first = piece.runs[0];
        let behind = wide_runs.partition_point(|(r, _)| (r.y, r.start) <= (first.y, first.start));
        if let Some(&(_, group)) = behind.checked_sub(1).and_then(|at| wide_runs.get(at)) {
            members[group].extend(piece.runs);
        }
    }
    let mut linked: Vec<Component> = members.into_iter().filter_map(measured).collect();
    linked.sort_by_key(|c| (c.runs[0].y, c.runs[0].start));
    linked
}

fn gather(runs: &[Run], parent: &mut [usize]) -> Vec<Component> {
    let mut index = vec![None; runs.len()];
    let mut members: Vec<Vec<Run>> = Vec::new();
    for (at, &run) in runs.iter().enumerate() {
        let root = find(parent, at);
        let component = *index[root].get_or_insert_with(|| {
            members.push(Vec::new());
            members.len() - 1
        });
        members[component].push(run);
    }
    members.into_iter().filter_map(measured).collect()
}

fn measured(mut runs: Vec<Run>) -> Option<Component> {
    if !runs.is_sorted_by_key(|r| (r.y, r.start)) {
        runs.sort_by_key(|r| (r.y, r.start));
    }
    let first = *runs.first()?;
    let mut bounds =
        Bounds { left: first.start, top: first.y, right: first.end - 1, bottom: first.y };
    let (mut area, mut sum_x2, mut sum_y) = (0_u64, 0_u64, 0_u64);
    for run in &runs {
        let length = (run.end - run.start) as u64;
        area += length;
        sum_x2 += length * (run.start + run.end - 1) as u64;
        sum_y += length * run.y as u64;
        bounds.left = bounds.left.min(run.start);
        bounds.right = bounds.right.max(run.end - 1);
        bounds.bottom = bounds.bottom.max(run.y);
    }
    let centre_px = (sum_x2 as f64 / (2 * area) as f64, sum_y as f64 / area as f64);
    Some(Component { area_px: area as usize, centre_px, bounds, runs })
}

fn runs_of_row(mask: &Mask, y: usize, runs: &mut Vec<Run>) {
    let row = mask.row(y);
    let mut x = 0;
    while let Some(start) = next_bit(row, x, true, mask.width()) {
        let end = next_bit(row, start, false, mask.width()).unwrap_or(mask.width());
        runs.push(Run { y, start, end });
        x = end;
    }
}

/// The first column from `from` on whose bit is `value`, below `width`.
fn next_bit(row: &[u64], from: usize, value: bool, width: usize) -> Option<usize> {
    let mut at = from / 64;
    let mut keep = u64::MAX << (from % 64);
    while let Some(&word) = row.get(at) {
        let wanted = if value { word } else { !word } & keep;
        if wanted != 0 {
            let x = 64 * at + wanted.trailing_zeros() as usize;
            return (x < width).then_some(x);
        }
        at += 1;
        keep = u64::MAX;
    }
    None
}

fn find(parent: &mut [usize], mut at: usize) -> usize {
    while parent[at] != at {
        parent[at] = parent[parent[at]];
        at = parent[at];
    }
    at
}

/// The smaller index becomes the root, so that roots do not depend on the order of unions.
fn unite(parent: &mut [usize], a: usize, b: usize) {
    let (a, b) = (find(parent, a), find(parent, b));
    parent[a.max(b)] = a.min(b);
}

#[cfg(test)]
mod tests {
    use image::{GrayImage, Luma};
    use imageproc::region_labelling;
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn pieces_are_joined_across_small_gaps_only() {
        let mask = Mask::from_fn(60, 20, |x, y| {
            (5..15).contains(&y) && ((5..15).contains(&x) || (19..25).contains(&x) || x > 40)
        });
        assert_eq!(linked_components(&mask, 0).len(), 3);
        let linked = linked_components(&mask, 4);
        assert_eq!(linked.len(), 2);
        assert_eq!(linked[0].area_px, 160);
        assert_eq!(linked[0].to_mask(60, 20).or(&linked[1].to_mask(60, 20)), mask);
        assert_eq!(linked_components(&mask, 20).len(), 1);
    }

    proptest! {
        #[test]
        fn components_are_those_of_another_library(
            w in 1_usize..140, h in 1_usize..20, density in 2_u64..14, eight in any::<bool>(), seed in any::<u64>()
        ) {
            let mask = Mask::from_fn(w, h, |x, y| {
                let mut z = seed ^ ((x * 977 + y * 7919) as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15);
                z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
                (z >> 40) % 16 < density
            });
            // With an empty column: the other library has no room for a label a pixel.
            let grey = GrayImage::from_fn(w as u32 + 1, h as u32, |x, y| {
                Luma([u8::from((x as usize) < w && mask.get(x as usize, y as usize))])
            });
            let (ours, theirs) = if eight {
                (Connectivity::Eight, region_labelling::Connectivity::Eight)
            } else {
                (Connectivity::Four, region_labelling::Connectivity::Four)
            };
            let labels = region_labelling::connected_components(&grey, theirs, Luma([0]));
            let found = components(&mask, ours);
            let labels_seen = labels.pixels().map(|p| p.0[0]).max().unwrap_or(0);
            prop_assert_eq!(found.len() as u32, labels_seen);
            let mut all = Mask::new(w, h);
            for component in &found {
                let alone = component.to_mask(w, h);
                prop_assert_eq!(alone.area(), component.area_px);
                prop_assert_eq!(alone.bounds(), Some(component.bounds));
                prop_assert_eq!(alone.centre_of_mass(), Some(component.centre_px));
                // One label throughout, and no pixel of that label elsewhere.
                let label = labels.get_pixel(component.runs[0].start as u32, component.runs[0].y as u32);
                let same = Mask::from_fn(w, h, |x, y| labels.get_pixel(x as u32, y as u32) == label);
                prop_assert_eq!(&alone, &same);
                all = all.or(&alone);
            }
            prop_assert_eq!(all, mask);
        }
    }
}
