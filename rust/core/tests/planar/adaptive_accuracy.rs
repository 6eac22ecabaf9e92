//! The adaptive scheme keeps its promise: errors follow the tolerance, steps end where intervals end.

use nalgebra::Vector2;
use snake_core::gait::Wave;
use snake_core::scene::{START_7_3, START_7_5, SceneConfig};
use snake_core::stepping::IntegratorConfig;
use snake_test_support::planar::{START_FREE, adaptive, aiko, ground, implicit, table_7_3, table_7_5};

/// Positions of all links every 0.1 s for five seconds, and the number of steps.
fn run(scene: &SceneConfig, start: [f64; 3], integrator: &IntegratorConfig) -> (Vec<Vector2<f64>>, u32) {
    let mut simulation = aiko(scene, start, integrator);
    let (mut positions, mut steps) = (Vec::new(), 0);
    for _ in 0..50 {
        let report = simulation.advance(0.1, &Wave::default());
        assert!(!report.diverged && report.misses == 0, "{report:?}");
        steps += report.steps;
        positions.extend(simulation.state().pose.iter().map(|q| q.xy()));
    }
    (positions, steps)
}

/// Worst distance after five seconds, and over all samples.
fn errors(a: &[Vector2<f64>], b: &[Vector2<f64>]) -> (f64, f64) {
    let worst = |range: std::ops::Range<usize>| range.map(|i| (a[i] - b[i]).norm()).fold(0.0, f64::max);
    (worst(a.len() - 11..a.len()), worst(0..a.len()))
}

struct Promise {
    tolerances: &'static [f64],
    /// Bounds on the error after five seconds, and on the worst of all samples, over the tolerance.
    end: std::ops::Range<f64>,
    worst: f64,
}

fn holds(name: &str, scene: &SceneConfig, start: [f64; 3], reference_step: f64, promise: &Promise) {
    let (limit, _) = run(scene, start, &implicit(reference_step, 2));
    let mut before = 0;
    for &tolerance in promise.tolerances {
        let (positions, steps) = run(scene, start, &adaptive(tolerance));
        let (end, worst) = errors(&positions, &limit);
        println!("{name}, tolerance {tolerance:.0e} m: {end:.2e} m after 5 s, worst {worst:.2e} m, {steps} steps");
        assert!(promise.end.contains(&(end / tolerance)), "{name} {tolerance:e}");
        assert!(worst < promise.worst * tolerance, "{name} {tolerance:e}");
        assert!(steps > before, "a sharper tolerance takes more steps");
        before = steps;
    }
}

/// Nothing holds the robot on free ground: errors stay, and the tolerance is met within a factor of four.
#[test]
fn free_undulation_errs_by_the_tolerance() {
    let promise = Promise { tolerances: &[1e-3, 1e-4, 1e-5, 1e-6], end: 0.1..1.0, worst: 1.5 };
    holds("free", &ground([0.2, 0.2]), START_FREE, 1e-4, &promise);
}

/// Large pegs guide the robot: most of an error is undone, so that much less than the tolerance remains.
#[test]
fn the_course_of_large_pegs_errs_by_less() {
    let promise = Promise { tolerances: &[1e-3, 1e-4, 1e-5], end: 0.005..0.5, worst: 0.5 };
    holds("Table 7.5", &table_7_5(), START_7_5, 2e-4, &promise);
}

/// Small pegs let the robot come loose and lock again; locked in a nearly singular posture a small error of the
/// joints is for a moment a larger one of the links.
#[test]
fn the_course_of_small_pegs_errs_by_the_tolerance_but_for_moments() {
    let promise = Promise { tolerances: &[1e-3, 1e-4, 1e-5], end: 0.01..1.0, worst: 5.0 };
    holds("Table 7.3", &table_7_3(), START_7_3, 1e-4, &promise);
}

/// A contact that has just opened keeps a trace of penetration; asked to undo it within one of the tiny steps that
/// follow an event, it would throw the link out at up to 0.2 m/s, an error that no tolerance removes.
#[test]
fn tiny_steps_do_not_throw_links_off_the_pegs() {
    let promise = Promise { tolerances: &[1e-6], end: 0.01..5.0, worst: 20.0 };
    holds("Table 7.3", &table_7_3(), START_7_3, 1e-4, &promise);
}

#[test]
fn intervals_end_exactly_whatever_their_length() {
    let mut simulation = aiko(&table_7_5(), START_7_5, &adaptive(1e-4));
    let mut time = 0.0;
    for duration in [0.05, 1e-3, 0.1 / 3.0, 0.2, 1e-6] {
        simulation.advance(duration, &Wave::default());
        time += duration;
        assert_eq!(simulation.state().time, time, "the state stands at the end of the interval, to the last bit");
    }
}

/// A continued run takes the same steps as one that was interrupted and restored elsewhere.
#[test]
fn a_snapshot_continues_bit_for_bit() {
    let scene = table_7_3();
    let mut simulation = aiko(&scene, START_7_3, &adaptive(1e-4));
    simulation.advance(0.7, &Wave::default());
    let snapshot = simulation.snapshot();
    let mut other = aiko(&scene, [0.0; 3], &adaptive(1e-4));
    other.restore(&snapshot);
    for _ in 0..5 {
        simulation.advance(0.1, &Wave::default());
        other.advance(0.1, &Wave::default());
    }
    assert_eq!(simulation.state(), other.state());
}

#[test]
fn a_tolerance_out_of_range_is_refused() {
    for tolerance in [1e-9, 1.0, 0.0, f64::NAN] {
        let error = adaptive(tolerance).validate().unwrap_err().to_string();
        assert!(error.starts_with("tolerance = "), "{error}");
    }
    assert!(adaptive(1e-6).validate().is_ok());
}

/// At the bluntest tolerance the bound on the step decides.
#[test]
fn steps_are_never_longer_than_asked() {
    let bounded = IntegratorConfig { step: Some(2e-3), ..adaptive(0.1) };
    let mut simulation = aiko(&ground([0.2, 0.2]), START_FREE, &bounded);
    let report = simulation.advance(0.5, &Wave::default());
    assert!(report.steps >= 250, "{report:?}");
}
