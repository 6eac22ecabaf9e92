//! The joint controller inside a step: sign, limit, switching on, soft start.

use snake_core::control::ControllerConfig;
use snake_core::gait::{Reference, SoftStart, Wave};
use snake_core::scene::START_7_5;
use snake_test_support::planar::{Hold, build, ground, implicit, links};

/// The limit holds within the step, not only for the state it starts from: |D| <= c tau_max exactly.
#[test]
fn torque_never_exceeds_its_limit() {
    for step in [1e-3, 1e-2, 5e-2] {
        for order in [1, 2] {
            let limit = 1.5;
            let pd = ControllerConfig { torque_limit: Some(limit), ..ControllerConfig::default() };
            let integrator = implicit(step, order);
            let mut simulation = build(&links(6), &ground([0.2, 0.5]), &pd, &integrator);
            let mut saturated = 0;
            for k in 0..200 {
                let report = simulation.advance(step, &Hold(if (k / 20) % 2 == 0 { 0.5 } else { -0.5 }));
                // Stages that creep to the cap of iterations are as good as this all the same.
                assert!(!report.diverged && report.residual < 1e-8, "order {order}, h {step}, step {k}: {report:?}");
                for torque in simulation.joint_torque() {
                    assert!(torque.abs() <= limit * (1.0 + 1e-14), "{torque}: one division's round-off");
                    saturated += u32::from(torque.abs() > 0.999 * limit);
                }
            }
            assert!(saturated > 10, "the limit must bind: {saturated}");
        }
    }
}

/// Under the soft start (T 7.2.2) a straight robot's joint stays at zero until its wave comes within
/// 3 degrees of zero. Joint 6 has phase -250 degrees at t = 0 and joins late, joint 1 at once.
#[test]
fn soft_start_holds_the_joints_until_their_wave_comes_by() {
    let wave = Wave::default();
    let soft = SoftStart::new(wave, 10);
    let mut simulation = build(&links(11), &ground([0.2, 0.2]), &ControllerConfig::default(), &implicit(5e-3, 2));
    for k in 1..=400 {
        simulation.advance(5e-3, &soft);
        let time = f64::from(k) * 5e-3;
        for joint in 0..10 {
            let target = soft.target(joint, time).angle;
            let angle = simulation.state().joint_angle(joint);
            // k_P = 800 N m/rad: inertial and frictional torques of about 1 N m leave errors of 2 mrad;
            // a joint that joins its wave with a jump of 3 degrees needs some steps to get there.
            let just_joined = soft.target(joint, time - 0.05).angle == 0.0 && target != 0.0;
            assert!(
                (angle - target).abs() < if just_joined { 0.06 } else { 0.02 },
                "joint {joint} at {time}: {angle} for {target}"
            );
        }
    }
}

/// Work done by the actuators is kinetic energy plus what friction took: the balance of a run, within
/// the dissipation of the scheme, which vanishes with the step.
#[test]
fn actuator_work_is_kinetic_energy_plus_friction_loss() {
    let mut defects = Vec::new();
    for step in [4e-3, 2e-3, 1e-3] {
        let mut simulation = snake_test_support::planar::aiko(&ground([0.2, 0.2]), START_7_5, &implicit(step, 2));
        let report = simulation.advance(1.0, &Wave::default());
        let stored = simulation.kinetic_energy() - report.friction_work;
        defects.push((report.actuator_work - stored).abs() / report.actuator_work);
        assert!(report.friction_work < 0.0 && report.positive_actuator_work >= report.actuator_work);
    }
    println!("relative defect of the energy balance at 4, 2, 1 ms: {defects:?}");
    assert!(defects[2] < 0.02 && defects[2] < defects[0]);
}
