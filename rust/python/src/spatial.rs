//! A scripted robot of the spatial model (T ch. 4).

use snake_core::ConfigError;
use snake_core::gait::{CardanGait, CardanTarget, Holding, JointTarget};
use snake_core::simulation::{Scheme, Simulation};
use snake_core::spatial::{Spatial, turning};

use crate::records::Layout;
use crate::run::RunConfig;
use crate::samples::Samples;
use crate::scripted::ScriptedModel;

impl ScriptedModel for Spatial {
    const COORDINATES: usize = 3;

    type Script = Holding<CardanGait, CardanTarget>;

    fn place<S: Scheme<Self>>(
        simulation: &mut Simulation<Self, S>,
        config: &RunConfig,
    ) -> Result<Self::Script, ConfigError> {
        let gait = config.spatial_reference(simulation.robot())?;
        config.start.place(simulation, &gait)?;
        // Waves pass by joints that only twist.
        let axes = simulation.robot().axes.iter().enumerate();
        let passed = axes.filter(|(_, axes)| axes.only_twists() && config.joint_trajectory.is_none());
        let held = config.robot.locked.iter().copied().chain(passed.map(|(joint, _)| joint)).map(|joint| {
            let of_axis = |angle| JointTarget { angle, ..JointTarget::default() };
            let [yaw, pitch] = simulation.joint_angle(joint).map(of_axis);
            (joint, CardanTarget { yaw, pitch })
        });
        Ok(Holding::new(gait, held))
    }

    fn write<S: Scheme<Self>>(simulation: &Simulation<Self, S>, samples: &mut Samples) {
        let (pose, robot) = (&simulation.state().pose, simulation.robot());
        let (links, joints) = (robot.link_count(), 0..robot.joint_count());
        let yaw = pose.iter().map(|q| q.axis()).map(|axis| axis.y.atan2(axis.x));
        let quaternion = pose.iter().map(|q| q.orientation).flat_map(|p| [p.w, p.i, p.j, p.k]);
        let joint_angle = robot.of_axes(joints.map(|joint| simulation.joint_angle(joint)));
        let torques = simulation.joint_torque().iter().map(|torque| (*torque).into());
        samples.put("position", &[links, 3], pose.iter().flat_map(|q| <[f64; 3]>::from(q.position)));
        samples.put("angle", &[links], yaw);
        samples.put("quaternion", &[links, 4], quaternion);
        samples.put("joint_angle", &robot.joint_shape(), joint_angle);
        samples.put("joint_torque", &robot.joint_shape(), robot.of_axes(torques));
    }

    fn write_velocity<S: Scheme<Self>>(simulation: &Simulation<Self, S>, samples: &mut Samples) {
        let (state, robot) = (simulation.state(), simulation.robot());
        let (links, joints) = (robot.link_count(), 0..robot.joint_count());
        let moving = || state.pose.iter().zip(&state.twist);
        let turning = moving().flat_map(|(q, u)| <[f64; 3]>::from(q.orientation * turning(u)));
        let rates = robot.of_axes(joints.map(|joint| simulation.joint_rate(joint)));
        samples.put("velocity", &[links, 3], state.twist.iter().flat_map(|u| [u[0], u[1], u[2]]));
        samples.put("angular_velocity", &[links, 3], turning);
        samples.put("joint_rate", &robot.joint_shape(), rates);
    }

    fn layout<S: Scheme<Self>>(simulation: &Simulation<Self, S>) -> Layout {
        let (robot, place) = (simulation.robot(), simulation.indices_of_obstacles());
        let (joint_shape, axes) = (robot.joint_shape(), robot.axes.clone());
        Layout { coordinates: 3, contacts: 2, joint_shape, axes, normal: None, place }
    }
}
