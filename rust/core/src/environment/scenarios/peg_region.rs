//! Where pegs are placed, and in which proportions.

use nalgebra::Vector2;

use crate::environment::config::EnvConfig;
use crate::environment::path::NaturalPath;
use crate::environment::rng::Rng;
use crate::environment::start::StartLine;
use crate::robot::Robot;

/// The area that pegs have to cover and the robot for which they are placed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PegRegion {
    /// Extent along the corridor, from behind the tail to beyond the head at the goal \[m\].
    pub x: [f64; 2],
    /// Centre line of the corridor and distance of the outermost pegs' centres from it \[m\].
    pub centre_line: f64,
    pub half_width: f64,
    /// Start of link 1 and the path it draws from there.
    pub head: [f64; 2],
    pub path: NaturalPath,
    /// Half width of the robot \[m\]; peg radii and distances are in proportion to it.
    pub body_radius: f64,
}

impl PegRegion {
    /// From behind the tail to beyond the head at the goal, half a wave more, and a fifth of the robot's length beside
    /// the corridor.
    pub fn around(line: &StartLine, config: &EnvConfig, robot: &Robot) -> Self {
        let head = line.nominal.position;
        let half_wave = line.path.half_wave();
        let to_head = head.x - line.gravity_centre.x;
        let tail = line.gravity_centre.x - to_head;
        Self {
            x: [tail - half_wave, head.x + config.goal_distance + half_wave],
            centre_line: line.centre_line,
            half_width: config.corridor_half_width + 0.2 * robot.total_length(),
            head: [head.x, head.y],
            path: line.path,
            body_radius: largest_radius(robot),
        }
    }

    /// Lengths relative to Aiko's.
    pub fn scale(&self) -> f64 {
        self.body_radius / AIKO_RADIUS
    }

    /// A random peg radius \[m\]: `largest` (in Aiko's scale) at difficulty zero, from 2 cm on at one.
    pub fn radius(&self, largest: f64, difficulty: f64, rng: &mut Rng) -> f64 {
        self.scale() * rng.uniform(largest - difficulty * (largest - SMALLEST_PEG), largest)
    }

    /// Smallest distance kept between a peg and the robot at the start \[m\].
    pub fn clearance(&self) -> f64 {
        0.002 * self.scale()
    }

    /// Smallest radius of a peg \[m\].
    pub fn smallest_radius(&self) -> f64 {
        self.scale() * SMALLEST_PEG
    }
}

/// Half the width of a robot \[m\].
pub fn largest_radius(robot: &Robot) -> f64 {
    robot.links.iter().map(|link| link.radius).fold(0.0, f64::max)
}

/// The way to a goal point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GoalPath {
    /// CG of the robot at its start; it moves to +x there \[m\].
    pub start: Vector2<f64>,
    /// Length of the way \[m\].
    pub length: f64,
    /// Largest turn of the way, at difficulty one \[rad\].
    pub turn: f64,
}

/// Link radius of Aiko \[m\] (T Table 7.1), for which the lengths of the generators are meant.
const AIKO_RADIUS: f64 = 0.0525;

/// Radii of pegs \[m\]: the smallest of random fields, the one of (T Table 7.5).
pub const SMALLEST_PEG: f64 = 0.02;
pub const LARGEST_PEG: f64 = 0.125;

#[cfg(test)]
pub mod tests {
    use super::*;
    use crate::gait::Wave;
    use crate::robot::RobotConfig;

    /// The region of the default environment.
    pub fn aiko_region() -> PegRegion {
        let line = StartLine::at_origin(Wave::default(), &Robot::new(&RobotConfig::default()).unwrap());
        PegRegion {
            x: [-0.9, 3.0],
            centre_line: line.centre_line,
            half_width: 1.0,
            head: [line.nominal.position.x, line.nominal.position.y],
            path: line.path,
            body_radius: 0.0525,
        }
    }

    /// The way of the default environment.
    pub fn aiko_path() -> GoalPath {
        GoalPath { start: Vector2::zeros(), length: 2.0, turn: std::f64::consts::FRAC_PI_2 }
    }
}
