//! Links whose CG is not in the middle.

use nalgebra::Vector2;
use snake_core::contact::gap;
use snake_core::planar::{PlanarState, Twist};
use snake_core::robot::{PerLink, Robot, RobotConfig};
use snake_core::scene::Peg;
use snake_test_support::pair::{FreePair, OFF_CENTRE, off_centre};
use snake_test_support::planar::{Hold, LIMP, build, ground, implicit, links, momentum, moving_chain};

/// A limp pair in free space against the equations of Lagrange, which the test integrates itself.
#[test]
fn a_free_pair_moves_as_lagrange_says() {
    for offset in [[0.0; 2], OFF_CENTRE, [-0.02, -0.05]] {
        let config = RobotConfig { joint_limit: Some(f64::INFINITY.into()), ..off_centre(offset) };
        let mut simulation = build(&config, &ground([0.0; 2]), &LIMP, &implicit(2e-4, 2));
        let mut pair = FreePair::of(simulation.robot(), [0.3, 0.3 + 0.7], [1.5, -2.5]);
        simulation.place_chain(0.4, -0.1, 0.3, &[0.7]);
        let head = Twist::new(0.2, 0.1, pair.rate[0]);
        let state = moving_chain(simulation.robot(), &simulation.state().pose, head, &pair.rate[1..]);
        simulation.place(&state);
        let energy = simulation.kinetic_energy();
        let momenta = momentum(simulation.robot(), simulation.state());
        let start = centre(simulation.robot(), simulation.state());
        simulation.advance(1.0, &Hold(0.0));
        pair.advance(1.0);
        let state = simulation.state();
        for (pose, angle) in state.pose.iter().zip(pair.angle) {
            assert!((pose.z - angle).abs() < 2e-7, "{offset:?}: {} instead of {angle}", pose.z);
        }
        let after = momentum(simulation.robot(), state);
        assert!((after.0 - momenta.0).norm() < 1e-12 && (after.1 - momenta.1).abs() < 1e-9, "{after:?}, {momenta:?}");
        assert!((simulation.kinetic_energy() / energy - 1.0).abs() < 1e-7);
        let moved = centre(simulation.robot(), state) - start;
        assert!((moved - momenta.0 / simulation.robot().total_mass()).norm() < 1e-7, "second order in the step");
        assert!(simulation.joint_gap() < 1e-14);
    }
}

fn centre(robot: &Robot, state: &PlanarState) -> Vector2<f64> {
    let weighted: Vector2<f64> = robot.links.iter().zip(&state.pose).map(|(link, pose)| pose.xy() * link.mass).sum();
    weighted / robot.total_mass()
}

/// Joints and outline are about the middle of a link.
#[test]
fn joints_and_outline_are_where_they_are_whatever_the_cg() {
    let config = RobotConfig { cg_offset: PerLink::Same(0.05), ..links(2) };
    let mut simulation = build(&config, &ground([0.0; 2]), &LIMP, &implicit(1e-2, 2));
    // The head's end is at x = 0, and the robot lies along x behind it.
    simulation.place_chain(0.061 - 0.05, 0.0, 0.0, &[0.0]);
    let links: Vec<_> = simulation.robot().links.clone();
    let [first, second] = [0, 1].map(|i| simulation.state().pose[i].x + links[i].cg_offset);
    assert!((first - 0.061).abs() < 1e-15 && (second - 3.0 * 0.061).abs() < 1e-15);
    let peg = Peg { radius: 0.02, x: -0.1, y: 0.0 };
    let gap = gap(&simulation.state().pose[0], &links[0], &peg);
    assert!((gap - (0.061 - 0.0393 - 0.0525 + 0.1 - 0.02)).abs() < 1e-15, "{gap}");
}

#[test]
fn a_cg_lies_within_its_link() {
    let refused = |cg_offset: PerLink| Robot::new(&RobotConfig { cg_offset, ..links(2) }).expect_err("refused");
    let same = refused(PerLink::Same(0.061));
    assert_eq!((same.field.as_str(), same.expected.as_str()), ("cg_offset", "a distance < 0.061, half of the link"));
    assert_eq!(refused(PerLink::Each(vec![0.0, -0.07])).field, "cg_offset[1]");
    assert_eq!(refused(PerLink::Each(vec![0.0, f64::NAN])).field, "cg_offset[1]");
}
