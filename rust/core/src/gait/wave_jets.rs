//! A travelling wave at one instant, its parameters varying; of one robot or of several side by side.

use serde::{Deserialize, Serialize};

use crate::math::Real;

/// Value, rate and acceleration of a scalar signal.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Jet<T = f64> {
    pub value: T,
    pub rate: T,
    pub acceleration: T,
}

impl Jet {
    /// A constant signal.
    pub fn at_rest(value: f64) -> Self {
        Self { value, rate: 0.0, acceleration: 0.0 }
    }
}

impl<T: Real> Jet<T> {
    #[inline]
    fn set_lane(&mut self, lane: usize, one: &Jet) {
        self.value.set_lane(lane, one.value);
        self.rate.set_lane(lane, one.rate);
        self.acceleration.set_lane(lane, one.acceleration);
    }
}

/// The wave `A sin(psi + i beta) + gamma` with `psi' = omega` at one instant, i = 0 at the first joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WaveJets<T = f64> {
    /// psi \[rad\].
    pub phase: T,
    /// A \[rad\].
    pub amplitude: Jet<T>,
    /// omega \[rad/s\].
    pub frequency: Jet<T>,
    /// beta \[rad\].
    pub phase_shift: Jet<T>,
    /// gamma \[rad\].
    pub offset: Jet<T>,
}

impl<T: Real> WaveJets<T> {
    /// A wave that holds all joints at zero.
    pub fn still() -> Self {
        let zero = T::zero();
        let nothing = Jet { value: zero, rate: zero, acceleration: zero };
        Self { phase: zero, amplitude: nothing, frequency: nothing, phase_shift: nothing, offset: nothing }
    }

    /// Takes one robot's wave over.
    #[inline]
    pub fn set_lane(&mut self, lane: usize, one: &WaveJets) {
        self.phase.set_lane(lane, one.phase);
        self.amplitude.set_lane(lane, &one.amplitude);
        self.frequency.set_lane(lane, &one.frequency);
        self.phase_shift.set_lane(lane, &one.phase_shift);
        self.offset.set_lane(lane, &one.offset);
    }

    /// The reference of a joint, given sine and cosine of psi + i beta.
    #[inline(always)]
    pub fn joint(&self, joint: usize, (sin, cos): (T, T)) -> Jet<T> {
        let i = T::splat(joint as f64);
        let turn = self.frequency.value + i * self.phase_shift.rate;
        let turn_rate = self.frequency.rate + i * self.phase_shift.acceleration;
        let (a, common) = (&self.amplitude, &self.offset);
        let bend = a.value * (turn_rate * cos - turn * turn * sin);
        let twice = a.rate + a.rate;
        Jet {
            value: a.value * sin + common.value,
            rate: a.rate * sin + a.value * turn * cos + common.rate,
            acceleration: a.acceleration * sin + twice * turn * cos + bend + common.acceleration,
        }
    }
}

/// Sine and cosine of the sum of two angles, given those of each.
#[inline(always)]
pub fn turned<T: Real>((sin, cos): (T, T), (sin_by, cos_by): (T, T)) -> (T, T) {
    (sin * cos_by + cos * sin_by, cos * cos_by - sin * sin_by)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wave_turned_from_joint_to_joint_is_the_sine_of_each() {
        let beta = Jet { value: -0.87, rate: 0.3, acceleration: -0.2 };
        let wave = WaveJets {
            phase: 1.3,
            amplitude: Jet { value: 0.7, rate: 0.2, acceleration: 0.4 },
            frequency: Jet { value: 1.4, rate: -0.5, acceleration: 0.0 },
            phase_shift: beta,
            offset: Jet::at_rest(0.1),
        };
        let (mut at, by) = (wave.phase.sin_cos(), beta.value.sin_cos());
        for joint in 0..200 {
            let turned_to = wave.joint(joint, at);
            let one = wave.joint(joint, (wave.phase + joint as f64 * beta.value).sin_cos());
            let scale = 1.0 + joint as f64;
            assert!((turned_to.value - one.value).abs() < 1e-15 * scale, "joint {joint}: {turned_to:?} {one:?}");
            assert!((turned_to.rate - one.rate).abs() < 1e-15 * scale * scale);
            at = turned(at, by);
        }
    }
}
