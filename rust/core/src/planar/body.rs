use std::borrow::BorrowMut;

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

use crate::contact::NearPegs;
use crate::gait::{JointReference, JointTarget, WaveJets};
use crate::pegs::PegGrid;
use crate::planar::{PlanarState, Pose, Twist, assemble_chain};
use crate::robot::Robot;

use crate::stepping::Tally;

use super::{Pace, Plant, Variation};

/// What one stage hands to the next: forces as a first guess, and which contacts were closed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WarmStart {
    /// Friction force on each link in its own frame \[N\].
    pub friction: Vec<Vector2<f64>>,
    /// tau_C of each joint at the end of the last step, thesis sign (T 3.51) \[N m\].
    pub joint_torque: Vec<f64>,
    pub near: NearPegs,
    /// Where each joint stands in its free play, phi less the motor's angle \[rad\].
    pub play: Vec<f64>,
    /// Whether a part of the last step had to be retaken because a peg's force changed abruptly.
    pub rough: bool,
    /// Time since the robot was placed \[s\].
    pub elapsed: f64,
    /// Step control of the adaptive scheme.
    pub pace: Pace,
}

impl WarmStart {
    pub fn new(links: usize) -> Self {
        Self {
            friction: vec![Vector2::zeros(); links],
            joint_torque: vec![0.0; links - 1],
            near: NearPegs::with_capacity(links),
            play: vec![0.0; links - 1],
            rough: false,
            elapsed: 0.0,
            pace: Pace::default(),
        }
    }

    pub fn clear(&mut self) {
        self.friction.fill(Vector2::zeros());
        self.joint_torque.fill(0.0);
        self.near.clear();
        self.play.fill(0.0);
        self.rough = false;
        self.elapsed = 0.0;
        self.pace = Pace::default();
    }
}

/// One robot among its pegs, as the schemes see it.
#[derive(Debug, Clone)]
pub struct Body {
    pub state: PlanarState,
    pub pegs: PegGrid,
    pub warm_start: WarmStart,
    pub variation: Variation,
    pub tally: Tally,
    /// The state became absurd during the present interval; it is the last good one.
    pub diverged: bool,
    /// Linear solves of the last stage.
    pub(super) effort: u32,
    /// Whether the state is still that of a robot; schemes tell.
    pub(super) sane: bool,
    /// State at the last instant known to be good.
    last_good: PlanarState,
}

impl Body {
    pub fn new(robot: &Robot, pegs: PegGrid) -> Self {
        let links = robot.link_count();
        Self {
            state: PlanarState::zero(links),
            pegs,
            warm_start: WarmStart::new(links),
            variation: Variation::default(),
            tally: Tally::new(links),
            diverged: false,
            effort: 0,
            sane: true,
            last_good: PlanarState::zero(links),
        }
    }

    /// Forgets impulses and counters; the present state counts as good.
    pub fn forget(&mut self) {
        self.last_good.copy_from(&self.state);
        self.warm_start.clear();
        self.tally.clear();
        self.diverged = false;
    }

    /// Free play of the robot's joints \[rad\].
    pub fn free_play(&self, plant: &Plant) -> f64 {
        plant.robot.free_play + self.variation.free_play
    }

    /// Begins an interval of integration.
    pub fn begin(&mut self) {
        self.last_good.copy_from(&self.state);
        self.tally.clear();
        self.diverged = false;
    }

    /// Time at which the present interval began \[s\].
    pub fn interval_start(&self) -> f64 {
        self.last_good.time
    }

    /// If the state is absurd, puts the robot to rest where it last was good and flags it. The counters
    /// keep what led there.
    pub fn contain(&mut self) {
        if !self.sane {
            std::mem::swap(&mut self.state, &mut self.last_good);
            self.state.twist.fill(Twist::zeros());
            self.last_good.copy_from(&self.state);
            self.warm_start.clear();
            self.tally.clear_works();
            self.sane = true;
            self.diverged = true;
        }
    }
}

/// A body with a reference for its joints: what a [`super::Fleet`] advances.
pub trait Driven {
    fn body(&self) -> &Body;
    fn body_mut(&mut self) -> &mut Body;
    /// The reference of all joints at `time` \[s\].
    fn targets(&self, time: f64, targets: &mut [JointTarget]);
    /// The wave that all joints follow at `time` \[s\], if it is all they follow.
    fn travelling_wave(&self, time: f64) -> Option<WaveJets>;
    /// The first time after `time` at which the reference jumps \[s\]; infinite if it never does.
    fn next_jump(&self, _time: f64) -> f64 {
        f64::INFINITY
    }
}

/// A body that follows a reference; both may be borrowed.
#[derive(Debug, Clone)]
pub struct Scripted<R, B = Body> {
    pub body: B,
    pub reference: R,
}

impl<R: JointReference> Scripted<R> {
    /// A robot at rest among `pegs`: `start` is CG and absolute angle of link 1, `joint_angle` its posture.
    pub fn new(robot: &Robot, pegs: PegGrid, start: [f64; 3], joint_angle: &[f64], reference: R) -> Self {
        let mut body = Body::new(robot, pegs);
        assemble_chain(robot, Pose::from(start), joint_angle, &mut body.state.pose);
        body.forget();
        Self { body, reference }
    }
}

impl<R: JointReference, B: BorrowMut<Body>> Driven for Scripted<R, B> {
    fn body(&self) -> &Body {
        self.body.borrow()
    }

    fn body_mut(&mut self) -> &mut Body {
        self.body.borrow_mut()
    }

    fn targets(&self, time: f64, targets: &mut [JointTarget]) {
        self.reference.targets(time, targets);
    }

    fn travelling_wave(&self, time: f64) -> Option<WaveJets> {
        self.reference.travelling_wave(time)
    }

    fn next_jump(&self, time: f64) -> f64 {
        self.reference.next_jump(time)
    }
}
