//! `analysis/silhouettes.csv`: what is known of each frame's silhouette.

use std::path::Path;

use super::store::read;
use super::tables::{number, parse, records, table};
use super::{Shot, Stage, paths};
use crate::error::{Error, Result};
use crate::mask::Mask;
use crate::silhouette::{Flags, FrameReport, report_of_corrected_mask, report_of_mask};

/// The table: one report a frame, in order from frame 0.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SilhouetteTable {
    /// The reports.
    pub reports: Vec<FrameReport>,
}

impl SilhouetteTable {
    /// The columns.
    pub const COLUMNS: [&'static str; 7] =
        ["frame", "time_s", "area_px", "centre_x_px", "centre_y_px", "confidence", "flags"];

    /// The table as text; the cells of an empty mask's centre are empty.
    #[must_use]
    pub fn to_csv(&self, fps: f64) -> String {
        let rows = self.reports.iter().map(|r| {
            let (x, y) = r.centre_px.map(|(x, y)| (number(x), number(y))).unwrap_or_default();
            vec![
                r.frame.to_string(),
                number(r.frame as f64 / fps),
                r.area_px.to_string(),
                x,
                y,
                number(r.confidence),
                r.flags.names(),
            ]
        });
        table(&Self::COLUMNS.map(str::to_owned), rows)
    }

    /// Reads the table, which a hand may have edited.
    ///
    /// # Errors
    /// [`Error::Table`] naming the line.
    pub fn from_csv(path: &Path, bytes: &[u8]) -> Result<Self> {
        let rows = records(path, bytes)?;
        let report = |(frame, row): (usize, &Vec<String>)| report(path, frame, row);
        Ok(Self { reports: rows.iter().enumerate().map(report).collect::<Result<_>>()? })
    }
}

fn report(path: &Path, frame: usize, row: &[String]) -> Result<FrameReport> {
    let line = frame + 2;
    let fail = |what: String| Error::table(path, line, &what);
    let [number, _, area, x, y, confidence, flags] = row else {
        return Err(fail(format!("columns are {}", SilhouetteTable::COLUMNS.join(", "))));
    };
    if number.parse() != Ok(frame) {
        return Err(fail(format!("frame {frame} is expected here, not «{number}»")));
    }
    let centre_px = match (x.as_str(), y.as_str()) {
        ("", "") => None,
        _ => Some((parse(path, line, x)?, parse(path, line, y)?)),
    };
    let confidence = parse(path, line, confidence)?;
    if !(0.0..=1.0).contains(&confidence) {
        return Err(fail(format!("a confidence is 0 to 1, not {confidence}")));
    }
    Ok(FrameReport {
        frame,
        area_px: area
            .parse()
            .map_err(|_| fail(format!("an area is a whole number of pixels, not «{area}»")))?,
        centre_px,
        confidence,
        flags: Flags::from_names(flags)
            .map_err(|word| fail(format!("no flag is called «{word}»")))?,
    })
}

impl Shot {
    /// What is known of each mask as it is now: the stored table, in which a mask that was edited
    /// by hand since is reported as corrected.
    ///
    /// # Errors
    /// When the table or a mask is missing or cannot be understood.
    pub fn frame_reports(&self) -> Result<Vec<FrameReport>> {
        let path = self.path(paths::SILHOUETTES);
        let mut reports = SilhouetteTable::from_csv(&path, &read(&path)?)?.reports;
        let files = self.mask_files()?;
        reports.truncate(files.len());
        let edited = self.edited_files(Stage::Segment)?;
        for (frame, file) in files.iter().enumerate() {
            let by_hand = edited.contains(&paths::mask(frame));
            if !by_hand && frame < reports.len() {
                continue;
            }
            let mask = Mask::from_image_bytes(file, &read(file)?)?;
            let report = if by_hand {
                report_of_corrected_mask(frame, &mask)
            } else {
                // More masks than the table knows: somebody added them.
                report_of_mask(frame, &mask)
            };
            match reports.get_mut(frame) {
                Some(old) => *old = report,
                None => reports.push(report),
            }
        }
        Ok(reports)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::silhouette::Flag;

    fn some() -> SilhouetteTable {
        let plain = FrameReport {
            frame: 0,
            area_px: 812,
            centre_px: Some((10.25, 1.0 / 3.0)),
            confidence: 0.1 + 0.2,
            flags: Flags::NONE,
        };
        let lost = FrameReport {
            frame: 1,
            area_px: 0,
            centre_px: None,
            confidence: 0.0,
            flags: Flags::from(Flag::Lost).with(Flag::AreaJump),
        };
        SilhouetteTable { reports: vec![plain, lost] }
    }

    #[test]
    fn reports_read_back_to_the_same_bits() {
        let text = some().to_csv(24.0);
        let header = "frame,time_s,area_px,centre_x_px,centre_y_px,confidence,flags\n";
        assert!(text.starts_with(header), "{text}");
        assert!(text.ends_with(",0,,,0,lost area_jump\n"), "{text}");
        let path = Path::new("s.csv");
        assert_eq!(SilhouetteTable::from_csv(path, text.as_bytes()).unwrap(), some());
    }

    #[test]
    fn what_a_hand_may_spoil_is_named_with_its_line() {
        let text = some().to_csv(24.0);
        let cases = [
            ("lost area_jump", "asleep"),
            (",0,lost", ",1.5,lost"),
            ("\n1,", "\n2,"),
            (",0,,,", ",-3,,,"),
            ("0,lost area_jump", "lost"),
        ];
        for (from, to) in cases {
            let edited = text.replace(from, to);
            assert_ne!(edited, text, "{from}");
            let error = SilhouetteTable::from_csv(Path::new("s.csv"), edited.as_bytes());
            assert!(matches!(error, Err(Error::Table { line: 3, .. })), "{to}: {error:?}");
        }
    }
}
