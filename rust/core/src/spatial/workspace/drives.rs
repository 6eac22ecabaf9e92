use crate::control::AxisGains;
use crate::gait::CardanTarget;
use crate::math::Real;
use crate::robot::Breakage;
use crate::spatial::SpatialSystem;
use crate::stepping::Backlash;

/// What the joints follow in a stage, and how their actuators do.
pub struct Drives<T: Real> {
    /// Joint references at the end of the stage: yaw and pitch, angle and rate; and laws.
    pub target: Vec<[[T; 2]; 2]>,
    pub gains: Vec<[AxisGains<T>; 2]>,
    /// Of the largest torques, 0 where actuators are off.
    pub strength: T,
    /// Axes that joints do not have.
    pub absent: Vec<(usize, usize)>,
    /// Joints that are locked or limp.
    pub broken: Vec<(usize, Breakage)>,
    pub backlash: Backlash<T>,
    /// References of one robot.
    pub targets: Vec<CardanTarget>,
    /// Torques of the actuators beside the controller's, and those of one robot.
    pub has_own_torques: bool,
    pub own_torque: Vec<[T; 2]>,
    pub torques: Vec<f64>,
}

impl<T: Real> Drives<T> {
    pub fn new(system: &SpatialSystem) -> Self {
        let (axes, zero) = (&system.robot.axes, T::zero());
        let joints = axes.len();
        Self {
            target: vec![[[zero; 2]; 2]; joints],
            gains: system.gains().iter().map(|joint| joint.map(AxisGains::splat)).collect(),
            strength: T::splat(1.0),
            absent: (0..joints).flat_map(|j| [(j, 0), (j, 1)]).filter(|(j, axis)| !axes[*j].has(*axis)).collect(),
            broken: system.robot.broken.clone(),
            backlash: Backlash::new(system.robot.backlash.iter().flatten().copied()),
            targets: vec![CardanTarget::default(); joints],
            has_own_torques: false,
            own_torque: vec![[zero; 2]; joints],
            torques: vec![0.0; 2 * joints],
        }
    }
}
