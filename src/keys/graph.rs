//! Bit-set graph of the frames that may still be chosen together, with the two prunings of clique
//! search: k-core and greedy colouring.

/// An undirected graph over local vertices `0..n`, one bit row a vertex.
pub(super) struct Graph {
    n: usize,
    words: usize,
    rows: Vec<u64>,
    /// Vertices not removed.
    alive: Vec<u64>,
}

impl Graph {
    /// `n` vertices without an edge.
    pub(super) fn new(n: usize) -> Self {
        let words = n.div_ceil(64);
        let mut alive = vec![0; words];
        for v in 0..n {
            alive[v / 64] |= 1 << (v % 64);
        }
        Self { n, words, rows: vec![0; words * n], alive }
    }

    /// Joins `u` with those of the vertices 8·`eight`…8·`eight` + 7 whose bit is set, in the row of
    /// `u` only: all rows together must be symmetric. `u` itself and bits past the last vertex are
    /// left out.
    #[inline(always)]
    pub(super) fn join_eight(&mut self, u: usize, eight: usize, joined: u8) {
        let at = u * self.words + eight / 8;
        self.rows[at] |= u64::from(joined) << (8 * (eight % 8));
        if eight == u / 8 {
            self.rows[at] &= !(1 << (u % 64));
        }
    }

    /// Removes the edges from `u` to those vertices that fail the test; to be done for both ends.
    pub(super) fn retain_neighbours(&mut self, u: usize, keep: impl Fn(usize) -> bool) {
        for v in (0..self.n).filter(|&v| !keep(v)) {
            self.rows[u * self.words + v / 64] &= !(1 << (v % 64));
        }
    }

    fn row(&self, v: usize) -> &[u64] {
        &self.rows[v * self.words..(v + 1) * self.words]
    }

    pub(super) fn remove(&mut self, v: usize) {
        self.alive[v / 64] &= !(1 << (v % 64));
    }

    pub(super) fn is_alive(&self, v: usize) -> bool {
        self.alive[v / 64] >> (v % 64) & 1 == 1
    }

    /// Vertices not removed, ascending.
    pub(super) fn vertices(&self) -> Vec<usize> {
        ones(&self.alive).collect()
    }

    /// Neighbours of `v` that are not removed, ascending.
    pub(super) fn neighbours(&self, v: usize) -> impl Iterator<Item = usize> + '_ {
        masked_ones(self.row(v), &self.alive)
    }

    fn degree(&self, v: usize) -> usize {
        self.row(v).iter().zip(&self.alive).map(|(a, b)| (a & b).count_ones() as usize).sum()
    }

    /// Removes every vertex with fewer than `least` neighbours until none is left: a clique of
    /// `least + 1` vertices lies within what remains. Returns how many remain.
    pub(super) fn keep_core(&mut self, least: usize) -> usize {
        let mut degrees: Vec<usize> = (0..self.n).map(|v| self.degree(v)).collect();
        let mut doomed: Vec<usize> =
            (0..self.n).filter(|&v| self.is_alive(v) && degrees[v] < least).collect();
        for &v in &doomed {
            self.remove(v);
        }
        while let Some(v) = doomed.pop() {
            let around: Vec<usize> = self.neighbours(v).collect();
            for u in around {
                degrees[u] -= 1;
                if degrees[u] < least {
                    self.remove(u);
                    doomed.push(u);
                }
            }
        }
        self.alive.iter().map(|w| w.count_ones() as usize).sum()
    }

    /// Greedy colouring of the remaining vertices in ascending order: classes of pairwise
    /// non-adjacent vertices, of which a clique holds at most one each.
    pub(super) fn colour_classes(&self) -> Vec<Vec<usize>> {
        let mut uncoloured = self.alive.clone();
        let mut open = vec![0_u64; self.words];
        let mut classes = Vec::new();
        while uncoloured.iter().any(|&w| w != 0) {
            open.copy_from_slice(&uncoloured);
            let mut class = Vec::new();
            for word in 0..self.words {
                while open[word] != 0 {
                    let v = word * 64 + open[word].trailing_zeros() as usize;
                    class.push(v);
                    uncoloured[word] &= !(1 << (v % 64));
                    open[word] &= !(1 << (v % 64));
                    for (o, r) in open.iter_mut().zip(self.row(v)).skip(word) {
                        *o &= !r;
                    }
                }
            }
            classes.push(class);
        }
        classes
    }
}

fn ones(words: &[u64]) -> impl Iterator<Item = usize> + '_ {
    masked_ones(words, words)
}

fn masked_ones<'a>(words: &'a [u64], mask: &'a [u64]) -> impl Iterator<Item = usize> + 'a {
    words.iter().zip(mask).enumerate().flat_map(|(i, (&w, &m))| {
        let mut rest = w & m;
        std::iter::from_fn(move || {
            (rest != 0).then(|| {
                let bit = rest.trailing_zeros() as usize;
                rest &= rest - 1;
                i * 64 + bit
            })
        })
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn graph(n: usize, edges: &[bool]) -> Graph {
        let mut g = Graph::new(n);
        for u in 0..n {
            for v in (0..n).filter(|&v| edges[u.max(v) * n + u.min(v)]) {
                g.join_eight(u, v / 8, 1 << (v % 8));
            }
        }
        g
    }

    proptest! {
        #[test]
        fn the_core_is_what_repeated_removal_leaves(
            n in 1_usize..80, least in 0_usize..6, raw in prop::collection::vec(prop::bool::weighted(0.08), 6400)
        ) {
            let mut g = graph(n, &raw);
            let adjacent = |u: usize, v: usize| u != v && raw[u.max(v) * n + u.min(v)];
            let mut left: Vec<usize> = (0..n).collect();
            loop {
                let next: Vec<usize> = left.iter().copied()
                    .filter(|&v| left.iter().filter(|&&u| adjacent(u, v)).count() >= least).collect();
                if next.len() == left.len() { break; }
                left = next;
            }
            prop_assert_eq!(g.keep_core(least), left.len());
            prop_assert_eq!(g.vertices(), left);
        }

        #[test]
        fn colour_classes_partition_and_hold_no_edge(
            n in 1_usize..130, raw in prop::collection::vec(any::<bool>(), 16900)
        ) {
            let classes = graph(n, &raw).colour_classes();
            let mut all: Vec<usize> = classes.concat();
            all.sort_unstable();
            prop_assert_eq!(all, (0..n).collect::<Vec<_>>());
            for class in &classes {
                for (i, &u) in class.iter().enumerate() {
                    for &v in &class[..i] {
                        prop_assert!(!raw[u.max(v) * n + u.min(v)]);
                    }
                }
            }
        }
    }
}
