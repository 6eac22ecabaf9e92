//! A robot of either model under a script, sample by sample.

use nalgebra::Vector3;
use snake_core::ConfigError;
use snake_core::gait::Reference;
use snake_core::simulation::{Scheme, SchemeConfig, SimulatedModel, Simulation};
use snake_core::stepping::{Record, StepStatistics};

use crate::records::Layout;
use crate::run::{RunConfig, Scripted};
use crate::samples::Samples;

/// A model whose robots follow scripts.
pub trait ScriptedModel: SimulatedModel {
    /// Coordinates of a position, and components of a force.
    const COORDINATES: usize;

    /// References of the joints.
    type Script: Reference<Self::Target>;

    /// Puts the robot in its start posture; returns what its joints follow.
    fn place<S: Scheme<Self>>(
        simulation: &mut Simulation<Self, S>,
        config: &RunConfig,
    ) -> Result<Self::Script, ConfigError>;

    /// See [`Scripted`].
    fn write<S: Scheme<Self>>(simulation: &Simulation<Self, S>, samples: &mut Samples);
    fn write_velocity<S: Scheme<Self>>(simulation: &Simulation<Self, S>, samples: &mut Samples);
    fn layout<S: Scheme<Self>>(simulation: &Simulation<Self, S>) -> Layout;
}

/// A robot of the model with its script.
pub struct ScriptedRobot<M: ScriptedModel, S> {
    simulation: Simulation<M, S>,
    script: M::Script,
}

impl<M: ScriptedModel, S: Scheme<M>> ScriptedRobot<M, S> {
    /// The robot in its start posture, advanced by a method.
    pub fn new(config: &RunConfig, method: &impl SchemeConfig<M, Scheme = S>) -> Result<Self, ConfigError> {
        let mut simulation = Simulation::new(&config.robot, &config.scene(), &config.controller(), method)?;
        let script = M::place(&mut simulation, config)?;
        if config.is_summed() {
            simulation.start_record();
        }
        Ok(Self { simulation, script })
    }
}

impl<M: ScriptedModel, S: Scheme<M>> Scripted for ScriptedRobot<M, S> {
    const COORDINATES: usize = M::COORDINATES;

    fn link_count(&self) -> usize {
        self.simulation.robot().link_count()
    }

    fn parts_of(&self, duration: f64) -> u32 {
        self.simulation.steps_in(duration)
    }

    fn advance(&mut self, duration: f64) -> StepStatistics {
        self.simulation.advance(duration, &self.script)
    }

    fn time(&self) -> f64 {
        self.simulation.state().time
    }

    fn add_contact_impulse(&self, sum: &mut [f64]) {
        add::<M>(sum, self.simulation.contact_impulse());
    }

    fn obstacle_impulse(&self) -> &[Vector3<f64>] {
        self.simulation.obstacle_impulse()
    }

    fn add_self_contact_impulse(&self, sum: &mut [f64]) -> bool {
        add::<M>(sum, self.simulation.self_contact_impulse());
        self.simulation.robot().self_contact
    }

    fn joint_gap(&self) -> f64 {
        self.simulation.joint_gap()
    }

    fn min_gap(&self) -> f64 {
        let outside = self.simulation.min_gap();
        if self.simulation.robot().self_contact { outside.min(self.simulation.self_gap()) } else { outside }
    }

    fn write(&mut self, samples: &mut Samples) {
        M::write(&self.simulation, samples);
        samples.put("energy", &[], [self.simulation.energy()]);
        samples.put_movables(self.simulation.movables());
    }

    fn write_velocity(&mut self, samples: &mut Samples) {
        M::write_velocity(&self.simulation, samples);
        samples.put_movable_velocities(&self.simulation.state().movables);
    }

    fn layout(&self) -> Layout {
        M::layout(&self.simulation)
    }

    fn record_mut(&mut self) -> Option<&mut Record> {
        self.simulation.record_mut()
    }
}

/// Adds vectors to a sum of as many, coordinate by coordinate.
fn add<M: ScriptedModel>(sum: &mut [f64], vectors: &[Vector3<f64>]) {
    let values = vectors.iter().flat_map(|vector| vector.iter().take(M::COORDINATES));
    sum.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
}
