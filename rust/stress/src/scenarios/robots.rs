//! Heavy and light links, few and many.

use snake_core::gait::Wave;
use snake_core::robot::RobotConfig;

use crate::case::{Case, Motion, weighted};

/// Mass of link i over that of Aiko's.
type Factor = Box<dyn Fn(usize) -> f64>;

/// Mass ratios up to 1e4 along the chain.
pub fn mass_ratios(duration: f64) -> Vec<Case> {
    let mut cases = Vec::new();
    for ratio in [1e2_f64, 1e4] {
        let graded = move |i: usize| ratio.powf(i as f64 / 10.0 - 0.5);
        let factors: [(&str, Factor); 4] = [
            ("rising", Box::new(graded)),
            ("falling", Box::new(move |i| graded(10 - i))),
            ("alternating", Box::new(move |i| if i % 2 == 0 { 1.0 } else { 1.0 / ratio })),
            ("one heavy link", Box::new(move |i| if i == 5 { ratio } else { 1.0 })),
        ];
        for (name, factor) in factors {
            for step in [1e-2, 5e-2] {
                let mut case = Case::course(format!("{name}, 1:{ratio:e}, h {step} s"), step, duration);
                case.robot = weighted(11, &factor);
                cases.push(case);
            }
        }
    }
    cases
}

/// From 2 to 300 links, undulating among pegs; gains grow with what they have to move.
pub fn links(duration: f64) -> Vec<Case> {
    let mut cases = Vec::new();
    for links in [2, 3, 11, 50, 100, 300] {
        for step in [1e-2, 5e-2] {
            let mut case = Case::course(format!("{links} links, h {step} s"), step, duration);
            case.robot = RobotConfig { links, ..RobotConfig::default() };
            case.motion = Motion::Wave(Wave::default());
            cases.push(case);
        }
    }
    cases
}
