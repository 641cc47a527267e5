use proptest::prelude::*;

use super::*;
use crate::mask::Mask;

/// What the masks look like: anything; an animal that is mostly in one place; nothing or all.
#[derive(Clone, Copy, Debug)]
enum Look {
    Noise,
    MostlyStill,
    Extreme,
}

fn bit(look: Look, seed: u64, mask: usize, x: usize, y: usize) -> bool {
    let hash = |m: usize| {
        let mut h =
            seed ^ ((m * 7919 + x * 131 + y * 17) as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        h ^= h >> 29;
        h = h.wrapping_mul(0xBF58_476D_1CE4_E5B9);
        h ^ h >> 32
    };
    match look {
        Look::Noise => hash(mask) & 1 == 1,
        Look::MostlyStill => (x / 9 + y) % 2 == 1 && hash(mask) % 11 > 0,
        Look::Extreme => !mask.is_multiple_of(3),
    }
}

fn look() -> impl Strategy<Value = Look> {
    prop_oneof![Just(Look::Noise), Just(Look::MostlyStill), Just(Look::Extreme)]
}

/// Every pair and every pixel by itself.
fn slow(masks: &[Mask]) -> Vec<u32> {
    let mut matrix = Vec::new();
    for a in masks {
        for b in masks {
            let pixels = (0..a.height()).flat_map(|y| (0..a.width()).map(move |x| (x, y)));
            matrix.push(pixels.filter(|&(x, y)| a.get(x, y) && b.get(x, y)).count() as u32);
        }
    }
    matrix
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    // Up to 150 masks are three tiles; up to 640 pixels a row are several blocks.
    #[test]
    fn every_instruction_set_gives_the_products_of_plain_booleans(
        width in 1_usize..640,
        height in 1_usize..5,
        n in 2_usize..150,
        look in look(),
        seed in any::<u64>(),
    ) {
        let masks: Vec<Mask> = (0..n)
            .map(|i| Mask::from_fn(width, height, |x, y| bit(look, seed, i, x, y)))
            .collect();
        let Ok(changes) = Changes::of(&masks.iter().collect::<Vec<_>>()) else {
            prop_assert!(masks.iter().all(Mask::is_empty));
            return Ok(());
        };
        let expected = slow(&masks);
        for set in InstructionSet::ALL {
            // One that the processor lacks is replaced: its kernel runs in plain instructions.
            prop_assert_eq!(&changes.gram(set), &expected, "{:?}", set);
        }
    }
}

#[test]
fn words_without_change_are_dropped() {
    // Always set, never set, and one word in which one mask differs.
    let mask = |i: usize| Mask::from_fn(256, 3, |x, y| y == 0 || (y == 1 && x == 70 && i == 4));
    let masks: Vec<Mask> = (0..9).map(mask).collect();
    let changes = Changes::of(&masks.iter().collect::<Vec<_>>()).unwrap();
    assert_eq!(changes.words, vec![5]);
    assert_eq!(changes.majority[..4], [u64::MAX; 4]);
    assert!(changes.majority[4..].iter().all(|&w| w == 0));
}

#[test]
fn sums_do_not_overflow_where_they_are_short() {
    // Columns of pixels that all masks set, none sets, or every third does: more of them than 16 bits count.
    let (width, height) = (640, 220);
    let mask = |i: usize| Mask::from_fn(width, height, |x, _| x > 8 && i.is_multiple_of(x % 2 + 2));
    let masks: Vec<Mask> = (0..70).map(mask).collect();
    let changes = Changes::of(&masks.iter().collect::<Vec<_>>()).unwrap();
    assert!(changes.words.len() > 2000);
    let of_parity = |odd: usize| (9..width).filter(|x| x % 2 == odd).count() * height;
    let set = |i: usize, odd: usize| i.is_multiple_of(odd + 2);
    for set_of in InstructionSet::ALL {
        let gram = changes.gram(set_of);
        for (at, found) in gram.iter().enumerate() {
            let (i, j) = (at / 70, at % 70);
            let both = |odd: usize| set(i, odd) && set(j, odd);
            let expected: usize = (0..2).filter(|&odd| both(odd)).map(of_parity).sum();
            assert_eq!(*found as usize, expected, "{i} {j} {set_of:?}");
        }
        assert!(gram.iter().max() > Some(&(1 << 16)), "nothing was to overflow");
    }
}
