//! Robots whose motion friction alone decides, for its laws with and without a fall in sliding.
use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2};

use snake_core::control::ControllerConfig;
use snake_core::planar::{Planar, Twist};
use snake_core::robot::RobotConfig;
use snake_core::scene::SceneConfig;
use snake_core::simulation::{Scheme, SchemeConfig, Simulation};

use crate::planar::{Hold, LIMP, build, links, moving_chain};

pub const G: f64 = 9.81;

/// A straight limp robot along the x axis, all links moving with `v`.
pub fn sliding<C: SchemeConfig<Planar>>(
    robot: &RobotConfig,
    scene: &SceneConfig,
    v: [f64; 2],
    integrator: &C,
) -> Simulation<Planar, C::Scheme> {
    let mut simulation = build(robot, scene, &LIMP, integrator);
    let joints = vec![0.0; robot.links - 1];
    simulation.place_chain(0.0, 0.0, 0.0, &joints);
    let pose = simulation.state().pose.clone();
    let state = moving_chain(simulation.robot(), &pose, Twist::new(v[0], v[1], 0.0), &joints);
    simulation.place(&state);
    simulation
}

/// On orthotropic ground a translating robot obeys v' = -g D^2 v / |D v|, so d ln v_y / d ln v_x is
/// (mu_y / mu_x)^2 and v_y^(mu_x^2) / v_x^(mu_y^2) is constant. Judged until a tenth of the speed remains,
/// where a step of 1 ms takes 5 % of it: the exponent is judged to 5 % of its change of about 2 mu_y^2.
pub fn slides_along_the_normal_of_the_ellipse<S: Scheme<Planar>>(
    scheme: &str,
    mut simulation: Simulation<Planar, S>,
    [mu_x, mu_y]: [f64; 2],
) {
    let integral = |u: Twist| mu_x * mu_x * u.y.ln() - mu_y * mu_y * u.x.ln();
    let start = integral(simulation.state().twist[0]);
    let mut judged = 0;
    while simulation.state().twist[0].norm() > 0.042 {
        simulation.advance(1e-3, &Hold(0.0));
        let drift = integral(simulation.state().twist[0]) - start;
        assert!(drift.abs() < 0.05 * 2.0 * mu_y * mu_y, "{scheme}: {drift:e}");
        judged += 1;
    }
    assert!(judged > 80, "{judged}");
}

/// Two links at a right angle with a constant joint torque: the friction at the two CGs alone resists.
/// The CGs lie d = L cos(phi/2) apart, and the power balance F d' = T phi' with d' = -L/2 sin(phi/2) phi'
/// gives the threshold T* = mu m g (L/2) sin(phi/2), here for mu = 0.2.
pub const THRESHOLD: f64 = 0.2 * (7.5 / 11.0) * G * 0.5 * 0.122 * FRAC_1_SQRT_2;

/// The drive saturates at its limit, so the torque is constant whatever the joint does.
pub fn bent_pair<C: SchemeConfig<Planar>>(
    torque: f64,
    scene: &SceneConfig,
    integrator: &C,
) -> Simulation<Planar, C::Scheme> {
    let pd = ControllerConfig { kp: 10.0, kd: 0.0, torque_limit: Some(torque), ..ControllerConfig::default() };
    let robot = RobotConfig { joint_limit: Some(f64::INFINITY.into()), ..links(2) };
    let mut simulation = build(&robot, scene, &pd, integrator);
    simulation.place_chain(0.3, -0.2, 0.7, &[FRAC_PI_2]);
    simulation
}
