//! How the robots of a chunk are advanced by a control period: side by side where the model can, else one by one.

use std::fmt::Debug;

use crate::environment::{Environment, PlanarRobot, RobotModel, SpatialRobot};
use crate::gait::{CardanReference, CardanTarget, JointTarget, WaveJets};
use crate::planar::{Body, Fleet, Planar};
use crate::spatial::{Spatial, SpatialBody, SpatialFleet};
use crate::stepping::{Driven, IntegratorConfig};

use super::chunk::Row;

/// A model of which many may be advanced side by side.
pub trait Batched: RobotModel {
    /// Memory to do so.
    type Stepper: Debug + Send;

    /// Memory for `rows` robots; `None` where each environment advances its own.
    fn stepper(prototype: &Environment<Self>, integrator: &IntegratorConfig, rows: usize) -> Option<Self::Stepper>;

    /// Advances the robots of the active rows by a control period.
    fn step_batch(stepper: &mut Self::Stepper, prototype: &Environment<Self>, rows: &mut [Row<Self>], active: &[bool]);
}

impl Batched for PlanarRobot {
    type Stepper = Fleet;

    fn stepper(prototype: &Environment, integrator: &IntegratorConfig, rows: usize) -> Option<Fleet> {
        integrator.implicit().map(|config| Fleet::new(config, prototype.system(), rows))
    }

    fn step_batch(fleet: &mut Fleet, prototype: &Environment, rows: &mut [Row<Self>], active: &[bool]) {
        fleet.advance(prototype.system(), rows, prototype.rules().period, |row| active[row]);
    }
}

impl Driven for Row<PlanarRobot> {
    type Model = Planar;

    fn body(&self) -> &Body {
        self.environment.model().body()
    }

    fn body_mut(&mut self) -> &mut Body {
        self.environment.model_mut().body_mut()
    }

    fn targets(&self, time: f64, targets: &mut [JointTarget]) {
        self.environment.model().targets(time, targets);
    }

    fn travelling_wave(&self, time: f64) -> Option<WaveJets> {
        self.environment.model().travelling_wave(time)
    }
}

impl Batched for SpatialRobot {
    type Stepper = SpatialFleet;

    fn stepper(prototype: &Environment<Self>, integrator: &IntegratorConfig, rows: usize) -> Option<SpatialFleet> {
        integrator.implicit().map(|config| SpatialFleet::new(config, prototype.model().simulation.system(), rows))
    }

    fn step_batch(fleet: &mut SpatialFleet, prototype: &Environment<Self>, rows: &mut [Row<Self>], active: &[bool]) {
        let system = prototype.model().simulation.system();
        fleet.advance(system, rows, prototype.rules().period, |row| active[row]);
    }
}

impl Driven for Row<SpatialRobot> {
    type Model = Spatial;

    fn body(&self) -> &SpatialBody {
        self.environment.model().simulation.body()
    }

    fn body_mut(&mut self) -> &mut SpatialBody {
        self.environment.model_mut().simulation.body_mut()
    }

    fn targets(&self, time: f64, targets: &mut [CardanTarget]) {
        self.environment.model().reference.targets(time, targets);
    }
}
