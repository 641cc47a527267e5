//! A grey picture at halving sizes.

/// Halving ends before a side gets shorter than this, pixels.
const LEAST_SIDE_PX: usize = 14;

/// Most levels.
const MOST_LEVELS: usize = 7;

/// A grey picture and its halvings, the whole one first.
#[derive(Clone, Debug, PartialEq)]
pub struct Pyramid {
    levels: Vec<Level>,
}

/// One picture of a pyramid, values 0 … 255.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Level {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) values: Vec<f32>,
}

impl Pyramid {
    /// From one byte a pixel, rows from the top; `None` when there are not `width * height` or
    /// none at all.
    #[must_use]
    pub fn new(width: usize, height: usize, grey: &[u8]) -> Option<Self> {
        if grey.is_empty() || width.checked_mul(height) != Some(grey.len()) {
            return None;
        }
        let values = grey.iter().map(|&v| f32::from(v)).collect();
        let mut levels = vec![Level { width, height, values }];
        while let Some(half) = levels.last().and_then(Level::halved) {
            if levels.len() == MOST_LEVELS {
                break;
            }
            levels.push(half);
        }
        Some(Self { levels })
    }

    /// Width and height of the whole picture, pixels.
    #[must_use]
    pub fn size(&self) -> (usize, usize) {
        (self.levels[0].width, self.levels[0].height)
    }

    pub(super) fn levels(&self) -> &[Level] {
        &self.levels
    }
}

impl Level {
    /// Each pixel the mean of four; an odd last row or column is dropped.
    fn halved(&self) -> Option<Self> {
        let (w, h) = (self.width / 2, self.height / 2);
        if w.min(h) < LEAST_SIDE_PX {
            return None;
        }
        let mut values = Vec::with_capacity(w * h);
        for y in 0..h {
            let upper = &self.values[2 * y * self.width..][..2 * w];
            let lower = &self.values[(2 * y + 1) * self.width..][..2 * w];
            values.extend(
                upper
                    .chunks_exact(2)
                    .zip(lower.chunks_exact(2))
                    .map(|(a, b)| (a[0] + a[1] + b[0] + b[1]) / 4.0),
            );
        }
        Some(Self { width: w, height: h, values })
    }

    pub(super) fn at(&self, x: usize, y: usize) -> f32 {
        self.values[y * self.width + x]
    }

    pub(super) fn row(&self, y: usize) -> &[f32] {
        &self.values[y * self.width..(y + 1) * self.width]
    }

    /// Bilinear value at (`x`, `y`); `None` outside the outermost pixel centres.
    #[inline]
    pub(super) fn sample(&self, x: f64, y: f64) -> Option<f32> {
        let inside =
            x >= 0.0 && y >= 0.0 && x < (self.width - 1) as f64 && y < (self.height - 1) as f64;
        if !inside {
            return None;
        }
        let (x0, y0) = (x as usize, y as usize);
        let (fx, fy) = ((x - x0 as f64) as f32, (y - y0 as f64) as f32);
        let at = y0 * self.width + x0;
        let v = &self.values;
        let top = v[at] + (v[at + 1] - v[at]) * fx;
        let low = v[at + self.width] + (v[at + self.width + 1] - v[at + self.width]) * fx;
        Some(top + (low - top) * fy)
    }
}
