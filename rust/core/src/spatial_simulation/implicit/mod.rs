//! The default scheme of the spatial model: implicit stages with exactly eliminated joints.
//!
//! A stage with base q_B, reference momenta p_R and coefficient c solves `M x - p_R = impulses over c`,
//! `q = q_B + c u` (see [`crate::spatial::Stage`]).
//!
//! * Order 1, implicit Euler: one stage (q_A, p_A, h).
//! * Order 2, the L-stable SDIRK with gamma = 1 - 1/sqrt 2 applied to the inclusion itself: stage (q_A, p_A, gamma h)
//!   gives u_1, p_1; stage (q_A + (1 - gamma) h u_1, p_A + (1 - gamma)/gamma (p_1 - p_A), gamma h) gives u_E. The second
//!   reference extrapolates the impulses of the first stage, which is wrong where they change abruptly; such a step is
//!   left undone, halved, and at last taken as Euler steps, as in the planar model.
//!
//! Within [`SpatialImplicit::advance`] the robot is a pose of link 1 and joint angles, so that no joint can open.

mod pegs;
mod stage_work;
mod stepping;
mod warm_start;
mod works;

pub use warm_start::SpatialWarmStart;

use nalgebra::Vector3;

use crate::gait::{CardanReference, CardanTarget};
use crate::spatial::{Screw, SpatialState, Twist, inertia, joint_angle, joint_rate, turning, twist_of};
use crate::stepper::IntegratorConfig;

use super::{SpatialBody, SpatialPlant};

use stepping::Stepping;

/// Workspace of the scheme, for one robot.
#[derive(Debug, Clone)]
pub struct SpatialImplicit {
    config: IntegratorConfig,
    stepping: Stepping,
    /// Time since the robot was placed \[s\].
    elapsed: f64,
    targets: Vec<CardanTarget>,
}

impl SpatialImplicit {
    pub fn new(config: IntegratorConfig, plant: &SpatialPlant) -> Self {
        let config = IntegratorConfig { step: Some(config.step.unwrap_or(STEP)), ..config };
        Self {
            config,
            stepping: Stepping::new(config, plant),
            elapsed: 0.0,
            targets: vec![CardanTarget::default(); plant.robot.joint_count()],
        }
    }

    /// The configuration with this scheme's default step.
    pub fn config(&self) -> &IntegratorConfig {
        &self.config
    }

    /// Forgets all impulses: the robot was placed.
    pub fn clear(&mut self) {
        self.elapsed = 0.0;
        self.stepping.forget();
    }

    /// Integrates over `duration` in equal steps no longer than the configured one.
    pub fn advance(
        &mut self,
        plant: &SpatialPlant,
        body: &mut SpatialBody,
        reference: &impl CardanReference,
        duration: f64,
    ) {
        body.begin();
        if duration <= 0.0 {
            return;
        }
        self.read(plant, body);
        self.settle(body, reference);
        let steps = self.config.steps_in(duration);
        let h = duration / f64::from(steps);
        self.stepping.event_tolerance = self.config.event_tolerance.unwrap_or(JUMP * h * h);
        for k in 1..=steps {
            if self.config.order == 2 {
                self.step(plant, body, reference, h, 0);
            } else {
                self.euler_steps(plant, body, reference, h, 1);
            }
            body.tally.steps += 1;
            body.state.time = body.interval_start() + h * f64::from(k);
            if !self.stepping.speed.is_sane() {
                body.contain();
                self.clear();
                return;
            }
        }
        self.write(plant, body);
    }

    /// One step of second order, divided where that does not do: a step in which forces change abruptly is halved and
    /// halved again, and at last taken as Euler steps. The first steps after the robot was placed are short.
    fn step(
        &mut self,
        plant: &SpatialPlant,
        body: &mut SpatialBody,
        reference: &impl CardanReference,
        h: f64,
        level: usize,
    ) {
        let starts = h > self.config.step() * (START + self.elapsed / START_LASTS);
        if !starts {
            if self.stepping.sdirk_step(plant, body, reference, h) {
                self.elapsed += h;
                return;
            }
            body.tally.events += 1;
            if level >= self.config.event_halvings() {
                self.euler_steps(plant, body, reference, h, self.config.event_steps());
                return;
            }
        }
        self.step(plant, body, reference, 0.5 * h, level + 1);
        self.step(plant, body, reference, 0.5 * h, level + 1);
    }

    /// An interval of length `h` in `count` Euler steps.
    fn euler_steps(
        &mut self,
        plant: &SpatialPlant,
        body: &mut SpatialBody,
        reference: &impl CardanReference,
        h: f64,
        count: u32,
    ) {
        let part = h / f64::from(count);
        for _ in 0..count {
            self.euler_step(plant, body, reference, part, 0);
        }
    }

    /// An Euler step, halved and halved again while links sink.
    fn euler_step(
        &mut self,
        plant: &SpatialPlant,
        body: &mut SpatialBody,
        reference: &impl CardanReference,
        h: f64,
        level: usize,
    ) {
        if self.stepping.euler_step(plant, body, reference, h, level < MAX_HALVINGS) {
            self.elapsed += h;
            return;
        }
        self.euler_step(plant, body, reference, 0.5 * h, level + 1);
        self.euler_step(plant, body, reference, 0.5 * h, level + 1);
    }

    /// Pose of link 1, joint angles, their rates and all momenta from the poses and twists of all links.
    fn read(&mut self, plant: &SpatialPlant, body: &SpatialBody) {
        let (pose, twist) = (&body.state.pose, &body.state.twist);
        let Stepping { posture, speed, momentum, .. } = &mut self.stepping;
        let q = pose[0].orientation.quaternion();
        (posture.position, posture.orientation) = (pose[0].position, [q.w, q.i, q.j, q.k]);
        speed.head = Screw { linear: linear(&twist[0]), angular: pose[0].orientation * turning(&twist[0]) };
        for (j, (angle, rate)) in posture.angle.iter_mut().zip(&mut speed.rate).enumerate() {
            *angle = joint_angle(&pose[j], &pose[j + 1]).into();
            *rate = joint_rate(&pose[j], &twist[j], &pose[j + 1], &twist[j + 1]).into();
        }
        for (i, link) in plant.robot.links.iter().enumerate() {
            let spin = turning(&twist[i]).component_mul(&inertia(link));
            momentum[i] = Screw { linear: linear(&twist[i]) * link.mass, angular: pose[i].orientation * spin };
        }
    }

    /// Poses and twists of all links.
    fn write(&mut self, plant: &SpatialPlant, body: &mut SpatialBody) {
        let SpatialState { pose, twist, .. } = &mut body.state;
        self.stepping.place_links(pose);
        for (i, link) in plant.robot.links.iter().enumerate() {
            let Screw { linear, angular } = &self.stepping.momentum[i];
            let spin = pose[i].orientation.inverse_transform_vector(angular);
            twist[i] = twist_of(linear / link.mass, spin.component_div(&inertia(link)));
        }
    }

    /// A robot that was placed in motion with its reference has no start to resolve.
    fn settle(&mut self, body: &SpatialBody, reference: &impl CardanReference) {
        if self.elapsed > 0.0 {
            return;
        }
        reference.targets(body.state.time, &mut self.targets);
        let (posture, speed) = (&self.stepping.posture, &self.stepping.speed);
        let follows = |(j, target): (usize, &CardanTarget)| {
            [target.yaw, target.pitch].iter().enumerate().all(|(axis, target)| {
                (target.angle - posture.angle[j][axis]).abs() < AT_REFERENCE
                    && (target.rate - speed.rate[j][axis]).abs() < WITH_REFERENCE
            })
        };
        if self.targets.iter().enumerate().all(follows) {
            self.elapsed = START_LASTS;
        }
    }
}

fn linear(twist: &Twist) -> Vector3<f64> {
    twist.fixed_rows::<3>(0).into()
}

/// Deviations from the reference that make no start \[rad\], \[rad/s\].
const AT_REFERENCE: f64 = 1e-3;
const WITH_REFERENCE: f64 = 1e-2;

/// Default step \[s\]: tenths of a millimetre in the peg course, some millimetres in sidewinding, where the
/// indeterminate normal forces leave as much open.
const STEP: f64 = 0.01;

/// Change of acceleration that counts as abrupt \[m/s^2\]. Gentler than in the plane: links touch down all the time.
const JUMP: f64 = 1.0;

/// Length of the first step after a robot was placed, in steps.
const START: f64 = 0.02;

/// Time over which steps then grow to their full length \[s\]: links that their joints set in motion at v come to rest
/// on the ground after about v / (mu g).
const START_LASTS: f64 = 0.2;

/// How often an Euler step in which links sink is halved.
const MAX_HALVINGS: usize = 4;
