use std::borrow::BorrowMut;

use nalgebra::Vector2;

use crate::gait::{CardanReference, CardanTarget};
use crate::pegs::PegGrid;
use crate::robot::Robot;
use crate::spatial::{Pose, SpatialState, Twist, assemble_chain, rest_on_ground};
use crate::stepping::Tally;

use super::Motion;

/// One robot among its pegs, as the schemes see it.
#[derive(Debug, Clone)]
pub struct SpatialBody {
    pub state: SpatialState,
    pub pegs: PegGrid,
    /// The robot as the implicit scheme carries it from step to step.
    pub motion: Motion,
    /// What happened since [`Self::begin`]; forces of pegs are horizontal, so x and y tell all of them.
    pub tally: Tally,
    /// Impulse of the ground's normal forces on each link since [`Self::begin`] \[N s\].
    pub ground_impulse: Vec<f64>,
    /// tau_C = (yaw, pitch) of each joint in the last step \[N m\] (T 4.89).
    pub joint_torque: Vec<Vector2<f64>>,
    /// The state became absurd during the present interval; it is the last good one.
    pub diverged: bool,
    /// State at the last instant known to be good.
    last_good: SpatialState,
}

impl SpatialBody {
    pub fn new(robot: &Robot, pegs: PegGrid) -> Self {
        let links = robot.link_count();
        Self {
            state: SpatialState::zero(links),
            pegs,
            motion: Motion::new(links),
            tally: Tally::new(links),
            ground_impulse: vec![0.0; links],
            joint_torque: vec![Vector2::zeros(); links - 1],
            diverged: false,
            last_good: SpatialState::zero(links),
        }
    }

    /// Forgets forces, torques and counters; the present state counts as good.
    pub fn forget(&mut self) {
        self.begin();
        self.motion.forget();
        self.joint_torque.fill(Vector2::zeros());
    }

    /// Begins an interval of integration.
    pub fn begin(&mut self) {
        self.last_good.copy_from(&self.state);
        self.tally.clear();
        self.ground_impulse.fill(0.0);
        self.diverged = false;
    }

    /// Time at which the present interval began \[s\].
    pub fn interval_start(&self) -> f64 {
        self.last_good.time
    }

    /// Puts the robot to rest where it last was good and flags it. The counters keep what led there.
    pub fn contain(&mut self) {
        self.state.copy_from(&self.last_good);
        self.state.twist.fill(Twist::zeros());
        self.motion.forget();
        self.tally.clear_works();
        self.ground_impulse.fill(0.0);
        self.joint_torque.fill(Vector2::zeros());
        self.diverged = true;
    }
}

/// A body with a reference for its joints: what a [`super::SpatialFleet`] advances.
pub trait SpatialDriven {
    fn body(&self) -> &SpatialBody;
    fn body_mut(&mut self) -> &mut SpatialBody;
    /// The reference of all joints at `time` \[s\].
    fn targets(&self, time: f64, targets: &mut [CardanTarget]);
    /// The first time after `time` at which the reference jumps \[s\]; infinite if it never does.
    fn next_jump(&self, _time: f64) -> f64 {
        f64::INFINITY
    }
}

/// A body that follows a reference; both may be borrowed.
#[derive(Debug, Clone)]
pub struct SpatialScripted<R, B = SpatialBody> {
    pub body: B,
    pub reference: R,
}

impl<R: CardanReference> SpatialScripted<R> {
    /// A robot at rest on the ground among `pegs`: pose of link 1, which is lifted or lowered, and (yaw, pitch) of all
    /// joints.
    pub fn new(robot: &Robot, pegs: PegGrid, head: Pose, joint_angle: &[Vector2<f64>], reference: R) -> Self {
        let mut body = SpatialBody::new(robot, pegs);
        assemble_chain(robot, head, joint_angle, &mut body.state.pose);
        rest_on_ground(robot, &mut body.state.pose);
        body.forget();
        Self { body, reference }
    }
}

impl<R: CardanReference, B: BorrowMut<SpatialBody>> SpatialDriven for SpatialScripted<R, B> {
    fn body(&self) -> &SpatialBody {
        self.body.borrow()
    }

    fn body_mut(&mut self) -> &mut SpatialBody {
        self.body.borrow_mut()
    }

    fn targets(&self, time: f64, targets: &mut [CardanTarget]) {
        self.reference.targets(time, targets);
    }

    fn next_jump(&self, time: f64) -> f64 {
        self.reference.next_jump(time)
    }
}
