//! Silhouettes of a walking animal: the shapes of the masks that the Python peers are timed on.

use muybridge::mask::Mask;

/// A capsule: both ends and the radius.
type Capsule = [f64; 5];

/// `frames` masks of a quadruped that walks in 25 frames a cycle and drifts by a sixteenth of the
/// picture.
pub(crate) fn walker(frames: usize, width: usize, height: usize) -> Vec<Mask> {
    let scale = height as f64 / 540.0;
    (0..frames)
        .map(|t| {
            let drift = (t as f64 / 53.0).sin() * 60.0 + (t as f64 * 7.3).sin();
            let bob = (t as f64 / 27.0).sin() * 20.0;
            let centre = (width as f64 / 2.0 + scale * drift, height as f64 / 2.0 + scale * bob);
            let animal = capsules(t as f64 * std::f64::consts::TAU / 25.0);
            draw(width, height, centre, scale, &animal)
        })
        .collect()
}

fn capsules(phase: f64) -> Vec<Capsule> {
    let mut animal = vec![
        [-70.0, 0.0, 70.0, 4.0 * (2.0 * phase).sin(), 48.0],
        [100.0, -20.0, 140.0, -48.0 + 6.0 * (2.0 * phase).sin(), 22.0],
        [-115.0, -10.0, -165.0, 20.0 + 8.0 * phase.cos(), 6.0],
    ];
    for (hip, lag) in [(-80.0, 0.0), (-62.0, 0.5), (78.0, 0.25), (96.0, 0.75)] {
        let swing = phase + lag * std::f64::consts::TAU;
        let upper = 0.5 * swing.sin();
        let lower = upper + 0.4 * swing.cos().max(0.0);
        let knee = (hip + 62.0 * upper.sin(), 30.0 + 62.0 * upper.cos());
        animal.push([hip, 30.0, knee.0, knee.1, 15.0]);
        let foot = (knee.0 + 62.0 * lower.sin(), knee.1 + 62.0 * lower.cos());
        animal.push([knee.0, knee.1, foot.0, foot.1, 9.0]);
    }
    animal
}

fn draw(width: usize, height: usize, centre: (f64, f64), scale: f64, animal: &[Capsule]) -> Mask {
    let mut mask = Mask::new(width, height);
    for &[x0, y0, x1, y1, radius] in animal {
        let rows = (y0.min(y1) - radius, y0.max(y1) + radius);
        let columns = (x0.min(x1) - radius, x0.max(x1) + radius);
        let pixel = |v: f64, c: f64, most: usize| (c + scale * v).clamp(0.0, most as f64) as usize;
        for y in pixel(rows.0, centre.1, height)..pixel(rows.1, centre.1, height) {
            for x in pixel(columns.0, centre.0, width)..pixel(columns.1, centre.0, width) {
                let (px, py) =
                    ((x as f64 - centre.0) / scale - x0, (y as f64 - centre.1) / scale - y0);
                let (dx, dy) = (x1 - x0, y1 - y0);
                let along = ((px * dx + py * dy) / (dx * dx + dy * dy)).clamp(0.0, 1.0);
                if (px - along * dx).hypot(py - along * dy) <= radius {
                    mask.set(x, y, true);
                }
            }
        }
    }
    mask
}
