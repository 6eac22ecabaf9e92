//! All schemes converge to one limit, each at its order.

use nalgebra::Vector2;
use snake_core::control::ControllerConfig;
use snake_core::gait::{JointTarget, Reference, SoftStart, Wave};
use snake_core::scene::{START_7_5, SceneConfig};
use snake_core::simulation::PlanarSimulation;
use snake_core::stepping::ImplicitConfig;
use snake_test_support::planar::{Unannounced, aiko, build, ground, implicit, links};

fn positions(scene: &SceneConfig, start: [f64; 3], integrator: &ImplicitConfig, duration: f64) -> Vec<Vector2<f64>> {
    follow(aiko(scene, start, integrator), &Wave::default(), duration)
}

fn follow(
    mut simulation: PlanarSimulation,
    reference: &impl Reference<JointTarget>,
    duration: f64,
) -> Vec<Vector2<f64>> {
    let report = simulation.advance(duration, reference);
    assert!(!report.diverged);
    simulation.state().pose.iter().map(|q| q.xy()).collect()
}

fn worst(a: &[Vector2<f64>], b: &[Vector2<f64>]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

/// Errors against a fine second-order run; the slope of the error in the step, over all halvings.
fn observed(name: &str, steps: &[f64], error: impl Fn(f64) -> f64) -> (f64, f64) {
    let errors: Vec<f64> = steps.iter().map(|&h| error(h)).collect();
    let halvings = (steps[0] / steps[steps.len() - 1]).log2();
    let order = (errors[0] / errors[errors.len() - 1]).log2() / halvings;
    println!("{name}: errors {errors:?} m at {steps:?} s, order {order:.2}");
    (order, errors[errors.len() - 1])
}

/// Free undulation, one second, from rest into a moving reference. Implicit Euler is of order 1, the two-stage scheme of
/// order 2 between stick-slip switches, once its first steps resolve the
/// start (measured 2.0; 1.2 with equal steps).
#[test]
fn free_undulation_converges_to_one_limit_at_the_order_of_each_scheme() {
    let scene = ground([0.2, 0.2]);
    let start = snake_test_support::planar::START_FREE;
    let limit = positions(&scene, start, &implicit(1e-4, 2), 1.0);
    let against = |integrator: ImplicitConfig| worst(&positions(&scene, start, &integrator, 1.0), &limit);
    let (order, error) = observed("implicit 1", &[4e-3, 2e-3, 1e-3, 5e-4], |h| against(implicit(h, 1)));
    assert!((0.7..1.5).contains(&order) && error < 3e-4);
    let (order, error) =
        observed("implicit 2", &[2e-2, 1e-2, 5e-3, 2.5e-3, 1.25e-3, 6.25e-4], |h| against(implicit(h, 2)));
    assert!(order > 1.7 && error < 1e-7);
}

/// The same with orthotropic ground, where the direction of friction matters.
#[test]
fn orthotropic_undulation_converges_too() {
    let scene = ground([0.2, 0.5]);
    let start = snake_test_support::planar::START_FREE;
    let limit = positions(&scene, start, &implicit(2.5e-4, 2), 1.0);
    let against = |integrator: ImplicitConfig| worst(&positions(&scene, start, &integrator, 1.0), &limit);
    let (order, _) = observed("implicit 1", &[4e-3, 2e-3, 1e-3], |h| against(implicit(h, 1)));
    assert!((0.7..1.5).contains(&order));
    let (order, error) = observed("implicit 2", &[2e-2, 1e-2, 5e-3, 2.5e-3], |h| against(implicit(h, 2)));
    assert!(order > 1.5 && error < 1e-5);
}

/// The soft start (T 7.2.2) lets joints jump to their waves within steps; steps that end at the jumps keep the order.
/// Jumps that steps do not know of are found by the deviation, which leaves three times the error; equal steps would smear
/// them.
#[test]
fn a_soft_start_keeps_the_order() {
    let soft = SoftStart::new(Wave::default(), 10);
    let straight = |h| build(&links(11), &ground([0.2, 0.2]), &ControllerConfig::default(), &implicit(h, 2));
    let limit = follow(straight(2e-4), &soft, 2.0);
    let error = |h: f64| worst(&follow(straight(h), &soft, 2.0), &limit);
    let (order, error) = observed("implicit 2, soft start", &[2e-2, 1e-2, 5e-3, 2.5e-3, 1.25e-3, 6.25e-4], error);
    assert!(order > 1.5 && error < 1e-6);
    let found = worst(&follow(straight(6.25e-4), &Unannounced(soft), 2.0), &limit);
    println!("jumps found by the deviation in steps of 0.6 ms: {found:.1e} m");
    assert!(found > 2.0 * error && found < 3e-6);
}

/// The course of (T Table 7.5), half a second. Impacts reduce every scheme to order 1 at best and make
/// errors irregular in the step: only the approach to one limit is asserted.
#[test]
fn course_converges_to_one_limit() {
    let scene = snake_test_support::planar::table_7_5();
    let limit = positions(&scene, START_7_5, &implicit(1e-4, 1), 0.5);
    let against = |integrator: ImplicitConfig| worst(&positions(&scene, START_7_5, &integrator, 0.5), &limit);
    let (order, error) = observed("implicit 1", &[8e-3, 4e-3, 2e-3, 1e-3], |h| against(implicit(h, 1)));
    assert!(order > 0.5 && error < 2e-4);
    let (order, error) = observed("implicit 2", &[2e-2, 1e-2, 5e-3, 2.5e-3], |h| against(implicit(h, 2)));
    assert!(order > 0.4 && error < 1e-4);
}
