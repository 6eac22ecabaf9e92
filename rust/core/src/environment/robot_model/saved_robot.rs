//! All that a run changes about a robot of any model.

use std::sync::Arc;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::environment::reference::{ReferenceGenerator, ReferenceState};
use crate::obstacles::{Obstacle, ObstacleGrid, SavedObstacle};
use crate::robot::Axes;
use crate::simulation::{SimulatedModel, Simulation, Snapshot};
use crate::stepping::LinkImpulses;

use super::accelerometer::Accelerometer;

/// State of the simulation `S`, joint references, obstacles, and what happened in the last control period.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SavedRobot<S> {
    /// Of its joints.
    axes: Vec<Axes>,
    simulation: S,
    reference: ReferenceState,
    obstacles: Vec<SavedObstacle>,
    accelerometer: Accelerometer,
    impulses: LinkImpulses,
    /// Of each obstacle, by its number \[N s\].
    obstacle_impulse: Vec<Vector3<f64>>,
}

impl<M: SimulatedModel> SavedRobot<Snapshot<M>> {
    pub fn save<const AXES: usize>(
        simulation: &Simulation<M>,
        reference: &ReferenceGenerator<AXES>,
        accelerometer: &Accelerometer,
    ) -> Self {
        Self {
            axes: simulation.robot().axes.clone(),
            simulation: simulation.snapshot(),
            reference: reference.state().clone(),
            obstacles: simulation.body().obstacles.obstacles().into_iter().map(SavedObstacle).collect(),
            accelerometer: *accelerometer,
            impulses: simulation.body().impulses.clone(),
            obstacle_impulse: simulation.obstacle_impulse().to_vec(),
        }
    }

    /// Continues from this state; false, and nothing changes, if it is of another robot or action mode.
    pub fn restore<const AXES: usize>(
        &self,
        simulation: &mut Simulation<M>,
        reference: &mut ReferenceGenerator<AXES>,
        accelerometer: &mut Accelerometer,
    ) -> bool {
        let links = simulation.robot().link_count();
        if !self.obstacles.iter().all(|SavedObstacle(obstacle)| obstacle.validate().is_ok()) {
            return false;
        }
        let obstacles = self.obstacles(&simulation.body().obstacles);
        let fits = self.links() == Some(links)
            && self.axes == simulation.robot().axes
            && self.simulation.fits(links, &obstacles)
            && self.obstacle_impulse.len() == obstacles.total()
            && reference.restore(&self.reference);
        if fits {
            simulation.set_obstacles(obstacles);
            simulation.restore(&self.simulation);
            *accelerometer = self.accelerometer;
            let body = simulation.body_mut();
            body.impulses.clone_from(&self.impulses);
            body.obstacle_impulse.replace(&self.obstacle_impulse);
        }
        fits
    }

    /// The saved obstacles, which may be those that are there.
    fn obstacles(&self, present: &Arc<ObstacleGrid>) -> Arc<ObstacleGrid> {
        let saved: Vec<Obstacle> = self.obstacles.iter().map(|SavedObstacle(obstacle)| obstacle.clone()).collect();
        if present.obstacles() == saved { present.clone() } else { ObstacleGrid::of(&saved).into() }
    }

    /// Number of links of the robot, if all lists of impulses agree on it.
    pub fn links(&self) -> Option<usize> {
        self.impulses.links()
    }
}
