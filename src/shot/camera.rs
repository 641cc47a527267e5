//! `analysis/camera.csv`: how the camera moved, as far as the background tells.

use std::path::Path;

use nalgebra::Matrix3;

use super::tables::{number, parse, records, table};
use crate::error::{Error, Result};
use crate::motion::{CameraPath, CameraStep, Homography};

/// The camera's path as a table: one row a frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CameraTable {
    /// The path, in pixels of the footage.
    pub path: CameraPath,
}

impl CameraTable {
    /// The columns. `dx_px` to `roll_rad` say how the background moved since the frame before, at the
    /// middle of the picture: to the right, down, larger by a factor, and clockwise. `h11` to `h33`
    /// are the whole mapping of the frame before to this one, row by row.
    pub const COLUMNS: [&'static str; 17] = [
        "frame",
        "time_s",
        "dx_px",
        "dy_px",
        "zoom",
        "roll_rad",
        "explained",
        "residual",
        "h11",
        "h12",
        "h13",
        "h21",
        "h22",
        "h23",
        "h31",
        "h32",
        "h33",
    ];

    /// The table as text; `size` is that of the footage, pixels.
    #[must_use]
    pub fn to_csv(&self, fps: f64, size: (usize, usize)) -> String {
        let (x, y) = ((size.0 as f64 - 1.0) / 2.0, (size.1 as f64 - 1.0) / 2.0);
        let rows = self.path.steps().iter().enumerate().map(|(t, step)| {
            let h = &step.from_previous;
            let (u, v) = h.apply(x, y);
            // Where a step of one pixel to the right of the middle leads.
            let (right, down) = h.apply(x + 1.0, y);
            let (a, b) = (right - u, down - v);
            let mut row = vec![t.to_string()];
            row.extend(
                [t as f64 / fps, u - x, v - y, a.hypot(b), b.atan2(a), step.inliers, step.residual]
                    .map(number),
            );
            row.extend(h.matrix().transpose().iter().copied().map(number));
            row
        });
        table(&Self::COLUMNS.map(str::to_owned), rows)
    }

    /// Reads the table; only the mapping counts, the columns for people do not.
    ///
    /// # Errors
    /// [`Error::Table`] naming the line.
    pub fn from_csv(path: &Path, bytes: &[u8]) -> Result<Self> {
        let mut steps = Vec::new();
        for (at, row) in records(path, bytes)?.iter().enumerate() {
            let line = at + 2;
            if row.len() != Self::COLUMNS.len() {
                let what = format!("columns are {}", Self::COLUMNS.join(", "));
                return Err(Error::table(path, line, &what));
            }
            let values: Vec<f64> =
                row.iter().skip(6).map(|cell| parse(path, line, cell)).collect::<Result<_>>()?;
            let from_previous = Homography::from_matrix(Matrix3::from_row_slice(&values[2..]))
                .ok_or_else(|| Error::table(path, line, "h11 to h33 cannot be inverted"))?;
            steps.push(CameraStep { from_previous, inliers: values[0], residual: values[1] });
        }
        Ok(Self { path: CameraPath::from_steps(steps) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::Registration;

    #[test]
    fn the_table_reads_back_the_same_and_says_what_moved() {
        let mut path = CameraPath::default();
        path.push(None);
        let turn = Matrix3::new(0.0, -2.0, 30.0, 2.0, 0.0, 4.0, 0.0, 0.0, 1.0);
        for homography in
            [Homography::translation(-3.25, 0.1), Homography::from_matrix(turn).unwrap()]
        {
            path.push(Some(Registration { homography, inliers: 0.75, residual: 1.5 }));
        }
        let table = CameraTable { path };
        let text = table.to_csv(25.0, (21, 11));
        assert_eq!(CameraTable::from_csv(Path::new("c.csv"), text.as_bytes()).unwrap(), table);
        let rows: Vec<Vec<f64>> = text
            .lines()
            .skip(1)
            .map(|line| line.split(',').map(|cell| cell.parse().unwrap()).collect())
            .collect();
        assert_eq!(rows[0][2..6], [0.0, 0.0, 1.0, 0.0]);
        assert!((rows[1][2] + 3.25).abs() < 1e-12 && (rows[1][1] - 0.04).abs() < 1e-12);
        assert!((rows[2][4] - 2.0).abs() < 1e-12);
        assert!((rows[2][5] - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
        let broken = text.replace("0.75", "x");
        assert!(CameraTable::from_csv(Path::new("c.csv"), broken.as_bytes()).is_err());
    }
}
