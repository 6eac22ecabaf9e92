//! A scripted robot of the planar model (T ch. 3).

use snake_core::ConfigError;
use snake_core::gait::{Gait, Holding, JointTarget};
use snake_core::planar::Planar;
use snake_core::robot::Axes;
use snake_core::simulation::{Scheme, Simulation};

use crate::records::Layout;
use crate::run::RunConfig;
use crate::samples::Samples;
use crate::scripted::ScriptedModel;

impl ScriptedModel for Planar {
    const COORDINATES: usize = 2;

    type Script = Holding<Gait, JointTarget>;

    fn place<S: Scheme<Self>>(
        simulation: &mut Simulation<Self, S>,
        config: &RunConfig,
    ) -> Result<Self::Script, ConfigError> {
        let joints = simulation.robot().joint_count();
        let gait = config.planar_reference(joints)?;
        let [x, y, heading] = config.start.in_plane(config.on())?;
        let joint_angle = config.start.joint_angle(joints, &gait)?;
        simulation.place_chain(x, y, heading, &joint_angle);
        Ok(Holding::new(gait, config.held_joints(&joint_angle)))
    }

    fn write<S: Scheme<Self>>(simulation: &Simulation<Self, S>, samples: &mut Samples) {
        let (state, links) = (simulation.state(), simulation.robot().link_count());
        samples.put("position", &[links, 2], state.pose.iter().flat_map(|pose| [pose.x, pose.y]));
        samples.put("angle", &[links], state.pose.iter().map(|pose| pose.z));
        samples.put("joint_angle", &[links - 1], (0..links - 1).map(|joint| state.joint_angle(joint)));
        samples.put("joint_torque", &[links - 1], simulation.joint_torque().iter().copied());
    }

    fn write_velocity<S: Scheme<Self>>(simulation: &Simulation<Self, S>, samples: &mut Samples) {
        let (state, links) = (simulation.state(), simulation.robot().link_count());
        samples.put("velocity", &[links, 2], state.twist.iter().flat_map(|u| [u.x, u.y]));
        samples.put("angular_velocity", &[links], state.twist.iter().map(|u| u.z));
        samples.put("joint_rate", &[links - 1], (0..links - 1).map(|joint| state.joint_rate(joint)));
    }

    fn layout<S: Scheme<Self>>(simulation: &Simulation<Self, S>) -> Layout {
        let system = simulation.system();
        let normal = system.robot.links.iter().map(|link| link.mass * system.normal_gravity());
        let place = simulation.indices_of_obstacles();
        let joints = system.robot.joint_count();
        let (joint_shape, axes) = (vec![joints], vec![Axes::Yaw; joints]);
        Layout { coordinates: 2, contacts: 1, joint_shape, axes, normal: Some(normal.collect()), place }
    }
}
