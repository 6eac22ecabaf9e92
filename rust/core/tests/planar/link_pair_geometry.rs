//! Distances between links of one robot against brute force, and their directions against finite differences.

use nalgebra::{Vector2, Vector3};
use snake_core::contact::{
    ClosePairs, Folding, FoldingBound, LinkPairContact, PlacedLink, centre_lines_cross, link_pair_contacts, self_gap,
    visit_close_pairs,
};
use snake_core::planar::{Pose, assemble_chain};
use snake_core::robot::{Link, Robot};
use snake_test_support::planar::{Random, links};
use snake_test_support::spatial_random::random_link;

fn random_pose(random: &mut Random) -> Pose {
    Pose::new(random.between(-0.2, 0.2), random.between(-0.2, 0.2), random.between(-7.0, 7.0))
}

/// Two links whose centre lines do not cross, with their contacts.
fn random_pair(random: &mut Random) -> ([Link; 2], [Pose; 2]) {
    loop {
        let links = [random_link(random), random_link(random)];
        let poses = [random_pose(random), random_pose(random)];
        let [first, second] = [0, 1].map(|i| PlacedLink::new(&links[i], poses[i]));
        if !centre_lines_cross([&first, &second]) {
            return (links, poses);
        }
    }
}

fn contacts(links: &[Link; 2], poses: &[Pose; 2]) -> Vec<LinkPairContact> {
    let [first, second] = [0, 1].map(|i| PlacedLink::new(&links[i], poses[i]));
    link_pair_contacts([&first, &second], f64::INFINITY).map(|(_, contact)| contact).collect()
}

fn gap(links: &[Link; 2], poses: &[Pose; 2]) -> f64 {
    contacts(links, poses).iter().map(|contact| contact.gap).fold(f64::INFINITY, f64::min)
}

/// Least distance of the surfaces over a grid of points of both centre lines.
fn gap_on_a_grid(links: &[Link; 2], poses: &[Pose; 2]) -> f64 {
    let points = |i: usize| {
        let (axis, half) = (Vector2::new(poses[i].z.cos(), poses[i].z.sin()), links[i].contact_half_length);
        (-100..=100).map(move |k| poses[i].xy() + axis * (links[i].cg_offset + half * f64::from(k) / 100.0))
    };
    let nearest = points(0).flat_map(|a| points(1).map(move |b| (a - b).norm())).fold(f64::INFINITY, f64::min);
    nearest - links[0].radius - links[1].radius
}

#[test]
fn the_least_contact_is_the_distance_of_the_links() {
    let mut random = Random::new(1);
    for _ in 0..200 {
        let (links, poses) = random_pair(&mut random);
        let (gap, grid) = (gap(&links, &poses), gap_on_a_grid(&links, &poses));
        // The grid's points are up to 1.5 mm from the nearest ones.
        assert!(gap <= grid + 1e-12 && grid < gap + 3.1e-3, "{gap} {grid}");
    }
}

#[test]
fn directions_are_the_derivatives_of_the_gaps() {
    const D: f64 = 1e-6;
    let mut random = Random::new(2);
    let mut seen = 0;
    for _ in 0..500 {
        let (links, poses) = random_pair(&mut random);
        for (k, contact) in contacts(&links, &poses).iter().enumerate() {
            for (link, axis) in (0..2).flat_map(|link| (0..3).map(move |axis| (link, axis))) {
                let moved = |by: f64| {
                    let mut poses = poses;
                    poses[link][axis] += by;
                    contacts(&links, &poses).get(k).copied()
                };
                // A contact of two ends may be listed on one side of a kink only.
                let (Some(ahead), Some(behind)) = (moved(D), moved(-D)) else { continue };
                if contact.along.iter().zip(&ahead.along).any(|(a, b)| (a - b).abs() > 1e-4) {
                    continue;
                }
                let slope = (ahead.gap - behind.gap) / (2.0 * D);
                assert!((slope - contact.direction[link][axis]).abs() < 1e-4, "{slope} {:?}", contact.direction);
                seen += 1;
            }
        }
    }
    assert!(seen > 6_000, "{seen} derivatives");
}

#[test]
fn a_unit_impulse_on_both_links_adds_no_momentum() {
    let mut random = Random::new(3);
    for _ in 0..100 {
        let (links, poses) = random_pair(&mut random);
        for contact in contacts(&links, &poses) {
            let [a, b] = contact.direction;
            assert!((a.xy() + b.xy()).norm() < 1e-15);
            let moment = |w: &Vector3<f64>, pose: &Pose| w.z + pose.x * w.y - pose.y * w.x;
            // The points on the centre lines are apart along the normal: the same line of action.
            assert!((moment(&a, &poses[0]) + moment(&b, &poses[1])).abs() < 1e-14);
        }
    }
}

#[test]
fn parallel_links_touch_in_two_places() {
    let (contact_half_length, radius, cg_offset) = (0.04, 0.05, 0.0);
    let link = Link { contact_half_length, radius, cg_offset, ..random_link(&mut Random::new(1)) };
    let touching = contacts(&[link; 2], &[Pose::zeros(), Pose::new(0.03, 0.1, std::f64::consts::PI)]);
    let mut places: Vec<f64> =
        touching.iter().filter(|contact| contact.gap.abs() < 1e-12).map(|contact| contact.along[0]).collect();
    places.sort_by(f64::total_cmp);
    assert_eq!(places.len(), 2, "{touching:?}");
    assert!((places[0] + 0.01).abs() < 1e-12 && (places[1] - 0.04).abs() < 1e-12, "{places:?}");
}

#[test]
fn an_end_on_the_other_centre_line_has_a_finite_direction() {
    let (contact_half_length, radius, cg_offset) = (0.04, 0.05, 0.0);
    let link = Link { contact_half_length, radius, cg_offset, ..random_link(&mut Random::new(1)) };
    for contact in contacts(&[link; 2], &[Pose::zeros(), Pose::new(0.04, 0.0, 1.0)]) {
        assert!(contact.direction.iter().all(|w| w.iter().all(|number| number.is_finite())));
    }
}

#[test]
fn the_search_along_the_chain_finds_every_close_pair_and_skips_the_others() {
    let mut random = Random::new(4);
    for count in [2, 3, 11, 200] {
        let robot = Robot::new(&links(count)).expect("a robot");
        for bend in [0.1, 0.5, 1.5] {
            let angles: Vec<f64> = (1..count).map(|_| random.between(-bend, bend)).collect();
            let mut poses = vec![Pose::zeros(); count];
            assemble_chain(&robot, Pose::new(0.0, 0.0, 1.0), &angles, &mut poses);
            let centre: Vec<Vector2<f64>> = poses.iter().map(|pose| pose.xy()).collect();
            let mut found = Vec::new();
            visit_close_pairs(&robot.links, |link| centre[link], 0.01, |i, j| found.push((i, j)));
            let reach = 2.0 * robot.links[0].reach() + 0.01;
            let close = |i: usize, j: usize| (centre[i] - centre[j]).norm() <= reach;
            let expected: Vec<(usize, usize)> =
                (0..count).flat_map(|i| (i + 2..count).map(move |j| (i, j))).filter(|&(i, j)| close(i, j)).collect();
            assert_eq!(found, expected, "{count} links bent by up to {bend}");
            let mut in_lanes = ClosePairs::<f64>::new(&robot.links);
            in_lanes.find(centre.iter().copied(), 0.01, true);
            let found: Vec<(usize, usize)> = in_lanes.of_lane(0).map(|[i, j]| (i, j)).collect();
            assert_eq!(found, expected, "{count} links bent by up to {bend}, in lanes");
        }
    }
}

/// Postures within the bound keep the clearance; the search is left out for them.
#[test]
fn links_are_apart_while_the_posture_is_within_the_folding_bound() {
    const CLEARANCE: f64 = 0.01;
    let mut random = Random::new(5);
    let (mut within, mut beyond_and_close) = (0, 0);
    for _ in 0..20_000 {
        let robot = Robot::new(&links(3 + random.below(9))).expect("a robot");
        let bend = random.between(0.1, 1.5);
        let angles: Vec<f64> = (1..robot.link_count()).map(|_| random.between(-bend, bend)).collect();
        let mut poses = vec![Pose::zeros(); robot.link_count()];
        assemble_chain(&robot, Pose::new(0.0, 0.0, 1.0), &angles, &mut poses);
        let gap = self_gap(&robot.links, &poses, 2.0 * CLEARANCE);
        if FoldingBound::new(&robot.links, CLEARANCE).exceeded_by(&Folding::of(poses.iter().map(|pose| pose.z))) {
            beyond_and_close += usize::from(gap < CLEARANCE);
        } else {
            within += 1;
            assert!(gap >= CLEARANCE, "{gap} m at {angles:?}");
        }
    }
    assert!(within > 2_000 && beyond_and_close > 50, "{within} postures within, {beyond_and_close} close ones beyond");
}

/// As many links are skipped as numbers can count, and no more.
#[test]
fn links_of_a_diverged_computation_end_the_search() {
    let robot = Robot::new(&links(11)).unwrap();
    for far in [1e300, f64::INFINITY, f64::NAN] {
        let mut poses: Vec<Vector3<f64>> = (0..11).map(|i| Vector3::new(0.122 * f64::from(i), 0.0, 0.0)).collect();
        poses[4].x = far;
        assert!(self_gap(&robot.links, &poses, 0.0) > 0.0);
    }
}
