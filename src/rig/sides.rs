//! Left and right in the names of bones.

/// Words for left and right as riggers write them.
const WORDS: [(&str, &str); 3] = [("left", "right"), ("lft", "rgt"), ("l", "r")];

/// Whether a name says left (`true`) or right, or neither.
pub(super) fn side(name: &str) -> Option<bool> {
    found(name).map(|(_, _, left)| left)
}

/// The same name for the other side: `Leg.L` and `Leg.R`, `b_LeftFoot02_018` and `b_RightFoot02_018`. `None` when the
/// name says neither left nor right.
pub(super) fn other_side(name: &str) -> Option<String> {
    let (from, word, left) = found(name)?;
    let (l, r) = WORDS[word];
    let (own, other) = if left { (l, r) } else { (r, l) };
    let written = &name[from..from + own.len()];
    Some(format!(
        "{}{}{}",
        &name[..from],
        in_the_case_of(written, other),
        &name[from + own.len()..]
    ))
}

/// Where a word for a side stands in a name, which of [`WORDS`] it is, and whether it is the left one. A long word may
/// stand anywhere, a single letter between the ends of the name, separators, digits or, as a capital, lower-case letters.
fn found(name: &str) -> Option<(usize, usize, bool)> {
    let lower = name.to_ascii_lowercase();
    for (word, (left, right)) in WORDS.iter().enumerate() {
        for (text, is_left) in [(left, true), (right, false)] {
            let at = lower.match_indices(*text).find(|(at, _)| text.len() > 1 || alone(name, *at));
            if let Some((at, _)) = at {
                return Some((at, word, is_left));
            }
        }
    }
    None
}

/// Whether the letter at `at` stands by itself.
fn alone(name: &str, at: usize) -> bool {
    let before = name[..at].chars().next_back();
    let after = name[at + 1..].chars().next();
    let apart = |c: Option<char>| c.is_none_or(|c| !c.is_alphabetic());
    apart(before) && apart(after)
}

fn in_the_case_of(written: &str, word: &str) -> String {
    if written.chars().all(|c| c.is_uppercase()) {
        word.to_uppercase()
    } else if written.starts_with(|c: char| c.is_uppercase()) {
        let mut letters = word.chars();
        letters.next().map_or_else(String::new, |c| c.to_uppercase().chain(letters).collect())
    } else {
        word.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_say_which_side() {
        for (one, other) in [
            ("FrontUpperLeg.L", "FrontUpperLeg.R"),
            ("b_LeftFoot02_018", "b_RightFoot02_018"),
            ("thigh_l", "thigh_r"),
            ("L_Hand", "R_Hand"),
            ("mixamorig:LeftArm", "mixamorig:RightArm"),
            ("LEFT leg", "RIGHT leg"),
            ("foot.l.001", "foot.r.001"),
            ("Lft_Ear", "Rgt_Ear"),
        ] {
            assert_eq!(other_side(one).as_deref(), Some(other));
            assert_eq!(other_side(other).as_deref(), Some(one));
            assert_eq!((side(one), side(other)), (Some(true), Some(false)));
        }
        for middle in ["Spine", "tail_03", "Pelvis", "skull", "node 4", "Rl"] {
            assert_eq!(other_side(middle), None, "{middle}");
        }
    }
}
