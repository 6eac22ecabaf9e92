//! The robot at its start and the pegs around it, while an episode is laid out.

use nalgebra::Vector2;

use crate::contact::gap;
use crate::environment::start::{Start, StartLine};
use crate::planar::{Pose, assemble_chain};
use crate::robot::Robot;
use crate::scene::Peg;

/// Pegs and posture of the current episode.
#[derive(Debug, Clone)]
pub struct Placement {
    robot: Robot,
    pub pegs: Vec<Peg>,
    joint_angle: Vec<f64>,
    pose: Vec<Pose>,
}

impl Placement {
    pub fn new(robot: &Robot) -> Self {
        Self {
            pegs: Vec::new(),
            joint_angle: vec![0.0; robot.joint_count()],
            pose: vec![Pose::zeros(); robot.link_count()],
            robot: robot.clone(),
        }
    }

    /// The robot's joint angles at its start \[rad\].
    pub fn joint_angle(&self) -> &[f64] {
        &self.joint_angle
    }

    /// Puts the robot at `start` in the posture of the line's gait.
    pub fn assemble(&mut self, line: &StartLine, start: &Start) {
        let angle = line.joint_angles(start.phase);
        self.joint_angle.iter_mut().enumerate().for_each(|(joint, value)| *value = angle(joint));
        let first = Pose::new(start.position.x, start.position.y, start.angle);
        assemble_chain(&self.robot, first, &self.joint_angle, &mut self.pose);
    }

    /// CG of the robot where it is \[m\].
    pub fn gravity_centre(&self) -> Vector2<f64> {
        let links = self.robot.links.iter().zip(&self.pose);
        links.map(|(link, q)| q.xy() * link.mass).sum::<Vector2<f64>>() / self.robot.total_mass()
    }

    /// Smallest gap between the robot and a peg \[m\].
    pub fn gap_to(&self, peg: &Peg) -> f64 {
        let links = self.robot.links.iter().zip(&self.pose);
        links.map(|(link, q)| gap(q, link, peg)).fold(f64::INFINITY, f64::min)
    }

    /// Smallest gap between the robot and any peg of the episode \[m\].
    pub fn smallest_gap(&self) -> f64 {
        self.pegs.iter().map(|peg| self.gap_to(peg)).fold(f64::INFINITY, f64::min)
    }

    /// Makes room for the robot: pegs nearer than `clearance` shrink, pegs that would become smaller than `smallest`
    /// are taken away \[m\].
    pub fn clear_pegs(&mut self, clearance: f64, smallest: f64) {
        let mut pegs = std::mem::take(&mut self.pegs);
        pegs.retain_mut(|peg| {
            peg.radius -= (clearance - self.gap_to(peg)).max(0.0);
            peg.radius >= smallest
        });
        self.pegs = pegs;
    }
}
