//! Input-output linearisation of the planar model: the implicit stage against the explicit torque.

use snake_core::control::ControllerConfig;
use snake_core::gait::Wave;
use snake_core::planar::{Planar, PlanarState};
use snake_core::simulation::{SchemeConfig, Simulation};
use snake_core::stepping::ImplicitConfig;
use snake_test_support::planar::{START_FREE, build, ground, links, posture};

use crate::thesis;

fn undulating<C: SchemeConfig<Planar>>(config: &C) -> Simulation<Planar, C::Scheme> {
    let mut simulation = build(&links(11), &ground([0.2, 0.5]), &ControllerConfig::io(), config);
    simulation.place_chain(START_FREE[0], START_FREE[1], START_FREE[2], &posture(&Wave::default(), 10));
    simulation
}

/// After one step from a state.
fn torque_after(state: &PlanarState, step: f64, config: &impl SchemeConfig<Planar>) -> Vec<f64> {
    let mut simulation = undulating(config);
    simulation.place(state);
    simulation.advance(step, &Wave::default());
    simulation.joint_torque().to_vec()
}

/// As the step shrinks, the torque of a stage is that of (6.58) at the state it starts from.
#[test]
fn planar_input_output_linearisation_tends_to_the_explicit_torque() {
    let mut moving = undulating(&ImplicitConfig { step: Some(0.01), ..ImplicitConfig::default() });
    moving.advance(0.73, &Wave::default());
    let explicit = torque_after(moving.state(), 1e-7, &thesis(1e-7, 1e-9));
    let size = explicit.iter().fold(0.0_f64, |a, tau| a.max(tau.abs()));
    let off = |step| {
        let euler = ImplicitConfig { step: Some(step), tolerance: Some(1e-9), order: 1, ..ImplicitConfig::default() };
        let implicit = torque_after(moving.state(), step, &euler);
        implicit.iter().zip(&explicit).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / size
    };
    let (coarse, fine) = (off(1e-5), off(1e-6));
    assert!(fine < 2e-2 && fine < 0.2 * coarse, "{coarse:e} {fine:e}");
}
