//! Ground without pegs.

use std::sync::Arc;

use crate::environment::config::{EnvConfig, ModelKind};
use crate::environment::default_gait::DefaultGait;
use crate::environment::rng::Rng;
use crate::environment::start::StartJitter;
use crate::error::ConfigError;
use crate::robot::Robot;

use super::open_ground::OpenGround;
use super::{EpisodeStart, Family, ISOTROPIC, ORTHOTROPIC, Placement, Scenario};

/// The planar robot needs ground that resists sideways sliding more; the spatial one sidewinds on any.
pub const FAMILY: Family = Family {
    name: "free",
    id: "SnakeFree-v1",
    description: "No pegs; the ground resists sliding across a link more than along it, which is what moves a snake \
                  forward on open ground.",
    has_pegs: false,
    friction: |model| match model {
        ModelKind::Planar => ORTHOTROPIC,
        ModelKind::Spatial => ISOTROPIC,
    },
    gait: |model| match model {
        ModelKind::Planar => DefaultGait::undulation(),
        ModelKind::Spatial => DefaultGait::sidewinding(),
    },
    scenario: |config, robot| Ok(Arc::new(Free::new(config, robot)?)),
    ..Family::DEFAULT
};

#[derive(Debug)]
pub struct Free(OpenGround);

impl Free {
    pub fn new(config: &EnvConfig, robot: &Robot) -> Result<Self, ConfigError> {
        OpenGround::new(config, robot, |_| 0.0).map(Self)
    }
}

impl Scenario for Free {
    fn draw(&self, placement: &mut Placement, _: f64, jitter: &StartJitter, _: &mut Rng) -> EpisodeStart {
        self.0.draw(placement, jitter, |_, _| None)
    }
}
