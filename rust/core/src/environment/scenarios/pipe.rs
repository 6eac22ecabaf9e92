//! A pipe that a robot crawls through as a helix that rolls.

use std::sync::Arc;

use crate::environment::config::ModelKind;
use crate::environment::rng::Rng;
use crate::environment::start::StartJitter;
use crate::obstacles::Shape;

use super::helix::{self, Helix, Winding};
use super::{EpisodeStart, Family, Placement, Scenario};

pub const FAMILY: Family = Family {
    name: "pipe",
    id: "SnakePipe-v1",
    description: "A straight level pipe from before the start to beyond the goal line. The robot lies in it as a helix, and \
                  action zero rolls as a wider one that presses on the wall. Coulomb friction at the wall falls from 0.8 to \
                  0.3 with `difficulty`.",
    model: ModelKind::Spatial,
    has_pegs: false,
    gait: |_| helix::rolling(WINDING),
    validate: helix::validate,
    scenario: |config, robot| Ok(Arc::new(Pipe(Helix::new(config, robot, WINDING, ABOVE)))),
    ..Family::DEFAULT
};

#[derive(Debug)]
struct Pipe(Helix);

impl Scenario for Pipe {
    fn draw(&self, placement: &mut Placement, difficulty: f64, _: &StartJitter, _: &mut Rng) -> EpisodeStart {
        let [_, radius] = self.0.cylinders();
        let [start, end] = self.0.way().map(|x| [x, 0.0, ABOVE]);
        self.0.place(placement, vec![(Shape::Cylinder { start, end, radius, inside: true }, 0.8 - 0.5 * difficulty)])
    }
}

const WINDING: Winding = Winding { bend: 0.6, turn: 0.29, grip: 0.8 };

/// Height of the pipe's axis \[m\].
const ABOVE: f64 = 0.4;
