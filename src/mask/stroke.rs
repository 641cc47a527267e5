//! Strokes: polylines of a given thickness, and the default thickness of sketches.

use super::Mask;

/// The default radius by which sketched strokes are thickened: 1 % of the picture's diagonal, at
/// least 1 pixel. Strokes drawn by hand over a limb then overlap from frame to frame, which is
/// what lets the PCA see them move rather than jump.
#[must_use]
pub fn default_stroke_radius_px(width: usize, height: usize) -> usize {
    let diagonal = (width as f64).hypot(height as f64);
    ((diagonal * 0.01).round() as usize).max(1)
}

impl Mask {
    /// Draws a polyline with round caps and joins: every pixel whose centre lies within
    /// `radius_px` of it. Points are in pixels (x to the right, y down) and may lie outside.
    pub fn draw_stroke(&mut self, points: &[(f64, f64)], radius_px: f64) {
        match points {
            [] => {}
            [only] => self.draw_capsule(*only, *only, radius_px),
            _ => {
                for pair in points.windows(2) {
                    self.draw_capsule(pair[0], pair[1], radius_px);
                }
            }
        }
    }

    fn draw_capsule(&mut self, a: (f64, f64), b: (f64, f64), radius_px: f64) {
        let range = |low: f64, high: f64, size: usize| {
            let first = (low - radius_px).ceil().max(0.0) as usize;
            let last = (high + radius_px).floor().min(size as f64 - 1.0);
            if last < 0.0 { 0..0 } else { first..last as usize + 1 }
        };
        for y in range(a.1.min(b.1), a.1.max(b.1), self.height()) {
            for x in range(a.0.min(b.0), a.0.max(b.0), self.width()) {
                if distance_to_segment((x as f64, y as f64), a, b) <= radius_px {
                    self.set(x, y, true);
                }
            }
        }
    }
}

fn distance_to_segment(p: (f64, f64), a: (f64, f64), b: (f64, f64)) -> f64 {
    let (dx, dy) = (b.0 - a.0, b.1 - a.1);
    let length_sq = dx * dx + dy * dy;
    let along = if length_sq > 0.0 {
        (((p.0 - a.0) * dx + (p.1 - a.1) * dy) / length_sq).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (p.0 - a.0 - along * dx).hypot(p.1 - a.1 - along * dy)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_straight_stroke_is_a_capsule() {
        let mut mask = Mask::new(120, 60);
        mask.draw_stroke(&[(20.0, 30.0), (90.0, 30.0)], 5.0);
        let expected = 70.0 * 10.0 + std::f64::consts::PI * 25.0;
        assert!((mask.area() as f64 - expected).abs() < 0.12 * expected, "{}", mask.area());
        assert!(mask.get(20, 35) && mask.get(95, 30) && !mask.get(20, 36) && !mask.get(96, 30));
    }

    #[test]
    fn strokes_may_leave_the_picture() {
        let mut mask = Mask::new(20, 20);
        mask.draw_stroke(&[(-50.0, 10.0), (70.0, 10.0)], 1.0);
        assert_eq!(mask.area(), 60);
        mask.draw_stroke(&[(500.0, 500.0)], 3.0);
        mask.draw_stroke(&[(-500.0, -500.0)], 3.0);
        assert_eq!(mask.area(), 60);
    }

    #[test]
    fn a_sketch_thickened_is_the_stroke_drawn_thick() {
        let mut thin = Mask::new(80, 80);
        thin.draw_stroke(&[(40.0, 40.0)], 0.5);
        let mut thick = Mask::new(80, 80);
        thick.draw_stroke(&[(40.0, 40.0)], 6.0);
        assert_eq!(thin.dilated(6), thick);
        assert_eq!(default_stroke_radius_px(320, 240), 4);
        assert_eq!(default_stroke_radius_px(30, 20), 1);
    }
}
