use proptest::prelude::*;

use super::*;

/// A problem as data: the pixels with their preferences, then capacities to the east, south-east,
/// south and south-west of every pixel of the grid.
#[derive(Clone, Debug)]
struct Field {
    width: usize,
    height: usize,
    preference: Vec<Option<i32>>,
    capacity: Vec<[i32; 4]>,
}

impl Field {
    fn solve(&self, buffers: &mut GridCut) -> Cut {
        let mut problem = buffers.problem(self.width, self.height);
        for (at, (preference, &capacities)) in
            self.preference.iter().zip(&self.capacity).enumerate()
        {
            if let &Some(preference) = preference {
                problem.add_pixel(at % self.width, at / self.width, preference, capacities);
            }
        }
        problem.solve()
    }

    /// Pairs with both ends in the problem: (pixel, pixel, capacity).
    fn pairs(&self) -> Vec<(usize, usize, i32)> {
        let steps = [(1, 0), (1, 1), (0, 1), (-1, 1)];
        let mut pairs = Vec::new();
        for (at, capacity) in self.capacity.iter().enumerate() {
            for ((dx, dy), &capacity) in steps.into_iter().zip(capacity) {
                let x = (at % self.width) as isize + dx;
                let y = (at / self.width) as isize + dy;
                if (0..self.width as isize).contains(&x) && y < self.height as isize {
                    let other = y as usize * self.width + x as usize;
                    if self.preference[at].is_some() && self.preference[other].is_some() {
                        pairs.push((at, other, capacity));
                    }
                }
            }
        }
        pairs
    }

    /// What a labelling costs, by the definition.
    fn cost(&self, foreground: &[bool]) -> i64 {
        let unary: i64 = self
            .preference
            .iter()
            .zip(foreground)
            .filter_map(|(preference, &label)| preference.map(|p| (i64::from(p), label)))
            .filter(|&(preference, label)| (preference > 0) != label)
            .map(|(preference, _)| preference.abs())
            .sum();
        let pair: i64 = self
            .pairs()
            .into_iter()
            .filter(|&(a, b, _)| foreground[a] != foreground[b])
            .map(|(_, _, capacity)| i64::from(capacity))
            .sum();
        unary + pair
    }

    /// Shortest augmenting paths on a matrix of capacities; Edmonds and Karp, 1972.
    fn solve_slowly(&self) -> Cut {
        let (source, sink) = (self.preference.len(), self.preference.len() + 1);
        let mut room = vec![vec![0_i64; sink + 1]; sink + 1];
        for (at, preference) in self.preference.iter().enumerate() {
            let preference = i64::from(preference.unwrap_or(0));
            room[source][at] = preference.max(0);
            room[at][sink] = (-preference).max(0);
        }
        for (a, b, capacity) in self.pairs() {
            room[a][b] += i64::from(capacity);
            room[b][a] += i64::from(capacity);
        }
        let mut value = 0;
        loop {
            let mut parent = vec![None; sink + 1];
            let mut queue = std::collections::VecDeque::from([source]);
            while let Some(at) = queue.pop_front() {
                for to in 0..=sink {
                    if room[at][to] > 0 && to != source && parent[to].is_none() {
                        parent[to] = Some(at);
                        queue.push_back(to);
                    }
                }
            }
            if parent[sink].is_none() {
                let foreground = parent[..source].iter().map(Option::is_some).collect();
                return Cut { value, foreground };
            }
            let path: Vec<(usize, usize)> =
                std::iter::successors(Some(sink), |&at| parent[at].filter(|&p| p != source))
                    .map(|at| (parent[at].unwrap(), at))
                    .collect();
            let fits = path.iter().map(|&(a, b)| room[a][b]).min().unwrap();
            for (a, b) in path {
                room[a][b] -= fits;
                room[b][a] += fits;
            }
            value += fits;
        }
    }

    /// All 2ⁿ labelings: the least cost, and what all labelings of that cost have in common.
    fn enumerate(&self) -> Cut {
        let pixels: Vec<usize> =
            (0..self.preference.len()).filter(|&at| self.preference[at].is_some()).collect();
        let mut best = Cut { value: i64::MAX, foreground: Vec::new() };
        for bits in 0..1_u32 << pixels.len() {
            let mut foreground = vec![false; self.preference.len()];
            for (bit, &pixel) in pixels.iter().enumerate() {
                foreground[pixel] = bits >> bit & 1 == 1;
            }
            let value = self.cost(&foreground);
            if value < best.value {
                best = Cut { value, foreground };
            } else if value == best.value {
                best.foreground.iter_mut().zip(foreground).for_each(|(all, this)| *all &= this);
            }
        }
        best
    }
}

/// Few distinct small numbers, for many ties, or the whole range.
fn number(low: i32, high: i32) -> impl Strategy<Value = i32> {
    prop_oneof![
        2 => Just(0),
        8 => low.max(-6)..=high.min(6),
        4 => low.max(-1000)..=high.min(1000),
        1 => low..=high,
        1 => prop_oneof![Just(low), Just(high)],
    ]
}

fn field(width: usize, height: usize) -> impl Strategy<Value = Field> {
    let pixels = width * height;
    let preference = prop::option::weighted(0.85, number(-i32::MAX, i32::MAX));
    let capacity = prop::array::uniform4(number(0, GridProblem::MAX_CAPACITY));
    (prop::collection::vec(preference, pixels), prop::collection::vec(capacity, pixels))
        .prop_map(move |(preference, capacity)| Field { width, height, preference, capacity })
}

fn any_field(sides: std::ops::RangeInclusive<usize>, most: usize) -> impl Strategy<Value = Field> {
    (sides.clone(), sides)
        .prop_map(move |(w, h)| (w, h.min(most / w).max(1)))
        .prop_flat_map(|(w, h)| field(w, h))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1500))]

    #[test]
    fn agrees_with_every_labelling_of_a_tiny_grid(field in any_field(1..=10, 10)) {
        let cut = field.solve(&mut GridCut::new());
        prop_assert_eq!(&cut, &field.enumerate());
        prop_assert_eq!(cut.value, field.cost(&cut.foreground));
    }

    #[test]
    fn agrees_with_shortest_augmenting_paths(field in any_field(1..=9, 64)) {
        prop_assert_eq!(field.solve(&mut GridCut::new()), field.solve_slowly());
    }

    #[test]
    fn buffers_remember_nothing(
        fields in prop::collection::vec(any_field(1..=12, 60), 2..5)
    ) {
        let mut buffers = GridCut::new();
        for field in &fields {
            prop_assert_eq!(field.solve(&mut buffers), field.solve(&mut GridCut::new()));
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    /// Long paths and many mendings, which small grids do not have.
    #[test]
    fn agrees_on_larger_grids(field in field(23, 17), strong in 1..40_i32) {
        let mut field = field;
        for (at, preference) in field.preference.iter_mut().enumerate() {
            // Terminals far apart on most seeds, with smooth capacities between.
            let x = at % field.width;
            *preference = preference.map(|p| match x {
                0..3 => strong * 20,
                20.. => -strong * 20,
                _ => p % 5,
            });
        }
        field.capacity.iter_mut().flatten().for_each(|c| *c %= 50);
        let cut = field.solve(&mut GridCut::new());
        prop_assert_eq!(cut.value, field.cost(&cut.foreground));
        prop_assert_eq!(cut, field.solve_slowly());
    }
}

#[test]
fn an_empty_problem_costs_nothing() {
    let mut buffers = GridCut::new();
    assert_eq!(buffers.problem(0, 5).solve(), Cut { value: 0, foreground: Vec::new() });
    assert_eq!(buffers.problem(2, 1).solve(), Cut { value: 0, foreground: vec![false; 2] });
}

#[test]
fn agreement_costs_nothing_and_indifference_is_background() {
    for (preference, foreground) in [(7, true), (-7, false), (0, false)] {
        let field = Field {
            width: 5,
            height: 4,
            preference: vec![Some(preference); 20],
            capacity: vec![[3; 4]; 20],
        };
        let cut = field.solve(&mut GridCut::new());
        assert_eq!(cut, Cut { value: 0, foreground: vec![foreground; 20] });
    }
}

#[test]
fn the_largest_numbers_do_not_overflow() {
    let most = GridProblem::MAX_CAPACITY;
    let field = Field {
        width: 9,
        height: 9,
        preference: (0..81).map(|at| Some(if at % 9 < 4 { i32::MAX } else { -i32::MAX })).collect(),
        capacity: vec![[most; 4]; 81],
    };
    let cut = field.solve(&mut GridCut::new());
    assert_eq!(cut, field.solve_slowly());
    assert!(cut.value > i64::from(i32::MAX) * 9);
}

#[test]
fn the_last_word_on_a_pixel_counts_and_order_does_not() {
    let mut buffers = GridCut::new();
    let mut problem = buffers.problem(2, 1);
    problem.add_pixel(1, 0, -4, [0; 4]);
    problem.add_pixel(0, 0, -1, [9; 4]);
    problem.add_pixel(0, 0, 3, [2; 4]);
    assert_eq!(problem.solve(), Cut { value: 2, foreground: vec![true, false] });
}

#[test]
#[should_panic(expected = "pixel outside the grid")]
fn a_pixel_outside_the_grid_is_a_broken_contract() {
    GridCut::new().problem(3, 3).add_pixel(3, 0, 1, [0; 4]);
}

#[test]
#[should_panic(expected = "capacity out of range")]
fn a_negative_capacity_is_a_broken_contract() {
    GridCut::new().problem(3, 3).add_pixel(0, 0, 0, [0, 0, -1, 0]);
}
