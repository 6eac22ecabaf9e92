//! Links whose CG is not in the middle.

use nalgebra::{Vector2, Vector3};
use snake_core::control::ControllerConfig;
use snake_core::gait::{CardanTarget, JointTarget, Reference};
use snake_core::robot::{AxesConfig, PerLink, RobotConfig};
use snake_core::simulation::SpatialSimulation;
use snake_core::spatial::{Pose, orientation_of, twist_of};
use snake_core::stepping::ImplicitConfig;
use snake_test_support::pair::{FreePair, OFF_CENTRE, off_centre};
use snake_test_support::planar::{LIMP, ground, implicit, links};

/// Pitch angles that never change.
struct Raised(Vec<f64>);

impl Reference<CardanTarget> for Raised {
    fn target(&self, joint: usize, _: f64) -> CardanTarget {
        let held = |angle| JointTarget { angle, ..JointTarget::default() };
        CardanTarget { yaw: held(0.0), pitch: held(self.0[joint]) }
    }
}

fn simulation(robot: &RobotConfig, pd: &ControllerConfig, scheme: &ImplicitConfig) -> SpatialSimulation {
    SpatialSimulation::new(robot, &ground([0.5; 2]), pd, scheme).expect("admissible")
}

/// A limp pair that falls and turns in a vertical plane, about its common CG as the equations of Lagrange say, which the
/// test integrates itself.
#[test]
fn a_falling_pair_turns_as_lagrange_says() {
    for offset in [[0.0; 2], OFF_CENTRE, [-0.02, -0.05]] {
        let (axes, joint_limit) = (AxesConfig::Same("pitch".to_owned()), Some(f64::INFINITY.into()));
        let config = RobotConfig { axes, joint_limit, ..off_centre(offset) };
        let mut simulation = simulation(&config, &LIMP, &implicit(2e-4, 2));
        // Pitch and rates turn the centre lines from the horizontal upwards, joint angles downwards.
        let mut pair = FreePair::of(simulation.robot(), [0.3, 1.0], [1.5, -2.5]);
        let head = Pose { position: Vector3::new(0.0, 0.0, 50.0), orientation: orientation_of(0.0, 0.3, 0.0) };
        simulation.place_chain(head, &[Vector2::new(0.0, -0.7)]);
        let mut state = simulation.state().clone();
        let [rear, front] = [simulation.robot().links[0].arms()[1], simulation.robot().links[1].arms()[0]];
        let across = |angle: f64| Vector3::new(-angle.sin(), 0.0, angle.cos());
        let first = Vector3::new(0.1, 0.0, 0.2);
        let second = first + across(0.3) * (rear * pair.rate[0]) + across(1.0) * (front * pair.rate[1]);
        for (i, velocity) in [first, second].into_iter().enumerate() {
            let spin = Vector3::new(0.0, -pair.rate[i], 0.0);
            state.twist[i] = twist_of(velocity, state.pose[i].orientation.inverse_transform_vector(&spin));
        }
        simulation.place(&state);
        let energy = simulation.energy();
        simulation.advance(1.0, &Raised(vec![0.0]));
        pair.advance(1.0);
        for (pose, angle) in simulation.state().pose.iter().zip(pair.angle) {
            let expected = Vector3::new(angle.cos(), 0.0, angle.sin());
            assert!((pose.axis() - expected).norm() < 2e-7, "{offset:?}: {:?} instead of {expected:?}", pose.axis());
        }
        assert!((simulation.energy() / energy - 1.0).abs() < 1e-8);
        assert!(simulation.joint_gap() < 1e-13);
    }
}

/// Both ends of a robot that lies on the ground are raised, and their joints carry their weights: m g times the distance
/// from the joint to the CG, L/2 + d at the head and L/2 - d at the tail.
#[test]
fn the_joint_of_a_raised_link_carries_its_weight_at_the_cg() {
    let (n, mass, length, angle) = (8, 7.5 / 11.0, 0.122, 0.2);
    for offset in [0.0, 0.03, -0.03] {
        let config = RobotConfig { cg_offset: PerLink::Same(offset), ..links(n) };
        let scheme = ImplicitConfig { tolerance: None, ..implicit(5e-3, 2) };
        let mut simulation = simulation(&config, &ControllerConfig::default(), &scheme);
        let mut reference = Raised(vec![0.0; n - 1]);
        (reference.0[0], reference.0[n - 2]) = (-angle, -angle);
        let posture: Vec<_> = reference.0.iter().map(|pitch| Vector2::new(0.0, *pitch)).collect();
        let head = Pose { position: Vector3::zeros(), orientation: orientation_of(0.0, -angle, 0.0) };
        simulation.place_chain(head, &posture);
        simulation.rest_on_ground();
        let report = simulation.advance(4.0, &reference);
        assert!(report.unconverged == 0 && simulation.state().kinetic_energy(simulation.robot()) < 1e-12);
        let state = simulation.state();
        for (joint, link, arm) in [(0, 0, 0.5 * length + offset), (n - 2, n - 1, 0.5 * length - offset)] {
            let flat = 1.0 - state.pose[link].axis().z.powi(2);
            let (torque, weight) = (simulation.joint_torque()[joint].y.abs(), mass * 9.81 * arm * flat.sqrt());
            assert!((torque / weight - 1.0).abs() < 1e-4, "{offset}: {torque} N m at joint {joint}, of {weight}");
        }
    }
}
