//! Maximum flow by incremental breadth-first search.
//!
//! Goldberg, Hed, Kaplan, Tarjan and Werneck, *Maximum Flows by Incremental Breadth-First Search*,
//! ESA 2011. Like the method of Boykov and Kolmogorov it grows one tree from each terminal and
//! mends the trees after each augmentation, but its trees are breadth-first, so that a node's
//! label tells whether a parent is sound without a walk to the root, and the work is polynomial
//! in the size of the graph.
//!
//! Departures: the graph is a grid, hence neighbours are offsets and two bit sets a node say which
//! arcs still have room. The search reads eight bytes a node and touches capacities only where
//! flow is pushed. Flow between neighbours is pushed before there are trees. An orphan may adopt
//! another as its parent: labels fall strictly towards the root, so no cycle can close, and should
//! the parent have to move it makes an orphan of the child once more.

/// Neighbours of a pixel, clockwise from east; the opposite of direction `d` is `d ^ 4`.
pub(super) const DIRECTIONS: usize = 8;

/// The parent of a node that hangs on its terminal.
const TERMINAL: u8 = 8;
/// The parent of a node that has lost its own, or is in neither tree.
const NONE: u8 = 9;

/// What the search knows of one pixel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    /// 1 + distance from the source in its tree, −(1 + distance to the sink) in the sink's; 0 in
    /// neither.
    label: i32,
    /// Bit `d`: the arc towards direction `d` has room.
    out: u8,
    /// Bit `d`: the arc that arrives from direction `d` has room.
    into: u8,
    /// Direction of the parent, or `TERMINAL` or `NONE`.
    parent: u8,
    /// Whether the pixel takes part.
    inside: bool,
}

impl Node {
    pub(super) const OUTSIDE: Self =
        Self { label: 0, out: 0, into: 0, parent: NONE, inside: false };

    /// The label as the tree of this side counts it: positive in the tree, negative in the other.
    #[inline]
    fn depth<const SOURCE: bool>(self) -> i32 {
        if SOURCE { self.label } else { -self.label }
    }

    /// Directions in which the tree of this side can grow from here.
    #[inline]
    fn ahead<const SOURCE: bool>(self) -> u8 {
        if SOURCE { self.out } else { self.into }
    }

    /// Directions from which the tree of this side can reach this node.
    #[inline]
    fn behind<const SOURCE: bool>(self) -> u8 {
        if SOURCE { self.into } else { self.out }
    }
}

/// The residual graph and both search trees.
#[derive(Clone, Debug, Default)]
pub(super) struct Trees {
    pub(super) nodes: Vec<Node>,
    /// Room of the arc towards each direction.
    room: Vec<[i32; DIRECTIONS]>,
    /// Room of the arc from the source (positive) or to the sink (negative).
    terminal: Vec<i32>,
    /// Index differences, modulo 2⁶⁴, to the eight neighbours.
    offset: [usize; DIRECTIONS],
    source: Front,
    sink: Front,
    /// Nodes of the level beyond the one from which a tree grows.
    next: Vec<u32>,
    orphans: Vec<u32>,
}

/// The outermost complete level of one tree.
#[derive(Clone, Debug, Default)]
struct Front {
    level: i32,
    /// The deepest level that may exist: one more than `level` while this tree grows.
    limit: i32,
    /// All nodes of this level, and perhaps some that have left it.
    nodes: Vec<u32>,
}

impl Trees {
    /// Makes space for a grid; all nodes must be outside.
    pub(super) fn set_grid(&mut self, stride: usize, nodes: usize) {
        let up = stride.wrapping_neg();
        let (east, west) = (1, 1_usize.wrapping_neg());
        self.offset = [
            east,
            stride + 1,
            stride,
            stride - 1,
            west,
            up.wrapping_sub(1),
            up,
            up.wrapping_add(1),
        ];
        if self.nodes.len() < nodes {
            self.nodes.resize(nodes, Node::OUTSIDE);
            // Nothing here is worth keeping, and fresh zeros take no memory until they are written:
            // a band then takes what a band needs.
            self.room = vec![[0; DIRECTIONS]; nodes];
            self.terminal = vec![0; nodes];
        }
    }

    /// Takes a node in with its terminal and its capacities towards directions 0 to 3, or replaces
    /// them; says whether it is new.
    #[inline]
    pub(super) fn add(&mut self, at: usize, preference: i32, capacities: [i32; 4]) -> bool {
        let [east, south_east, south, south_west] = capacities;
        self.terminal[at] = preference;
        self.room[at] = [east, south_east, south, south_west, 0, 0, 0, 0];
        !std::mem::replace(&mut self.nodes[at].inside, true)
    }

    /// Pushes the maximum flow between the terminals and returns it; then exactly the nodes that
    /// the source still reaches are [`reached`](Self::reached).
    pub(super) fn separate(&mut self, pixels: &[u32]) -> i64 {
        for front in [&mut self.source, &mut self.sink] {
            front.nodes.clear();
            (front.level, front.limit) = (1, 1);
        }
        let mut flow = pixels.iter().map(|&pixel| self.link(pixel as usize)).sum();
        for &pixel in pixels {
            let side = self.terminal[pixel as usize].signum();
            if side != 0 {
                let node = &mut self.nodes[pixel as usize];
                (node.label, node.parent) = (side, TERMINAL);
                let front = if side > 0 { &mut self.source } else { &mut self.sink };
                front.nodes.push(pixel);
            }
        }
        // The flow is at its maximum once either tree cannot grow; the source's then grows on, as
        // its nodes are the answer.
        while !self.source.nodes.is_empty() {
            flow += self.grow::<true>();
            flow += self.grow::<false>();
        }
        flow
    }

    /// Whether the source reaches a node after [`separate`](Self::separate).
    pub(super) fn reached(&self, at: usize) -> bool {
        self.nodes[at].label > 0
    }

    #[inline]
    fn neighbour(&self, at: usize, direction: usize) -> usize {
        at.wrapping_add(self.offset[direction % DIRECTIONS])
    }

    #[inline]
    fn front<const SOURCE: bool>(&mut self) -> &mut Front {
        if SOURCE { &mut self.source } else { &mut self.sink }
    }

    /// Opens the arcs between a node and the four before it, both ways, and pushes what flow goes
    /// from terminal to terminal through one of them: where terms are noisy, that is the most of
    /// it, and no tree is needed to find it.
    fn link(&mut self, at: usize) -> i64 {
        let mut flow = 0;
        let mut terminal = self.terminal[at];
        for direction in DIRECTIONS / 2..DIRECTIONS {
            let other = self.neighbour(at, direction);
            // No branches below: they would be guesses. A neighbour outside the problem takes part
            // with a capacity of 0, to no effect.
            let inside = self.nodes[other].inside;
            let capacity = if inside { self.room[other][direction ^ 4] } else { 0 };
            let theirs = self.terminal[other];
            let opposed = (theirs ^ terminal) < 0;
            let fits = if opposed { capacity.min(theirs.abs()).min(terminal.abs()) } else { 0 };
            flow += i64::from(fits);
            // Positive from `at` to `other`.
            let signed = if terminal < 0 { -fits } else { fits };
            terminal -= signed;
            self.terminal[other] = theirs + signed;
            self.room[other][direction ^ 4] = capacity + signed;
            self.room[at][direction] = capacity - signed;
            let (here, there) = (u8::from(signed < capacity), u8::from(-signed < capacity));
            self.nodes[at].out |= here << direction;
            self.nodes[other].into |= here << (direction ^ 4);
            self.nodes[other].out |= there << (direction ^ 4);
            self.nodes[at].into |= there << direction;
        }
        self.terminal[at] = terminal;
        flow
    }

    /// Grows one tree by a level; returns the flow pushed where it met the other tree.
    fn grow<const SOURCE: bool>(&mut self) -> i64 {
        self.front::<SOURCE>().limit += 1;
        let (mut flow, mut at) = (0, 0);
        // Mending may add to the list while it is walked.
        while let Some(&node) = self.front::<SOURCE>().nodes.get(at) {
            flow += self.scan::<SOURCE>(node as usize);
            at += 1;
        }
        let mut grown = std::mem::take(&mut self.next);
        let front = self.front::<SOURCE>();
        front.level += 1;
        std::mem::swap(&mut front.nodes, &mut grown);
        grown.clear();
        self.next = grown;
        flow
    }

    /// Grows one tree from one node of its outermost level.
    fn scan<const SOURCE: bool>(&mut self, at: usize) -> i64 {
        let level = self.front::<SOURCE>().level;
        let mut flow = 0;
        let node = self.nodes[at];
        if node.depth::<SOURCE>() != level {
            return flow;
        }
        let mut open = node.ahead::<SOURCE>();
        while open != 0 {
            let direction = open.trailing_zeros() as usize;
            let to = self.neighbour(at, direction);
            let other = &mut self.nodes[to];
            let depth = other.depth::<SOURCE>();
            if depth < 0 {
                flow += if SOURCE {
                    self.augment(at, direction, to)
                } else {
                    self.augment(to, direction ^ 4, at)
                };
                // This may have moved the node or closed arcs, and the one just used may be open
                // still; those before it lead to nothing new.
                let node = self.nodes[at];
                if node.depth::<SOURCE>() != level {
                    return flow;
                }
                open &= node.ahead::<SOURCE>();
                continue;
            }
            if depth == 0 {
                other.label = if SOURCE { level + 1 } else { -(level + 1) };
                other.parent = (direction ^ 4) as u8;
                self.next.push(to as u32);
            }
            open &= open - 1;
        }
        flow
    }

    /// Pushes what fits along source … `from` → `to` … sink and mends the trees.
    fn augment(&mut self, from: usize, direction: usize, to: usize) -> i64 {
        let fits = self.room[from][direction % DIRECTIONS]
            .min(self.bottleneck::<true>(from))
            .min(self.bottleneck::<false>(to));
        self.push(from, direction, to, fits);
        self.drain::<true>(from, fits);
        self.drain::<false>(to, fits);
        i64::from(fits)
    }

    /// The least room on the way between a node and its terminal.
    #[inline]
    fn bottleneck<const SOURCE: bool>(&self, mut at: usize) -> i32 {
        let mut least = i32::MAX;
        loop {
            let parent = self.nodes[at].parent;
            if parent == TERMINAL {
                return least.min(self.terminal[at].abs());
            }
            let parent = usize::from(parent);
            let up = self.neighbour(at, parent);
            let room = if SOURCE {
                self.room[up][(parent ^ 4) % DIRECTIONS]
            } else {
                self.room[at][parent % DIRECTIONS]
            };
            least = least.min(room);
            at = up;
        }
    }

    /// Pushes flow between a node and its terminal, then finds new parents for the nodes whose arc
    /// it fills.
    #[inline]
    fn drain<const SOURCE: bool>(&mut self, mut at: usize, flow: i32) {
        loop {
            let parent = self.nodes[at].parent;
            if parent == TERMINAL {
                let terminal = &mut self.terminal[at];
                *terminal -= if SOURCE { flow } else { -flow };
                if *terminal == 0 {
                    self.nodes[at].parent = NONE;
                    self.orphans.push(at as u32);
                }
                break;
            }
            let parent = usize::from(parent);
            let up = self.neighbour(at, parent);
            let left = if SOURCE {
                self.push(up, parent ^ 4, at, flow)
            } else {
                self.push(at, parent, up, flow)
            };
            if left == 0 {
                self.nodes[at].parent = NONE;
                self.orphans.push(at as u32);
            }
            at = up;
        }
        // Nearest to the terminal first: those behind may then keep what they have.
        self.orphans.reverse();
        self.adopt::<SOURCE>();
    }

    /// Pushes flow through one arc and returns the room left in it.
    #[inline]
    fn push(&mut self, at: usize, direction: usize, to: usize, flow: i32) -> i32 {
        let left = self.room[at][direction % DIRECTIONS] - flow;
        self.room[at][direction % DIRECTIONS] = left;
        let (here, there) = (1 << direction, 1 << (direction ^ 4));
        if left == 0 {
            self.nodes[at].out &= !here;
            self.nodes[to].into &= !there;
        }
        self.room[to][(direction ^ 4) % DIRECTIONS] += flow;
        self.nodes[to].out |= there;
        self.nodes[at].into |= here;
        left
    }

    /// Gives every orphan a new parent, at its old label if it can, else at the least label that
    /// it can have; where that lies beyond the tree's limit the node leaves the tree.
    fn adopt<const SOURCE: bool>(&mut self) {
        let &mut Front { level, limit, .. } = self.front::<SOURCE>();
        let mut done = 0;
        while let Some(&orphan) = self.orphans.get(done) {
            done += 1;
            let at = orphan as usize;
            let node = self.nodes[at];
            let depth = node.depth::<SOURCE>();
            let (least, parent) = self.nearest_parent::<SOURCE>(at, node);
            if least < depth {
                self.nodes[at].parent = parent;
                continue;
            }
            // The children hang one below the old label.
            let mut ahead = node.ahead::<SOURCE>();
            while ahead != 0 {
                let direction = ahead.trailing_zeros() as usize;
                ahead &= ahead - 1;
                let to = self.neighbour(at, direction);
                let child = &mut self.nodes[to];
                if usize::from(child.parent) == direction ^ 4 && child.depth::<SOURCE>() > 0 {
                    child.parent = NONE;
                    self.orphans.push(to as u32);
                }
            }
            let node = &mut self.nodes[at];
            if least >= limit {
                (node.label, node.parent) = (0, NONE);
                continue;
            }
            let depth = least + 1;
            node.label = if SOURCE { depth } else { -depth };
            node.parent = parent;
            if depth == level {
                self.front::<SOURCE>().nodes.push(orphan);
            } else if depth > level {
                self.next.push(orphan);
            }
        }
        self.orphans.clear();
    }

    /// The least label among the nodes of the tree that reach this one, and the direction of the
    /// first that has it.
    #[inline]
    fn nearest_parent<const SOURCE: bool>(&self, at: usize, node: Node) -> (i32, u8) {
        let wanted = node.depth::<SOURCE>() - 1;
        let (mut least, mut parent) = (i32::MAX, NONE);
        let mut behind = node.behind::<SOURCE>();
        while behind != 0 {
            let direction = behind.trailing_zeros() as usize;
            behind &= behind - 1;
            let depth = self.nodes[self.neighbour(at, direction)].depth::<SOURCE>();
            if depth > 0 && depth < least {
                (least, parent) = (depth, direction as u8);
                if depth == wanted {
                    break;
                }
            }
        }
        (least, parent)
    }
}
