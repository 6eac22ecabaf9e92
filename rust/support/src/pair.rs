//! Two links on a hinge in free space by the equations of Lagrange, for links whose CG is not in the middle.

use snake_core::robot::{PerLink, Robot, RobotConfig};

/// Offsets of the two links' CGs \[m\].
pub const OFF_CENTRE: [f64; 2] = [0.04, -0.03];

/// Two unequal links.
pub fn off_centre(offset: [f64; 2]) -> RobotConfig {
    RobotConfig {
        links: 2,
        cg_offset: PerLink::Each(offset.into()),
        length: PerLink::Each(vec![0.122, 0.15]),
        mass: PerLink::Each(vec![0.5, 0.8]),
        inertia: PerLink::Each(vec![1.3e-3, 9e-4]),
        ..RobotConfig::default()
    }
}

/// The motion about the common CG in the plane of both links, whose kinetic energy is
/// `T = (I_1 w_1^2 + I_2 w_2^2 + mu |a_1 w_1 e_1 + a_2 w_2 e_2|^2) / 2` with the reduced mass mu and the arms a from the
/// hinge to the CGs.
pub struct FreePair {
    /// Absolute angles \[rad\] and their rates.
    pub angle: [f64; 2],
    pub rate: [f64; 2],
    /// I_i + mu a_i^2, and mu a_1 a_2.
    own: [f64; 2],
    mixed: f64,
}

impl FreePair {
    pub fn of(robot: &Robot, angle: [f64; 2], rate: [f64; 2]) -> Self {
        let [first, second] = [&robot.links[0], &robot.links[1]];
        let reduced = first.mass * second.mass / (first.mass + second.mass);
        let arms = [0.5 * first.length + first.cg_offset, 0.5 * second.length - second.cg_offset];
        let own = [first.inertia + reduced * arms[0] * arms[0], second.inertia + reduced * arms[1] * arms[1]];
        Self { angle, rate, own, mixed: reduced * arms[0] * arms[1] }
    }

    /// Runge-Kutta's method in steps of 0.1 ms, whose error is that of round-off.
    pub fn advance(&mut self, duration: f64) {
        let steps = (duration / 1e-4).round() as usize;
        let h = duration / steps as f64;
        for _ in 0..steps {
            let x = [self.angle[0], self.angle[1], self.rate[0], self.rate[1]];
            let after = |k: [f64; 4], t: f64| std::array::from_fn(|i| x[i] + t * k[i]);
            let k1 = self.slope(x);
            let k2 = self.slope(after(k1, 0.5 * h));
            let k3 = self.slope(after(k2, 0.5 * h));
            let k4 = self.slope(after(k3, h));
            let end: [f64; 4] = std::array::from_fn(|i| x[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]));
            (self.angle, self.rate) = ([end[0], end[1]], [end[2], end[3]]);
        }
    }

    fn slope(&self, [first, second, w1, w2]: [f64; 4]) -> [f64; 4] {
        let (sin, cos) = (second - first).sin_cos();
        let coupled = self.mixed * cos;
        let load = [self.mixed * sin * w2 * w2, -self.mixed * sin * w1 * w1];
        let determinant = self.own[0] * self.own[1] - coupled * coupled;
        let a1 = (self.own[1] * load[0] - coupled * load[1]) / determinant;
        let a2 = (self.own[0] * load[1] - coupled * load[0]) / determinant;
        [w1, w2, a1, a2]
    }
}
