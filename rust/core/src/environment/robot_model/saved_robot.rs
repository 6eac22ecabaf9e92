//! All that a run changes about a robot of any model.

use std::fmt::Debug;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::environment::reference::{ReferenceGenerator, ReferenceState};
use crate::obstacles::SavedObstacle;
use crate::pegs::PegGrid;
use crate::scene::Peg;
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
    simulation: S,
    reference: ReferenceState,
    pegs: Vec<Peg>,
    /// All obstacles, where they are not only pegs without friction.
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
            simulation: simulation.snapshot(),
            reference: reference.state().clone(),
            pegs: simulation.pegs().to_vec(),
            obstacles: simulation.body().pegs.written().iter().map(SavedObstacle::from).collect(),
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
        let obstacles = self.pegs.len().max(self.obstacles.len());
        let fits = self.links() == Some(links)
            && self.simulation.fits(links, obstacles)
            && self.obstacle_impulse.len() == obstacles
            && self.obstacles.iter().all(SavedObstacle::is_valid)
            && reference.restore(&self.reference);
        if fits {
            if self.obstacles.is_empty() {
                simulation.set_scene_pegs(&self.pegs);
            } else {
                let obstacles: Vec<_> = self.obstacles.iter().cloned().map(Into::into).collect();
                if simulation.body().pegs.written() != obstacles {
                    simulation.set_obstacles(PegGrid::of(&obstacles).into());
                }
            }
            simulation.restore(&self.simulation);
            forces.clone_from(&self.forces);
            simulation.body_mut().obstacle_impulse.replace(&self.obstacle_impulse);
        }
        fits
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
