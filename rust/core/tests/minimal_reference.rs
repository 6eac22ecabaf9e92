//! The set-valued robot model against trajectories of an independent implementation.

use snake_core::gait::{Gait, JointReference, SoftStart, Wave};
use snake_core::minimal::{FeedbackConfig, FrictionLaw, Ground, MinimalState, NoiseConfig};
use snake_core::minimal_simulation::{MinimalConfig, MinimalSimulation};
use snake_core::robot::RobotConfig;
use snake_core::stepper::{IntegratorConfig, Method};

fn config(method: Method, step: f64, tolerance: f64) -> MinimalConfig {
    MinimalConfig {
        robot: RobotConfig::default(),
        ground: Ground::default(),
        friction_law: FrictionLaw::SetValued,
        controller: FeedbackConfig::pd(),
        integrator: IntegratorConfig {
            method,
            step: Some(step),
            tolerance: Some(tolerance),
            max_iterations: Some(100_000),
            ..IntegratorConfig::default()
        },
        noise: NoiseConfig::default(),
        seed: 0,
    }
}

#[test]
fn probe() {
    let gait = Gait::SoftStart(SoftStart::new(Wave::default(), 10));
    let text =
        std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/minimal-pd-setvalued-joint5.csv"))
            .unwrap();
    let rows: Vec<Vec<f64>> =
        text.lines().skip(1).map(|l| l.split(',').map(|x| x.parse().unwrap()).collect()).collect();
    for (name, config) in [
        ("thesis 2.5e-4 tight", config(Method::Thesis, 2.5e-4, 1e-10)),
        ("implicit 1e-3", config(Method::Implicit, 1e-3, 1e-8)),
        ("implicit 1e-2", config(Method::Implicit, 1e-2, 1e-8)),
        ("implicit 2e-2", config(Method::Implicit, 2e-2, 1e-8)),
    ] {
        let mut sim = MinimalSimulation::new(&config).unwrap();
        sim.place(&MinimalState::zero(13));
        let t0 = std::time::Instant::now();
        let (mut max, mut sq, mut tsq, mut n) = (0.0f64, 0.0, 0.0, 0);
        let (mut worst_e, mut worst_cm, mut res, mut its, mut steps, mut misses) =
            (0.0f64, 0.0f64, 0.0f64, 0u64, 0u64, 0u64);
        for k in 1..=2000usize {
            assert!(sim.advance(0.01, &gait));
            let t = sim.tally();
            res = res.max(t.residual);
            its += t.iterations as u64;
            steps += t.steps as u64;
            misses += t.misses as u64;
            let e = sim.state().phi()[4] - gait.target(4, sim.state().time).angle;
            let r = &rows[k];
            let poses = sim.poses();
            let cm = poses.iter().map(|p| p.x).sum::<f64>() / 11.0;
            worst_cm = worst_cm.max((cm - r[4]).abs());
            if k >= 500 {
                max = max.max(e.abs());
                sq += e * e;
                tsq += sim.torque()[4].powi(2);
                n += 1;
                worst_e = worst_e.max((e - r[2]).abs());
            }
            if k == 2000 {
                println!("cm moved {}", cm - 0.671);
            }
        }
        println!(
            "{name}: max {:.4} rms {:.4} torque {:.4}, against ref: e {worst_e:.2e} rad cm {worst_cm:.2e} m; residual {res:.1e} it/step {:.1} steps {steps} misses {misses}; {:.1} s/s",
            max.to_degrees(),
            (sq / n as f64).sqrt().to_degrees(),
            (tsq / n as f64).sqrt(),
            its as f64 / steps as f64,
            20.0 / t0.elapsed().as_secs_f64()
        );
    }
}
