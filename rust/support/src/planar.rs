//! What several law tests need: robots, references, random numbers, momenta.
use std::f64::consts::PI;
use std::fmt::Debug;

use nalgebra::Vector2;
use snake_core::control::{ControlLaw, ControllerConfig, Treatment};
use snake_core::gait::{CardanTarget, JointTarget, Reference, Wave};
use snake_core::planar::{Planar, PlanarState, Pose, Twist};
use snake_core::robot::{PerAxis, PerLink, Robot, RobotConfig};
use snake_core::rows::MotorRow;
use snake_core::scene::{Peg, SceneConfig, TABLE_7_3, TABLE_7_5};
use snake_core::simulation::{PlanarSimulation, SchemeConfig, Simulation};
use snake_core::stepping::ImplicitConfig;

/// Start of the free-undulation reference: CG of link 1 and its angle.
pub const START_FREE: [f64; 3] = [0.507175344325, -0.011634455967, 3.755516615855];

/// No actuation.
pub const LIMP: ControllerConfig = ControllerConfig {
    law: ControlLaw::Pd,
    kp: 0.0,
    kd: 0.0,
    torque_limit: None,
    active_from: 0.0,
    treatment: Treatment::Implicit,
};

/// A reference that never changes, one angle for all joints.
pub struct Hold(pub f64);

impl Reference<JointTarget> for Hold {
    fn target(&self, _joint: usize, _time: f64) -> JointTarget {
        JointTarget { angle: self.0, rate: 0.0, acceleration: 0.0 }
    }
}

/// A reference that does not tell when it jumps.
pub struct Unannounced<R>(pub R);

impl<R: Reference<JointTarget>> Reference<JointTarget> for Unannounced<R> {
    fn target(&self, joint: usize, time: f64) -> JointTarget {
        self.0.target(joint, time)
    }
}

impl<R: Reference<CardanTarget>> Reference<CardanTarget> for Unannounced<R> {
    fn target(&self, joint: usize, time: f64) -> CardanTarget {
        self.0.target(joint, time)
    }
}

pub fn implicit(step: f64, order: u32) -> ImplicitConfig {
    ImplicitConfig { step: Some(step), order, tolerance: Some(1e-10), ..ImplicitConfig::default() }
}

pub fn links(links: usize) -> RobotConfig {
    RobotConfig { links, ..RobotConfig::default() }
}

/// A quantity of joint axes, one value a joint.
pub fn each_joint(values: &[f64]) -> PerAxis {
    PerAxis::Each(values.iter().map(|value| PerLink::Same(*value)).collect())
}

/// Aiko with so many joints, each with other gains and another limit, and with links of other friction.
pub fn uneven_joints(joints: usize) -> RobotConfig {
    let each = |value: fn(f64) -> f64, count| (0..count).map(|j| value(j as f64)).collect::<Vec<_>>();
    RobotConfig {
        kp: Some(each_joint(&each(|j| 800.0 - 50.0 * j, joints))),
        kd: Some(each_joint(&each(|j| 2.0 + 0.1 * j, joints))),
        torque_limit: Some(each_joint(&each(|j| 4.0 + 0.5 * j, joints))),
        friction_factor: PerLink::Each(each(|i| 2.0 / (1.0 + 0.1 * i), joints + 1)),
        ..links(joints + 1)
    }
}

pub fn ground(friction: [f64; 2]) -> SceneConfig {
    SceneConfig { friction, ..SceneConfig::default() }
}

pub fn table_7_3() -> SceneConfig {
    SceneConfig { obstacles: TABLE_7_3.iter().map(|&peg| peg.into()).collect(), ..SceneConfig::default() }
}

pub fn table_7_5() -> SceneConfig {
    SceneConfig { obstacles: TABLE_7_5.iter().map(|&peg| peg.into()).collect(), ..SceneConfig::default() }
}

pub fn build<C: SchemeConfig<Planar>>(
    robot: &RobotConfig,
    scene: &SceneConfig,
    pd: &ControllerConfig,
    integrator: &C,
) -> Simulation<Planar, C::Scheme> {
    Simulation::new(robot, scene, pd, integrator).expect("a valid configuration")
}

/// Joint angles of `reference` at t = 0.
pub fn posture(reference: &impl Reference<JointTarget>, joints: usize) -> Vec<f64> {
    (0..joints).map(|j| reference.target(j, 0.0).angle).collect()
}

/// Aiko with the gait (T 7.3), at rest in the gait's posture.
pub fn aiko<C: SchemeConfig<Planar>>(
    scene: &SceneConfig,
    start: [f64; 3],
    integrator: &C,
) -> Simulation<Planar, C::Scheme> {
    let mut simulation = build(&RobotConfig::default(), scene, &ControllerConfig::default(), integrator);
    simulation.place_chain(start[0], start[1], start[2], &posture(&Wave::default(), 10));
    simulation
}

/// Rows of t, then x, y, theta of links 1..11.
pub fn rows(name: &str) -> Vec<Vec<f64>> {
    let path = format!("{}/../core/tests/data/planar-{name}.csv", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(path).expect("the reference data");
    text.lines().skip(1).map(|line| line.split(',').map(|x| x.parse().expect("a number")).collect()).collect()
}

/// Worst distance of any link's CG from a trajectory of an independent implementation, up to `duration`.
pub fn distance_from_reference<C: SchemeConfig<Planar> + Debug>(
    name: &str,
    scene: &SceneConfig,
    start: [f64; 3],
    integrator: &C,
    duration: f64,
) -> f64 {
    let mut simulation = aiko(scene, start, integrator);
    let (mut worst, mut judged, mut time) = (0.0_f64, 0, 0.0);
    for row in rows(name).iter().take_while(|row| row[0] < duration + 1e-6) {
        let report = simulation.advance(row[0] - time, &Wave::default());
        assert!(!report.diverged && report.unconverged == 0, "{report:?}");
        time = row[0];
        for (i, q) in simulation.state().pose.iter().enumerate() {
            worst = worst.max((q.x - row[1 + 3 * i]).hypot(q.y - row[2 + 3 * i]));
        }
        judged += 1;
    }
    println!("{name}, {integrator:?}: within {worst:.2e} m over {judged} samples");
    assert!(judged as f64 > 10.0 * duration - 1.0);
    worst
}

/// Linear momentum and angular momentum about the origin.
pub fn momentum(robot: &Robot, state: &PlanarState) -> (Vector2<f64>, f64) {
    let mut linear = Vector2::zeros();
    let mut angular = 0.0;
    for ((link, q), u) in robot.links.iter().zip(&state.pose).zip(&state.twist) {
        linear += u.xy() * link.mass;
        angular += link.mass * (q.x * u.y - q.y * u.x) + link.inertia * u.z;
    }
    (linear, angular)
}

/// A chain in motion: twist of link 1 and angular velocities given, the rest from the joints.
pub fn moving_chain(robot: &Robot, pose: &[Pose], head: Twist, omega: &[f64]) -> PlanarState {
    let mut twist = vec![head; pose.len()];
    for i in 1..pose.len() {
        let lateral = |k: usize| Vector2::new(-pose[k].z.sin(), pose[k].z.cos());
        let [rear, front] = [robot.links[i - 1].arms()[1], robot.links[i].arms()[0]];
        let v = twist[i - 1].xy() + lateral(i - 1) * (rear * twist[i - 1].z) + lateral(i) * (front * omega[i - 1]);
        twist[i] = Twist::new(v.x, v.y, omega[i - 1]);
    }
    PlanarState { time: 0.0, pose: pose.to_vec(), twist, movables: Vec::new() }
}

/// A straight pair of links in free space whose joint opens at `rate`.
pub fn swinging_pair(
    robot: &RobotConfig,
    pd: &ControllerConfig,
    rate: f64,
    scheme: &ImplicitConfig,
) -> PlanarSimulation {
    let mut simulation = build(robot, &ground([0.0, 0.0]), pd, scheme);
    simulation.place_chain(0.0, 0.0, 0.0, &[0.0]);
    let pose = simulation.state().pose.clone();
    // The links turn against each other; by symmetry their CGs are at rest.
    let state = moving_chain(simulation.robot(), &pose, Twist::new(0.0, 0.0, -0.5 * rate), &[0.5 * rate]);
    simulation.place(&state);
    simulation
}

/// A motor that a drive of the impulse `size` meets in part, turning at up to some rad/s.
pub fn random_motor(size: f64, random: &mut Random) -> MotorRow {
    let stall = size * random.magnitude(0.03, 3.0);
    MotorRow {
        stall,
        fall: stall / random.magnitude(0.1, 10.0),
        friction: random.magnitude(1e-4, 1e-1) * stall,
        inertia: random.magnitude(1e-5, 1e-2),
        reference: random.between(-3.0, 3.0),
        damping: random.magnitude(1e-6, 1e-2),
    }
}

/// A straight limp robot in front of a peg, without friction, in a state of motion.
pub fn in_front_of<C: SchemeConfig<Planar>>(
    peg: Peg,
    robot: &RobotConfig,
    integrator: &C,
    state: impl Fn(&Robot, &[Pose]) -> PlanarState,
) -> Simulation<Planar, C::Scheme> {
    let scene = SceneConfig { obstacles: vec![peg.into()], ..ground([0.0, 0.0]) };
    let mut simulation = build(robot, &scene, &LIMP, integrator);
    simulation.place_chain(0.0, 0.0, 0.0, &vec![0.0; robot.links - 1]);
    let state = state(simulation.robot(), &simulation.state().pose.clone());
    simulation.place(&state);
    simulation
}

/// A small deterministic generator (Knuth's MMIX constants).
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        let mut random = Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0xD1B5_4A32_D192_ED03);
        for _ in 0..8 {
            random.unit();
        }
        random
    }

    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Uniform in the logarithm.
    pub fn magnitude(&mut self, low: f64, high: f64) -> f64 {
        self.between(low.ln(), high.ln()).exp()
    }

    pub fn angle(&mut self) -> f64 {
        self.between(-PI, PI)
    }

    pub fn below(&mut self, count: usize) -> usize {
        (self.unit() * count as f64) as usize
    }
}
