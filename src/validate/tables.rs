//! The validation as text and as CSV.

use super::{AngleError, Row, Validation};

impl Validation {
    /// The seed's tables as text for a terminal.
    #[must_use]
    pub fn to_text(&self) -> String {
        let mut text = format!(
            "{}: {} frames, {} a cycle, yaw {}°, {} % of edge pixels flipped, seed {}\n",
            self.subject,
            self.frames,
            self.frames_per_cycle,
            self.yaw_deg,
            100.0 * self.noise,
            self.seed
        );
        text.push_str(&format!("verdict: {}\n", self.verdict));
        for reason in &self.reasons {
            text.push_str(&format!("  - {reason}\n"));
        }
        text.push_str(&format!("silhouette repeats every {:.2} frames\n\n", self.step_frames));
        text.push_str(&list("component", (1..=self.r.len()).map(|c| format!("PC{c}"))));
        let shares = self.variance_shares.iter().map(|v| format!("{:.1}", 100.0 * v));
        text.push_str(&list("variance, %", shares));
        text.push_str(&list("r", self.r.iter().map(|r| format!("{r:.2}"))));
        text.push_str(&format!(
            "\nerror, degrees: mean ± standard deviation over frames and {} joints; method {}\n",
            self.joints, self.method
        ));
        text.push_str(&self.error_table(|c| Some(c.error)));
        text.push_str(&format!("mean pose: {}\n", angle(self.mean_pose)));
        if self.rows.iter().flat_map(|r| &r.cells).any(|c| c.without_switching.is_some()) {
            text.push_str("\nas many poses on key images of their own, without switching\n");
            text.push_str(&self.error_table(|c| c.without_switching));
        }
        if let Some(mean_pose) = self.mean_pose_in_plane {
            text.push_str("\nthe seed's measure: absolute difference of the in-plane angles\n");
            text.push_str(&self.error_table(|c| c.in_plane));
            text.push_str(&format!("mean pose: {}\n", angle(mean_pose)));
        }
        text
    }

    fn error_table(&self, pick: impl Fn(&super::Cell) -> Option<AngleError>) -> String {
        let columns = self.rows.first().map_or(&[][..], |r| &r.cells[..]);
        let mut text = format!("{:<6}{:<7}", "keys", "poses");
        for cell in columns {
            text.push_str(&format!("{:<14}", format!("{} PC", cell.components)));
        }
        text.push_str("floor\n");
        for row in &self.rows {
            text.push_str(&format!("{:<6}{:<7}", row.keys, row.poses));
            for cell in &row.cells {
                text.push_str(&format!("{:<14}", pick(cell).map(angle).unwrap_or_default()));
            }
            text.push_str(&format!("{}\n", row.floor.map(angle).unwrap_or_default()));
        }
        text
    }

    /// The error table as CSV, one line a cell.
    #[must_use]
    pub fn errors_csv(&self) -> String {
        let mut text = String::from(
            "keys,poses,components,error_mean_deg,error_sd_deg,in_plane_mean_deg,in_plane_sd_deg,without_switching_mean_deg,without_switching_sd_deg,floor_mean_deg,floor_sd_deg,mean_pose_deg,condition,proven_optimal,expected_error_share\n",
        );
        for row in &self.rows {
            for cell in &row.cells {
                let fields = [
                    row.keys.to_string(),
                    row.poses.to_string(),
                    cell.components.to_string(),
                    both(Some(cell.error)),
                    both(cell.in_plane),
                    both(cell.without_switching),
                    both(row.floor),
                    self.mean_pose.mean_deg.to_string(),
                    cell.condition.map(|c| c.to_string()).unwrap_or_default(),
                    cell.proven_optimal.to_string(),
                    cell.expected_error_share.map(|e| e.to_string()).unwrap_or_default(),
                ];
                text.push_str(&fields.join(","));
                text.push('\n');
            }
        }
        text
    }

    /// The variance and r tables as CSV, one line a component.
    #[must_use]
    pub fn components_csv(&self) -> String {
        let mut text = String::from("component,variance_share,r\n");
        for (c, (share, r)) in self.variance_shares.iter().zip(&self.r).enumerate() {
            text.push_str(&format!("{},{share},{r}\n", c + 1));
        }
        text
    }

    /// Mean errors of a row over the numbers of components, for a plot.
    #[must_use]
    pub fn curve(row: &Row) -> Vec<(usize, f64)> {
        row.cells.iter().map(|c| (c.components, c.error.mean_deg)).collect()
    }
}

fn list(name: &str, values: impl Iterator<Item = String>) -> String {
    let cells: String = values.map(|v| format!("{v:<8}")).collect();
    format!("{name:<13}{}\n", cells.trim_end())
}

fn angle(error: AngleError) -> String {
    format!("{:.2} ± {:.2}", error.mean_deg, error.sd_deg)
}

fn both(error: Option<AngleError>) -> String {
    error.map_or_else(|| ",".to_owned(), |e| format!("{},{}", e.mean_deg, e.sd_deg))
}
