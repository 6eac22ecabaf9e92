//! The robot: a chain of rigid links (T Table 7.1).

mod axes;
mod limits;
mod motor;
mod per_axis;

pub use axes::{Axes, AxesConfig, OneJoint, of_axes};
pub use motor::Motor;
pub use per_axis::PerAxis;

use nalgebra::Vector3;
use serde::{Deserialize, Deserializer, Serialize};

use crate::error::{ConfigError, finite, integer_in, length, length_or_zero, non_negative, positive, require, within};

/// A quantity given once for all links or link by link.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged, expecting = "a number, or a list of numbers")]
pub enum PerLink<V = f64> {
    Same(V),
    Each(Vec<V>),
}

impl<V> PerLink<V> {
    /// The values that were given.
    pub fn values(&self) -> &[V] {
        match self {
            PerLink::Same(value) => std::slice::from_ref(value),
            PerLink::Each(values) => values,
        }
    }
}

impl PerLink {
    fn expand(
        &self,
        field: &str,
        links: usize,
        check: fn(&str, f64) -> Result<f64, ConfigError>,
    ) -> Result<Vec<f64>, ConfigError> {
        let values = match self {
            PerLink::Same(value) => vec![*value; links],
            PerLink::Each(values) => values.clone(),
        };
        let expected = format!("a number, or a list of {links} numbers (one a link)");
        require(values.len() == links, field, format!("{} values", values.len()), &expected)?;
        for (i, &value) in values.iter().enumerate() {
            check(&self.name(field, i), value)?;
        }
        Ok(values)
    }

    /// The name of a link's value.
    fn name(&self, field: &str, link: usize) -> String {
        if matches!(self, PerLink::Each(_)) { format!("{field}[{link}]") } else { field.to_owned() }
    }
}

/// What a user may choose about the robot; the default is Aiko (T Table 7.1).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RobotConfig {
    /// Number of links n >= 2.
    #[serde(deserialize_with = "integer_in::<_, 2, MAX_LINKS>")]
    pub links: usize,
    /// Distance between adjacent joints, L_i \[m\].
    pub length: PerLink,
    /// Half length of the straight sides of the contact outline, L_GS,i \[m\].
    pub contact_half_length: PerLink,
    /// Half width of a link and radius of its end caps, L_SC,i \[m\].
    pub radius: PerLink,
    /// Link mass m_i \[kg\].
    pub mass: PerLink,
    /// How far the CG lies in front of the middle of the link, on its axis and towards the head \[m\].
    pub cg_offset: PerLink,
    /// Moment of inertia about an axis across the link through the CG, Theta_psi,i \[kg m^2\].
    pub inertia: PerLink,
    /// Moment of inertia about the link's centre line, Theta_rho,i \[kg m^2\]; the spatial model only.
    pub roll_inertia: PerLink,
    /// Acceleration of gravity \[m/s^2\]; in the plane it enters through the friction bounds.
    pub gravity: f64,
    /// Backlash of a joint, from end to end (T 7.5.4) \[rad\]; not the minimal model.
    #[serde(alias = "free_play")]
    pub backlash: PerAxis,
    /// Whether links that are not neighbours touch each other; null: where the model has it.
    pub self_contact: Option<bool>,
    /// Coefficient of friction between links that touch each other; the planar model only.
    pub link_friction: f64,
    /// Limits of the joint angles \[rad\]; null: a right angle to either side where the model has limits, none elsewhere.
    #[serde(deserialize_with = "unbounded")]
    pub joint_limit: Option<PerAxis>,
    /// About which axes each joint turns; the planar models have yaw only.
    pub axes: AxesConfig,
    /// The motors of the axes that are not broken; null for actuators with any torque at any rate.
    #[serde(deserialize_with = "unbounded")]
    pub motor: Option<PerAxis<Motor>>,
    /// Joints that keep their angles of the start, from 0.
    pub locked: Vec<usize>,
    /// Joints without an actuator, from 0.
    pub limp: Vec<usize>,
    /// Gains k_P \[N m/rad\] and k_D \[N m s/rad\] and largest torque \[N m\] of the joint axes; null: those of the
    /// controller.
    pub kp: Option<PerAxis>,
    pub kd: Option<PerAxis>,
    #[serde(deserialize_with = "unbounded")]
    pub torque_limit: Option<PerAxis>,
    /// Factor on the coefficients of friction between each link and the plane ground.
    pub friction_factor: PerLink,
}

/// What may hold infinite numbers, which readers of configurations refuse elsewhere.
#[derive(Deserialize)]
struct Unbounded<V>(V);

fn unbounded<'de, D: Deserializer<'de>, V: Deserialize<'de>>(deserializer: D) -> Result<V, D::Error> {
    Unbounded::deserialize(deserializer).map(|unbounded| unbounded.0)
}

impl Default for RobotConfig {
    fn default() -> Self {
        Self {
            links: 11,
            length: PerLink::Same(0.122),
            contact_half_length: PerLink::Same(0.0393),
            radius: PerLink::Same(0.0525),
            mass: PerLink::Same(7.5 / 11.0),
            cg_offset: PerLink::Same(0.0),
            inertia: PerLink::Same(1.32e-3),
            roll_inertia: PerLink::Same(9.40e-4),
            gravity: 9.81,
            backlash: PerAxis::Same(0.0),
            self_contact: None,
            link_friction: 0.0,
            joint_limit: None,
            axes: AxesConfig::default(),
            motor: None,
            locked: Vec::new(),
            limp: Vec::new(),
            kp: None,
            kd: None,
            torque_limit: None,
            friction_factor: PerLink::Same(1.0),
        }
    }
}

/// One link of a validated robot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Link {
    pub length: f64,
    pub contact_half_length: f64,
    pub radius: f64,
    pub mass: f64,
    /// From the middle of the link towards the head to the CG.
    pub cg_offset: f64,
    pub inertia: f64,
    pub roll_inertia: f64,
    /// On the coefficients of friction of the plane ground.
    pub friction_factor: f64,
}

impl Link {
    /// Kinetic energy of motion (x, y, angle) in the plane \[J\].
    pub fn energy_in_plane(&self, u: &Vector3<f64>) -> f64 {
        0.5 * (self.mass * (u.x * u.x + u.y * u.y) + self.inertia * u.z * u.z)
    }

    /// Distances of the CG from the joint in front of the link and from that behind it \[m\].
    pub fn arms(&self) -> [f64; 2] {
        [0.5 * self.length - self.cg_offset, 0.5 * self.length + self.cg_offset]
    }

    /// Coordinates along the centre line, from the CG towards the next link, at which the straight sides of the contact
    /// outline begin and end \[m\].
    pub fn sides(&self) -> [f64; 2] {
        [self.cg_offset - self.contact_half_length, self.cg_offset + self.contact_half_length]
    }

    /// Farthest point of the link's contact outline from its CG \[m\].
    pub fn reach(&self) -> f64 {
        self.contact_half_length + self.radius + self.cg_offset.abs()
    }

    /// Largest distance of the CGs of neighbours \[m\].
    pub fn farthest_neighbours(links: &[Link]) -> f64 {
        links.windows(2).map(|pair| pair[0].arms()[1] + pair[1].arms()[0]).fold(0.0, f64::max)
    }
}

/// A validated robot: constants only.
#[derive(Debug, Clone, PartialEq)]
pub struct Robot {
    pub links: Vec<Link>,
    pub gravity: f64,
    /// Of yaw and pitch of each joint \[rad\].
    pub backlash: Vec<[f64; 2]>,
    /// k_P, k_D and largest torque of yaw and pitch of each joint, where they are not the controller's.
    pub own_gains: [Option<Vec<[f64; 2]>>; 3],
    /// Whether links that are not neighbours touch each other, in models that have it.
    pub self_contact: bool,
    /// Coefficient of friction between such links.
    pub link_friction: f64,
    /// Least and largest angle of each joint, in models that have limits \[rad\].
    pub joint_bounds: Vec<[f64; 2]>,
    /// The axes of each joint in 3D.
    pub axes: Vec<Axes>,
    /// Whether they were listed: joint angles are then listed axis by axis too.
    pub lists_axes: bool,
    /// Of yaw and pitch of each joint.
    pub motors: Option<Vec<[Motor; 2]>>,
    /// The broken joints, in order.
    pub broken: Vec<(usize, Breakage)>,
}

/// How a joint is broken (T ch. 8).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Breakage {
    /// It keeps its angle.
    Locked,
    /// It has no actuator.
    Limp,
}

impl Robot {
    /// # Errors
    /// Names the field that is not finite, not positive, or of the wrong length.
    pub fn new(config: &RobotConfig) -> Result<Self, ConfigError> {
        let n = config.links;
        require((2..=MAX_LINKS).contains(&n), "links", n, &format!("an integer in [2, {MAX_LINKS}]"))?;
        let lengths = config.length.expand("length", n, length)?;
        let half = config.contact_half_length.expand("contact_half_length", n, length_or_zero)?;
        let radius = config.radius.expand("radius", n, length)?;
        let mass = config.mass.expand("mass", n, positive)?;
        let offset = config.cg_offset.expand("cg_offset", n, finite)?;
        for (i, (&offset, &length)) in offset.iter().zip(&lengths).enumerate() {
            let expected = format!("a distance < {}, half of the link", 0.5 * length);
            require(offset.abs() < 0.5 * length, &config.cg_offset.name("cg_offset", i), offset, &expected)?;
        }
        let inertia = config.inertia.expand("inertia", n, positive)?;
        let roll_inertia = config.roll_inertia.expand("roll_inertia", n, positive)?;
        let friction_factor = config.friction_factor.expand("friction_factor", n, non_negative)?;
        let links = (0..n)
            .map(|i| Link {
                length: lengths[i],
                contact_half_length: half[i],
                radius: radius[i],
                mass: mass[i],
                cg_offset: offset[i],
                inertia: inertia[i],
                roll_inertia: roll_inertia[i],
                friction_factor: friction_factor[i],
            })
            .collect();
        let gravity = positive("gravity", config.gravity)?;
        let axes = config.axes.expand(n - 1)?;
        let backlash =
            config.backlash.expand("backlash", &axes, |field, play| within(field, *play, 0.0, MOST_PLAY).map(drop))?;
        let own = |field: &str, values: &Option<PerAxis>, check: fn(&str, f64) -> Result<f64, ConfigError>| {
            values
                .as_ref()
                .map(|values| values.expand(field, &axes, |field, value| check(field, *value).map(drop)))
                .transpose()
        };
        let own_gains = [
            own("kp", &config.kp, non_negative)?,
            own("kd", &config.kd, non_negative)?,
            own("torque_limit", &config.torque_limit, |field, limit| {
                if limit == f64::INFINITY { Ok(limit) } else { positive(field, limit) }
            })?,
        ];
        let joint_limit = config.joint_limit.clone().unwrap_or(RIGHT_ANGLE.into());
        let broken = broken_joints(config)?;
        let expand = |motor: &PerAxis<Motor>| {
            motor.expand("motor", &axes, |field, motor| motor.validate().map_err(|e| e.inside(field)))
        };
        let motors = config.motor.as_ref().map(expand).transpose()?;
        for (play, motor) in
            backlash.iter().zip(motors.iter().flatten()).flat_map(|(play, motor)| play.iter().zip(motor))
        {
            require(*play == 0.0 || !motor.needs_tight_gear(), "backlash", *play, NO_PLAY)?;
        }
        Ok(Self {
            links,
            gravity,
            backlash,
            own_gains,
            self_contact: config.self_contact.unwrap_or(true),
            link_friction: non_negative("link_friction", config.link_friction)?,
            joint_bounds: joint_limit.bounds(n - 1)?,
            axes,
            lists_axes: config.axes != AxesConfig::default(),
            motors,
            broken,
        })
    }

    pub fn link_count(&self) -> usize {
        self.links.len()
    }

    pub fn joint_count(&self) -> usize {
        self.links.len() - 1
    }

    /// The axes in 3D, joint by joint: joint and, in 0 and 1, place in [`Axes`].
    pub fn axis_list(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        let of_joint = |(joint, axes): (usize, &Axes)| [0, 1].map(|axis| axes.has(axis).then_some((joint, axis)));
        self.axes.iter().enumerate().flat_map(of_joint).flatten()
    }

    /// Of two values for each joint, those of the axes that there are.
    pub fn of_axes<'a>(&'a self, values: impl Iterator<Item = [f64; 2]> + 'a) -> impl Iterator<Item = f64> + 'a {
        of_axes(&self.axes, values)
    }

    /// The two values of each joint, `none` about axes that it does not have, from those of all axes; `None` if the
    /// numbers differ.
    pub fn by_joint<V: Clone>(&self, of_axes: &[V], none: &V) -> Option<Vec<[V; 2]>> {
        let mut values = vec![[none.clone(), none.clone()]; self.joint_count()];
        let axes: Vec<_> = self.axis_list().collect();
        if axes.len() != of_axes.len() {
            return None;
        }
        for ((joint, axis), value) in axes.into_iter().zip(of_axes) {
            values[joint][axis] = value.clone();
        }
        Some(values)
    }

    /// Shape of an array of joint angles in 3D.
    pub fn joint_shape(&self) -> Vec<usize> {
        if self.lists_axes { vec![self.axis_list().count()] } else { vec![self.joint_count(), 2] }
    }

    /// Largest angle that a joint may have to either side; infinite where one has no limit \[rad\].
    pub fn joint_limit(&self) -> f64 {
        self.joint_bounds.iter().flatten().map(|bound| bound.abs()).fold(0.0, f64::max)
    }

    /// Rejects links that are not neighbours and overlap although the robot is straight, where they are farthest apart: if
    /// they touched each other, no posture would part them.
    ///
    /// # Errors
    /// Names the length between them, and both.
    pub fn require_parted_links(&self) -> Result<(), ConfigError> {
        for (i, triple) in self.links.windows(3).enumerate() {
            let [first, middle, last] = [&triple[0], &triple[1], &triple[2]];
            let apart = 0.5 * (first.length + last.length) + middle.length;
            let expected =
                format!("links {i} and {} that are apart in the straight robot, or self_contact=False", i + 2);
            let outline = |link: &Link| link.contact_half_length + link.radius;
            require(apart > outline(first) + outline(last), &format!("length[{}]", i + 1), middle.length, &expected)?;
        }
        Ok(())
    }

    /// Whether a joint is locked or limp.
    pub fn is_broken(&self, joint: usize) -> bool {
        self.broken.iter().any(|(broken, _)| *broken == joint)
    }

    /// The joints that keep their angles.
    pub fn locked(&self) -> impl Iterator<Item = usize> + '_ {
        self.broken.iter().filter(|(_, breakage)| *breakage == Breakage::Locked).map(|(joint, _)| *joint)
    }

    /// Kinetic energy of the rotors of motors, given the rates of `axes` axes a joint \[J\].
    pub fn rotor_energy(&self, axes: usize, rates: impl Iterator<Item = f64>) -> f64 {
        let Some(motors) = &self.motors else { return 0.0 };
        let driven = rates.enumerate().filter(|(axis, _)| !self.is_broken(axis / axes));
        let twice = driven.map(|(axis, rate)| motors[axis / axes][axis % axes].reflected_inertia() * rate * rate);
        0.5 * twice.sum::<f64>()
    }

    /// Mass of the whole robot \[kg\].
    pub fn total_mass(&self) -> f64 {
        self.links.iter().map(|link| link.mass).sum()
    }

    /// Length of the stretched robot from the first to the last joint end \[m\].
    pub fn total_length(&self) -> f64 {
        self.links.iter().map(|link| link.length).sum()
    }
}

/// The locked and the limp joints of a robot, in order.
fn broken_joints(config: &RobotConfig) -> Result<Vec<(usize, Breakage)>, ConfigError> {
    let joints = config.links - 1;
    let mut broken: Vec<(usize, Breakage)> = Vec::new();
    for (name, list, breakage) in [("locked", &config.locked, Breakage::Locked), ("limp", &config.limp, Breakage::Limp)]
    {
        for (k, &joint) in list.iter().enumerate() {
            let field = format!("{name}[{k}]");
            require(joint < joints, &field, joint, &format!("an integer in [0, {}]", joints - 1))?;
            let is_new = broken.iter().all(|(other, _)| *other != joint);
            require(is_new, &field, joint, "a joint that is named once, as locked or as limp")?;
            broken.push((joint, breakage));
        }
    }
    broken.sort_unstable_by_key(|(joint, _)| *joint);
    Ok(broken)
}

/// Stiffness of a locked joint \[N m/rad\]: taken at the end of every stage, it keeps the angle within a nanoradian per
/// newton metre however long the step, and does not drift; a lock a thousand times stiffer would show round-off in the
/// residual.
pub const LOCK_STIFFNESS: f64 = 1e9;

/// Upper bound on the number of links: a guard against typing errors, not a limit of the method.
pub const MAX_LINKS: usize = 10_000;

/// Largest angle of a joint unless another was chosen \[rad\]: up to it links on either side of a link cannot touch
/// where that is longer than they are thick; those of Aiko do at 94.9 degrees.
const RIGHT_ANGLE: f64 = std::f64::consts::FRAC_PI_2;

/// What backlash must be where [`Motor::needs_tight_gear`].
pub const NO_PLAY: &str = "0 with a motor that has rotor inertia, or gear friction or damping";

/// Largest backlash, a quarter turn \[rad\].
pub const MOST_PLAY: f64 = std::f64::consts::FRAC_PI_2;
