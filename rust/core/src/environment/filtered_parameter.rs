//! One smooth scalar command: a slew-limited target behind a critically damped filter.
//!
//! A channel follows the target `u`, constant over a control period, through the third-order filter
//! with the triple pole `-lambda`,
//!
//! ```text
//! (d/dt + lambda)^3 x = lambda^3 u,    x(t) = u + (a + b t + c t^2) exp(-lambda t),
//! ```
//!
//! so value, rate and acceleration are continuous when `u` jumps. The impulse response
//! `h(t) = lambda^3 t^2 / 2 exp(-lambda t)` is non-negative and integrates to one. Hence, from rest,
//! - `x` never leaves the interval spanned by the past targets: no overshoot;
//! - with targets that move by at most `slew T` a period `T`, the rate `sum_k du_k h(t - t_k)` is at
//!   most `slew T sum_k h(t - k T)`, which by Poisson's summation formula is at most
//!   `slew (1 + 2 sum_{m >= 1} (1 + (2 pi m / (lambda T))^2)^(-3/2))`, see [`Filter::ripple`].

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};

use crate::gait::Jet;

/// The filter that all channels of a robot share.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Filter {
    /// Control period T \[s\].
    pub period: f64,
    /// lambda \[1/s\]; the delay of a ramp is `3 / lambda`.
    pub bandwidth: f64,
    /// exp(-lambda T).
    period_decay: f64,
}

impl Filter {
    /// The filter for a control period \[s\]: as quick as [`FASTEST`] allows, but never so quick that
    /// the staircase of the targets shows in the rate by more than 4 %.
    pub fn new(period: f64) -> Self {
        let bandwidth = FASTEST.min(BANDWIDTH_PERIOD / period);
        Self { period, bandwidth, period_decay: (-bandwidth * period).exp() }
    }

    /// exp(-lambda t).
    pub fn decay(&self, time: f64) -> f64 {
        (-self.bandwidth * time).exp()
    }

    /// The same after a control period.
    pub fn period_decay(&self) -> f64 {
        self.period_decay
    }

    /// Upper bound of rate / slew, minus one.
    pub fn ripple(&self) -> f64 {
        let ratio = TAU / (self.bandwidth * self.period);
        // The tail beyond M terms is below the integral of (ratio m)^-3, 1 / (2 ratio^3 M^2).
        let terms = 100;
        let sum: f64 = (1..=terms).map(|m| (1.0 + (ratio * f64::from(m)).powi(2)).powf(-1.5)).sum();
        2.0 * sum + 1.0 / (ratio.powi(3) * f64::from(terms).powi(2))
    }
}

/// Quickest filter \[1/s\]: a ramp lags 0.1 s, a robot of Aiko's size can follow it.
const FASTEST: f64 = 30.0;

/// Largest lambda T: two periods of delay, 4 % of ripple.
const BANDWIDTH_PERIOD: f64 = 1.5;

/// Admissible targets of a channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    pub low: f64,
    pub high: f64,
    /// Largest rate of the target \[unit/s\].
    pub slew: f64,
}

/// The state of one channel at a control instant; it moves on with [`FilteredParameter::finish_period`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FilteredParameter {
    target: f64,
    a: f64,
    b: f64,
    c: f64,
}

impl FilteredParameter {
    /// A channel that rests at `value`.
    pub fn at_rest(value: f64) -> Self {
        Self { target: value, a: 0.0, b: 0.0, c: 0.0 }
    }

    pub fn target(&self) -> f64 {
        self.target
    }

    /// Moves the target towards `desired`, no farther than the limits allow in one period; value, rate
    /// and acceleration stay as they are.
    pub fn set_target(&mut self, desired: f64, limits: &Limits, filter: &Filter) {
        let reach = limits.slew * filter.period;
        let target = desired.clamp(self.target - reach, self.target + reach).clamp(limits.low, limits.high);
        *self = Self::from_jet(target, self.jet(0.0, 1.0, filter), filter);
    }

    /// Value, rate and acceleration `time` after the control instant; `decay` is the filter's there.
    #[inline]
    pub fn jet(&self, time: f64, decay: f64, filter: &Filter) -> Jet {
        let lambda = filter.bandwidth;
        let polynomial = self.a + time * (self.b + time * self.c);
        let slope = self.b + 2.0 * time * self.c;
        Jet {
            value: self.target + decay * polynomial,
            rate: decay * (slope - lambda * polynomial),
            acceleration: decay * (2.0 * self.c - 2.0 * lambda * slope + lambda * lambda * polynomial),
        }
    }

    /// Integral of the value from the control instant to `time` after it.
    pub fn integral(&self, time: f64, decay: f64, filter: &Filter) -> f64 {
        let time_constant = 1.0 / filter.bandwidth;
        // -exp(-lambda t) (p + q t + r t^2) is the antiderivative of exp(-lambda t) (a + b t + c t^2).
        let r = self.c * time_constant;
        let q = (self.b + 2.0 * r) * time_constant;
        let p = (self.a + q) * time_constant;
        self.target * time + p - decay * (p + time * (q + time * r))
    }

    /// Makes the end of the period the new control instant.
    pub fn finish_period(&mut self, filter: &Filter) {
        let jet = self.jet(filter.period, filter.period_decay, filter);
        *self = Self::from_jet(self.target, jet, filter);
    }

    fn from_jet(target: f64, jet: Jet, filter: &Filter) -> Self {
        let lambda = filter.bandwidth;
        let a = jet.value - target;
        let b = jet.rate + lambda * a;
        let c = 0.5 * (jet.acceleration + 2.0 * lambda * b - lambda * lambda * a);
        Self { target, a, b, c }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const LIMITS: Limits = Limits { low: -1.0, high: 2.0, slew: 3.0 };

    /// Runs `check(before, after, channel)` at every control instant, `before` and `after` the jets
    /// just before and just after the target moved.
    fn drive(period: f64, desired_values: &[f64], mut check: impl FnMut(Jet, Jet, &FilteredParameter, &Filter)) {
        let filter = Filter::new(period);
        let mut channel = FilteredParameter::at_rest(0.0);
        for &desired in desired_values {
            let before = channel.jet(0.0, 1.0, &filter);
            channel.set_target(desired, &LIMITS, &filter);
            check(before, channel.jet(0.0, 1.0, &filter), &channel, &filter);
            channel.finish_period(&filter);
        }
    }

    fn samples(channel: &FilteredParameter, filter: &Filter) -> impl Iterator<Item = Jet> {
        let times = (0..=10).map(|k| filter.period * f64::from(k) / 10.0);
        times.map(|t| channel.jet(t, filter.decay(t), filter))
    }

    proptest! {
        #[test]
        fn value_rate_and_acceleration_are_continuous(
            desired_values in prop::collection::vec(-3.0..3.0f64, 1..40), period in 0.005..0.5f64,
        ) {
            // Round-off: a few ulp of lambda^2 times the value.
            let tolerance = 1e-12 * FASTEST * FASTEST;
            let mut end = Jet::at_rest(0.0);
            drive(period, &desired_values, |before, after, channel, filter| {
                for jet in [end, after] {
                    assert!((jet.value - before.value).abs() < tolerance);
                    assert!((jet.rate - before.rate).abs() < tolerance);
                    assert!((jet.acceleration - before.acceleration).abs() < tolerance);
                }
                end = channel.jet(filter.period, filter.decay(filter.period), filter);
            });
        }

        #[test]
        fn value_stays_in_its_range_and_rate_below_the_slew_limit(
            desired_values in prop::collection::vec(prop_oneof![Just(-9.0), Just(9.0), -1.0..2.0f64], 1..60),
            period in 0.005..0.5f64,
        ) {
            drive(period, &desired_values, |_, _, channel, filter| {
                for jet in samples(channel, filter) {
                    assert!(jet.value > LIMITS.low - 1e-9 && jet.value < LIMITS.high + 1e-9);
                    assert!(jet.rate.abs() <= LIMITS.slew * (1.0 + filter.ripple()) + 1e-9);
                }
            });
        }

        #[test]
        fn rate_and_integral_belong_to_the_value(
            desired_values in prop::collection::vec(-3.0..3.0f64, 1..20), t in 0.001..0.05f64,
        ) {
            let h = 1e-5;
            drive(0.05, &desired_values, |_, _, channel, filter| {
                let jet = |t: f64| channel.jet(t, filter.decay(t), filter);
                let integral = |t: f64| channel.integral(t, filter.decay(t), filter);
                // Central differences: error h^2 / 6 times a third derivative below lambda^3.
                let tolerance = h * h * FASTEST.powi(3) + 1e-8;
                assert!(((jet(t + h).value - jet(t - h).value) / (2.0 * h) - jet(t).rate).abs() < tolerance);
                let slope = (jet(t + h).rate - jet(t - h).rate) / (2.0 * h);
                assert!((slope - jet(t).acceleration).abs() < FASTEST * tolerance);
                assert!(((integral(t + h) - integral(t - h)) / (2.0 * h) - jet(t).value).abs() < tolerance);
                assert_eq!(integral(0.0), 0.0);
            });
        }
    }

    #[test]
    fn ripple_is_below_four_percent_at_every_period() {
        for period in [1e-3, 0.01, 0.05, 0.2, 1.0] {
            assert!(Filter::new(period).ripple() < 0.04, "at {period} s: {}", Filter::new(period).ripple());
        }
    }

    #[test]
    fn a_step_is_approached_from_one_side() {
        let filter = Filter::new(0.05);
        let limits = Limits { slew: 1e9, ..LIMITS };
        let mut channel = FilteredParameter::at_rest(0.0);
        channel.set_target(1.0, &limits, &filter);
        let mut last = 0.0;
        for _ in 0..40 {
            channel.finish_period(&filter);
            let value = channel.jet(0.0, 1.0, &filter).value;
            assert!(value >= last && value <= 1.0 + 1e-12, "{value} after {last}");
            last = value;
        }
        // exp(-60) times a quadratic: the step has arrived.
        assert!((last - 1.0).abs() < 1e-12);
    }
}
