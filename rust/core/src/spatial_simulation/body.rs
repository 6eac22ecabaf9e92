use nalgebra::Vector2;

use crate::pegs::PegGrid;
use crate::robot::Robot;
use crate::spatial::{SpatialState, Twist};
use crate::stepper::Tally;

/// One robot among its pegs, as the schemes see it.
#[derive(Debug, Clone)]
pub struct SpatialBody {
    pub state: SpatialState,
    pub pegs: PegGrid,
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
            tally: Tally::new(links),
            ground_impulse: vec![0.0; links],
            joint_torque: vec![Vector2::zeros(); links - 1],
            diverged: false,
            last_good: SpatialState::zero(links),
        }
    }

    /// Forgets torques and counters; the present state counts as good.
    pub fn forget(&mut self) {
        self.begin();
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
        self.tally.clear_works();
        self.ground_impulse.fill(0.0);
        self.joint_torque.fill(Vector2::zeros());
        self.diverged = true;
    }
}
