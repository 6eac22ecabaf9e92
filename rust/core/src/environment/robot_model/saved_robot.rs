//! All that a run changes about a robot of any model.

use std::fmt::Debug;
use std::sync::Arc;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::environment::reference::{ReferenceGenerator, ReferenceState};
use crate::obstacles::{Obstacle, ObstacleGrid, SavedObstacle};
use crate::robot::Axes;
use crate::simulation::{SimulatedModel, Simulation, Snapshot};

/// Mean forces on each link over the last control period.
pub trait MeanForces: Clone + Debug {
    /// Of a robot of `links` links that nothing touches.
    fn zero(links: usize) -> Self;

    fn clear(&mut self);

    /// Number of links, if all lists have as many entries.
    fn links(&self) -> Option<usize>;
}

/// State of the simulation `S`, joint references, obstacles and mean forces `F`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SavedRobot<S, F> {
    /// Of its joints.
    axes: Vec<Axes>,
    simulation: S,
    reference: ReferenceState,
    obstacles: Vec<SavedObstacle>,
    forces: F,
    /// Of each obstacle over the last control period, by its number \[N s\].
    obstacle_impulse: Vec<Vector3<f64>>,
}

impl<M: SimulatedModel, F: MeanForces> SavedRobot<Snapshot<M>, F> {
    pub fn save<const AXES: usize>(
        simulation: &Simulation<M>,
        reference: &ReferenceGenerator<AXES>,
        forces: &F,
    ) -> Self {
        Self {
            axes: simulation.robot().axes.clone(),
            simulation: simulation.snapshot(),
            reference: reference.state().clone(),
            obstacles: simulation.body().obstacles.obstacles().into_iter().map(SavedObstacle).collect(),
            forces: forces.clone(),
            obstacle_impulse: simulation.obstacle_impulse().to_vec(),
        }
    }

    /// Continues from this state; false, and nothing changes, if it is of another robot or action mode.
    pub fn restore<const AXES: usize>(
        &self,
        simulation: &mut Simulation<M>,
        reference: &mut ReferenceGenerator<AXES>,
        forces: &mut F,
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
            forces.clone_from(&self.forces);
            simulation.body_mut().obstacle_impulse.replace(&self.obstacle_impulse);
        }
        fits
    }

    /// The saved obstacles, which may be those that are there.
    fn obstacles(&self, present: &Arc<ObstacleGrid>) -> Arc<ObstacleGrid> {
        let saved: Vec<Obstacle> = self.obstacles.iter().map(|SavedObstacle(obstacle)| obstacle.clone()).collect();
        if present.obstacles() == saved { present.clone() } else { ObstacleGrid::of(&saved).into() }
    }

    /// Number of links of the robot, if all lists of forces agree on it.
    pub fn links(&self) -> Option<usize> {
        self.forces.links()
    }
}

/// The common length of lists, if they have one.
pub fn common_length<const N: usize>(lengths: [usize; N]) -> Option<usize> {
    lengths.windows(2).all(|pair| pair[0] == pair[1]).then(|| lengths[0])
}
