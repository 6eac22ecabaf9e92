//! Joint references of the user's own, sampled in time.
//!
//! Between two samples each joint follows a cubic in Hermite form, `h = t_{k+1} - t_k`, `s = (t - t_k) / h`:
//!
//! `phi = a_k + h r_k s + (3 D - h (2 r_k + r_{k+1})) s^2 + (h (r_k + r_{k+1}) - 2 D) s^3`, `D = a_{k+1} - a_k`,
//!
//! so angle and rate are continuous. Rates that are not given are those of Fritsch and Butland (1984): weighted harmonic
//! means of the slopes on both sides, zero where these have opposite signs. The reference then stays between neighbouring
//! samples and never overshoots. Before the first and after the last sample the angles stay.

use crate::error::{ConfigError, coordinate, finite, require};

use super::{JointTarget, Reference};

/// References of all joints through samples in time.
#[derive(Debug, Clone, PartialEq)]
pub struct SampledReference {
    time: Vec<f64>,
    /// Angle and rate at the samples, joint by joint.
    joints: Vec<Vec<Knot>>,
}

/// Angle \[rad\] and rate \[rad/s\] at a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Knot {
    angle: f64,
    rate: f64,
}

impl SampledReference {
    /// Of angles `angle[joint][sample]`, and of rates likewise where they are given.
    ///
    /// # Errors
    /// Names the samples that are not finite, not in order, or not as many as the times.
    pub fn new(time: Vec<f64>, angle: &[Vec<f64>], rate: Option<&[Vec<f64>]>) -> Result<Self, ConfigError> {
        let count = time.len();
        require(count >= 2, "time", count, "2 samples or more")?;
        for (k, &t) in time.iter().enumerate() {
            finite(&format!("time[{k}]"), t)?;
            let is_later = k == 0 || t > time[k - 1];
            require(is_later, &format!("time[{k}]"), t, "later than the sample before")?;
        }
        validate_table("angle", angle, count, angle.len())?;
        if let Some(rate) = rate {
            validate_table("rate", rate, count, angle.len())?;
        }
        let joints = angle.iter().enumerate().map(|(joint, angles)| {
            let rates = rate.map_or_else(|| monotone_rates(&time, angles), |rate| rate[joint].clone());
            angles.iter().zip(rates).map(|(&angle, rate)| Knot { angle, rate }).collect()
        });
        Ok(Self { joints: joints.collect(), time })
    }

    pub fn joint_count(&self) -> usize {
        self.joints.len()
    }

    /// Largest angle of a sample \[rad\].
    pub fn largest_angle(&self) -> f64 {
        self.joints.iter().flatten().map(|knot| knot.angle.abs()).fold(0.0, f64::max)
    }

    /// Samples at or before `time`.
    fn passed(&self, time: f64) -> usize {
        self.time.partition_point(|&sample| sample <= time)
    }

    /// The reference of a joint after so many samples.
    fn after(&self, passed: usize, joint: usize, time: f64) -> JointTarget {
        let knots = &self.joints[joint];
        let at_rest = |knot: &Knot| JointTarget { angle: knot.angle, ..JointTarget::default() };
        if passed == 0 {
            return at_rest(&knots[0]);
        }
        if passed == knots.len() {
            return at_rest(&knots[passed - 1]);
        }
        let (from, to) = (&knots[passed - 1], &knots[passed]);
        let h = self.time[passed] - self.time[passed - 1];
        let s = (time - self.time[passed - 1]) / h;
        let (change, start, end) = (to.angle - from.angle, h * from.rate, h * to.rate);
        let (square, cube) = (3.0 * change - 2.0 * start - end, start + end - 2.0 * change);
        JointTarget {
            angle: from.angle + s * (start + s * (square + s * cube)),
            rate: (start + s * (2.0 * square + s * 3.0 * cube)) / h,
            acceleration: (2.0 * square + s * 6.0 * cube) / (h * h),
        }
    }
}

impl Reference<JointTarget> for SampledReference {
    fn target(&self, joint: usize, time: f64) -> JointTarget {
        self.after(self.passed(time), joint, time)
    }

    fn targets(&self, time: f64, targets: &mut [JointTarget]) {
        let passed = self.passed(time);
        for (joint, target) in targets.iter_mut().enumerate() {
            *target = self.after(passed, joint, time);
        }
    }

    /// The rates jump where the samples begin and end.
    fn next_jump(&self, time: f64) -> f64 {
        let ends = [self.time[0], self.time[self.time.len() - 1]];
        ends.into_iter().filter(|&end| end > time).fold(f64::INFINITY, f64::min)
    }
}

fn validate_table(field: &str, table: &[Vec<f64>], samples: usize, joints: usize) -> Result<(), ConfigError> {
    require(table.len() == joints, field, format!("{} joints", table.len()), &format!("{joints} joints"))?;
    for (joint, values) in table.iter().enumerate() {
        let expected = format!("{samples} samples, one per time");
        require(values.len() == samples, field, format!("{} samples", values.len()), &expected)?;
        for (k, &value) in values.iter().enumerate() {
            coordinate(&format!("{field}[{k}][{joint}]"), value)?;
        }
    }
    Ok(())
}

/// Rates with which cubics between the samples are monotone wherever the samples are.
fn monotone_rates(time: &[f64], angle: &[f64]) -> Vec<f64> {
    let last = time.len() - 1;
    let length = |k: usize| time[k + 1] - time[k];
    let slope = |k: usize| (angle[k + 1] - angle[k]) / length(k);
    if last == 1 {
        return vec![slope(0); 2];
    }
    let inside = |k: usize| {
        let (before, after) = (slope(k - 1), slope(k));
        if before * after <= 0.0 {
            return 0.0;
        }
        let (near, far) = (2.0 * length(k) + length(k - 1), length(k) + 2.0 * length(k - 1));
        (near + far) / (near / before + far / after)
    };
    // The parabola through three samples, kept monotone.
    let at_end = |own: usize, next: usize| {
        let (h, h_next, d, d_next) = (length(own), length(next), slope(own), slope(next));
        let rate = ((2.0 * h + h_next) * d - h * d_next) / (h + h_next);
        match () {
            () if rate * d <= 0.0 => 0.0,
            () if d * d_next <= 0.0 && rate.abs() > 3.0 * d.abs() => 3.0 * d,
            () => rate,
        }
    };
    (0..=last)
        .map(|k| match k {
            0 => at_end(0, 1),
            k if k == last => at_end(last - 1, last - 2),
            k => inside(k),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gait::Wave;

    fn bumps() -> SampledReference {
        let angle = vec![vec![0.0, 0.0, 0.5, 0.5, -0.3, -0.2, 0.4], vec![0.1, 0.3, 0.2, 0.9, 0.9, 0.0, 0.0]];
        SampledReference::new(vec![0.0, 0.3, 0.5, 1.0, 1.1, 2.0, 2.4], &angle, None).unwrap()
    }

    #[test]
    fn a_reference_goes_through_its_samples_and_stays_between_neighbours() {
        let sampled = bumps();
        for joint in 0..2 {
            for k in 0..=2400 {
                let time = f64::from(k) * 1e-3;
                let passed = sampled.passed(time).min(6);
                let [low, high] = [passed - 1, passed].map(|knot| sampled.joints[joint][knot].angle);
                let angle = sampled.target(joint, time).angle;
                assert!(angle >= low.min(high) - 1e-12 && angle <= low.max(high) + 1e-12, "{angle} at {time}");
            }
            for (knot, &time) in sampled.joints[joint].iter().zip(&sampled.time) {
                assert!((sampled.target(joint, time).angle - knot.angle).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn rate_and_acceleration_are_the_derivatives_of_the_angle_and_the_rate_is_continuous() {
        let (sampled, h) = (bumps(), 1e-6);
        for joint in 0..2 {
            for time in [0.1, 0.37, 0.8, 1.05, 1.7, 2.2] {
                let at = |t: f64| sampled.target(joint, t);
                let (before, after) = (at(time - h), at(time + h));
                assert!(((after.angle - before.angle) / (2.0 * h) - at(time).rate).abs() < 1e-6);
                assert!(((after.rate - before.rate) / (2.0 * h) - at(time).acceleration).abs() < 1e-6);
            }
            for &time in &sampled.time[1..6] {
                let (before, after) = (sampled.target(joint, time - 1e-9), sampled.target(joint, time));
                assert!((before.rate - after.rate).abs() < 1e-6);
            }
        }
    }

    /// With rates, of fourth order: half the interval leaves a sixteenth of the error.
    #[test]
    fn samples_of_a_wave_with_their_rates_follow_it_to_fourth_order() {
        let wave = Wave::default();
        let error = |intervals: u32| {
            let time: Vec<f64> = (0..=intervals).map(|k| 4.0 * f64::from(k) / f64::from(intervals)).collect();
            let of = |value: fn(JointTarget) -> f64| {
                (0..3)
                    .map(|joint| time.iter().map(|&t| value(wave.target(joint, t))).collect())
                    .collect::<Vec<Vec<_>>>()
            };
            let (angle, rate) = (of(|target| target.angle), of(|target| target.rate));
            let sampled = SampledReference::new(time, &angle, Some(&rate)).unwrap();
            let difference = |k: u32, joint: usize| {
                let t = 4.0 * f64::from(k) / 997.0;
                (sampled.target(joint, t).angle - wave.target(joint, t).angle).abs()
            };
            (0..997).flat_map(|k| (0..3).map(move |joint| difference(k, joint))).fold(0.0, f64::max)
        };
        let ratio = error(40) / error(80);
        assert!((15.0..17.0).contains(&ratio), "{ratio}");
        assert!(error(80) < 1e-6);
    }
}
