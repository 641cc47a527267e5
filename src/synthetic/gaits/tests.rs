//! The gaits against the published tables, measured on the posed horse.

use nalgebra::Point3;

use super::*;
use crate::synthetic::horse;

/// Height of each foot's lowest point over a stride, in steps of a hundredth.
fn hoof_heights(gait: Gait) -> [Vec<f64>; 4] {
    let model = horse();
    let hooves = Foot::ALL.map(|foot| {
        let joints = if foot.is_fore() { 6 } else { 5 };
        let node = foot.first_joint() + joints;
        model.meshes.iter().position(|m| m.node == node).unwrap()
    });
    let mut heights: [Vec<f64>; 4] = Default::default();
    for step in 0..100 {
        let pose = gait.pose(&model.skeleton, f64::from(step) / 100.0).pose;
        let vertices = model.posed_vertices(&pose);
        for (foot, mesh) in hooves.iter().enumerate() {
            let low = |m: f64, p: &Point3<f64>| m.min(p.y);
            heights[foot].push(vertices[*mesh].iter().fold(f64::INFINITY, low));
        }
    }
    heights
}

#[test]
fn feet_are_down_when_the_tables_say_so_and_never_below_the_ground() {
    for gait in Gait::ALL {
        let heights = hoof_heights(gait);
        for (foot, heights) in Foot::ALL.into_iter().zip(&heights) {
            let (contact, duty) = gait.stance(foot);
            for (step, height) in heights.iter().enumerate() {
                let since = (step as f64 / 100.0 - contact).rem_euclid(1.0);
                let share = since / duty;
                assert!(*height > -0.06, "{gait} {foot:?} at {step}: {height}");
                if (0.05..0.75).contains(&share) {
                    assert!(*height < 0.035, "{gait} {foot:?} at {step}: {height}");
                }
                // Well into the swing the foot is off the ground.
                let swing = (since - duty) / (1.0 - duty);
                if (0.25..0.7).contains(&swing) {
                    assert!(*height > 0.04, "{gait} {foot:?} at {step}: {height}");
                }
            }
        }
    }
}

#[test]
fn the_footfall_order_is_the_published_one() {
    let order = |gait: Gait| {
        let mut feet = Foot::ALL.to_vec();
        feet.sort_by(|a, b| gait.stance(*a).0.total_cmp(&gait.stance(*b).0));
        feet
    };
    use Foot::{LeftFore, LeftHind, RightFore, RightHind};
    assert_eq!(order(Gait::Walk), [LeftHind, LeftFore, RightHind, RightFore]);
    assert_eq!(order(Gait::Gallop), [RightHind, LeftHind, RightFore, LeftFore]);
    let canter = order(Gait::Canter);
    assert_eq!((canter[0], canter[3]), (RightHind, LeftFore));
    assert_eq!(Gait::Canter.stance(LeftHind).0, Gait::Canter.stance(RightFore).0);
    assert_eq!(Gait::Trot.stance(LeftHind).0, Gait::Trot.stance(RightFore).0);
}

/// Share of the stride in which no foot is down.
fn suspension(gait: Gait) -> f64 {
    let free = (0..1000).filter(|step| {
        Foot::ALL.into_iter().all(|foot| {
            let (contact, duty) = gait.stance(foot);
            (f64::from(*step) / 1000.0 - contact).rem_euclid(1.0) >= duty
        })
    });
    free.count() as f64 / 1000.0
}

#[test]
fn walks_have_no_suspension_and_running_gaits_do() {
    assert_eq!(suspension(Gait::Walk), 0.0);
    assert!(suspension(Gait::Trot) > 0.1);
    assert!(suspension(Gait::Canter) > 0.1);
    assert!((0.15..0.35).contains(&suspension(Gait::Gallop)));
}

#[test]
fn symmetric_gaits_repeat_with_left_and_right_exchanged() {
    let model = horse();
    for gait in [Gait::Walk, Gait::Trot] {
        for step in 0..8 {
            let phase = f64::from(step) / 8.0;
            let now = gait.pose(&model.skeleton, phase).angles_rad;
            let later = gait.pose(&model.skeleton, phase + 0.5).angles_rad;
            for joint in 0..6 {
                assert!((now[FORE_LEFT + joint] - later[FORE_RIGHT + joint]).abs() < 1e-6);
            }
            for joint in 0..5 {
                assert!((now[HIND_LEFT + joint] - later[HIND_RIGHT + joint]).abs() < 1e-6);
            }
        }
    }
}

#[test]
fn joints_of_the_walk_move_as_far_as_published() {
    // Four yearlings at a flat walk: carpus 54 ± 4 degrees, tarsus 40 ± 9, fore fetlock 45 ± 8.
    let model = horse();
    let range = |joint: usize| {
        let angles: Vec<f64> = (0..100)
            .map(|s| Gait::Walk.pose(&model.skeleton, f64::from(s) / 100.0).angles_rad[joint])
            .collect();
        let high = angles.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        (high - angles.iter().copied().fold(f64::INFINITY, f64::min)).to_degrees()
    };
    let (carpus, tarsus) = (range(FORE_LEFT + 3), range(HIND_LEFT + 2));
    let fetlock = range(FORE_LEFT + 4);
    eprintln!("carpus {carpus:.0}, tarsus {tarsus:.0}, fore fetlock {fetlock:.0} degrees");
    assert!((46.0..=66.0).contains(&carpus), "{carpus}");
    assert!((22.0..=58.0).contains(&tarsus), "{tarsus}");
    assert!((29.0..=65.0).contains(&fetlock), "{fetlock}");
}

#[test]
fn motion_is_continuous_over_the_stride() {
    let model = horse();
    for gait in Gait::ALL {
        for step in 0..200 {
            let phase = f64::from(step) / 200.0;
            let a = gait.pose(&model.skeleton, phase).angles_rad;
            let b = gait.pose(&model.skeleton, phase + 0.005).angles_rad;
            for joint in 0..IN_PLANE_ANGLES {
                let change = (a[joint] - b[joint]).abs();
                assert!(
                    change < 0.16,
                    "{gait} {} at {phase}: {change}",
                    crate::synthetic::IN_PLANE_JOINTS[joint]
                );
            }
        }
    }
}

#[test]
fn names_are_read_back() {
    for gait in Gait::ALL {
        assert_eq!(gait.name().parse(), Ok(gait));
    }
    assert!("hop".parse::<Gait>().is_err());
}
