//! Gap functions and force directions against the printed cases and against finite differences.

use nalgebra::{Matrix2, Vector2, Vector3};
use snake_core::contact::{NearObstacles, PlacedLink, clear_way, gap, link_peg_contact};
use snake_core::obstacles::ObstacleGrid;
use snake_core::planar::{Heading, Pose, Twist, assemble_chain, joint_gap, mean_twist, travel};
use snake_core::robot::{Link, PerLink, Robot, RobotConfig};
use snake_core::scene::Peg;
use snake_test_support::planar::{Random, links, moving_chain};
use snake_test_support::spatial_random::random_link;

fn random_pose(random: &mut Random) -> Pose {
    Pose::new(random.between(-1.0, 1.0), random.between(-1.0, 1.0), random.between(-7.0, 7.0))
}

/// A peg that does not contain the link's centre line.
fn random_peg(random: &mut Random, pose: &Pose, link: &Link) -> Peg {
    loop {
        let peg = Peg {
            radius: random.between(0.005, 0.15),
            x: pose.x + random.between(-0.5, 0.5),
            y: pose.y + random.between(-0.5, 0.5),
        };
        if gap(pose, link, &peg) > -link.radius - 0.8 * peg.radius {
            return peg;
        }
    }
}

/// R_B^I of (T 3.7) and D of (T 3.19), written out from the print.
fn rotation(theta: f64) -> Matrix2<f64> {
    Matrix2::new(theta.cos(), -theta.sin(), theta.sin(), theta.cos())
}

/// (gap, w_H) from the printed cases of the middle of the link, with the moment about the CG.
fn printed(pose: &Pose, link: &Link, peg: &Peg) -> (f64, Vector3<f64>) {
    let shift = rotation(pose.z) * Vector2::new(link.cg_offset, 0.0);
    let (gap, direction) = printed_at_middle(&(pose + shift.push(0.0)), link, peg);
    (gap, direction + Vector3::z() * shift.perp(&direction.xy()))
}

/// (gap, w_H) from the printed cases: rectangle (T 3.8)-(T 3.9), (T 3.16), caps (T 3.10)-(T 3.12), (T 3.18).
fn printed_at_middle(pose: &Pose, link: &Link, peg: &Peg) -> (f64, Vector3<f64>) {
    let r = rotation(pose.z);
    let (e_x, e_y) = (r.column(0).into_owned(), r.column(1).into_owned());
    let (centre, hub) = (pose.xy(), Vector2::new(peg.x, peg.y));
    let reach = peg.radius + link.radius;
    let along = (hub - centre).dot(&e_x);
    if along.abs() <= link.contact_half_length {
        let d = (centre - hub).dot(&e_y);
        let moment = (hub - centre).dot(&Vector2::new(pose.z.cos(), pose.z.sin()));
        return (d.abs() - reach, Vector3::new(e_y.x, e_y.y, moment) * d.signum());
    }
    let body_fixed = Vector2::new(link.contact_half_length * along.signum(), 0.0);
    let to_cap = centre + r * body_fixed - hub;
    let normal = to_cap / to_cap.norm();
    let turned = r * Matrix2::new(0.0, -1.0, 1.0, 0.0) * body_fixed;
    (to_cap.norm() - reach, Vector3::new(normal.x, normal.y, normal.dot(&turned)))
}

#[test]
fn gap_and_direction_are_the_printed_cases() {
    let mut random = Random::new(2);
    for _ in 0..100_000 {
        let (link, pose) = (random_link(&mut random), random_pose(&mut random));
        let peg = random_peg(&mut random, &pose, &link);
        let (expected_gap, expected_direction) = printed(&pose, &link, &peg);
        let contact = link_peg_contact(&PlacedLink::new(&link, pose), &peg);
        // Coordinates of size 1: differences carry a few ulps of 1; the direction divides by the
        // distance of the axis, at least 0.2 of the peg's radius of 5 mm.
        assert!((contact.gap - expected_gap).abs() < 5e-15);
        assert!((gap(&pose, &link, &peg) - expected_gap).abs() < 5e-15);
        assert!((contact.direction - expected_direction).norm() < 2e-12);
    }
}

/// Central differences with step d err by d^2 / 6 times the third derivative (about 1 / distance^2,
/// with distances of at least 1 mm) plus round-off of 1e-16 / d: d = 1e-7 gives about 1e-8 at worst.
/// Where the pair changes between side and cap the gap is once continuously differentiable: the second
/// derivative jumps by 1/distance, and the central difference errs by d / distance instead, below 1e-4.
#[test]
fn force_direction_is_the_gradient_of_the_gap_on_sides_caps_and_between() {
    let mut random = Random::new(3);
    let d = 1e-7;
    let (mut worst_smooth, mut worst_seam) = (0.0_f64, 0.0_f64);
    for k in 0..50_000 {
        let (link, pose) = (random_link(&mut random), random_pose(&mut random));
        let mut peg = random_peg(&mut random, &pose, &link);
        let r = rotation(pose.z);
        let at_seam = k % 5 == 0;
        if at_seam {
            let side = if k % 10 == 0 { 1.0 } else { -1.0 };
            let lateral = side * (link.radius + peg.radius) * random.between(0.9, 2.0);
            let end = link.cg_offset + if k % 20 < 10 { link.contact_half_length } else { -link.contact_half_length };
            let hub = pose.xy() + r * Vector2::new(end, lateral);
            (peg.x, peg.y) = (hub.x, hub.y);
        }
        let direction = link_peg_contact(&PlacedLink::new(&link, pose), &peg).direction;
        for axis in 0..3 {
            let shifted = |sign: f64| {
                let mut moved = pose;
                moved[axis] += sign * d;
                gap(&moved, &link, &peg)
            };
            let error = ((shifted(1.0) - shifted(-1.0)) / (2.0 * d) - direction[axis]).abs();
            let worst = if at_seam { &mut worst_seam } else { &mut worst_smooth };
            *worst = worst.max(error);
        }
    }
    println!("gap gradient against central differences: {worst_smooth:.1e}, at the seam {worst_seam:.1e}");
    assert!(worst_smooth < 1e-6 && worst_seam < 1e-5);
}

/// A peg centred on the centre line leaves the direction open; the answer must still be a unit normal.
#[test]
fn a_peg_on_the_centre_line_gives_a_finite_unit_direction() {
    let (contact_half_length, radius, cg_offset) = (0.04, 0.05, 0.0);
    let link = Link { contact_half_length, radius, cg_offset, ..random_link(&mut Random::new(1)) };
    let pose = Pose::new(0.0, 0.0, 0.0);
    for x in [-0.04, 0.0, 0.02, 0.04] {
        let contact = link_peg_contact(&PlacedLink::new(&link, pose), &Peg { radius: 0.02, x, y: 0.0 });
        assert_eq!(contact.direction.xy().norm(), 1.0);
        assert_eq!(contact.gap, -0.07);
    }
}

/// (T 3.36)-(T 3.37) are the derivatives of (T 3.14): W_J^T (u_i, u_i+1) against central differences.
/// The solvers' own W_J is judged in `chain_sweep.rs` with the matrix checked here.
#[test]
fn joint_force_directions_are_the_derivatives_of_the_joint_gap() {
    let mut random = Random::new(4);
    let d = 1e-6;
    for _ in 0..2_000 {
        let links = [random_link(&mut random), random_link(&mut random)];
        let poses = [random_pose(&mut random), random_pose(&mut random)];
        let w = common_joint_directions(&links, &poses);
        for column in 0..6 {
            let shifted = |sign: f64| {
                let mut q = poses;
                q[column / 3][column % 3] += sign * d;
                joint_gap(&links[0], &q[0], &links[1], &q[1])
            };
            let difference = (shifted(1.0) - shifted(-1.0)) / (2.0 * d);
            for (row, w_row) in w.iter().enumerate() {
                // Truncation L d^2 / 12 < 1e-13, round-off 2e-16 / d = 2e-10 for coordinates of size 1.
                assert!((difference[row] - w_row[column]).abs() < 1e-9);
            }
        }
    }
}

/// w_Jx^T and w_Jy^T as printed.
fn common_joint_directions(links: &[Link; 2], q: &[Pose; 2]) -> [[f64; 6]; 2] {
    let (rear, front) = (0.5 * links[0].length + links[0].cg_offset, 0.5 * links[1].length - links[1].cg_offset);
    [
        [1.0, 0.0, -rear * q[0].z.sin(), -1.0, 0.0, -front * q[1].z.sin()],
        [0.0, 1.0, rear * q[0].z.cos(), 0.0, -1.0, front * q[1].z.cos()],
    ]
}

fn random_pegs(random: &mut Random, count: usize) -> Vec<Peg> {
    let mut between = |low, high| random.between(low, high);
    let peg = |_| Peg { radius: 10f64.powf(between(-2.3, -0.5)), x: between(-2.0, 2.0), y: between(-2.0, 2.0) };
    (0..count).map(peg).collect()
}

/// Poses about `size` away from others.
fn disturbed(random: &mut Random, poses: &[Pose], size: f64) -> Vec<Pose> {
    let mut unit = || random.between(-1.0, 1.0);
    poses.iter().map(|pose| pose + Vector3::new(unit(), unit(), 9.0 * unit()) * size).collect()
}

/// The farthest that a point of the links moves, at most.
fn farthest(links: &[Link], from: &[Pose], to: &[Pose]) -> f64 {
    let way =
        |(link, (from, to)): (&Link, (&Pose, &Pose))| (to - from).xy().norm() + link.reach() * (to - from).z.abs();
    links.iter().zip(from.iter().zip(to)).map(way).fold(0.0, f64::max)
}

/// Calls `check` with each pair of a link and a peg and its gap.
fn for_pairs(links: &[Link], poses: &[Pose], pegs: &[Peg], mut check: impl FnMut(usize, usize, f64)) {
    for (i, (pose, link)) in poses.iter().zip(links).enumerate() {
        pegs.iter().enumerate().for_each(|(j, peg)| check(i, j, gap(pose, link, peg)));
    }
}

/// Along random walks with jumps of all sizes, no pair below the margin is ever missing from the list.
#[test]
fn near_list_never_misses_a_pair_below_the_margin() {
    let mut random = Random::new(5);
    let (mut listed, mut rebuilt) = (0_usize, 0);
    for scene in 0..40 {
        let pegs = random_pegs(&mut random, [3, 30, 300][scene % 3]);
        let grid = ObstacleGrid::new(&pegs);
        let links: Vec<Link> = (0..4).map(|_| random_link(&mut random)).collect();
        let mut poses: Vec<Pose> = (0..4).map(|_| random_pose(&mut random)).collect();
        let (mut near, mut previous) = (NearObstacles::with_capacity(4), Vec::new());
        for _ in 0..400 {
            let size = random.magnitude(1e-4, 0.2);
            let next = disturbed(&mut random, &poses, size);
            let (margin, displacement) = (random.between(0.0, 0.05), farthest(&links, &poses, &next));
            poses = next;
            if !near.covers(displacement, margin) {
                near.rebuild(poses.iter().copied(), &links, &grid, margin, displacement, &mut previous);
                rebuilt += 1;
            }
            near.advance(displacement);
            for_pairs(&links, &poses, &pegs, |i, j, gap| {
                listed += usize::from(gap < margin);
                assert!(gap >= margin || near.pairs().iter().any(|pair| pair.link == i && pair.obstacle == j));
            });
        }
    }
    assert!(listed > 10_000, "the walks must meet pegs: {listed}");
    assert!((1000..15_000).contains(&rebuilt), "some lists must serve several poses: {rebuilt} of 16,000");
}

/// Robots that look ahead and arrive about there, but now and then stay where they are: no pair below the margin is
/// ever passed over, and most of the others are.
#[test]
fn a_look_ahead_passes_no_pair_below_the_margin_over() {
    let mut random = Random::new(6);
    let (mut within, mut seen, mut listed) = (0_usize, 0_usize, 0_usize);
    for _ in 0..40 {
        let pegs = random_pegs(&mut random, 60);
        let grid = ObstacleGrid::new(&pegs);
        let links: Vec<Link> = (0..4).map(|_| random_link(&mut random)).collect();
        let mut poses: Vec<Pose> = (0..4).map(|_| random_pose(&mut random)).collect();
        let (mut near, mut previous) = (NearObstacles::with_capacity(4), Vec::new());
        for step in 0..300 {
            let ahead = disturbed(&mut random, &poses, 4e-3);
            let (margin, displacement) = (random.between(0.0, 0.01), farthest(&links, &poses, &ahead));
            if !near.covers(displacement, margin) {
                near.rebuild(ahead.iter().copied(), &links, &grid, margin, displacement, &mut previous);
            }
            let mut looked_at = Vec::new();
            near.visit_within(displacement, margin, |_, pair| {
                looked_at.push((pair.link, pair.obstacle));
                gap(&ahead[pair.link], &links[pair.link], &pegs[pair.obstacle])
            });
            for_pairs(&links, &ahead, &pegs, |i, j, gap| {
                within += usize::from(gap < margin);
                assert!(gap >= margin || looked_at.contains(&(i, j)), "step {step}: link {i}, peg {j} at {gap}");
            });
            (seen, listed) = (seen + looked_at.len(), listed + near.pairs().len());
            if step % 5 > 0 {
                poses = disturbed(&mut random, &ahead, 2e-4);
                near.arrive(displacement, farthest(&links, &ahead, &poses));
            }
        }
    }
    assert!(within > 10_000 && 2 * seen < listed, "{within} within the margin, {seen} looked at, {listed} listed");
}

/// However far the nearest peg, no point of a robot that goes the clear way meets one.
#[test]
fn the_clear_way_is_clear_and_long_where_pegs_are_far() {
    let mut random = Random::new(7);
    for scene in 0..300 {
        let distance = random.magnitude(0.1, 1e4);
        let turned = |(k, mut peg): (usize, Peg)| {
            (peg.x, peg.y) = (peg.x + distance * (k as f64).cos(), peg.y + distance * (k as f64).sin());
            peg
        };
        let pegs: Vec<Peg> = random_pegs(&mut random, 1 + scene % 9).into_iter().enumerate().map(turned).collect();
        let links: Vec<Link> = (0..4).map(|_| random_link(&mut random)).collect();
        let poses: Vec<Pose> = (0..4).map(|_| random_pose(&mut random)).collect();
        let way = clear_way(poses.iter().copied(), &links, &ObstacleGrid::new(&pegs));
        let mut nearest = f64::INFINITY;
        for_pairs(&links, &poses, &pegs, |_, _, gap| nearest = nearest.min(gap));
        assert!(way >= 0.0 && way <= nearest.max(0.0), "{way} but {nearest}");
        assert!(distance < 100.0 || way > 0.1 * distance, "{way} at a distance of {distance}");
        for nowhere in [f64::NAN, f64::INFINITY] {
            let poses = [Pose::repeat(nowhere); 4];
            assert_eq!(clear_way(poses.into_iter(), &links, &ObstacleGrid::new(&pegs)), 0.0);
        }
    }
}

/// Largest distance of a chain's links from where `move_by` takes them, after it has travelled for `duration` \[s\].
fn travel_error(duration: f64, is_mean: bool) -> f64 {
    let mut random = Random::new(3);
    let offsets = (0..50).map(|_| random.between(-0.05, 0.05)).collect();
    let robot = Robot::new(&RobotConfig { cg_offset: PerLink::Each(offsets), ..links(50) }).unwrap();
    let joint_angle: Vec<f64> = (1..50).map(|_| random.between(-0.5, 0.5)).collect();
    let omega: Vec<f64> = (1..50).map(|_| random.between(-1.0, 1.0)).collect();
    let mut from = vec![Pose::zeros(); 50];
    assemble_chain(&robot, Pose::new(0.0, 0.0, 0.3), &joint_angle, &mut from);
    let twist = moving_chain(&robot, &from, Twist::new(0.1, -0.2, 0.5), &omega).twist;
    let arms: Vec<_> = robot.links.iter().map(Link::arms).collect();
    let (mut to, mut heading) = (from.clone(), vec![Heading::of(0.0); 50]);
    travel(&arms, &from, &twist, duration, &mut to, &mut heading);
    let mut mean = twist.clone();
    if is_mean {
        mean_twist(&arms, &heading, &twist, &mut mean);
    }
    let moved = from.iter().zip(&mean).map(|(pose, u)| pose + u * duration);
    to.iter().zip(moved).map(|(there, moved)| (there - moved).norm()).fold(0.0, f64::max)
}

#[test]
fn links_travel_with_their_mean_twist_to_third_order() {
    let order = |is_mean| (travel_error(2e-3, is_mean) / travel_error(1e-3, is_mean)).log2();
    assert!((order(false) - 2.0).abs() < 0.05, "{}", order(false));
    assert!((order(true) - 3.0).abs() < 0.05, "{}", order(true));
}
