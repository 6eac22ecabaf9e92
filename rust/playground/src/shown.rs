//! What the page reads and changes of a robot that differs between the models.

use nalgebra::{UnitQuaternion, Vector2, Vector3};
use snake_core::environment::{PlanarRobot, RobotModel, SpatialRobot};
use snake_core::obstacles::Moved;

/// A robot model that the page can show.
pub trait Shown: RobotModel {
    /// CG \[m\] and the rotation that turns z into the centre line of a link.
    fn link_pose(&self, link: usize) -> (Vector3<f64>, UnitQuaternion<f64>);

    /// Velocity of the CG of a link \[m/s\].
    fn velocity(&self, link: usize) -> Vector3<f64>;

    /// Torques of the actuators, in 3D yaw and pitch of each joint \[N m\].
    fn joint_torque(&self) -> Vec<f64>;

    /// The obstacles that can be pushed, in the order of the scene.
    fn movables_mut(&mut self) -> &mut [Moved] {
        &mut self.simulation_mut().body_mut().state.movables
    }

    /// Ends of the centre line of a link, seen from above \[m\].
    fn centre_line(&self, link: usize) -> [Vector2<f64>; 2] {
        let (position, orientation) = self.link_pose(link);
        let half = (orientation * Vector3::z()).xy() * self.robot().links[link].contact_half_length;
        [position.xy() - half, position.xy() + half]
    }
}

impl Shown for PlanarRobot {
    fn link_pose(&self, link: usize) -> (Vector3<f64>, UnitQuaternion<f64>) {
        let pose = &self.simulation.state().pose[link];
        let upright_to_x = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), std::f64::consts::FRAC_PI_2);
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), pose.z);
        (Vector3::new(pose.x, pose.y, self.robot().links[link].radius), turn * upright_to_x)
    }

    fn velocity(&self, link: usize) -> Vector3<f64> {
        let twist = &self.simulation.state().twist[link];
        Vector3::new(twist.x, twist.y, 0.0)
    }

    fn joint_torque(&self) -> Vec<f64> {
        self.simulation.joint_torque().to_vec()
    }
}

impl Shown for SpatialRobot {
    fn link_pose(&self, link: usize) -> (Vector3<f64>, UnitQuaternion<f64>) {
        let pose = &self.simulation.state().pose[link];
        (pose.position, pose.orientation)
    }

    fn velocity(&self, link: usize) -> Vector3<f64> {
        self.simulation.state().twist[link].fixed_rows::<3>(0).into_owned()
    }

    fn joint_torque(&self) -> Vec<f64> {
        self.simulation.joint_torque().iter().flat_map(|torque| [torque.x, torque.y]).collect()
    }
}
