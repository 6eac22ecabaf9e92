use crate::control::{AxisGains, ControlLaw};
use crate::gait::{Jet, JointTarget, WaveJets};
use crate::math::Real;
use crate::planar::PlanarSystem;
use crate::planar::io_drive::IoDrive;
use crate::robot::Breakage;
use crate::stepping::Backlash;

/// What the joints follow in a stage, and how their actuators do.
pub struct Drives<T: Real> {
    /// The wave that the joints follow at the end of the stage, where they follow one.
    pub wave: WaveJets<T>,
    /// Joint references at the end of the stage, and laws.
    pub target: Vec<Jet<T>>,
    pub gains: Vec<AxisGains<T>>,
    /// Of the largest torques, 0 where actuators are off.
    pub strength: T,
    /// Input-output linearisation instead of PD.
    pub io: Option<IoDrive<T>>,
    /// Joints that are locked or limp.
    pub broken: Vec<(usize, Breakage)>,
    pub backlash: Backlash<T>,
    /// References of one robot.
    pub targets: Vec<JointTarget>,
    /// Torques of the actuators beside the controller's, and those of one robot.
    pub has_own_torques: bool,
    pub own_torque: Vec<T>,
    pub torques: Vec<f64>,
}

impl<T: Real> Drives<T> {
    pub fn new(system: &PlanarSystem) -> Self {
        let (joints, zero) = (system.robot.link_count() - 1, T::zero());
        Self {
            wave: WaveJets::still(),
            target: vec![Jet { value: zero, rate: zero, acceleration: zero }; joints],
            gains: system.gains().iter().map(|[yaw, _]| yaw.splat()).collect(),
            strength: T::splat(1.0),
            io: (system.controller.law == ControlLaw::Io).then(|| IoDrive::new(system)),
            broken: system.robot.broken.clone(),
            backlash: Backlash::new(system.robot.backlash.iter().map(|[yaw, _]| *yaw)),
            targets: vec![JointTarget::default(); joints],
            has_own_torques: false,
            own_torque: vec![zero; joints],
            torques: vec![0.0; joints],
        }
    }
}
