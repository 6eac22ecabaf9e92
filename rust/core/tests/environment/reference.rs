//! Laws of the reference generator: smooth, rate-limited, and the thesis's wave at rest.

use proptest::prelude::*;
use snake_core::control::AxisGains;
use snake_core::environment::ActionMode;
use snake_core::environment::action::{Reach, planar_entries};
use snake_core::environment::default_gait::DefaultGait;
use snake_core::environment::reference::ReferenceGenerator;
use snake_core::gait::{JointTarget, Reference, Wave};

const JOINTS: usize = 5;
const PERIOD: f64 = 0.05;

fn generator(mode: ActionMode) -> ReferenceGenerator<1> {
    let mut generator = ReferenceGenerator::new(
        planar_entries(mode, JOINTS, Reach { torque: 10.0, ..Reach::UNLIMITED }),
        DefaultGait::undulation(),
        PERIOD,
    );
    generator.rest_in_posture(0.3);
    generator
}

fn mode() -> impl Strategy<Value = ActionMode> {
    use ActionMode::{Gait, Joints, Residual, Velocities};
    prop_oneof![Just(Gait), Just(Joints), Just(Residual), Just(Velocities)]
}

fn actions() -> impl Strategy<Value = Vec<Vec<f64>>> {
    let extreme_or_any = prop_oneof![Just(-1.0), Just(1.0), -1.0..1.0f64];
    prop::collection::vec(prop::collection::vec(extreme_or_any, 4 + JOINTS), 1..40)
}

fn targets(generator: &ReferenceGenerator<1>, time: f64) -> [JointTarget; JOINTS] {
    std::array::from_fn(|joint| generator.target(joint, time))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    #[test]
    fn angle_rate_and_acceleration_are_continuous_across_control_instants(mode in mode(), actions in actions()) {
        let mut generator = generator(mode);
        let mut time = 0.0;
        let mut before = targets(&generator, time);
        for action in &actions {
            generator.set_action(action, time);
            let after = targets(&generator, time);
            for (a, b) in before.iter().zip(&after) {
                // Round-off of lambda^2 = 900 / s^2 times angles near one, and of phases near pi.
                prop_assert!((a.angle - b.angle).abs() < 1e-12);
                prop_assert!((a.rate - b.rate).abs() < 1e-11);
                prop_assert!((a.acceleration - b.acceleration).abs() < 1e-9);
            }
            time += PERIOD;
            before = targets(&generator, time);
            generator.finish_period();
        }
    }

    #[test]
    fn rate_and_acceleration_are_derivatives_of_the_angle(mode in mode(), actions in actions(), t in 0.001..0.049f64) {
        let mut generator = generator(mode);
        let h = 1e-5;
        for (k, action) in actions.iter().enumerate() {
            let start = k as f64 * PERIOD;
            generator.set_action(action, start);
            for joint in 0..JOINTS {
                let at = |dt: f64| generator.target(joint, start + t + dt);
                let rate = (at(h).angle - at(-h).angle) / (2.0 * h);
                let acceleration = (at(h).rate - at(-h).rate) / (2.0 * h);
                // Central differences: h^2 / 6 of a third derivative below 1e5, and round-off / h.
                prop_assert!((rate - at(0.0).rate).abs() < 1e-5);
                prop_assert!((acceleration - at(0.0).acceleration).abs() < 1e-3);
            }
            generator.finish_period();
        }
    }

    #[test]
    fn angles_and_rates_stay_within_the_sums_of_their_limits(mode in mode(), actions in actions()) {
        let mut generator = generator(mode);
        let ripple = 1.0 + generator.filter().ripple();
        let (angle, rate) = bounds(mode);
        for (k, action) in actions.iter().enumerate() {
            let start = k as f64 * PERIOD;
            generator.set_action(action, start);
            for sample in 0..10 {
                for target in targets(&generator, start + PERIOD * f64::from(sample) / 10.0) {
                    prop_assert!(target.angle.abs() <= angle.to_radians() + 1e-9);
                    prop_assert!(target.rate.abs() <= ripple * rate.to_radians() + 1e-9, "{}", target.rate.to_degrees());
                }
            }
            generator.finish_period();
        }
    }
}

/// Largest angle and rate of any joint \[deg, deg/s\].
fn bounds(mode: ActionMode) -> (f64, f64) {
    // A sin + gamma: rates of A, of the phase (omega, and beta of the last joint) at largest A, and of gamma.
    let phase_rate = 200.0 + (JOINTS - 1) as f64 * 25.0;
    let wave = (65.0 + 25.0, 50.0 + 65f64.to_radians() * phase_rate + 50.0);
    match mode {
        ActionMode::Gait => wave,
        ActionMode::Joints => (70.0, 150.0),
        ActionMode::Residual => (wave.0 + 20.0, wave.1 + 60.0),
        ActionMode::Velocities => (80.0, 150.0),
        ActionMode::Torques => unreachable!("no references"),
    }
}

#[test]
fn action_zero_becomes_the_wave_of_the_thesis() {
    for mode in [ActionMode::Gait, ActionMode::Residual] {
        let mut generator = generator(mode);
        let wave = Wave::default();
        for k in 0..40 {
            generator.set_action(&[0.0; 4 + JOINTS], f64::from(k) * PERIOD);
            generator.finish_period();
        }
        let start = 2.0;
        generator.set_action(&[0.0; 4 + JOINTS], start);
        let delay = generator.phase() / wave.omega;
        for joint in 0..JOINTS {
            let (ours, theirs) = (generator.target(joint, start + 0.02), wave.target(joint, delay + 0.02));
            // 2 s are 60 time constants, less the half second that the frequency needs to start.
            assert!((ours.angle - theirs.angle).abs() < 1e-9);
            assert!((ours.rate - theirs.rate).abs() < 1e-9);
            assert!((ours.acceleration - theirs.acceleration).abs() < 1e-9);
        }
    }
}

#[test]
fn a_reference_at_rest_holds_the_posture_of_the_gait() {
    let wave = Wave::default();
    for mode in [ActionMode::Gait, ActionMode::Joints, ActionMode::Residual, ActionMode::Velocities] {
        let generator = generator(mode);
        for joint in 0..JOINTS {
            let target = generator.target(joint, 0.0);
            let posture = wave.target(joint, 0.3 / wave.omega).angle;
            assert!((target.angle - posture).abs() < 1e-12);
            assert_eq!((target.rate, target.acceleration), (0.0, 0.0));
        }
    }
}

#[test]
fn all_joints_at_once_are_the_joints_one_by_one() {
    let mut generator = generator(ActionMode::Residual);
    generator.set_action(&[0.5, -1.0, 0.7, 0.2, 1.0, -1.0, 0.3, 0.0, 0.6], 0.0);
    let mut all = [JointTarget::default(); JOINTS];
    generator.targets(0.03, &mut all);
    for (one, of_all) in targets(&generator, 0.03).iter().zip(&all) {
        // Rotating the phase from joint to joint costs an ulp each.
        assert!((one.angle - of_all.angle).abs() < 1e-14);
        assert!((one.rate - of_all.rate).abs() < 1e-13);
        assert!((one.acceleration - of_all.acceleration).abs() < 1e-11);
    }
}

#[test]
fn joint_actions_arrive_at_the_angles_they_ask_for() {
    let mut generator = generator(ActionMode::Joints);
    let action = [1.0, -1.0, 0.5, 0.0, -0.25];
    for k in 0..60 {
        generator.set_action(&action, f64::from(k) * PERIOD);
        generator.finish_period();
    }
    let mut angles = [0.0; JOINTS];
    generator.angles((0..angles.len()).map(|joint| (joint, 0)), &mut angles);
    for (angle, action) in angles.iter().zip(action) {
        assert!((angle - action * 70f64.to_radians()).abs() < 1e-9);
    }
}

#[test]
fn references_turn_at_the_rates_they_are_asked_for() {
    let mut generator = generator(ActionMode::Velocities);
    generator.rest_bent(|_, _| 0.0);
    let action = [0.2, -0.2, 0.1, 0.0, -0.05];
    let mut angles = [[0.0; JOINTS]; 2];
    for k in 0..40 {
        generator.set_action(&action, f64::from(k) * PERIOD);
        generator.finish_period();
        angles[usize::from(k == 39)] = [0.0; JOINTS];
        generator.angles((0..5).map(|joint| (joint, 0)), &mut angles[usize::from(k == 39)]);
    }
    for (joint, action) in action.iter().enumerate() {
        // 2 s are 60 time constants of the filter.
        let rate = (angles[1][joint] - angles[0][joint]) / PERIOD;
        assert!((rate - action * 150f64.to_radians()).abs() < 1e-9, "joint {joint}: {rate}");
        assert!((generator.target(joint, 2.0).rate - rate).abs() < 1e-9);
    }
}

#[test]
fn a_reference_that_is_held_up_does_not_run_ahead_of_its_joint() {
    let mut generator = generator(ActionMode::Velocities);
    generator.rest_bent(|_, _| 0.0);
    // The last joint is twice as weak.
    let gains = |kp| [AxisGains { kp, kd: 0.0, torque_limit: 5.0 }; 2];
    let gains: Vec<_> = (0..JOINTS).map(|joint| gains(if joint == JOINTS - 1 { 200.0 } else { 400.0 })).collect();
    let mut farthest = [0.0_f64; JOINTS];
    for k in 0..60 {
        generator.set_action(&[1.0; JOINTS], f64::from(k) * PERIOD);
        generator.limit_windup(&gains, |joint, _| 0.01 * joint as f64);
        for joint in 0..JOINTS {
            let ahead = generator.target(joint, f64::from(k) * PERIOD).angle - 0.01 * joint as f64;
            assert!(ahead <= 5.0 / gains[joint][0].kp + 1e-15);
            farthest[joint] = farthest[joint].max(ahead);
        }
        generator.finish_period();
    }
    assert!(farthest[0] > 0.0124 && farthest[JOINTS - 1] > 0.0249, "{farthest:?}");
}

#[test]
fn torques_reach_the_joints_at_once_and_rest_with_the_posture() {
    let mut generator = generator(ActionMode::Torques);
    let mut torques = [1.0; JOINTS];
    assert!(generator.torques(0.0, &mut torques) && torques == [0.0; JOINTS]);
    generator.set_action(&[1.0, -1.0, 0.5, 0.0, -0.25], 0.0);
    assert!(generator.torques(0.03, &mut torques));
    assert_eq!(torques, [10.0, -10.0, 5.0, 0.0, -2.5]);
    generator.rest_in_posture(0.0);
    assert!(generator.torques(0.0, &mut torques) && torques == [0.0; JOINTS]);
}
