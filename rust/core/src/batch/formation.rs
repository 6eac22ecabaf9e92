//! How the robots of a chunk are advanced by a control period: side by side where the model can, else one by one.

use std::fmt::Debug;

use crate::environment::{Environment, Machine, PlanarMachine, SpatialMachine};
use crate::gait::{CardanReference, CardanTarget, JointTarget, WaveJets};
use crate::spatial_simulation::{SpatialBody, SpatialDriven, SpatialFleet};
use crate::stepper::{Body, Driven, Fleet, IntegratorConfig, Method};

use super::chunk::Row;

/// A machine of which many may be advanced side by side.
pub trait Formed: Machine {
    /// Memory to do so.
    type Formation: Debug + Send;

    /// Memory for `rows` robots; `None` where each environment advances its own.
    fn formation(prototype: &Environment<Self>, integrator: &IntegratorConfig, rows: usize) -> Option<Self::Formation>;

    /// Advances the robots of the active rows by a control period.
    fn advance_together(
        formation: &mut Self::Formation,
        prototype: &Environment<Self>,
        rows: &mut [Row<Self>],
        active: &[bool],
    );
}

impl Formed for PlanarMachine {
    type Formation = Fleet;

    fn formation(prototype: &Environment, integrator: &IntegratorConfig, rows: usize) -> Option<Fleet> {
        let laned = integrator.method == Method::Implicit;
        laned.then(|| Fleet::new(*integrator, prototype.plant(), rows))
    }

    fn advance_together(fleet: &mut Fleet, prototype: &Environment, rows: &mut [Row<Self>], active: &[bool]) {
        fleet.advance(prototype.plant(), rows, prototype.rules().period, |row| active[row]);
    }
}

impl Driven for Row<PlanarMachine> {
    fn body(&self) -> &Body {
        self.environment.machine().body()
    }

    fn body_mut(&mut self) -> &mut Body {
        self.environment.machine_mut().body_mut()
    }

    fn targets(&self, time: f64, targets: &mut [JointTarget]) {
        self.environment.machine().targets(time, targets);
    }

    fn travelling_wave(&self, time: f64) -> Option<WaveJets> {
        self.environment.machine().travelling_wave(time)
    }
}

impl Formed for SpatialMachine {
    type Formation = SpatialFleet;

    fn formation(prototype: &Environment<Self>, integrator: &IntegratorConfig, rows: usize) -> Option<SpatialFleet> {
        let laned = integrator.method == Method::Implicit;
        laned.then(|| SpatialFleet::new(*integrator, prototype.machine().simulation.plant(), rows))
    }

    fn advance_together(
        fleet: &mut SpatialFleet,
        prototype: &Environment<Self>,
        rows: &mut [Row<Self>],
        active: &[bool],
    ) {
        let plant = prototype.machine().simulation.plant();
        fleet.advance(plant, rows, prototype.rules().period, |row| active[row]);
    }
}

impl SpatialDriven for Row<SpatialMachine> {
    fn body(&self) -> &SpatialBody {
        self.environment.machine().simulation.body()
    }

    fn body_mut(&mut self) -> &mut SpatialBody {
        self.environment.machine_mut().simulation.body_mut()
    }

    fn targets(&self, time: f64, targets: &mut [CardanTarget]) {
        self.environment.machine().reference.targets(time, targets);
    }
}
