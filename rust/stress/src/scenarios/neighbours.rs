//! One sick robot in a fleet.

use snake_core::gait::{JointReference, Wave};
use snake_core::pegs::PegGrid;
use snake_core::planar::{PlanarState, is_sane};
use snake_core::robot::{Robot, RobotConfig};
use snake_core::scene::{START_7_5, TABLE_7_5};
use snake_core::simulation::StepReport;
use snake_core::stepper::{Fleet, IntegratorConfig, Plant, Scripted};

use crate::case::pegs;
use crate::figures::Figures;

type Undulator = Scripted<Wave>;

/// Puts NaN or infinity into one robot of `ROBOTS` after a while, goes on for `periods` control periods, and
/// compares the others bit for bit with a healthy fleet; `broken` counts what differs, and a sick robot unnoticed.
pub fn poisoned(step: f64, poison: f64, periods: u32) -> Figures {
    let config = IntegratorConfig { step: Some(step), ..IntegratorConfig::default() };
    let robot = Robot::new(&RobotConfig::default()).expect("Aiko");
    let plant = Plant::new(robot, [0.2, 0.2], Default::default()).expect("the thesis's controller");
    let (mut healthy, mut sick) = (robots(&plant), robots(&plant));
    let mut fleets = [Fleet::new(config, &plant, ROBOTS), Fleet::new(config, &plant, ROBOTS)];
    let mut figures = Figures::default();
    for period in 0..periods {
        let patient = (period as usize * 5) % ROBOTS;
        let ill = period % 4 == 3;
        if ill {
            let twist = &mut sick[patient].body.state.twist[period as usize % 11];
            twist[period as usize % 3] = poison;
        }
        fleets[0].advance(&plant, &mut healthy, PERIOD, |_| true);
        fleets[1].advance(&plant, &mut sick, PERIOD, |_| true);
        for (k, (a, b)) in healthy.iter().zip(&mut sick).enumerate() {
            figures.count(&StepReport { diverged: false, ..StepReport::of(&a.body) });
            if ill && k == patient {
                figures.broken += u64::from(!b.body.diverged || !is_sane(&b.body.state.pose, &b.body.state.twist));
                b.body.clone_from(&a.body);
            } else {
                figures.broken += u64::from(!same_bits(&a.body.state, &b.body.state));
            }
        }
    }
    figures
}

/// Robots that differ in gait and in the number of pegs around them.
fn robots(plant: &Plant) -> Vec<Undulator> {
    let undulator = |k: usize| {
        let wave = Wave { omega: 1.0 + 0.2 * k as f64, ..Wave::default() };
        let angles: Vec<f64> = (0..10).map(|joint| wave.target(joint, 0.0).angle).collect();
        Scripted::new(&plant.robot, PegGrid::new(&pegs(&TABLE_7_5[..k % 8])), START_7_5, &angles, wave)
    };
    (0..ROBOTS).map(undulator).collect()
}

fn same_bits(a: &PlanarState, b: &PlanarState) -> bool {
    let bits = |state: &PlanarState| -> Vec<u64> {
        state.pose.iter().chain(&state.twist).flat_map(|v| v.iter().map(|x| x.to_bits()).collect::<Vec<_>>()).collect()
    };
    bits(a) == bits(b)
}

/// Two full registers of eight and a rest.
const ROBOTS: usize = 19;

/// \[s\]
const PERIOD: f64 = 0.05;
