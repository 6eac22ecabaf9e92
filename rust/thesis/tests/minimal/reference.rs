//! The set-valued minimal model against an independent implementation at 2.5e-4 s (`tests/data`), and the schemes
//! against each other: PD, gait (7.3) with soft start, from straight rest.

use snake_core::capabilities::Method;
use snake_core::control::ControllerConfig;
use snake_core::stepping::ImplicitConfig;
use snake_thesis::ThesisConfig;
use snake_thesis::minimal::MinimalConfig;

use crate::robots::{default_config, error_of_joint_5, soft_start, straight};

/// Rows of t, phi_d5, e5, tau5, x_cm, y_cm, w.
fn reference() -> Vec<Vec<f64>> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/minimal-pd-setvalued-joint5.csv");
    let text = std::fs::read_to_string(path).expect("the reference data");
    text.lines().skip(1).map(|line| line.split(',').map(|x| x.parse().expect("a number")).collect()).collect()
}

fn with(method: Method, step: f64, tolerance: f64) -> MinimalConfig {
    let integrator = match method {
        Method::Thesis => ThesisConfig { step, tolerance: Some(tolerance), ..ThesisConfig::default() }.into(),
        Method::Implicit => {
            ImplicitConfig { step: Some(step), tolerance: Some(tolerance), ..ImplicitConfig::default() }.into()
        }
    };
    MinimalConfig { integrator, ..default_config() }
}

/// What section 7.3.5 reports of joint 5 after 5 s, and how far the centre of mass moved in 20 s.
struct Figures {
    max_error: f64,
    rms_error: f64,
    rms_torque: f64,
    travelled: f64,
    /// Worst difference from the reference, in the error after 5 s \[rad\] and in the centre of mass \[m\].
    off: [f64; 2],
}

fn figures(config: &MinimalConfig) -> Figures {
    let (mut simulation, gait) = (straight(config), soft_start());
    let mut f = Figures { max_error: 0.0, rms_error: 0.0, rms_torque: 0.0, travelled: 0.0, off: [0.0; 2] };
    let mut count = 0.0;
    for row in reference().iter().skip(1) {
        let duration = row[0] - simulation.state().time;
        assert!(simulation.advance(duration, &gait));
        assert_eq!(simulation.statistics().unconverged, 0);
        let error = error_of_joint_5(&simulation, &gait);
        let poses = simulation.poses();
        let centre = poses.iter().map(|pose| pose.x).sum::<f64>() / poses.len() as f64;
        f.off[1] = f.off[1].max((centre - row[4]).abs());
        f.travelled = centre - 0.671;
        if row[0] >= 5.0 {
            f.off[0] = f.off[0].max((error - row[2]).abs());
            f.max_error = f.max_error.max(error.abs());
            f.rms_error += error * error;
            f.rms_torque += simulation.torque()[4].powi(2);
            count += 1.0;
        }
    }
    f.rms_error = (f.rms_error / count).sqrt();
    f.rms_torque = (f.rms_torque / count).sqrt();
    println!(
        "{:?} at {} s: max {:.4} deg, RMS {:.4} deg, torque {:.4} N m, {:.4} m; off by {:.1e} rad, {:.1e} m",
        config.integrator.method(),
        config.integrator.step(),
        f.max_error.to_degrees(),
        f.rms_error.to_degrees(),
        f.rms_torque,
        f.travelled,
        f.off[0],
        f.off[1]
    );
    f
}

fn assert_the_published_figures(f: &Figures) {
    for (ours, theirs) in [
        (f.max_error.to_degrees(), 0.3526),
        (f.rms_error.to_degrees(), 0.2460),
        (f.rms_torque, 0.859),
        (f.travelled, -1.327),
    ] {
        assert!((ours / theirs - 1.0).abs() < 5e-3, "{ours} against {theirs}");
    }
}

/// The same discretisation: what is left is the last digit of the data and where the iteration stops.
#[test]
fn thesis_follows_the_reference_at_its_own_step() {
    let f = figures(&with(Method::Thesis, 2.5e-4, 1e-7));
    assert_the_published_figures(&f);
    assert!(f.off[0] < 1e-6 && f.off[1] < 1e-5, "{:?}", f.off);
}

/// At steps forty times longer; the reference itself is 1 mm from its limit.
#[test]
fn the_default_scheme_gives_the_same_figures_at_ten_milliseconds() {
    let f = figures(&with(Method::Implicit, 1e-2, 1e-8));
    assert_the_published_figures(&f);
    assert!(f.off[0] < 1e-5 && f.off[1] < 1.5e-3, "{:?}", f.off);
}

/// Worst differences over 20 s between two runs, sampled every 0.1 s: joint angles \[rad\] and O_2 \[m\].
fn distance(one: &MinimalConfig, other: &MinimalConfig, duration: f64) -> [f64; 2] {
    let (mut a, mut b, gait) = (straight(one), straight(other), soft_start());
    let mut worst = [0.0_f64; 2];
    for _ in 0..(10.0 * duration) as u32 {
        assert!(a.advance(0.1, &gait) && b.advance(0.1, &gait));
        let (p, q) = (&a.state().q, &b.state().q);
        worst[1] = worst[1].max((p[0] - q[0]).hypot(p[1] - q[1]));
        for (p, q) in p[3..].iter().zip(&q[3..]) {
            worst[0] = worst[0].max((p - q).abs());
        }
    }
    println!("{}: {:.1e} rad, {:.1e} m", one.integrator.step(), worst[0], worst[1]);
    worst
}

#[test]
fn input_output_linearisation_at_long_steps_is_within_a_milliradian_and_a_millimetre_over_20_s() {
    let io = |step, tolerance| MinimalConfig {
        controller: ControllerConfig::io(),
        ..with(Method::Implicit, step, tolerance)
    };
    let limit = io(5e-4, 1e-8);
    for step in [0.02, 0.05] {
        let [angle, place] = distance(&io(step, 1e-8), &limit, 20.0);
        assert!(angle < 1e-3 && place < 1e-3, "{step}: {angle:e} rad, {place:e} m");
    }
}

/// Two implementations of chapter 6, one dense and one of O(n), meet as the step of the first shrinks fourfold.
#[test]
fn the_two_schemes_converge_to_one_limit() {
    let limit = with(Method::Implicit, 2e-4, 1e-8);
    let coarse = distance(&with(Method::Thesis, 5e-4, 1e-8), &limit, 2.0);
    let fine = distance(&with(Method::Thesis, 1.25e-4, 1e-8), &limit, 2.0);
    assert!(fine[0] < 3e-4 && fine[1] < 1e-4, "{fine:?}");
    assert!(fine[0] < 0.35 * coarse[0] && fine[1] < 0.35 * coarse[1], "{coarse:?} {fine:?}");
}
