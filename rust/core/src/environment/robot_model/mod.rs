//! What an environment needs of a robot model; everything else in the environment is the same for every model.

mod accelerometer;
mod common_methods;
mod planar;
mod planar_observation;
mod planar_state;
mod saved_robot;
mod spatial;
mod spatial_observation;
mod spatial_state;

use std::fmt::Debug;

use nalgebra::Vector3;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::error::ConfigError;
use crate::obstacles::PlacedMovable;
use crate::robot::Robot;
use crate::scene::Peg;
use crate::simulation::{SimulatedModel, Simulation};
use crate::stepping::{Driven, PlantParameters, StepStatistics};

use crate::environment::action::ActionEntry;
use crate::environment::config::{EnvConfig, ModelKind};
use crate::environment::motion::Motion;
use crate::environment::observation::BlockRow;
use crate::environment::perception::LinkPose;
use crate::environment::quantity::Quantity;
use crate::environment::raised_chain::RaisedChain;
use crate::environment::signal::Signal;
use crate::environment::start::Start;

pub use planar::{PlanarRobot, PlanarRobotState};
pub use spatial::{Attitude, SpatialRobot, SpatialRobotState};

/// A simulated robot together with the generator of its joint references.
///
/// One control period is `set_action`, `advance`, `finish_period`; everything else reads.
pub trait RobotModel: Clone + Debug + Send + Sync + 'static {
    /// The choice in [`EnvConfig::model`] that this is.
    const KIND: ModelKind;

    /// Rows of the observation: of the body, before those of the task; of contacts and references, after them; and of
    /// sensors that it has on request.
    const OBSERVATION: [&'static [BlockRow<Self>]; 3];

    /// What it reports beside the signals of every environment.
    const SIGNALS: &'static [Signal<Self>];

    /// Quantities that programs outside of the core may read, beside those of every model.
    const STATE: &'static [Quantity<Self>];

    /// The model that is simulated.
    type Model: SimulatedModel;

    /// All that a run changes.
    type State: Clone + Debug + PartialEq + Serialize + DeserializeOwned + Send + Sync;

    /// # Errors
    /// Names the section, the field, the value and what is admissible.
    fn new(config: &EnvConfig) -> Result<Self, ConfigError>;

    fn simulation(&self) -> &Simulation<Self::Model>;

    fn simulation_mut(&mut self) -> &mut Simulation<Self::Model>;

    /// The robot with the references of its joints.
    fn driven(&mut self) -> Driven<'_, Self::Model>;

    fn robot(&self) -> &Robot {
        self.simulation().robot()
    }

    fn pegs(&self) -> &[Peg] {
        self.simulation().pegs()
    }

    /// The obstacles that can be pushed, in the order of the scene, where they are now.
    fn movables(&self) -> impl Iterator<Item = PlacedMovable<'_>> + Clone {
        self.simulation().movables().map(PlacedMovable::new)
    }

    /// The entries of an action.
    fn action_entries(&self) -> &[ActionEntry];

    /// Puts the robot to rest, lying on what is under it in the posture of the gait.
    fn reset(&mut self, start: &Start, joint_angle: &[f64]);

    /// Puts the robot at rest as raised off the ground or tilted, after [`Self::reset`]; models without height have no
    /// such starts.
    fn raise(&mut self, _: &RaisedChain) {}

    /// Turns an action in [-1, 1] into joint references.
    fn set_action(&mut self, action: &[f64]);

    /// Keeps the targets of the joint references for another period.
    fn hold_reference(&mut self);

    /// Sets how the robot differs from the configured one.
    fn set_parameters(&mut self, parameters: PlantParameters) {
        self.simulation_mut().body_mut().parameters = parameters;
    }

    /// Length of a control period \[s\].
    fn period(&self) -> f64;

    /// Advances the robot by a control period.
    fn advance(&mut self);

    /// Changes the momentum of a link by an impulse at its CG, frame I \[N s\]; the next step passes it on along the chain.
    fn strike(&mut self, link: usize, impulse: &Vector3<f64>);

    /// Ends a control period.
    fn finish_period(&mut self);

    /// What happened while it was advanced.
    fn report(&self) -> StepStatistics {
        self.simulation().body().statistics
    }

    /// Mean force of the obstacles on each link over the last control period (T 7.6), world frame; without a z part in the
    /// plane \[N\].
    fn contact_force(&self) -> impl ExactSizeIterator<Item = Vector3<f64>> + '_ {
        mean_force(self.simulation().contact_impulse(), self.period())
    }

    /// The same of the robot's other links \[N\].
    fn self_contact_force(&self) -> impl ExactSizeIterator<Item = Vector3<f64>> + '_ {
        mean_force(self.simulation().self_contact_impulse(), self.period())
    }

    /// Whether an obstacle pressed on a link in the last control period.
    fn is_pressed(&self, link: usize) -> bool {
        self.simulation().contact_impulse()[link] != Vector3::zeros()
    }

    /// The largest of [`Self::self_contact_force`] \[N\].
    fn largest_self_contact_force(&self) -> f64 {
        self.self_contact_force().map(|force| force.norm_squared()).fold(0.0, f64::max).sqrt()
    }

    fn motion(&self) -> Motion;

    /// Kinetic and potential energy, the latter zero with every CG at the height of the origin \[J\].
    fn energy(&self) -> f64 {
        self.simulation().energy()
    }

    /// Number of joint angles.
    fn joint_coordinates(&self) -> usize;

    /// Joint angles \[rad\] and their rates \[rad/s\], `joint_coordinates` each.
    fn read_joints(&self, angle: &mut [f64], rate: &mut [f64]);

    /// A link seen from above; the one with index 0 leads.
    fn link(&self, index: usize) -> LinkPose;

    /// Height of a link's CG, zero in the plane \[m\].
    fn height(&self, _: usize) -> f64 {
        0.0
    }

    fn save(&self) -> Self::State;

    /// Continues from a saved state; false if it is of another robot or action mode.
    fn restore(&mut self, state: &Self::State) -> bool;

    /// Number of links of the robot that a state was saved of.
    fn links_of(state: &Self::State) -> usize;
}

/// Of impulses over a period; most links have none.
fn mean_force(impulses: &[Vector3<f64>], period: f64) -> impl ExactSizeIterator<Item = Vector3<f64>> + '_ {
    let mean = move |impulse: &Vector3<f64>| if *impulse == Vector3::zeros() { *impulse } else { impulse / period };
    impulses.iter().map(mean)
}
