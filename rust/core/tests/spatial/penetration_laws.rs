//! No link of the 3D model passes through an obstacle within a step.

use nalgebra::{Vector2, Vector3};
use snake_core::robot::{PerLink, RobotConfig};
use snake_core::scene::{Peg, SceneConfig};
use snake_core::simulation::SpatialSimulation;
use snake_core::spatial::{Pose, orientation_of, twist_of};
use snake_test_support::flat::Still;
use snake_test_support::planar::{LIMP, ground};
use snake_test_support::spatial::implicit;

/// Three slender links in the air, of which the middle one turns about its CG and takes the others along. Its end comes by a
/// thin peg and is beyond it one step later, while its CG rests.
#[test]
fn a_slender_link_that_turns_does_not_pass_through_a_peg() {
    let robot = RobotConfig {
        links: 3,
        length: PerLink::Same(1.0),
        contact_half_length: PerLink::Same(0.45),
        radius: PerLink::Same(1e-3),
        inertia: PerLink::Same(0.06),
        ..RobotConfig::default()
    };
    for spin in [10.0, 15.0, 20.0] {
        for place in 0..20 {
            let peg = Peg { radius: 5e-4, x: 0.43, y: 0.03 + 0.004 * f64::from(place) };
            let scene = SceneConfig { obstacles: vec![peg.into()], rolling_friction: 0.0, ..ground([0.0; 2]) };
            let mut simulation = SpatialSimulation::new(&robot, &scene, &LIMP, &implicit(0.01, 2)).expect("admissible");
            let head = Pose { position: Vector3::new(-1.0, 0.0, 50.0), orientation: orientation_of(0.0, 0.0, 0.0) };
            simulation.place_chain(head, &[Vector2::zeros(); 2]);
            let mut state = simulation.state().clone();
            for (side, twist) in [-1.0, 0.0, 1.0].into_iter().zip(&mut state.twist) {
                let turn = if side == 0.0 { spin } else { 0.0 };
                let turning = state.pose[0].orientation.inverse_transform_vector(&(Vector3::z() * turn));
                *twist = twist_of(Vector3::y() * (0.5 * side * spin), turning);
            }
            simulation.place(&state);
            let mut was_pushed = false;
            for _ in 0..25 {
                simulation.advance(0.01, &Still);
                was_pushed |= simulation.contact_impulse().iter().any(|impulse| impulse.norm() > 0.0);
                let link = &simulation.state().pose[1];
                let (axis, offset) = (link.axis().xy(), Vector2::new(peg.x, peg.y) - link.position.xy());
                let is_beside = offset.dot(&axis).abs() < 0.45;
                assert!(!is_beside || axis.perp(&offset) > 0.0, "{spin} rad/s, peg {place}: passed through");
            }
            assert!(was_pushed, "{spin} rad/s, peg {place}");
        }
    }
}
