//! The order people expect of numbered files (`img2` before `img10`), and gaps in the numbers.

use std::cmp::Ordering;
use std::path::{Path, PathBuf};

use super::Finding;

/// Splits a text into runs of digits and runs of anything else; the flag says digits.
fn runs(text: &str) -> impl Iterator<Item = (bool, &str)> {
    let mut rest = text;
    std::iter::from_fn(move || {
        let digits = rest.chars().next()?.is_ascii_digit();
        let end = rest.find(|c: char| c.is_ascii_digit() != digits).unwrap_or(rest.len());
        let (run, tail) = rest.split_at(end);
        rest = tail;
        Some((digits, run))
    })
}

fn compare_numbers(a: &str, b: &str) -> Ordering {
    let (short_a, short_b) = (a.trim_start_matches('0'), b.trim_start_matches('0'));
    short_a.len().cmp(&short_b.len()).then_with(|| short_a.cmp(short_b))
}

/// Natural order: runs of digits compare as numbers, everything else byte by byte. Names that
/// differ by leading zeros only are ordered by their bytes, so the order is total.
pub(crate) fn compare(a: &Path, b: &Path) -> Ordering {
    let (text_a, text_b) = (a.to_string_lossy(), b.to_string_lossy());
    let (mut runs_a, mut runs_b) = (runs(&text_a), runs(&text_b));
    loop {
        let order = match (runs_a.next(), runs_b.next()) {
            (None, None) => return a.cmp(b),
            (None, Some(_)) => Ordering::Less,
            (Some(_), None) => Ordering::Greater,
            (Some((true, x)), Some((true, y))) => compare_numbers(x, y),
            (Some((_, x)), Some((_, y))) => x.cmp(y),
        };
        if order != Ordering::Equal {
            return order;
        }
    }
}

/// How far apart two file names are counted: the difference of their one number that differs, or
/// `None` where more than one thing differs.
fn distance(a: &Path, b: &Path) -> Option<u64> {
    let (stem_a, stem_b) = (a.file_stem()?.to_str()?, b.file_stem()?.to_str()?);
    let (runs_a, runs_b) = (runs(stem_a).collect::<Vec<_>>(), runs(stem_b).collect::<Vec<_>>());
    if runs_a.len() != runs_b.len() {
        return None;
    }
    let mut differing = runs_a.iter().zip(&runs_b).filter(|(x, y)| x != y);
    let (&(digits_a, x), &(digits_b, y)) = differing.next()?;
    if differing.next().is_some() || !digits_a || !digits_b {
        return None;
    }
    y.parse::<u64>().ok()?.checked_sub(x.parse().ok()?)
}

/// Gaps in the numbering of files in natural order. The smallest distance in the sequence is its
/// step (frames 2, 4, 6 are numbered in twos and have no gap).
pub(super) fn gaps(files: &[PathBuf]) -> Vec<Finding> {
    let distances: Vec<_> = files.windows(2).map(|w| distance(&w[0], &w[1])).collect();
    let Some(step) = distances.iter().flatten().copied().filter(|&d| d > 0).min() else {
        return Vec::new();
    };
    files
        .windows(2)
        .zip(distances)
        .filter_map(|(pair, distance)| match distance {
            Some(d) if d > step => Some(Finding::Gap {
                after: pair[0].clone(),
                before: pair[1].clone(),
                missing: (d - 1) / step,
            }),
            _ => None,
        })
        .collect()
}

/// The number at the very end of a file's stem: 12 for `a3_000012.png`, `None` for `a3b.png`.
pub(super) fn trailing_number(path: &Path) -> Option<usize> {
    let stem = path.file_stem()?.to_str()?;
    let (true, run) = runs(stem).last()? else { return None };
    run.parse().ok()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn paths(names: &[&str]) -> Vec<PathBuf> {
        names.iter().map(PathBuf::from).collect()
    }

    #[test]
    fn two_comes_before_ten() {
        let mut files = paths(&["img10.png", "img2.png", "b1.png", "img1.png", "img002.png"]);
        files.sort_by(|a, b| compare(a, b));
        assert_eq!(files, paths(&["b1.png", "img1.png", "img002.png", "img2.png", "img10.png"]));
    }

    #[test]
    fn numbers_beyond_any_integer_type_still_order() {
        let (a, b) = ("x99999999999999999999999999.png", "x100000000000000000000000000.png");
        assert_eq!(compare(Path::new(a), Path::new(b)), Ordering::Less);
    }

    #[test]
    fn gaps_are_counted_in_steps() {
        let missing = |names: &[&str]| -> Vec<u64> {
            gaps(&paths(names))
                .iter()
                .map(|f| match f {
                    Finding::Gap { missing, .. } => *missing,
                    other => panic!("{other:?}"),
                })
                .collect()
        };
        assert!(missing(&["a1.png", "a2.png", "a3.png"]).is_empty());
        assert_eq!(missing(&["a1.png", "a2.png", "a6.png", "a7.png", "a9.png"]), [3, 1]);
        assert!(missing(&["a2.png", "a4.png", "a6.png"]).is_empty());
        assert_eq!(missing(&["a2.png", "a4.png", "a10.png"]), [2]);
        assert_eq!(missing(&["s1_08_v2.png", "s1_09_v2.png", "s1_11_v2.png"]), [1]);
        assert!(missing(&["front.png", "side.png"]).is_empty());
        assert!(missing(&["a1.png", "b7.png", "b8.png"]).is_empty());
        assert!(missing(&["only5.png"]).is_empty());
    }

    #[test]
    fn the_trailing_number_ends_the_stem() {
        assert_eq!(trailing_number(Path::new("s3/000012.png")), Some(12));
        assert_eq!(trailing_number(Path::new("a3_7.tif")), Some(7));
        assert_eq!(trailing_number(Path::new("a3b.png")), None);
        assert_eq!(trailing_number(Path::new("notes")), None);
    }

    proptest! {
        #[test]
        fn plain_numbers_order_as_numbers(a: u64, b: u64, pad in 0_usize..24) {
            let (x, y) = (format!("f{a}.png"), format!("f{b:0pad$}.png"));
            let order = compare(Path::new(&x), Path::new(&y));
            if a != b {
                prop_assert_eq!(order, a.cmp(&b));
            }
        }

        #[test]
        fn the_order_is_total(names in prop::collection::vec("[a0-3]{0,6}", 3)) {
            let p = paths(&names.iter().map(String::as_str).collect::<Vec<_>>());
            let (a, b, c) = (&p[0], &p[1], &p[2]);
            prop_assert_eq!(compare(a, b), compare(b, a).reverse());
            prop_assert_eq!(compare(a, b) == Ordering::Equal, a == b);
            if compare(a, b).is_le() && compare(b, c).is_le() {
                prop_assert!(compare(a, c).is_le());
            }
        }
    }
}
