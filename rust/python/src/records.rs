//! What a run records besides its motion, when it is asked for: optional columns of a `Trajectory`.

use nalgebra::Vector3;
use serde::Deserialize;
use snake_core::robot::{Axes, of_axes};
use snake_core::stepping::{Record, StageRecord};

use crate::samples::Samples;

/// A group of columns, as users name it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Recorded {
    /// Velocities of the links and rates of the joints.
    Velocity,
    /// Forces at every contact of a link with the ground.
    Ground,
    /// Force of every obstacle.
    Obstacles,
    /// Force of every link on every other.
    SelfContacts,
    /// Power of actuators and friction.
    Power,
    /// Power of motors: every run of a robot that has some.
    #[serde(skip)]
    Motors,
}

impl Recorded {
    /// Whether the schemes have to sum something up for it.
    pub fn is_summed(self) -> bool {
        self != Recorded::Velocity
    }
}

/// What a model has of the recorded sums besides the sums themselves.
pub struct Layout {
    /// Components of a force.
    pub coordinates: usize,
    /// Contacts of a link with the ground.
    pub contacts: usize,
    /// Shape of an array of joint angles, and which of two axes each joint has.
    pub joint_shape: Vec<usize>,
    pub axes: Vec<Axes>,
    /// Constant normal force at each contact of each link \[N\]; `None` where it is recorded.
    pub normal: Option<Vec<f64>>,
    /// Place in the scene of each obstacle, by its number.
    pub place: Vec<usize>,
}

/// Sums that the run itself keeps over an interval.
pub struct Sums<'a> {
    /// Impulse of each obstacle, by its number \[N s\].
    pub obstacle_impulse: &'a [Vector3<f64>],
    /// \[J\]
    pub friction_work: f64,
}

/// Writes means over an interval of the length `duration`, and clears the sums; none at the start of a run, where
/// `duration` is zero.
pub fn write_means(
    record: &mut Record,
    wanted: &[Recorded],
    layout: &Layout,
    sums: &Sums<'_>,
    duration: f64,
    samples: &mut Samples,
) {
    let per_second = if duration > 0.0 { 1.0 / duration } else { 0.0 };
    let links = record.sum.ground.len();
    for group in wanted {
        match group {
            Recorded::Velocity => {}
            Recorded::Ground => write_ground(record, layout, links, per_second, samples),
            Recorded::Obstacles => {
                let Layout { place, coordinates, .. } = layout;
                let mut force = vec![0.0; coordinates * place.len()];
                for (place, impulse) in place.iter().zip(sums.obstacle_impulse) {
                    let of_obstacle = force[coordinates * place..].iter_mut().zip(impulse.iter()).take(*coordinates);
                    of_obstacle.for_each(|(force, impulse)| *force = impulse * per_second);
                }
                samples.put("obstacle_force", &[place.len(), *coordinates], force);
            }
            Recorded::SelfContacts => {
                let shape = [links, links, layout.coordinates];
                let force = record.pair.iter().flat_map(|pair| pair.iter().take(layout.coordinates));
                samples.put("pair_force", &shape, force.map(|impulse| impulse * per_second));
            }
            Recorded::Power => {
                let work = record.sum.actuator_work.iter().copied();
                samples.put(
                    "actuator_power",
                    &layout.joint_shape,
                    of_axes(&layout.axes, work).map(|work| work * per_second),
                );
                samples.put("friction_power", &[], [sums.friction_work * per_second]);
            }
            Recorded::Motors => {
                let StageRecord { actuator_work, drawn, .. } = &record.sum;
                for (name, energy) in [("motor_power", actuator_work), ("electrical_power", drawn)] {
                    let power = of_axes(&layout.axes, energy.iter().copied()).map(|energy| energy * per_second);
                    samples.put(name, &layout.joint_shape, power);
                }
            }
        }
    }
    record.clear();
}

fn write_ground(record: &Record, layout: &Layout, links: usize, per_second: f64, samples: &mut Samples) {
    let impulses = || record.sum.ground.iter().flat_map(|link| &link[..layout.contacts]);
    let friction = impulses().flat_map(|impulse| [impulse.x * per_second, impulse.y * per_second]);
    samples.put("ground_friction", &[links, layout.contacts, 2], friction);
    let shape = [links, layout.contacts];
    match &layout.normal {
        Some(normal) => {
            let forces = normal.iter().flat_map(|normal| std::iter::repeat_n(*normal, layout.contacts));
            samples.put("ground_normal", &shape, forces);
        }
        None => samples.put("ground_normal", &shape, impulses().map(|impulse| impulse.z * per_second)),
    }
}
