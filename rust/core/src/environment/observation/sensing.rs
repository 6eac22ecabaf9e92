//! Blocks of sensors that robots have, beside those of the models: in an observation only where `observation_blocks` names
//! them.

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::Vector2;

use crate::environment::robot_model::RobotModel;
use crate::environment::symmetry::Parity;

use super::{BlockRow, Setup, each, even, odd};

impl<M: RobotModel> BlockRow<M> {
    pub(super) const SENSING: &'static [Self] = &[
        BlockRow {
            name: "touch",
            description: "1 for each link on which an obstacle pressed in the control period, else 0",
            present: |setup| setup.has_pegs(),
            elements: |setup| each(setup.links(), &[even("link_#")]),
            bound: 1.0,
            memory: true,
            read: |view, values| {
                let links = values.iter_mut().enumerate();
                links.for_each(|(link, value)| *value = f64::from(u8::from(view.model.is_pressed(link))));
            },
            ..BlockRow::DEFAULT
        },
        BlockRow {
            name: "touch_side",
            description: "side of each link on which obstacles pressed, all together and seen from above: 1 left, -1 right, \
                          0 none",
            present: |setup| setup.has_pegs(),
            elements: |setup| each(setup.links(), &[odd("link_#")]),
            bound: 1.0,
            memory: true,
            read: |view, values| {
                for (link, (value, force)) in values.iter_mut().zip(view.model.contact_force()).enumerate() {
                    let (sin, cos) = view.model.link(link).angle.sin_cos();
                    let to_the_right = cos * force.y - sin * force.x;
                    *value = if to_the_right == 0.0 { 0.0 } else { to_the_right.signum() };
                }
            },
            ..BlockRow::DEFAULT
        },
        BlockRow {
            name: "range",
            unit: "m",
            description: "distance from the CG of link 1, or of `range_link`, to the nearest obstacle along 9 rays, at most the robot's \
                          length. They go from the right over straight ahead to the left in steps of pi/8. In 3D the rays are horizontal, from the height of \
                          that CG, and pass above lower obstacles",
            present: |setup| setup.has_pegs(),
            elements: |_| each(RAYS, &[("ray_#", Parity::Swapped)]),
            scale: |setup| setup.robot.total_length(),
            bound: 1.0,
            memory: false,
            read: |view, values| {
                let link = view.model.link(view.sensors.range_link);
                // Link 1 leads: forward is against its axis.
                let direction = |ray: usize| {
                    let (sin, cos) = (link.angle + PI - FRAC_PI_2 + PI / (RAYS - 1) as f64 * ray as f64).sin_cos();
                    Vector2::new(cos, sin)
                };
                let rays = std::array::from_fn::<_, RAYS, _>(direction);
                values.fill(view.model.robot().total_length());
                let obstacles = &view.model.simulation().body().obstacles;
                let eye = Vector2::new(link.x, link.y);
                let height = view.model.height(view.sensors.range_link);
                obstacles.cast_rays(&eye, height, &rays, values);
                for movable in view.model.movables() {
                    for (value, ray) in values.iter_mut().zip(&rays) {
                        *value = value.min(movable.distance_along(&eye, height, ray));
                    }
                }
            },
        },
    ];
}

/// Description of the accelerometer of each model.
pub const ACCELEROMETER: &str = "specific force of link 1, or of `imu_link`, about its own axes: mean acceleration of its CG over the control \
    period, minus gravity. It follows from the velocities at both ends, so that impacts count whole";

/// Description of the motors' torques in each model.
pub const MOTOR_TORQUE: &str = "torque of each actuator at the joint, in a motor before the friction of its gear, in the last \
    integration step; positive where it increases the joint angle. Torque over torque constant is the current";

/// The limit of the actuators, 10 N m without one.
pub fn motor_scale(setup: &Setup) -> f64 {
    setup.config.controller().torque_limit.unwrap_or(10.0)
}

/// Rays of the leading link over half a turn.
const RAYS: usize = 9;
