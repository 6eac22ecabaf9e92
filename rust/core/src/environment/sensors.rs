//! Measured motion and obstacles: the true ones with the noise of the robot's sensors.

use crate::obstacles::ObstacleGrid;

use super::config::EnvConfig;
use super::episode::Episode;
use super::motion::Motion;
use super::randomization::Randomization;
use super::rng::Rng;
use super::robot_model::RobotModel;

/// Measurements at a control instant.
#[derive(Debug, Clone)]
pub struct Sensors {
    randomization: Randomization,
    /// Angle between two marks of the joint encoders, zero for exact ones \[rad\].
    resolution: f64,
    /// The link with the range finder.
    pub range_link: usize,
    pub joint_angle: Vec<f64>,
    pub joint_rate: Vec<f64>,
    pub motion: Motion,
    /// Position of the CG to the left of the centre line \[m\].
    pub lateral_offset: f64,
    /// Share of the way to the goal that is left.
    pub remaining: f64,
    /// The obstacles as located; empty where they are located without error.
    obstacles: ObstacleGrid,
}

impl Sensors {
    pub fn new(config: &EnvConfig, joint_coordinates: usize, motion: Motion) -> Self {
        let (joint_angle, joint_rate) = (vec![0.0; joint_coordinates], vec![0.0; joint_coordinates]);
        Self {
            randomization: config.randomization,
            resolution: config.encoder_resolution,
            range_link: config.range_link,
            joint_angle,
            joint_rate,
            motion,
            lateral_offset: 0.0,
            remaining: 1.0,
            obstacles: ObstacleGrid::default(),
        }
    }

    /// Begins an episode among `obstacles`.
    pub fn begin(&mut self, obstacles: &ObstacleGrid, rng: &mut Rng) {
        if self.randomization.peg_error > 0.0 {
            let mut located = obstacles.pegs().to_vec();
            self.randomization.misplace(rng, &mut located);
            self.obstacles.rebuild(&located);
        }
    }

    /// The obstacles as the robot's sensors report them.
    pub fn obstacles<'a>(&'a self, obstacles: &'a ObstacleGrid) -> &'a ObstacleGrid {
        if self.obstacles.is_empty() { obstacles } else { &self.obstacles }
    }

    /// Measures; noise is drawn from `rng` if there is any.
    pub fn measure(&mut self, model: &impl RobotModel, episode: &Episode, rng: impl FnOnce() -> Rng) {
        model.read_joints(&mut self.joint_angle, &mut self.joint_rate);
        self.motion = episode.motion;
        self.lateral_offset = episode.summary.lateral_offset;
        self.remaining = episode.remaining();
        if !self.randomization.noise.is_silent() {
            self.disturb(episode.goal.span(), &mut rng());
        }
        if self.resolution > 0.0 {
            let marks = self.joint_angle.iter_mut();
            marks.for_each(|angle| *angle = (*angle / self.resolution).round() * self.resolution);
        }
    }

    /// (T 7.9)-(T 7.14); the position counts along the goal direction and across it.
    fn disturb(&mut self, span: f64, rng: &mut Rng) {
        let noise = &self.randomization.noise;
        self.remaining += rng.around_zero(noise.position) / span;
        self.lateral_offset += rng.around_zero(noise.position);
        self.motion.heading += rng.around_zero(noise.heading);
        self.motion.velocity.x += rng.around_zero(noise.velocity);
        self.motion.velocity.y += rng.around_zero(noise.velocity);
        self.motion.yaw_rate += rng.around_zero(noise.yaw_rate);
        self.joint_angle.iter_mut().for_each(|angle| *angle += rng.around_zero(noise.joint_angle));
        self.joint_rate.iter_mut().for_each(|rate| *rate += rng.around_zero(noise.joint_rate));
    }
}
