//! The measured gait phase as CSV: `analysis/phase.csv`, one row a frame, and `analysis/cycle.csv`,
//! one row a harmonic.

use std::path::Path;

use super::store::read;
use super::tables::{number, numbers, table};
use super::{Shot, paths};
use crate::error::{Error, Result};
use crate::gait::GaitPhase;
use crate::numeric::Harmonics;

const COLUMNS: [&str; 7] =
    ["frame", "time_s", "stride_cycles", "deviation_cycles", "trust", "drift", "amplitude"];

/// What keys and interpolation need of the gait phase.
#[derive(Clone, Debug, PartialEq)]
pub struct PhaseTable {
    /// Phase of each frame, strides, unwrapped.
    pub stride_cycles: Vec<f64>,
    /// Standard deviation of each phase, strides.
    pub deviation_cycles: Vec<f64>,
    /// How well each frame fits the cycle, 0…1.
    pub trust: Vec<f64>,
    /// The silhouette's scores over the stride, weighted by their deviations.
    pub cycle: Harmonics,
    /// How far the view has drifted at each frame, in standard deviations over the clip; 0 throughout where it does
    /// not drift.
    pub drift: Vec<f64>,
    /// Size of the motion about each frame over the mean.
    pub amplitude: Vec<f64>,
}

impl PhaseTable {
    /// From the measurement.
    #[must_use]
    pub fn of(phase: &GaitPhase) -> Self {
        Self {
            stride_cycles: phase.stride_cycles.clone(),
            deviation_cycles: phase.deviation_cycles.clone(),
            trust: phase.trust.clone(),
            cycle: phase.cycle.clone(),
            drift: vec![0.0; phase.stride_cycles.len()],
            amplitude: phase.amplitude.clone(),
        }
    }

    /// Whether the view drifts.
    #[must_use]
    pub fn drifts(&self) -> bool {
        self.drift.iter().any(|d| *d != 0.0)
    }

    /// One row a frame: frame, `time_s`, `stride_cycles`, `deviation_cycles`, trust, drift, amplitude.
    #[must_use]
    pub fn frames_csv(&self, fps: f64) -> String {
        let rows = (0..self.stride_cycles.len()).map(|t| {
            vec![
                t.to_string(),
                number(t as f64 / fps),
                number(self.stride_cycles[t]),
                number(self.deviation_cycles[t]),
                number(self.trust[t]),
                number(self.drift[t]),
                number(self.amplitude[t]),
            ]
        });
        table(&COLUMNS.map(str::to_owned), rows)
    }

    /// One row a harmonic: its number, then cosine and sine of each component.
    #[must_use]
    pub fn cycle_csv(&self) -> String {
        let components = 1..=self.cycle.components();
        let mut header = vec!["harmonic".to_owned()];
        header.extend(components.flat_map(|c| [format!("cos_pc{c}"), format!("sin_pc{c}")]));
        let rows = (1..=self.cycle.order()).map(|h| {
            let mut row = vec![h.to_string()];
            for c in 0..self.cycle.components() {
                let (cos, sin) = self.cycle.of(h, c);
                row.extend([number(cos), number(sin)]);
            }
            row
        });
        table(&header, rows)
    }

    fn from_csv(frames: (&Path, &[u8]), cycle: (&Path, &[u8])) -> Result<Self> {
        let rows = numbers(frames.0, frames.1)?;
        // A table without the last column is one from before amplitudes were measured.
        let columns = rows.first().map_or(0, Vec::len);
        if !(COLUMNS.len() - 1..=COLUMNS.len()).contains(&columns) {
            return Err(Error::table(frames.0, 1, &format!("columns are {}", COLUMNS.join(", "))));
        }
        let harmonics: Vec<(Vec<f64>, Vec<f64>)> = numbers(cycle.0, cycle.1)?
            .iter()
            .map(|row| {
                let pairs = row.get(1..).unwrap_or_default().chunks_exact(2);
                pairs.map(|p| (p[0], p[1])).unzip()
            })
            .collect();
        let components = harmonics.first().map_or(0, |h| h.0.len());
        let cycle = Harmonics::from_parts(&vec![0.0; components], &harmonics)
            .filter(|h| h.order() > 0 && components > 0)
            .ok_or_else(|| {
                Error::table(cycle.0, 2, "every harmonic has a cosine and a sine of each component")
            })?;
        let column = |at: usize| rows.iter().map(|r| r[at]).collect::<Vec<f64>>();
        let amplitude = if columns == COLUMNS.len() { column(6) } else { vec![1.0; rows.len()] };
        let bad = |a: &f64| !(*a > 0.0 && a.is_finite());
        if let Some(row) = amplitude.iter().position(bad) {
            return Err(Error::table(frames.0, row + 2, "an amplitude is a number over 0"));
        }
        let (stride_cycles, deviation_cycles) = (column(2), column(3));
        let (trust, drift) = (column(4), column(5));
        Ok(Self { stride_cycles, deviation_cycles, trust, cycle, drift, amplitude })
    }
}

impl Shot {
    /// The gait phase, as stored or edited; `None` when none could be measured. `frames` is the
    /// length of the clip.
    ///
    /// # Errors
    /// When the tables cannot be understood or have another number of frames.
    pub fn phase(&self, frames: usize) -> Result<Option<PhaseTable>> {
        let (path, cycle) = (self.path(paths::PHASE), self.path(paths::CYCLE));
        if !path.is_file() || !cycle.is_file() {
            return Ok(None);
        }
        let found = PhaseTable::from_csv((&path, &read(&path)?), (&cycle, &read(&cycle)?))?;
        if found.stride_cycles.len() != frames {
            let what =
                format!("the table has {} rows for {frames} frames", found.stride_cycles.len());
            return Err(Error::table(&path, 1, &what));
        }
        Ok(Some(found))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_reads_back_to_the_same_bits() {
        let cycle = Harmonics::from_parts(
            &[0.0, 0.0],
            &[(vec![0.1, 1.0 / 3.0], vec![-0.2, 0.0]), (vec![0.7, 0.01], vec![0.3, -5.0])],
        );
        let table = PhaseTable {
            stride_cycles: vec![0.0, 0.1, 0.30000000000000004],
            deviation_cycles: vec![0.01, 0.02, 1.0 / 7.0],
            trust: vec![1.0, 0.0, 0.5],
            cycle: cycle.unwrap(),
            drift: vec![-1.2, 0.0, 1.0 / 3.0],
            amplitude: vec![1.0, 0.9, 1.1],
        };
        let path = Path::new("phase.csv");
        let (frames, cycle) = (table.frames_csv(24.0), table.cycle_csv());
        let read =
            |f: &str, c: &str| PhaseTable::from_csv((path, f.as_bytes()), (path, c.as_bytes()));
        assert_eq!(read(&frames, &cycle).unwrap(), table);
        assert!(read("frame,trust\n1,2\n", &cycle).is_err());
        assert!(read(&frames.replace(",0.9\n", ",0\n"), &cycle).is_err());
        // A table from before there were amplitudes.
        let older: String = (frames.lines())
            .filter_map(|line| line.rsplit_once(','))
            .flat_map(|(rest, _)| [rest, "\n"])
            .collect();
        assert_eq!(read(&older, &cycle).unwrap().amplitude, [1.0; 3]);
        assert!(read(&frames, "harmonic\n").is_err());
    }
}
