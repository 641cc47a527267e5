//! The tables of a shot as CSV: one row a frame, numbers written so that reading them back gives
//! the same bits.

use std::path::Path;

use crate::error::{Error, Result};
use crate::interpolate::Weights;
use crate::numeric::Coefficients;

/// `analysis/projections.csv`: what the analysis found out about each frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Projections {
    /// Frames a second.
    pub fps: f64,
    /// For each frame, whether its mask entered the PCA; the coefficients of one that did not are
    /// bridged from its neighbours.
    pub used: Vec<bool>,
    /// Unit-deviation scores, frames × components.
    pub raw: Coefficients,
    /// The same after the band-pass.
    pub band_passed: Coefficients,
}

impl Projections {
    /// The table as text.
    #[must_use]
    pub fn to_csv(&self) -> String {
        let components = self.raw.components();
        let mut header = vec!["frame".to_owned(), "time_s".to_owned(), "used".to_owned()];
        header.extend((1..=components).map(|c| format!("pc{c}")));
        header.extend((1..=components).map(|c| format!("pc{c}_band_passed")));
        let rows = (0..self.raw.frames()).map(|t| {
            let mut row = vec![
                t.to_string(),
                number(t as f64 / self.fps),
                u8::from(self.used[t]).to_string(),
            ];
            row.extend(self.raw.point(t).iter().copied().map(number));
            row.extend(self.band_passed.point(t).iter().copied().map(number));
            row
        });
        table(&header, rows)
    }

    /// Reads what [`Projections::to_csv`] wrote; `fps` comes from the shot.
    ///
    /// # Errors
    /// [`Error::Table`] naming the line.
    pub fn from_csv(path: &Path, bytes: &[u8], fps: f64) -> Result<Self> {
        let rows = numbers(path, bytes)?;
        let width = rows.first().map_or(3, Vec::len);
        let components = width.saturating_sub(3) / 2;
        if width != 3 + 2 * components || components == 0 {
            return Err(Error::table(
                path,
                1,
                "columns are frame, time_s, used, pc…, pc…_band_passed",
            ));
        }
        let part = |from: usize| -> Vec<f64> {
            rows.iter().flat_map(|r| r[from..from + components].iter().copied()).collect()
        };
        let frames = rows.len();
        let coefficients = |values| {
            Coefficients::from_rows(frames, components, values)
                .ok_or_else(|| Error::table(path, 1, "rows differ in length"))
        };
        Ok(Self {
            fps,
            used: rows.iter().map(|r| r[2] != 0.0).collect(),
            raw: coefficients(part(3))?,
            band_passed: coefficients(part(3 + components))?,
        })
    }
}

/// Before the number of a key whose pose is taken with left and right exchanged.
const MIRRORED: &str = "mirrored_";

/// `keys/weights.csv`: for every frame the weight of every key's pose, their sum, and the active
/// switching model. It needs no rig: anything that can be summed can be driven by it.
#[derive(Clone, Debug, PartialEq)]
pub struct WeightTable {
    /// Number of poses, K.
    pub poses: usize,
    /// How many of them, the last ones, are the first ones with left and right exchanged.
    pub mirrored: usize,
    /// Frames × poses, row-major.
    pub values: Vec<f64>,
    /// The switching model of each frame, from 0; `None` without switching.
    pub models: Vec<Option<usize>>,
}

impl WeightTable {
    /// From the interpolation's result.
    #[must_use]
    pub fn of(weights: &Weights) -> Self {
        Self {
            poses: weights.poses(),
            mirrored: weights.mirrored(),
            values: weights.values().to_vec(),
            models: (0..weights.frames()).map(|t| weights.active_model(t)).collect(),
        }
    }

    /// The rows of some frames.
    ///
    /// # Panics
    /// When `frames` are not all frames of the table.
    #[must_use]
    pub fn rows(&self, frames: std::ops::Range<usize>) -> Self {
        Self {
            poses: self.poses,
            mirrored: self.mirrored,
            values: self.values[frames.start * self.poses..frames.end * self.poses].to_vec(),
            models: self.models[frames].to_vec(),
        }
    }

    /// Number of frames.
    #[must_use]
    pub fn frames(&self) -> usize {
        self.models.len()
    }

    /// The weights of frame `t`.
    ///
    /// # Panics
    /// When `t` is not a frame.
    #[must_use]
    pub fn row(&self, t: usize) -> &[f64] {
        &self.values[t * self.poses..(t + 1) * self.poses]
    }

    /// The sum of frame `t`'s weights.
    ///
    /// # Panics
    /// When `t` is not a frame.
    #[must_use]
    pub fn sum(&self, t: usize) -> f64 {
        self.row(t).iter().sum()
    }

    /// Number of poses that somebody has to make.
    #[must_use]
    pub fn posed(&self) -> usize {
        self.poses - self.mirrored
    }

    /// The table as text: frame, time, one column a key, one a mirrored key, sum, model (from 1, empty without
    /// switching).
    #[must_use]
    pub fn to_csv(&self, fps: f64) -> String {
        let mut header = vec!["frame".to_owned(), "time_s".to_owned()];
        header.extend((1..=self.posed()).map(|k| format!("key_{k}")));
        header.extend((1..=self.mirrored).map(|k| format!("{MIRRORED}{k}")));
        header.extend(["sum".to_owned(), "model".to_owned()]);
        let rows = (0..self.frames()).map(|t| {
            let mut row = vec![t.to_string(), number(t as f64 / fps)];
            row.extend(self.row(t).iter().copied().map(number));
            row.push(number(self.sum(t)));
            row.push(self.models[t].map(|m| (m + 1).to_string()).unwrap_or_default());
            row
        });
        table(&header, rows)
    }

    /// Reads the table; the sum column is computed anew, so a weight edited by hand counts.
    ///
    /// # Errors
    /// [`Error::Table`] naming the line.
    pub fn from_csv(path: &Path, bytes: &[u8]) -> Result<Self> {
        let (header, rows) = header_and_records(path, bytes)?;
        let mirrored = header.iter().filter(|name| name.starts_with(MIRRORED)).count();
        let mut found = Self { poses: 0, mirrored, values: Vec::new(), models: Vec::new() };
        for (at, row) in rows.into_iter().enumerate() {
            let line = at + 2;
            if row.len() < 5 {
                return Err(Error::table(
                    path,
                    line,
                    "columns are frame, time_s, key_1…, sum, model",
                ));
            }
            found.poses = row.len() - 4;
            if 2 * mirrored > found.poses {
                return Err(Error::table(path, 1, "there are more mirrored keys than keys"));
            }
            for cell in &row[2..2 + found.poses] {
                found.values.push(parse(path, line, cell)?);
            }
            found.models.push(match row[row.len() - 1].trim() {
                "" => None,
                text => Some(model_index(path, line, text)?),
            });
        }
        if found.models.is_empty() {
            return Err(Error::table(path, 1, "the table has no rows"));
        }
        Ok(found)
    }
}

fn model_index(path: &Path, line: usize, text: &str) -> Result<usize> {
    match text.parse::<usize>() {
        Ok(model) if model >= 1 => Ok(model - 1),
        _ => Err(Error::table(path, line, "a model is a whole number from 1")),
    }
}

/// A table of numbers with a header line, as text.
#[must_use]
pub fn table(header: &[String], rows: impl Iterator<Item = Vec<String>>) -> String {
    let mut text = header.join(",");
    text.push('\n');
    for row in rows {
        text.push_str(&row.join(","));
        text.push('\n');
    }
    text
}

/// The shortest decimal that reads back as the same `f64`.
#[must_use]
pub fn number(value: f64) -> String {
    format!("{value}")
}

pub(super) fn records(path: &Path, bytes: &[u8]) -> Result<Vec<Vec<String>>> {
    Ok(header_and_records(path, bytes)?.1)
}

fn header_and_records(path: &Path, bytes: &[u8]) -> Result<(Vec<String>, Vec<Vec<String>>)> {
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(bytes);
    let header = reader.headers().map_err(|e| Error::table(path, 1, &e.to_string()))?;
    let header = header.iter().map(str::to_owned).collect();
    let mut rows = Vec::new();
    for (at, record) in reader.records().enumerate() {
        let record = record.map_err(|e| Error::table(path, at + 2, &e.to_string()))?;
        rows.push(record.iter().map(str::to_owned).collect());
    }
    Ok((header, rows))
}

pub(super) fn numbers(path: &Path, bytes: &[u8]) -> Result<Vec<Vec<f64>>> {
    records(path, bytes)?
        .iter()
        .enumerate()
        .map(|(at, row)| row.iter().map(|cell| parse(path, at + 2, cell)).collect())
        .collect()
}

pub(super) fn parse(path: &Path, line: usize, cell: &str) -> Result<f64> {
    match cell.trim().parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err(Error::table(path, line, &format!("«{cell}» is not a finite number"))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn projections_read_back_to_the_same_bits() {
        let values: Vec<f64> = (0..12).map(|i| (f64::from(i) * 0.7).sin() / 3.0).collect();
        let raw = Coefficients::from_rows(6, 2, values.clone()).unwrap();
        let band_passed =
            Coefficients::from_rows(6, 2, values.iter().map(|v| v.exp()).collect()).unwrap();
        let projections = Projections {
            fps: 24.0,
            used: vec![true, true, false, true, true, true],
            raw,
            band_passed,
        };
        let text = projections.to_csv();
        let back = Projections::from_csv(Path::new("p.csv"), text.as_bytes(), 24.0).unwrap();
        assert_eq!(back, projections);
    }

    #[test]
    fn weights_read_back_and_may_be_edited() {
        let weights = WeightTable {
            poses: 2,
            mirrored: 0,
            values: vec![0.25, 0.75, 1.0 / 3.0, -0.1],
            models: vec![Some(0), None],
        };
        let text = weights.to_csv(24.0);
        assert!(text.starts_with("frame,time_s,key_1,key_2,sum,model\n0,0,0.25,0.75,1,1\n"));
        let path = Path::new("w.csv");
        assert_eq!(WeightTable::from_csv(path, text.as_bytes()).unwrap(), weights);
        let edited = text.replace("0.25,0.75,1,1", "0.5,0.75,9,0");
        let error = WeightTable::from_csv(path, edited.as_bytes()).unwrap_err();
        assert!(matches!(error, Error::Table { line: 2, .. }), "{error}");
        assert!(WeightTable::from_csv(path, b"frame,time_s,key_1,sum,model\n").is_err());
        let mirrored = WeightTable { mirrored: 1, ..weights };
        let text = mirrored.to_csv(24.0);
        assert!(text.starts_with("frame,time_s,key_1,mirrored_1,sum,model\n"));
        assert_eq!(WeightTable::from_csv(path, text.as_bytes()).unwrap(), mirrored);
        let error = WeightTable::from_csv(path, text.replace("key_1", "mirrored_2").as_bytes());
        assert!(matches!(error, Err(Error::Table { line: 1, .. })));
    }

    #[test]
    fn a_bad_cell_is_named_with_its_line() {
        let text = "frame,time_s,used,pc1,pc1_band_passed\n0,0,1,.5,.4\n1,0.04,1,oops,.4\n";
        let error = Projections::from_csv(Path::new("p.csv"), text.as_bytes(), 25.0).unwrap_err();
        assert!(matches!(error, Error::Table { line: 3, .. }), "{error}");
    }
}
