//! A pole that a robot climbs as a helix that rolls.

use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use crate::environment::config::ModelKind;
use crate::environment::rng::Rng;
use crate::environment::start::StartJitter;
use crate::obstacles::Shape;
use crate::slope::Slope;

use super::helix::{self, Helix, Winding};
use super::{EpisodeStart, Family, Placement, Scenario};

pub const FAMILY: Family = Family {
    name: "climb",
    id: "SnakeClimb-v1",
    description: "A pole to climb, by the distance to the goal line. The robot starts wound around it, and action zero rolls \
                  as a helix that presses on the pole. The x axis points up, gravity along -x, so that heights are distances; \
                  pictures show the pole lying. Coulomb friction at the pole falls from 1.0 to 0.7 with `difficulty`. A floor \
                  catches robots that fall. Action zero needs joint torques of up to 80 N m, which the id allows; Aiko, \
                  which weighs 7.5 kg, does not have them.",
    model: ModelKind::Spatial,
    has_pegs: false,
    slope: Slope { angle: FRAC_PI_2, direction: 0.0 },
    torque_limit: 80.0,
    gait: |_| helix::rolling(WINDING),
    validate: helix::validate,
    scenario: |config, robot| Ok(Arc::new(Climb(Helix::new(config, robot, WINDING, AWAY)))),
    ..Family::DEFAULT
};

#[derive(Debug)]
struct Climb(Helix);

impl Scenario for Climb {
    fn draw(&self, placement: &mut Placement, difficulty: f64, _: &StartJitter, _: &mut Rng) -> EpisodeStart {
        let [radius, _] = self.0.cylinders();
        let [start, end] = self.0.way();
        let pole = Shape::Cylinder { start: [start, 0.0, AWAY], end: [end, 0.0, AWAY], radius, inside: false };
        let corner = |k: usize| {
            let side = |bit: usize, low: f64, high: f64| if k & bit == 0 { low } else { high };
            [side(1, start - THICK, start), side(2, -WIDE, WIDE), side(4, -WIDE, WIDE)]
        };
        let floor = Shape::Polyhedron { vertices: (0..8).map(corner).collect() };
        let friction = 1.0 - 0.3 * difficulty;
        self.0.place(placement, vec![(pole, friction), (floor, friction)])
    }
}

const WINDING: Winding = Winding { bend: 0.69, turn: -0.29, grip: 1.2 };

/// Distance of the pole from the plane z = 0, which is upright \[m\].
const AWAY: f64 = 2.0;

/// Thickness and half width of the floor \[m\].
const THICK: f64 = 0.5;
const WIDE: f64 = 10.0;
