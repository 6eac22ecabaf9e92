//! The robot at its start and the pegs around it, while an episode is laid out.

use std::collections::BTreeSet;
use std::sync::Arc;

use nalgebra::Vector2;

use crate::contact::{gap, wall_gap};
use crate::environment::raised_chain::{Raised, RaisedChain};
use crate::environment::start::{Start, StartJitter, StartLine};
use crate::obstacles::{Obstacle, ObstacleGrid, Shape};
use crate::planar::{Pose, assemble_chain};
use crate::robot::Robot;
use crate::scene::Peg;

/// Pegs and posture of the current episode.
#[derive(Debug, Clone)]
pub struct Placement {
    /// Shared by copies.
    robot: Arc<Robot>,
    /// The drawn ones.
    pub pegs: Vec<Peg>,
    /// The obstacles of a prescribed scene, which replace them.
    scene: Option<Arc<ObstacleGrid>>,
    /// Workspace: the pegs in a grid.
    grid: ObstacleGrid,
    joint_angle: Vec<f64>,
    pose: Vec<Pose>,
    /// The robot of the spatial model where it does not lie flat; `pose` then counts for nothing.
    raised: Option<RaisedChain>,
}

impl Placement {
    pub fn new(robot: &Robot) -> Self {
        Self {
            pegs: Vec::new(),
            scene: None,
            grid: ObstacleGrid::default(),
            joint_angle: vec![0.0; robot.joint_count()],
            pose: vec![Pose::zeros(); robot.link_count()],
            raised: None,
            robot: Arc::new(robot.clone()),
        }
    }

    /// Begins an episode in a prescribed scene, or whose pegs are drawn.
    pub fn set_scene(&mut self, scene: Option<Arc<ObstacleGrid>>) {
        self.scene = scene;
    }

    /// The prescribed scene.
    pub fn scene(&self) -> Option<&Arc<ObstacleGrid>> {
        self.scene.as_ref()
    }

    pub fn robot(&self) -> &Robot {
        &self.robot
    }

    /// The robot's joint angles at its start \[rad\].
    pub fn joint_angle(&self) -> &[f64] {
        &self.joint_angle
    }

    /// The robot of the spatial model at its start, if it does not lie flat there.
    pub fn raised(&self) -> Option<&RaisedChain> {
        self.raised.as_ref()
    }

    /// Puts the robot flat at `start` in the posture of the line's gait.
    pub fn assemble(&mut self, line: &StartLine, start: &Start) {
        let angles = line.joint_angles(&self.robot, start.phase);
        self.joint_angle.iter_mut().zip(angles).for_each(|(value, angle)| *value = angle);
        self.lay_flat(start);
    }

    /// Puts the robot flat, straight or bent as prescribed, CG and absolute angle of link 1 as at `start`.
    pub fn assemble_posture(&mut self, start: &Start, joint_angle: &[f64]) {
        self.joint_angle.copy_from_slice(joint_angle);
        self.lay_flat(start);
    }

    fn lay_flat(&mut self, start: &Start) {
        let first = Pose::new(start.position.x, start.position.y, start.angle);
        assemble_chain(&self.robot, first, &self.joint_angle, &mut self.pose);
        self.raised = None;
    }

    /// Raises the robot that lies at `start`.
    pub fn raise(&mut self, start: &Start, raised: &Raised) {
        self.raised = Some(RaisedChain::new(&self.robot, start, &self.joint_angle, raised));
    }

    /// Puts the robot as a chain that does not lie flat.
    pub fn set_raised(&mut self, chain: RaisedChain) {
        self.joint_angle.iter_mut().zip(&chain.joint_angle).for_each(|(yaw, angle)| *yaw = angle.x);
        self.raised = Some(chain);
    }

    /// The start nearest to the full deviation, in halvings, that clears the pegs, or else the nominal one.
    pub fn free_start(&mut self, line: &StartLine, jitter: &StartJitter) -> Start {
        let mut factor = 1.0;
        while factor > SMALLEST_JITTER {
            let start = line.deviated(&self.robot, &jitter.scaled(factor));
            self.assemble(line, &start);
            if self.smallest_gap() > CLEARANCE {
                return start;
            }
            factor *= 0.5;
        }
        self.assemble(line, &line.nominal);
        line.nominal
    }

    /// CG of the robot where it is \[m\].
    pub fn gravity_centre(&self) -> Vector2<f64> {
        if let Some(chain) = &self.raised {
            return chain.gravity_centre(&self.robot).xy();
        }
        let links = self.robot.links.iter().zip(&self.pose);
        links.map(|(link, q)| q.xy() * link.mass).sum::<Vector2<f64>>() / self.robot.total_mass()
    }

    /// Smallest gap between the robot and a peg \[m\].
    pub fn gap_to(&self, peg: &Peg) -> f64 {
        if let Some(chain) = &self.raised {
            return chain.gap_to_peg(&self.robot, peg);
        }
        let links = self.robot.links.iter().zip(&self.pose);
        links.map(|(link, q)| gap(q, link, peg)).fold(f64::INFINITY, f64::min)
    }

    /// Smallest gap between the robot and an obstacle, a ball as seen from above; infinite where a wall is out of reach \[m\].
    pub fn gap_to_obstacle(&self, obstacle: &Obstacle) -> f64 {
        match &obstacle.shape {
            Shape::Circle(peg) => self.gap_to(peg),
            &Shape::Sphere { radius, centre: [x, y, _], .. } => self.gap_to(&Peg { radius, x, y }),
            shape => self.gap_to_walls(&ObstacleGrid::of(&[Obstacle::endless(shape.clone())])),
        }
    }

    /// Smallest gap between the robot and any obstacle of the episode; of those of a prescribed scene only the ones
    /// in reach count \[m\].
    pub fn smallest_gap(&self) -> f64 {
        match &self.scene {
            None => self.pegs.iter().map(|peg| self.gap_to(peg)).fold(f64::INFINITY, f64::min),
            Some(scene) => {
                let near = self.within_reach(scene, 2.0 * CLEARANCE).into_iter();
                near.map(|place| self.gap_to_obstacle(&scene.obstacle(place))).fold(f64::INFINITY, f64::min)
            }
        }
    }

    /// Places in a scene of the obstacles that may lie within `margin` of the robot, in order.
    pub fn within_reach(&self, scene: &ObstacleGrid, margin: f64) -> BTreeSet<usize> {
        let mut places = BTreeSet::new();
        for (i, link) in self.robot.links.iter().enumerate() {
            let centre = self.raised.as_ref().map_or(self.pose[i].xy(), |chain| chain.pose[i].position.xy());
            scene.visit_obstacles(&centre, link.reach() + margin, |obstacle| {
                places.insert(scene.index_in_scene(obstacle));
            });
            for (k, movable) in scene.movables().iter().enumerate() {
                if (Vector2::from(movable.start) - centre).norm() < link.reach() + movable.link.reach() + margin {
                    places.insert(scene.index_in_scene(scene.len() + k));
                }
            }
        }
        places
    }

    /// Smallest gap between the robot and the ground, where it does not lie flat \[m\].
    pub fn gap_to_ground(&self) -> f64 {
        self.raised.as_ref().map_or(0.0, |chain| chain.gap_to_ground(&self.robot))
    }

    fn gap_to_walls(&self, grid: &ObstacleGrid) -> f64 {
        if let Some(chain) = &self.raised {
            let walls = grid.walls().walls().iter();
            return walls.map(|wall| chain.gap_to_wall(&self.robot, &wall.polygon)).fold(f64::INFINITY, f64::min);
        }
        let links = self.robot.links.iter().zip(&self.pose);
        links.map(|(link, q)| wall_gap(q, link, grid)).fold(f64::INFINITY, f64::min)
    }

    /// Makes room for the robot: pegs nearer than `clearance` shrink, pegs that would become smaller than `smallest`
    /// are taken away \[m\].
    pub fn clear_pegs(&mut self, clearance: f64, smallest: f64) {
        self.grid.rebuild(&self.pegs);
        for place in self.within_reach(&self.grid, 2.0 * clearance) {
            let gap = self.gap_to(&self.pegs[place]);
            self.pegs[place].radius -= (clearance - gap).max(0.0);
        }
        self.pegs.retain(|peg| peg.radius >= smallest);
    }
}

/// Gap that a start keeps to the pegs of a course \[m\].
pub const CLEARANCE: f64 = 5e-4;

/// Share of the drawn jitter below which the nominal start is taken.
const SMALLEST_JITTER: f64 = 0.01;
