//! Distances of links as capsules.

use nalgebra::Vector3;
use snake_core::contact::{
    Capsule, CapsuleContact, FoldingBound, capsule_contact, capsule_contacts, capsule_gap, visit_close_pairs,
};
use snake_core::robot::{Link, Robot};
use snake_core::spatial::{Pose, assemble_chain, orientation_of, self_gap};
use snake_test_support::planar::{Random, links};
use snake_test_support::spatial_random::{random_angle, random_link, random_pose, random_vector};

fn capsule<'a>(link: &'a Link, pose: &Pose) -> Capsule<'a> {
    Capsule { link, centre: pose.position, axis: pose.axis() }
}

fn random_pair(random: &mut Random) -> ([Link; 2], [Pose; 2]) {
    let pair = [random_link(random), random_link(random)];
    let poses = [random_pose(random), random_pose(random)].map(|pose| Pose { position: 0.2 * pose.position, ..pose });
    (pair, poses)
}

fn gap(links: &[Link; 2], poses: &[Pose; 2]) -> f64 {
    capsule_gap([&capsule(&links[0], &poses[0]), &capsule(&links[1], &poses[1])])
}

fn contacts(links: &[Link; 2], poses: &[Pose; 2]) -> Vec<(usize, CapsuleContact)> {
    capsule_contacts([&capsule(&links[0], &poses[0]), &capsule(&links[1], &poses[1])]).collect()
}

/// Alternating projections onto two segments converge to their nearest points, and know no cases.
fn distance_by_projection(links: &[Link; 2], poses: &[Pose; 2]) -> f64 {
    let point = |k: usize, s: f64| poses[k].position + poses[k].axis() * s;
    let mut along = [0.0; 2];
    for _ in 0..100_000 {
        let before = along;
        for k in [0, 1] {
            let Link { contact_half_length: half, cg_offset: middle, .. } = links[k];
            let to = point(1 - k, along[1 - k]) - poses[k].position;
            along[k] = to.dot(&poses[k].axis()).clamp(middle - half, middle + half);
        }
        if before == along {
            break;
        }
    }
    (point(0, along[0]) - point(1, along[1])).norm() - links[0].radius - links[1].radius
}

#[test]
fn the_least_of_the_contacts_is_the_distance_of_the_links() {
    let mut random = Random::new(1);
    let mut crossings = 0;
    for _ in 0..2_000 {
        let (links, poses) = random_pair(&mut random);
        let (direct, slow) = (gap(&links, &poses), distance_by_projection(&links, &poses));
        assert!((direct - slow).abs() < 1e-7, "{direct} {slow}");
        let nearest = contacts(&links, &poses).into_iter().min_by(|a, b| a.1.gap.total_cmp(&b.1.gap));
        crossings += usize::from(nearest.is_some_and(|(number, _)| number == 4));
    }
    assert!(crossings > 100, "{crossings} pairs are nearest inside both links");
}

/// The tangent plane of each contact never overestimates the distance of links that translate.
#[test]
fn every_contact_is_convex_in_the_relative_translation() {
    let mut random = Random::new(2);
    for _ in 0..5_000 {
        let (links, poses) = random_pair(&mut random);
        let step = random_vector(&mut random, 0.2);
        let moved = [Pose { position: poses[0].position + step, ..poses[0] }, poses[1]];
        for (number, contact) in contacts(&links, &poses) {
            let plane = contact.gap + contact.normal.dot(&step);
            let pair = [&capsule(&links[0], &moved[0]), &capsule(&links[1], &moved[1])];
            if let Some(there) = capsule_contact(pair, number) {
                assert!(plane <= there.gap + 1e-12, "contact {number}: {plane} above {}", there.gap);
            }
        }
    }
}

/// Links that lie in a plane have the contacts of stadiums, and none across.
#[test]
fn links_that_lie_flat_have_no_crossing() {
    let mut random = Random::new(3);
    for _ in 0..2_000 {
        let link = random_link(&mut random);
        let mut flat = || Pose {
            position: random_vector(&mut random, 0.5).xy().push(0.0),
            orientation: orientation_of(random.angle(), 0.0, 0.0),
        };
        let poses = [flat(), flat()];
        for (number, contact) in contacts(&[link; 2], &poses) {
            assert!(number < 4 || contact.gap < 1e-12 - 2.0 * link.radius, "{contact:?}");
            assert!(number == 4 || contact.normal.z.abs() < 1e-12);
        }
    }
}

#[test]
fn parallel_links_touch_in_two_places() {
    let (contact_half_length, radius, cg_offset) = (0.04, 0.05, 0.0);
    let link = Link { contact_half_length, radius, cg_offset, ..random_link(&mut Random::new(1)) };
    let lying = |x: f64, z: f64| Pose { position: Vector3::new(x, 0.0, z), orientation: orientation_of(0.0, 0.0, 0.0) };
    let touching = contacts(&[link; 2], &[lying(0.0, 0.0), lying(0.03, 0.1)]);
    let at_zero = touching.iter().filter(|(_, contact)| contact.gap.abs() < 1e-12);
    assert_eq!(at_zero.count(), 2, "{touching:?}");
}

#[test]
fn the_search_along_the_chain_finds_every_close_pair_in_3d() {
    let mut random = Random::new(4);
    for count in [2, 3, 11, 200] {
        let robot = Robot::new(&links(count)).expect("a robot");
        for bend in [0.1, 0.5, 1.5] {
            let poses = random_posture(&robot, bend, &mut random);
            let mut found = Vec::new();
            visit_close_pairs(&robot.links, |link| poses[link].position, 0.01, |i, j| found.push((i, j)));
            let reach = 2.0 * robot.links[0].reach() + 0.01;
            let close = |i: usize, j: usize| (poses[i].position - poses[j].position).norm() <= reach;
            let expected: Vec<(usize, usize)> =
                (0..count).flat_map(|i| (i + 2..count).map(move |j| (i, j))).filter(|&(i, j)| close(i, j)).collect();
            assert_eq!(found, expected, "{count} links bent by up to {bend}");
        }
    }
}

fn random_posture(robot: &Robot, bend: f64, random: &mut Random) -> Vec<Pose> {
    let angles: Vec<_> = (1..robot.link_count()).map(|_| random_angle(random, bend)).collect();
    let mut poses = vec![Pose::identity(); robot.link_count()];
    assemble_chain(robot, random_pose(random), &angles, &mut poses);
    poses
}

/// Postures within the bound keep the clearance; the search is left out for them.
#[test]
fn links_are_apart_while_the_posture_is_within_the_folding_bound_in_3d() {
    const CLEARANCE: f64 = 0.01;
    let mut random = Random::new(5);
    let (mut within, mut beyond_and_close) = (0, 0);
    for _ in 0..20_000 {
        let robot = Robot::new(&links(3 + random.below(9))).expect("a robot");
        let bend = random.between(0.1, 1.5);
        let poses = random_posture(&robot, bend, &mut random);
        let gap = self_gap(&robot.links, &poses);
        let bound = FoldingBound::new(&robot.links, CLEARANCE);
        if bound.exceeded_by_axes::<f64>(poses.iter().map(Pose::axis)) {
            beyond_and_close += usize::from(gap < 0.0);
        } else {
            within += 1;
            assert!(gap >= CLEARANCE, "{gap} m");
        }
    }
    assert!(within > 2_000 && beyond_and_close > 50, "{within} postures within, {beyond_and_close} close ones beyond");
}
