//! Friction, and rest under load.

use snake_core::control::ControllerConfig;
use snake_core::simulation::Simulation;
use snake_core::stepping::StepStatistics;

use crate::case::{Case, Motion};
use crate::figures::Figures;
use crate::observable::Observable;

/// From ice to glue, and runners of ratio up to a thousand.
pub fn friction(duration: f64) -> Vec<Case> {
    let pairs = [
        [0.0, 0.0],
        [1e-3, 1e-3],
        [10.0, 10.0],
        [0.0, 0.5],
        [0.5, 0.0],
        [1e-3, 1.0],
        [1.0, 1e-3],
        [1e-2, 10.0],
        [10.0, 1e-2],
    ];
    let mut cases = Vec::new();
    for friction in pairs {
        for step in [1e-2, 5e-2] {
            let mut case = Case::course(format!("mu {friction:?}, h {step} s"), step, duration);
            case.scene.friction = friction;
            cases.push(case);
        }
    }
    cases
}

/// Robots whose joints push against friction and pegs too weakly to move anything.
pub fn rest() -> Vec<Case> {
    let mut free = Case::straight("free", 1e-2, 0.0);
    free.controller = ControllerConfig { kp: 0.5, kd: 0.05, ..ControllerConfig::default() };
    free.motion = Motion::Hold(0.2);
    let mut limited = pressed("on the course, torques at their limit", 1e-2);
    limited.controller = ControllerConfig { kp: 800.0, torque_limit: Some(0.3), ..ControllerConfig::default() };
    limited.motion = Motion::Hold(0.0);
    vec![free, limited]
}

/// Robots that slid until friction and pegs could just hold them: nearly every link is at its limit.
pub fn brink() -> Vec<Case> {
    let mut orthotropic = pressed("on the course, orthotropic", 1e-2);
    orthotropic.scene.friction = [0.01, 1.0];
    vec![pressed("on the course", 5e-2), orthotropic]
}

/// A bent robot on the course whose joints pull it straighter than the pegs allow.
fn pressed(name: &str, step: f64) -> Case {
    let mut case = Case::course(name, step, 0.0);
    case.posture = Some((0..10).map(|joint| 0.7 * (joint as f64 * -0.87).sin()).collect());
    case.controller = ControllerConfig { kp: 20.0, kd: 2.0, ..ControllerConfig::default() };
    case.motion = Motion::Hold(0.3);
    case.integrator.tolerance = Some(1e-8);
    case
}

/// Lets a robot come to rest, then stands `steps` steps; `drift` is how far any link crept.
pub fn stand<M: Observable>(
    mut simulation: Simulation<M>,
    step: f64,
    steps: u64,
    advance: impl Fn(&mut Simulation<M>, f64) -> StepStatistics,
) -> Figures {
    advance(&mut simulation, SETTLE);
    let before = simulation.state().clone();
    let mut figures = Figures::default();
    for _ in 0..steps {
        let report = advance(&mut simulation, step);
        figures.count(&report);
    }
    figures.measure(&simulation, step);
    figures.drift = M::moved(simulation.state(), &before);
    figures
}

/// Time after which nothing moves any more \[s\].
const SETTLE: f64 = 60.0;
