//! Joint references: the travelling wave (T 2.14), (T 7.1), a pair of waves for cardan joints, and soft start
//! (T 7.2.2).

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

use crate::error::{ConfigError, coordinate};

mod holding;
mod sampled;
mod wave_jets;

pub use holding::Holding;
pub use sampled::SampledReference;
pub use wave_jets::{Jet, WaveJets, turned};

/// Reference of one joint: angle \[rad\], rate \[rad/s\], acceleration \[rad/s^2\].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct JointTarget {
    pub angle: f64,
    pub rate: f64,
    pub acceleration: f64,
}

/// Joint angles over time. `T` is the reference of one joint: [`JointTarget`], or [`CardanTarget`] in 3D. Joint 0 lies
/// between links 0 and 1.
pub trait Reference<T>: Sync {
    /// The reference of `joint` at `time` \[s\].
    fn target(&self, joint: usize, time: f64) -> T;

    /// The references of all joints at `time` \[s\].
    fn targets(&self, time: f64, targets: &mut [T]) {
        for (joint, target) in targets.iter_mut().enumerate() {
            *target = self.target(joint, time);
        }
    }

    /// The travelling wave that all joints follow at `time`, where they follow one and nothing else: the references of
    /// several robots are then computed side by side, equal to [`Self::targets`] but for round-off.
    fn travelling_wave(&self, _time: f64) -> Option<WaveJets> {
        None
    }

    /// Torques that the actuators add to those of the controller at `time`, in the order of the joints and their axes,
    /// positive where they increase an angle \[N m\]; false if there are none.
    fn torques(&self, _time: f64, _torques: &mut [f64]) -> bool {
        false
    }

    /// The first time after `time` at which the reference jumps \[s\]; infinite if it never does.
    fn next_jump(&self, _time: f64) -> f64 {
        f64::INFINITY
    }
}

/// The travelling wave phi_i = A sin(omega t + (i - 1) beta + beta_0) + gamma (T 2.14), (T 2.15).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Wave {
    /// A_h \[rad\].
    pub amplitude: f64,
    /// omega_h \[rad/s\].
    pub omega: f64,
    /// beta_h, phase shift between adjacent joints \[rad\].
    pub beta: f64,
    /// gamma_h, common offset that steers \[rad\].
    pub gamma: f64,
    /// beta_0, phase of the first joint at t = 0 \[rad\].
    pub phase: f64,
}

impl Default for Wave {
    /// Lateral undulation (T 7.3).
    fn default() -> Self {
        let degree = PI / 180.0;
        Self { amplitude: 40.0 * degree, omega: 80.0 * degree, beta: -50.0 * degree, gamma: 0.0, phase: 0.0 }
    }
}

impl Wave {
    /// # Errors
    /// Names the parameter that is not finite.
    pub fn validate(&self) -> Result<(), ConfigError> {
        coordinate("amplitude", self.amplitude)?;
        coordinate("omega", self.omega)?;
        coordinate("beta", self.beta)?;
        coordinate("gamma", self.gamma)?;
        coordinate("phase", self.phase)?;
        Ok(())
    }

    /// A wave that holds all joints at zero.
    pub fn still() -> Self {
        Self { amplitude: 0.0, omega: 0.0, beta: 0.0, gamma: 0.0, phase: 0.0 }
    }

    /// Phase of `joint` at `time`, omega t + (i - 1) beta + beta_0.
    fn phase_at(&self, joint: usize, time: f64) -> f64 {
        self.omega * time + joint as f64 * self.beta + self.phase
    }
}

impl Reference<JointTarget> for Wave {
    fn target(&self, joint: usize, time: f64) -> JointTarget {
        let (sin, cos) = self.phase_at(joint, time).sin_cos();
        let (a, w) = (self.amplitude, self.omega);
        JointTarget { angle: a * sin + self.gamma, rate: a * w * cos, acceleration: -a * w * w * sin }
    }

    fn travelling_wave(&self, time: f64) -> Option<WaveJets> {
        Some(WaveJets {
            phase: self.phase_at(0, time),
            amplitude: Jet::at_rest(self.amplitude),
            frequency: Jet::at_rest(self.omega),
            phase_shift: Jet::at_rest(self.beta),
            offset: Jet::at_rest(self.gamma),
        })
    }
}

/// References below which a joint joins its wave in the soft start \[rad\] (T 7.2.2).
const SOFT_START_THRESHOLD: f64 = 3.0 * PI / 180.0;

/// A wave whose joints wait at zero until their reference first comes within 3 degrees of zero after start-up.
///
/// The phase of the wave is absolute time, so at start-up a joint's reference may be anywhere in [-A, A]: joining the
/// wave there is a step of up to A in the reference, k_P A = 560 N m with the gains of (T Table 7.2) and A = 40
/// degrees. Waiting bounds each step by k_P 3 deg + k_D omega A = 44 N m. A wave with A > 3 degrees leaves the band
/// for pi / omega - 2 asin(3 deg / A) / omega at most, 2.14 s of the gait (T 7.3), so all joints move by then. Start-up
/// is when the actuators are switched on: a joint whose wave passed through zero while they were off has to wait for
/// the next passage. Yaw and pitch are separate waves and wait separately.
///
/// The waiting times (T 7.2.2 != D7) follow from the wave and the time of start-up, so the reference does not depend
/// on the step.
#[derive(Debug, Clone, PartialEq)]
pub struct SoftStart {
    wave: Wave,
    start: Vec<f64>,
}

impl SoftStart {
    /// With actuators that are on from t = 0.
    pub fn new(wave: Wave, joints: usize) -> Self {
        Self::switched_on_at(0.0, wave, joints)
    }

    /// With actuators that are switched on at `start_up` \[s\].
    pub fn switched_on_at(start_up: f64, wave: Wave, joints: usize) -> Self {
        Self { wave, start: (0..joints).map(|joint| first_time_near_zero(&wave, joint, start_up)).collect() }
    }
}

impl Reference<JointTarget> for SoftStart {
    fn target(&self, joint: usize, time: f64) -> JointTarget {
        if time < self.start[joint] { JointTarget::default() } else { self.wave.target(joint, time) }
    }

    fn next_jump(&self, time: f64) -> f64 {
        self.start.iter().copied().filter(|&start| start > time).fold(f64::INFINITY, f64::min)
    }
}

/// First t >= `start_up` with |A sin(omega t + phase) + gamma| <= 3 degrees; infinite if there is none.
fn first_time_near_zero(wave: &Wave, joint: usize, start_up: f64) -> f64 {
    if wave.target(joint, start_up).angle.abs() <= SOFT_START_THRESHOLD {
        return start_up;
    }
    let (amplitude, omega) = (wave.amplitude, wave.omega);
    let mut first = f64::INFINITY;
    if amplitude == 0.0 || omega == 0.0 {
        return first;
    }
    // The band is entered through one of its edges: A sin(x) + gamma = +-threshold.
    for edge in [SOFT_START_THRESHOLD, -SOFT_START_THRESHOLD] {
        let sine = (edge - wave.gamma) / amplitude;
        if sine.abs() > 1.0 {
            continue;
        }
        for x in [sine.asin(), PI - sine.asin()] {
            let wait = (x - wave.phase_at(joint, start_up)) / omega;
            first = first.min(start_up + wait.rem_euclid(2.0 * PI / omega.abs()));
        }
    }
    first
}

/// The reference of a scripted run: the plain wave, the wave with soft start, or samples of the user's own.
#[derive(Debug, Clone, PartialEq)]
pub enum Gait {
    Wave(Wave),
    SoftStart(SoftStart),
    Sampled(SampledReference),
}

impl Gait {
    /// Largest deflection, of a wave from its offset \[rad\].
    pub fn amplitude(&self) -> f64 {
        match self {
            Gait::Wave(wave) | Gait::SoftStart(SoftStart { wave, .. }) => wave.amplitude,
            Gait::Sampled(samples) => samples.largest_angle(),
        }
    }
}

impl Reference<JointTarget> for Gait {
    fn target(&self, joint: usize, time: f64) -> JointTarget {
        match self {
            Gait::Wave(wave) => wave.target(joint, time),
            Gait::SoftStart(wave) => wave.target(joint, time),
            Gait::Sampled(samples) => samples.target(joint, time),
        }
    }

    fn targets(&self, time: f64, targets: &mut [JointTarget]) {
        match self {
            Gait::Wave(wave) => wave.targets(time, targets),
            Gait::SoftStart(wave) => wave.targets(time, targets),
            Gait::Sampled(samples) => samples.targets(time, targets),
        }
    }

    fn travelling_wave(&self, time: f64) -> Option<WaveJets> {
        match self {
            Gait::Wave(wave) => wave.travelling_wave(time),
            Gait::SoftStart(_) | Gait::Sampled(_) => None,
        }
    }

    fn next_jump(&self, time: f64) -> f64 {
        match self {
            Gait::Wave(wave) => wave.next_jump(time),
            Gait::SoftStart(wave) => wave.next_jump(time),
            Gait::Sampled(samples) => samples.next_jump(time),
        }
    }
}

/// References of one cardan joint.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CardanTarget {
    /// phi_h: sideways.
    pub yaw: JointTarget,
    /// phi_v: up and down.
    pub pitch: JointTarget,
}

/// Two waves, one for the yaw and one for the pitch of each joint (T 7.1), (T 7.2).
#[derive(Debug, Clone, PartialEq)]
pub struct CardanGait {
    pub yaw: Gait,
    pub pitch: Gait,
}

impl Reference<CardanTarget> for CardanGait {
    fn target(&self, joint: usize, time: f64) -> CardanTarget {
        CardanTarget { yaw: self.yaw.target(joint, time), pitch: self.pitch.target(joint, time) }
    }

    fn next_jump(&self, time: f64) -> f64 {
        self.yaw.next_jump(time).min(self.pitch.next_jump(time))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rate_and_acceleration_are_the_derivatives_of_the_angle() {
        let wave = Wave { gamma: 0.1, phase: 0.4, ..Wave::default() };
        let h = 1e-5;
        for joint in 0..10 {
            let at = |t: f64| wave.target(joint, t);
            let t = 0.37 + joint as f64;
            let rate = (at(t + h).angle - at(t - h).angle) / (2.0 * h);
            let acceleration = (at(t + h).rate - at(t - h).rate) / (2.0 * h);
            assert!((rate - at(t).rate).abs() < 1e-9, "truncation h^2 omega^3 A / 6 is below 1e-9");
            assert!((acceleration - at(t).acceleration).abs() < 1e-9);
        }
    }

    #[test]
    fn soft_start_joins_the_wave_at_the_first_time_within_three_degrees_after_start_up() {
        let wave = Wave { gamma: 0.05, phase: 1.3, ..Wave::default() };
        for start_up in [0.0, 1.0, 7.3] {
            let soft = SoftStart::switched_on_at(start_up, wave, 10);
            for joint in 0..10 {
                let near_zero = |&t: &f64| wave.target(joint, t).angle.abs() <= SOFT_START_THRESHOLD;
                let start = (0..).map(|k| start_up + f64::from(k) * 1e-4).find(near_zero).unwrap();
                assert!((soft.start[joint] - start).abs() <= 1e-4, "the scan has steps of 1e-4 s");
                assert_eq!(soft.target(joint, soft.start[joint]), wave.target(joint, soft.start[joint]));
                if soft.start[joint] > 0.0 {
                    assert_eq!(soft.target(joint, soft.start[joint] - 1e-9), JointTarget::default());
                }
            }
        }
    }

    /// The bounds of the documentation of [`SoftStart`], for any time of start-up.
    #[test]
    fn soft_start_steps_by_three_degrees_at_most_and_ends_within_half_a_period() {
        let wave = Wave::default();
        for k in 0..90 {
            let start_up = 0.05 * f64::from(k);
            let soft = SoftStart::switched_on_at(start_up, wave, 10);
            let longest = (PI - 2.0 * (SOFT_START_THRESHOLD / wave.amplitude).asin()) / wave.omega;
            for (joint, &start) in soft.start.iter().enumerate() {
                assert!((start_up..=start_up + longest + 1e-9).contains(&start), "joint {joint} at {start}");
                let step = wave.target(joint, start).angle.abs();
                assert!(step <= SOFT_START_THRESHOLD + 1e-12, "joint {joint} steps by {step}");
            }
        }
    }

    #[test]
    fn soft_start_of_a_wave_that_never_comes_near_zero_never_ends() {
        let wave = Wave { amplitude: 0.1, gamma: 1.0, ..Wave::default() };
        assert_eq!(SoftStart::new(wave, 1).target(0, 1e6), JointTarget::default());
    }
}
