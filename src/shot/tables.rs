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
    /// The same after the band-pass, again of unit deviation.
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
            let mut row =
                vec![t.to_string(), number(t as f64 / self.fps), u8::from(self.used[t]).to_string()];
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
            return Err(Error::table(path, 1, "columns are frame, time_s, used, pc…, pc…_band_passed"));
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

/// `keys/weights.csv`: for every frame the weight of every key's pose, their sum, and the active
/// switching model (empty without switching).
#[must_use]
pub fn weights_to_csv(weights: &Weights, fps: f64) -> String {
    let keys = weights.keys();
    let mut header = vec!["frame".to_owned(), "time_s".to_owned()];
    header.extend((1..=keys).map(|k| format!("key_{k}")));
    header.extend(["sum".to_owned(), "model".to_owned()]);
    let rows = (0..weights.frames()).map(|t| {
        let mut row = vec![t.to_string(), number(t as f64 / fps)];
        row.extend(weights.row(t).iter().copied().map(number));
        row.push(number(weights.sum(t)));
        row.push(weights.active_model(t).map(|m| (m + 1).to_string()).unwrap_or_default());
        row
    });
    table(&header, rows)
}

/// Reads `keys/weights.csv`; the sum column is computed anew, so a weight edited by hand counts.
///
/// # Errors
/// [`Error::Table`] naming the line.
pub fn weights_from_csv(path: &Path, bytes: &[u8]) -> Result<Weights> {
    let mut values = Vec::new();
    let mut models = Vec::new();
    let mut keys = 0;
    for (at, row) in records(path, bytes)?.into_iter().enumerate() {
        let line = at + 2;
        if row.len() < 5 {
            return Err(Error::table(path, line, "columns are frame, time_s, key_1…, sum, model"));
        }
        keys = row.len() - 4;
        for cell in &row[2..2 + keys] {
            values.push(parse(path, line, cell)?);
        }
        let model = row[row.len() - 1].trim();
        models.push(match model {
            "" => None,
            text => {
                let model = parse(path, line, text)?;
                if model < 1.0 || model.fract() != 0.0 {
                    return Err(Error::table(path, line, "a model is a whole number from 1"));
                }
                Some(model as usize - 1)
            }
        });
    }
    Weights::from_rows(keys, values, models)
        .ok_or_else(|| Error::table(path, 1, "rows differ in length"))
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

fn records(path: &Path, bytes: &[u8]) -> Result<Vec<Vec<String>>> {
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(bytes);
    let mut rows = Vec::new();
    for (at, record) in reader.records().enumerate() {
        let record = record.map_err(|e| Error::table(path, at + 2, &e.to_string()))?;
        rows.push(record.iter().map(str::to_owned).collect());
    }
    Ok(rows)
}

fn numbers(path: &Path, bytes: &[u8]) -> Result<Vec<Vec<f64>>> {
    records(path, bytes)?
        .iter()
        .enumerate()
        .map(|(at, row)| row.iter().map(|cell| parse(path, at + 2, cell)).collect())
        .collect()
}

fn parse(path: &Path, line: usize, cell: &str) -> Result<f64> {
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
        let projections =
            Projections { fps: 24.0, used: vec![true, true, false, true, true, true], raw, band_passed };
        let text = projections.to_csv();
        let back = Projections::from_csv(Path::new("p.csv"), text.as_bytes(), 24.0).unwrap();
        assert_eq!(back, projections);
    }

    #[test]
    fn a_bad_cell_is_named_with_its_line() {
        let text = "frame,time_s,used,pc1,pc1_band_passed\n0,0,1,.5,.4\n1,0.04,1,oops,.4\n";
        let error = Projections::from_csv(Path::new("p.csv"), text.as_bytes(), 25.0).unwrap_err();
        assert!(matches!(error, Error::Table { line: 3, .. }), "{error}");
    }
}
