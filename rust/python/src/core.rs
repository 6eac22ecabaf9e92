//! The batch of the core behind a Python object: one of the two models, chosen at construction.

use snake_core::ConfigError;
use snake_core::batch::Batch;
use snake_core::environment::signal::SignalKind;
use snake_core::environment::{EnvConfig, ModelKind, PlanarRobot, SpatialRobot};

/// A batch of either model.
pub enum Core {
    Planar(Box<Batch<PlanarRobot>>),
    Spatial(Box<Batch<SpatialRobot>>),
}

/// Evaluates an expression with the batch of a [`Core`], whichever it is.
macro_rules! of_model {
    ($core:expr, $batch:ident => $value:expr) => {
        match $core {
            $crate::core::Core::Planar($batch) => $value,
            $crate::core::Core::Spatial($batch) => $value,
        }
    };
}
pub(crate) use of_model;

impl Core {
    pub fn new(config: &EnvConfig, num_envs: usize, num_threads: usize) -> Result<Self, ConfigError> {
        Ok(match config.model {
            ModelKind::Planar => Core::Planar(Box::new(Batch::new(config, num_envs, num_threads)?)),
            ModelKind::Spatial => Core::Spatial(Box::new(Batch::new(config, num_envs, num_threads)?)),
        })
    }

    pub fn num_envs(&self) -> usize {
        of_model!(self, batch => batch.num_envs())
    }

    pub fn num_threads(&self) -> usize {
        of_model!(self, batch => batch.num_threads())
    }

    pub fn observation_size(&self) -> usize {
        of_model!(self, batch => batch.observation_size())
    }

    pub fn action_size(&self) -> usize {
        of_model!(self, batch => batch.action_size())
    }

    /// Rows of the signals of a kind, in order.
    pub fn rows_of(&self, kind: SignalKind) -> Vec<usize> {
        let rows = |kinds: &mut dyn Iterator<Item = SignalKind>| {
            kinds.enumerate().filter(|(_, one)| *one == kind).map(|(row, _)| row).collect()
        };
        of_model!(self, batch => rows(&mut batch.signals().iter().map(|signal| signal.kind)))
    }

    pub fn signal_count(&self) -> usize {
        of_model!(self, batch => batch.signals().len())
    }
}
