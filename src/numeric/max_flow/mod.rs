//! Minimum cuts of two-label random fields on 8-connected pixel grids.

mod trees;

#[cfg(test)]
mod tests;

use trees::{Node, Trees};

/// The least costly labelling of one problem.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cut {
    /// What the labelling costs: see [`GridProblem`].
    pub value: i64,
    /// Whether each pixel is foreground, row by row over the whole grid; pixels outside the
    /// problem are not.
    pub foreground: Vec<bool>,
}

/// Buffers for minimum cuts, kept from one problem to the next.
///
/// A problem on a grid no larger than those before it allocates nothing but its answer, and its
/// cost follows the number of pixels in it, not the size of the grid. The address space taken is
/// 44 bytes a pixel of the grid.
///
/// ```
/// use muybridge::numeric::GridCut;
///
/// // A doubtful pixel between a bright and a dark one goes with the one it is tied to more.
/// let mut buffers = GridCut::new();
/// let mut problem = buffers.problem(3, 1);
/// problem.add_pixel(0, 0, 9, [5, 0, 0, 0]);
/// problem.add_pixel(1, 0, 0, [2, 0, 0, 0]);
/// problem.add_pixel(2, 0, -9, [0; 4]);
/// let cut = problem.solve();
/// assert_eq!(cut.foreground, [true, true, false]);
/// assert_eq!(cut.value, 2);
/// ```
#[derive(Clone, Debug, Default)]
pub struct GridCut {
    trees: Trees,
    /// Nodes of the last problem, which are what the next one has to clear.
    pixels: Vec<u32>,
}

impl GridCut {
    /// Empty buffers.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Starts a problem on a grid of `width` × `height` pixels, none of which is in it yet.
    ///
    /// # Panics
    /// When the grid, with its padding, has 2³¹ pixels or more.
    pub fn problem(&mut self, width: usize, height: usize) -> GridProblem<'_> {
        // One column and two rows of padding, never part of a problem, give every pixel eight
        // neighbours: one column serves both sides, as east of a row's end is the next row's start.
        let stride = width.saturating_add(1);
        let nodes = height
            .checked_add(2)
            .and_then(|rows| rows.checked_mul(stride))
            .and_then(|nodes| nodes.checked_add(2))
            .filter(|&nodes| i32::try_from(nodes).is_ok());
        let Some(nodes) = nodes else {
            panic!("a grid of {width} × {height} pixels is too large")
        };
        for &pixel in &self.pixels {
            self.trees.nodes[pixel as usize] = Node::OUTSIDE;
        }
        self.pixels.clear();
        self.trees.set_grid(stride, nodes);
        GridProblem { width, height, stride, cut: self }
    }
}

/// One two-label problem under construction: which pixels take part, what each prefers, and what
/// it costs to tell neighbours apart.
///
/// A labelling costs |preference| for each pixel labelled against its preference and the pair's
/// capacity for each pair of neighbours labelled differently. [`solve`](Self::solve) finds the
/// labelling of least cost, and among several of them the one with the fewest foreground pixels;
/// it is unique (the least minimiser of a submodular function, contained in all others), so the
/// answer is a property of the problem, not of the algorithm.
///
/// All costs are integers and nothing is rounded. The cost of any labelling fits `i64` on any grid
/// that fits in memory.
#[derive(Debug)]
pub struct GridProblem<'a> {
    width: usize,
    height: usize,
    stride: usize,
    cut: &'a mut GridCut,
}

impl GridProblem<'_> {
    /// The largest capacity of a pair, 2³⁰ − 1: the flow through a pair may use it twice over, and
    /// that must fit `i32`.
    pub const MAX_CAPACITY: i32 = i32::MAX / 2;

    /// Takes the pixel in column `x`, row `y` into the problem, or replaces what was said of it.
    ///
    /// A positive preference is what it costs as background, the magnitude of a negative one what
    /// it costs as foreground. `capacities` are what it costs to tell the pixel from the four
    /// neighbours that follow it, in the order east, south-east, south, south-west:
    ///
    /// ```text
    ///   ·  pixel  0
    ///   3    2    1
    /// ```
    ///
    /// Those towards pixels outside the problem or the grid do not count, so that callers need not
    /// look. Pixels may come in any order; row by row is fastest.
    ///
    /// # Panics
    /// When the pixel lies outside the grid, a capacity outside 0..=[`Self::MAX_CAPACITY`], or for
    /// the preference `i32::MIN`, whose magnitude `i32` cannot hold.
    #[inline]
    pub fn add_pixel(&mut self, x: usize, y: usize, preference: i32, capacities: [i32; 4]) {
        assert!(x < self.width && y < self.height, "pixel outside the grid");
        assert!(preference != i32::MIN, "preference out of range");
        let valid = |c: i32| (0..=Self::MAX_CAPACITY).contains(&c);
        assert!(capacities.into_iter().all(valid), "capacity out of range");
        let at = (y + 1) * self.stride + x + 1;
        if self.cut.trees.add(at, preference, capacities) {
            self.cut.pixels.push(at as u32);
        }
    }

    /// The labelling of least cost; of several, the one with the fewest foreground pixels.
    #[must_use]
    pub fn solve(self) -> Cut {
        let GridCut { trees, pixels } = self.cut;
        let value = trees.separate(pixels);
        // Division by 32 bits is the faster.
        let stride = self.stride as u32;
        let mut foreground = vec![false; self.width * self.height];
        for &pixel in &*pixels {
            // (row − 1) · width + column − 1, where the node is row · stride + column.
            let row = (pixel / stride) as usize;
            foreground[pixel as usize - self.width - row - 1] = trees.reached(pixel as usize);
        }
        Cut { value, foreground }
    }
}
