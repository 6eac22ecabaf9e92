//! Whole scenes as a handful of numbers: drawn at random here, by a property test elsewhere.

use snake_core::contact::{gap, self_gap};
use snake_core::control::ControllerConfig;
use snake_core::environment::rng::Rng;
use snake_core::gait::Wave;
use snake_core::planar::{Pose, assemble_chain};
use snake_core::robot::{Robot, RobotConfig};
use snake_core::scene::{Peg, SceneConfig};
use snake_core::stepping::ImplicitConfig;

use crate::case::{Case, Motion, weighted};
use crate::stages::magnitude;

/// Distance of the links from pegs and from each other at the start \[m\].
const CLEARANCE: f64 = 1e-4;

/// Largest k_P over the weight of the lightest link \[N m/rad\]. Pegs that divide a step resolve the oscillation of that
/// link, whose rate of 0.7 sqrt(k_P / I) has to stay below what is taken for a diverged computation.
const STIFFEST: f64 = 1e8;

/// What makes up a scene; every field is admissible by itself.
#[derive(Debug, Clone, PartialEq)]
pub struct Draw {
    /// At least 2.
    pub links: usize,
    /// Mass of link i over that of Aiko's; taken in turns.
    pub weights: Vec<f64>,
    pub friction: [f64; 2],
    pub kp: f64,
    pub kd: f64,
    pub torque_limit: Option<f64>,
    pub wave: Wave,
    /// Angle of the joints at the start, taken in turns \[rad\].
    pub bends: Vec<f64>,
    pub velocity: [f64; 2],
    /// Radius and place relative to the robot's box; those that touch the robot are left out.
    pub pegs: Vec<[f64; 3]>,
    pub step: f64,
    pub order: u32,
    pub tolerance: f64,
}

impl Draw {
    /// Scene `index` of the family `seed`.
    pub fn random(seed: u64, index: u64) -> Self {
        let random = &mut Rng::new(seed, index);
        let links = [2, 3, 5, 8, 11, 20][random.index(6)];
        let ratio = [1.0, 10.0, 1e4][random.index(3)];
        let count = [0, 5, 20, 60][random.index(4)];
        let mu = |random: &mut Rng| if random.chance(0.1) { 0.0 } else { magnitude(random, 1e-3, 10.0) };
        let friction = if random.chance(0.5) { [mu(random); 2] } else { [mu(random), mu(random)] };
        let speed = if random.chance(0.5) { 0.0 } else { magnitude(random, 1e-3, 5.0) };
        Self {
            links,
            weights: (0..links).map(|_| magnitude(random, 1.0 / ratio, 1.0)).collect(),
            friction,
            kp: if random.chance(0.1) { 0.0 } else { magnitude(random, 1.0, 1e6) },
            kd: if random.chance(0.1) { 0.0 } else { magnitude(random, 1e-2, 1e2) },
            torque_limit: random.chance(0.5).then(|| magnitude(random, 1e-2, 30.0)),
            wave: Wave {
                amplitude: random.uniform(0.0, 1.0),
                omega: magnitude(random, 0.1, 20.0),
                beta: random.around_zero(1.5),
                gamma: random.around_zero(0.2),
                phase: 0.0,
            },
            bends: (0..links).map(|_| random.around_zero(0.6)).collect(),
            velocity: [random.around_zero(speed), random.around_zero(speed)],
            pegs: (0..count).map(|_| [magnitude(random, 2e-3, 0.2), random.unit(), random.unit()]).collect(),
            step: [1e-3, 5e-3, 1e-2, 2.5e-2, 5e-2][random.index(5)],
            order: 1 + random.index(2) as u32,
            tolerance: [1e-6, 1e-8][random.index(2)],
        }
    }

    /// The scene, to be run for `duration` \[s\].
    pub fn case(&self, name: impl Into<String>, duration: f64) -> Case {
        let robot = weighted(self.links, |i| self.weights[i % self.weights.len()]);
        let posture = self.clear_posture(&robot);
        Case {
            name: name.into(),
            scene: SceneConfig {
                obstacles: self.clear_pegs(&robot, &posture).into_iter().map(Into::into).collect(),
                friction: self.friction,
                ..SceneConfig::default()
            },
            robot,
            controller: ControllerConfig {
                kp: self.kp.min(STIFFEST * self.weights.iter().copied().fold(1.0, f64::min)),
                kd: self.kd,
                torque_limit: self.torque_limit,
                ..ControllerConfig::default()
            },
            integrator: ImplicitConfig {
                step: Some(self.step),
                order: self.order,
                tolerance: Some(self.tolerance),
                ..ImplicitConfig::default()
            },
            motion: Motion::Wave(self.wave),
            place: [0.0; 3],
            posture: Some(posture),
            velocity: self.velocity,
            duration,
        }
    }

    /// Angles of the joints, halved until no two links overlap: undoing such a start moves the robot by itself.
    fn clear_posture(&self, robot: &RobotConfig) -> Vec<f64> {
        let mut posture: Vec<f64> = (0..self.links - 1).map(|i| self.bends[i % self.bends.len()]).collect();
        let robot = Robot::new(robot).expect("an admissible robot");
        while self_gap(&robot.links, &self.poses(&robot, &posture), 0.0) < CLEARANCE {
            posture.iter_mut().for_each(|angle| *angle *= 0.5);
        }
        posture
    }

    fn poses(&self, robot: &Robot, posture: &[f64]) -> Vec<Pose> {
        let mut poses = vec![Pose::zeros(); self.links];
        assemble_chain(robot, Pose::zeros(), posture, &mut poses);
        poses
    }

    fn clear_pegs(&self, robot: &RobotConfig, posture: &[f64]) -> Vec<Peg> {
        let robot = Robot::new(robot).expect("an admissible robot");
        let poses = self.poses(&robot, posture);
        let low = poses.iter().fold([0.0_f64; 2], |low, q| [low[0].min(q.x), low[1].min(q.y)]);
        let high = poses.iter().fold([0.0_f64; 2], |high, q| [high[0].max(q.x), high[1].max(q.y)]);
        let place = |axis: usize, part: f64| low[axis] - 0.3 + part * (high[axis] - low[axis] + 0.6);
        let pegs = self.pegs.iter().map(|&[radius, x, y]| Peg { radius, x: place(0, x), y: place(1, y) });
        let touches = |peg: &Peg| poses.iter().zip(&robot.links).any(|(pose, link)| gap(pose, link, peg) < CLEARANCE);
        pegs.filter(|peg| !touches(peg)).collect()
    }
}
