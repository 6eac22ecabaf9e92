//! The scheme converges to the limit of the implicit ones.

use nalgebra::Vector2;
use snake_core::gait::Wave;
use snake_core::laws::Stribeck;
use snake_core::planar::Planar;
use snake_core::scene::{START_7_5, SceneConfig};
use snake_core::simulation::SchemeConfig;
use snake_test_support::planar::{START_FREE, aiko, ground, implicit, table_7_5};

use crate::thesis;

fn positions(
    scene: &SceneConfig,
    start: [f64; 3],
    integrator: &impl SchemeConfig<Planar>,
    duration: f64,
) -> Vec<Vector2<f64>> {
    let mut simulation = aiko(scene, start, integrator);
    let report = simulation.advance(duration, &Wave::default());
    assert!(!report.diverged);
    simulation.state().pose.iter().map(|q| q.xy()).collect()
}

fn worst(a: &[Vector2<f64>], b: &[Vector2<f64>]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

/// Free undulation, one second, from rest into a moving reference: order 1.
#[test]
fn free_undulation_converges_to_the_limit_at_first_order() {
    let scene = ground([0.2, 0.2]);
    let limit = positions(&scene, START_FREE, &implicit(1e-4, 2), 1.0);
    let errors =
        [2.5e-4, 1.25e-4, 6.25e-5].map(|h| worst(&positions(&scene, START_FREE, &thesis(h, 1e-11), 1.0), &limit));
    let order = 0.5 * (errors[0] / errors[2]).log2();
    println!("errors {errors:?} m, order {order:.2}");
    assert!((0.7..1.5).contains(&order) && errors[2] < 1e-4);
}

/// The course of (T Table 7.5), half a second. Contacts act on velocity level once a gap is closed, so they keep what a
/// step penetrates: v h / 2 about 1e-5 m.
#[test]
fn course_converges_to_the_limit() {
    let scene = table_7_5();
    let limit = positions(&scene, START_7_5, &implicit(1e-4, 1), 0.5);
    let errors = [2.5e-4, 1.25e-4].map(|h| worst(&positions(&scene, START_7_5, &thesis(h, 1e-7), 0.5), &limit));
    println!("errors {errors:?} m");
    assert!(errors[1] < 2e-4);
}

/// Falling friction is explicit in one scheme, lagged in the other: both tend to the same motion.
#[test]
fn the_printed_scheme_and_the_implicit_one_agree_on_falling_friction() {
    let stribeck = Stribeck { drop: 0.3, speed: 0.05 };
    let scene = SceneConfig { friction: [0.2, 0.5], stribeck, ..SceneConfig::default() };
    let printed = positions(&scene, START_FREE, &thesis(1e-4, 1e-9), 1.0);
    let apart = [5e-3, 2.5e-3].map(|h| worst(&positions(&scene, START_FREE, &implicit(h, 2), 1.0), &printed));
    println!("apart by {apart:?} m");
    assert!(apart[1] < 1e-4, "{apart:?}");
}
