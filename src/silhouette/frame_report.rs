//! What is known of one frame's silhouette: its measures, how sure its outline is, and what was
//! noticed about it.

use std::fmt;

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::mask::{Bounds, Mask};

/// One thing noticed about a frame.
///
/// A flag that [excludes](Flag::excludes) its frame says that the outline is not the animal's
/// whole outline: the frame is left out of the PCA and bridged. The others are only told.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
pub enum Flag {
    /// Nothing of the animal was in the picture; the mask is empty.
    Empty,
    /// Something was in the picture, but nothing that can be the animal seen before; the mask is
    /// empty.
    Lost,
    /// The silhouette reaches the picture's border: a part may be outside.
    AtBorder,
    /// The area is far under the usual one for a while: something in front of the animal, or another
    /// one of its kind, covers a part of it ([`flag_occlusions`]).
    ///
    /// [`flag_occlusions`]: super::flag_occlusions
    Occluded,
    /// The area is far over the usual one for a while: another animal touches this one and is taken
    /// along ([`flag_companions`]).
    ///
    /// [`flag_companions`]: super::flag_companions
    Joined,
    /// The outline is hardly more than a guess.
    LowConfidence,
    /// The area is another one than in the frames before and after ([`area_jumps`]).
    ///
    /// [`area_jumps`]: super::area_jumps
    AreaJump,
    /// The silhouette is in several pieces: something thin cuts it, or a part of it was lost.
    SeveralPieces,
    /// A person drew on this frame or repainted its mask: it is taken as it is.
    Corrected,
}

impl Flag {
    /// All flags, the gravest first; lists of flags keep this order.
    pub const ALL: [Flag; 9] = [
        Flag::Empty,
        Flag::Lost,
        Flag::AtBorder,
        Flag::Occluded,
        Flag::Joined,
        Flag::LowConfidence,
        Flag::AreaJump,
        Flag::SeveralPieces,
        Flag::Corrected,
    ];

    /// The word in tables and JSON: lower case, words joined by `_`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Flag::Empty => "empty",
            Flag::Lost => "lost",
            Flag::AtBorder => "at_border",
            Flag::Occluded => "occluded",
            Flag::Joined => "joined",
            Flag::LowConfidence => "low_confidence",
            Flag::AreaJump => "area_jump",
            Flag::SeveralPieces => "several_pieces",
            Flag::Corrected => "corrected",
        }
    }

    /// The flag of that [name](Flag::name).
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|f| f.name() == name)
    }

    /// A short sentence for people, without the frame and without a full stop.
    #[must_use]
    pub fn sentence(self) -> &'static str {
        match self {
            Flag::Empty => "nothing of the animal was seen",
            Flag::Lost => "the animal was lost",
            Flag::AtBorder => "the silhouette reaches the picture's border",
            Flag::Occluded => "a part of the animal is missing for a while, as if covered",
            Flag::Joined => {
                "more than the animal is there for a while, as if another one touched it"
            }
            Flag::LowConfidence => "the outline is uncertain",
            Flag::AreaJump => "the area jumps against the frames around",
            Flag::SeveralPieces => "the silhouette is in several pieces",
            Flag::Corrected => "corrected by hand",
        }
    }

    /// Whether a frame with this flag is left out of the PCA unless the user says otherwise.
    #[must_use]
    pub fn excludes(self) -> bool {
        !matches!(self, Flag::SeveralPieces | Flag::Corrected)
    }

    fn bit(self) -> u16 {
        1 << self as u8
    }
}

/// A set of [`Flag`]s. In JSON it is a list of [names](Flag::name).
#[derive(Clone, Copy, Default, PartialEq, Eq, Hash)]
pub struct Flags(u16);

impl Flags {
    /// No flag.
    pub const NONE: Flags = Flags(0);

    /// Whether there is no flag at all.
    #[must_use]
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Whether `flag` is among them.
    #[must_use]
    pub fn contains(self, flag: Flag) -> bool {
        self.0 & flag.bit() != 0
    }

    /// Adds a flag.
    pub fn insert(&mut self, flag: Flag) {
        self.0 |= flag.bit();
    }

    /// Takes a flag away.
    pub fn remove(&mut self, flag: Flag) {
        self.0 &= !flag.bit();
    }

    /// These and one more.
    #[must_use]
    pub fn with(mut self, flag: Flag) -> Self {
        self.insert(flag);
        self
    }

    /// The flags, the gravest first.
    pub fn iter(self) -> impl Iterator<Item = Flag> {
        Flag::ALL.into_iter().filter(move |f| self.contains(*f))
    }

    /// Whether any of them [excludes](Flag::excludes) its frame from the PCA.
    #[must_use]
    pub fn exclude(self) -> bool {
        self.iter().any(Flag::excludes)
    }

    /// The names with one space between them, as tables hold them; empty without flags.
    #[must_use]
    pub fn names(self) -> String {
        self.iter().map(Flag::name).collect::<Vec<_>>().join(" ")
    }

    /// Reads [`Flags::names`] back: names in any order, with white space or `+` between them.
    ///
    /// # Errors
    /// The first word that is no flag's name.
    pub fn from_names(names: &str) -> std::result::Result<Self, String> {
        names
            .split(|c: char| c == '+' || c.is_whitespace())
            .filter(|word| !word.is_empty())
            .map(|word| Flag::from_name(word).ok_or_else(|| word.to_owned()))
            .collect()
    }
}

impl From<Flag> for Flags {
    fn from(flag: Flag) -> Self {
        Flags::NONE.with(flag)
    }
}

impl FromIterator<Flag> for Flags {
    fn from_iter<I: IntoIterator<Item = Flag>>(flags: I) -> Self {
        flags.into_iter().fold(Flags::NONE, Flags::with)
    }
}

impl fmt::Debug for Flags {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_set().entries(self.iter()).finish()
    }
}

impl Serialize for Flags {
    fn serialize<S: Serializer>(&self, to: S) -> std::result::Result<S::Ok, S::Error> {
        to.collect_seq(self.iter().map(Flag::name))
    }
}

impl<'de> Deserialize<'de> for Flags {
    fn deserialize<D: Deserializer<'de>>(from: D) -> std::result::Result<Self, D::Error> {
        let names = Vec::<String>::deserialize(from)?;
        let flag = |name: &String| {
            Flag::from_name(name).ok_or_else(|| D::Error::custom(format!("no flag is «{name}»")))
        };
        names.iter().map(flag).collect()
    }
}

/// What is known of one frame's silhouette.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrameReport {
    /// The frame, counted from 0.
    pub frame: usize,
    /// Area of the silhouette, pixels.
    pub area_px: usize,
    /// Its centre of mass, pixels; `None` of an empty mask.
    pub centre_px: Option<(f64, f64)>,
    /// How sure the outline is, 0 to 1. 1 for what a person made (mattes, sketches, corrected
    /// frames); 0 where there is no outline.
    pub confidence: f64,
    /// What was noticed.
    pub flags: Flags,
}

impl FrameReport {
    /// Whether the frame is left out of the PCA unless the user says otherwise.
    #[must_use]
    pub fn is_excluded(&self) -> bool {
        self.flags.exclude()
    }
}

/// The report of a mask that came from outside (a matte, a sketch, a paint program): sure of its
/// outline, flagged when it is empty or reaches the border.
#[must_use]
pub fn report_of_mask(frame: usize, mask: &Mask) -> FrameReport {
    let flags = match mask.bounds() {
        None => Flag::Empty.into(),
        Some(b) if touches_border(&b, mask.width(), mask.height()) => Flag::AtBorder.into(),
        Some(_) => Flags::NONE,
    };
    FrameReport {
        frame,
        area_px: mask.area(),
        centre_px: mask.centre_of_mass(),
        confidence: if mask.is_empty() { 0.0 } else { 1.0 },
        flags,
    }
}

/// The report of a mask that a person corrected in this shot: nothing is held against it, even at
/// the border, except that it is empty (which is how a frame is taken out by hand).
#[must_use]
pub fn report_of_corrected_mask(frame: usize, mask: &Mask) -> FrameReport {
    let mut report = report_of_mask(frame, mask);
    report.flags.remove(Flag::AtBorder);
    report.flags.insert(Flag::Corrected);
    report
}

/// Whether a box within a picture of that size reaches the picture's border.
pub(super) fn touches_border(b: &Bounds, width: usize, height: usize) -> bool {
    b.left == 0 || b.top == 0 || b.right + 1 == width || b.bottom + 1 == height
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_flag_has_a_name_and_a_sentence_of_its_own() {
        for (at, flag) in Flag::ALL.into_iter().enumerate() {
            assert_eq!(Flag::from_name(flag.name()), Some(flag));
            assert!(flag.name().chars().all(|c| c.is_ascii_lowercase() || c == '_'));
            assert!(!flag.sentence().is_empty() && !flag.sentence().ends_with('.'));
            let same = |other: &Flag| other.sentence() == flag.sentence();
            assert_eq!(Flag::ALL.iter().position(same), Some(at));
        }
        assert_eq!(Flag::from_name("tracked"), None);
    }

    #[test]
    fn a_set_holds_what_was_put_in_and_reads_back_from_both_forms() {
        let mut flags = Flags::from(Flag::Corrected).with(Flag::AtBorder);
        assert!(flags.contains(Flag::AtBorder) && !flags.contains(Flag::Lost));
        assert_eq!(flags.names(), "at_border corrected");
        assert_eq!(Flags::from_names("corrected+at_border"), Ok(flags));
        assert_eq!(Flags::from_names(" "), Ok(Flags::NONE));
        assert_eq!(Flags::from_names("corrected hungry"), Err("hungry".to_owned()));
        let text = serde_json::to_string(&flags).unwrap();
        assert_eq!(text, r#"["at_border","corrected"]"#);
        assert_eq!(serde_json::from_str::<Flags>(&text).unwrap(), flags);
        assert!(serde_json::from_str::<Flags>(r#"["hungry"]"#).is_err());
        flags.remove(Flag::AtBorder);
        assert!(!flags.is_empty() && !flags.exclude());
        let all: Flags = Flag::ALL.into_iter().collect();
        assert_eq!(all.iter().collect::<Vec<_>>(), Flag::ALL);
    }

    #[test]
    fn what_a_person_did_excludes_nothing() {
        assert!(!Flags::NONE.exclude());
        let kept: Vec<Flag> = Flag::ALL.into_iter().filter(|f| !f.excludes()).collect();
        assert_eq!(kept, [Flag::SeveralPieces, Flag::Corrected]);
        assert!(Flags::from(Flag::Corrected).with(Flag::Empty).exclude());
    }

    #[test]
    fn masks_from_outside_are_reported_too() {
        let empty = report_of_mask(3, &Mask::new(5, 5));
        assert_eq!((empty.flags, empty.confidence), (Flag::Empty.into(), 0.0));
        let all = Mask::from_fn(5, 5, |_, _| true);
        assert_eq!(report_of_mask(3, &all).flags, Flag::AtBorder.into());
        let dot = report_of_mask(3, &Mask::from_fn(5, 5, |x, y| x == 2 && y == 2));
        assert_eq!((dot.flags, dot.confidence, dot.area_px), (Flags::NONE, 1.0, 1));
        assert_eq!((dot.frame, dot.centre_px), (3, Some((2.0, 2.0))));
        assert_eq!(report_of_corrected_mask(3, &all).flags, Flag::Corrected.into());
        assert!(report_of_corrected_mask(3, &Mask::new(5, 5)).is_excluded());
    }
}
