//! The plan of one robot's interval, which it advances through in parts of free length.
//!
//! Each robot follows its own plan; those that have not reached the end of the interval are regrouped for every part.
//!
//! * A part of second order is accepted if its second stage ends within `step_tolerance` of its prediction, and within a
//!   share of it where a contact closes. The deviation, which grows with the square of the length where a force jumps
//!   and with its cube otherwise, sets the length of the next part, or of the part that replaces a rejected one.
//! * An impact is a jump of velocity, which no length resolves: the part before it ends where open contacts are forecast
//!   to close, and two short Euler parts take it. The first ends the gap, the second the approach.
//! * A part of second order that takes a contact across a border of friction is taken again up to there.
//! * A part ends where the reference jumps. Parts after a jump and after a robot was placed begin short.
//! * An Euler part that takes a link too deep into what it touches is halved until it does not, or is too short.

use super::body::{Body, Clock, Driven, Trial};
use super::config::steps_in;
use super::model::Model;
use super::start::{end_before, first_part};
use super::{Accuracy, ImplicitConfig};

/// An interval, and the parts that it may be taken in.
#[derive(Debug, Clone, Copy)]
pub struct Interval {
    /// \[s\]
    duration: f64,
    /// Longest part \[s\], of which a whole number fills the interval, and this number.
    step: f64,
    steps: u32,
    /// Whether all parts are Euler steps.
    is_euler: bool,
    /// Length of the parts that take an impact \[s\].
    impact_step: f64,
}

impl Interval {
    pub fn new(config: &ImplicitConfig, accuracy: &Accuracy, duration: f64) -> Self {
        let steps = steps_in(duration, accuracy.step);
        let step = duration / f64::from(steps);
        let is_euler = config.order == 1;
        let impact_step = if is_euler { step } else { accuracy.impact_step.min(0.25 * step) };
        Self { duration, step, steps, is_euler, impact_step }
    }

    pub fn step(&self) -> f64 {
        self.step
    }
}

/// The next part of an interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Part {
    /// \[s\]
    pub length: f64,
    /// An Euler step instead of one of second order.
    pub is_euler: bool,
    /// Whether it may be rejected because it takes a penetration too deep; parts of second order always may.
    pub may_fail: bool,
}

/// What a part ends with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Ends {
    Nothing,
    /// The reference jumps here.
    Jump,
    Interval,
}

/// Position of a robot within its interval, and the part it takes next.
#[derive(Debug, Clone, Copy)]
pub struct StepPlan {
    pub part: Part,
    ends: Ends,
    /// Time since the interval began \[s\], and the whole steps that it contains.
    progress: f64,
    steps: u32,
    /// Length of the next Euler part, and time that the last ones have taken without one of second order between \[s\].
    euler_length: f64,
    euler_run: f64,
    /// Parts of the present step that were rejected, and the longest that is tried since one took a link too deep \[s\].
    rejections: u32,
    longest: f64,
    /// Time to the border of a patch that the part at hand would have crossed; infinite otherwise \[s\].
    to_border: f64,
    /// Linear solves of the robot's last stage.
    solves: u32,
}

impl StepPlan {
    pub fn at_start(interval: &Interval) -> Self {
        Self {
            part: Part { length: 0.0, is_euler: false, may_fail: false },
            ends: Ends::Nothing,
            progress: 0.0,
            steps: 0,
            euler_length: interval.impact_step,
            euler_run: 0.0,
            rejections: 0,
            longest: f64::INFINITY,
            to_border: f64::INFINITY,
            solves: 0,
        }
    }

    pub fn has_ended(&self, interval: &Interval) -> bool {
        self.steps == interval.steps
    }

    /// Time from the beginning of the interval to that of the next part \[s\], and linear solves of the last stage.
    pub fn position(&self) -> (f64, u32) {
        (self.progress, self.solves)
    }

    /// Chooses the next part.
    pub fn choose_part<M: Model>(&mut self, interval: &Interval, robot: &Driven<M>) {
        let Driven { body, reference } = robot;
        let (time, clock) = (body.state.time, &body.clock);
        let to_jump = end_before(time, |time| reference.next_jump(time)) - time;
        let to_end = interval.duration - self.progress;
        let (left, end) = if to_jump < to_end { (to_jump, Ends::Jump) } else { (to_end, Ends::Interval) };
        let may_be_rejected = self.rejections < MOST_REJECTIONS;
        let is_euler = interval.is_euler || clock.euler_time > 0.0 || !may_be_rejected;
        let own = if is_euler { self.euler_length } else { clock.next.min(interval.step).min(self.to_border) };
        let wanted = own.min(self.longest);
        let at_border = self.to_border < f64::INFINITY;
        let is_exact = interval.is_euler || clock.ends_at_closing || at_border;
        let takes_all = match is_exact {
            true if at_border => 1.0,
            true => ALMOST,
            false => STRETCHED,
        };
        let length;
        (length, self.ends) = match wanted / left {
            share if share >= takes_all => (left, end),
            // Two equal parts rather than a long and a tiny one.
            share if share > 0.5 && !is_exact && !is_euler => (0.5 * left, Ends::Nothing),
            _ => (wanted, Ends::Nothing),
        };
        let is_divisible = length > interval.impact_step / LONGEST_OVER_SHORTEST_EULER;
        self.part = Part { length, is_euler, may_fail: may_be_rejected && (is_divisible || !is_euler) };
        self.solves = body.solves;
    }

    /// Accepts the part: the robot has moved on by its length, or is quarantined if it diverged.
    pub fn accept<M: Model>(&mut self, interval: &Interval, body: &mut Body<M>) {
        self.progress += self.part.length;
        self.longest *= GROWTH_AFTER_SINKING;
        self.to_border = f64::INFINITY;
        body.quarantine();
        if body.statistics.diverged {
            return;
        }
        let Body { trial, clock, .. } = body;
        if self.part.is_euler {
            self.follow_euler(interval, trial, clock);
        } else {
            self.follow_second_order(interval, trial, clock);
        }
        if clock.euler_time == 0.0 && !interval.is_euler {
            self.cut_at_forecast(interval, trial, clock);
        }
        if self.ends == Ends::Jump {
            *clock = Clock { next: first_part(interval.step), ..Clock::default() };
        }
        let passed = match self.ends {
            Ends::Interval => interval.steps,
            _ => ((self.progress / interval.step) as u32).min(interval.steps - 1),
        };
        if passed > self.steps {
            self.end_step(interval, body, passed);
        }
    }

    /// After a part of second order.
    fn follow_second_order(&mut self, interval: &Interval, trial: &Trial, clock: &mut Clock) {
        if std::mem::take(&mut clock.ends_at_closing) && trial.closing.is_fresh() {
            clock.euler_time = interval.impact_step;
        }
        let length = self.part.length;
        let longest = LARGEST_GROWTH * clock.next.max(length);
        clock.next = scaled(length, trial.deviation, 0.5).max(length.min(interval.impact_step)).min(longest);
    }

    /// After an Euler part.
    fn follow_euler(&mut self, interval: &Interval, trial: &Trial, clock: &mut Clock) {
        let (length, impact_step) = (self.part.length, interval.impact_step);
        if interval.is_euler {
            self.euler_length = impact_step;
            return;
        }
        self.euler_run += length;
        clock.euler_time -= length;
        if clock.euler_time < (1.0 - ALMOST) * impact_step {
            clock.euler_time = 0.0;
        }
        if trial.closing.is_fresh() {
            clock.euler_time = clock.euler_time.max(impact_step);
        }
        let equal_run = if length >= impact_step { ALMOST * IMPACT * impact_step } else { MOST_EQUAL * length };
        if clock.euler_time == 0.0 {
            (self.euler_run, self.euler_length) = (0.0, impact_step);
            clock.next = AFTER_IMPACT * length;
        } else if self.euler_run > equal_run {
            self.euler_length = LONGER * length;
            clock.euler_time = clock.euler_time.max(self.euler_length);
        }
    }

    /// Ends the next part where an open contact is forecast to close, or takes that at once.
    fn cut_at_forecast(&mut self, interval: &Interval, trial: &Trial, clock: &mut Clock) {
        let time = trial.closing.forecast;
        if time < AT_ONCE * interval.impact_step {
            clock.euler_time = IMPACT * interval.impact_step;
        } else if time < clock.next {
            (clock.next, clock.ends_at_closing) = (time, true);
        }
    }

    /// The part is retaken in shorter parts, or in Euler parts.
    pub fn reject<M: Model>(&mut self, interval: &Interval, body: &mut Body<M>) {
        self.rejections += 1;
        let Body { trial, clock, .. } = body;
        let length = self.part.length;
        self.to_border = f64::INFINITY;
        let is_sunk_only = self.part.is_euler || trial.deviation <= 1.0;
        if is_sunk_only && !self.part.is_euler && trial.closing.crossing < length {
            body.statistics.events += 1;
            self.to_border = trial.closing.crossing;
            return;
        }
        if is_sunk_only {
            self.longest = 0.5 * length;
        }
        if self.part.is_euler {
            return;
        }
        body.statistics.events += 1;
        clock.ends_at_closing = false;
        let closes_fresh = trial.closing.is_fresh() && !is_sunk_only;
        let closes_at_once = closes_fresh && trial.closing.at <= AT_ONCE * interval.impact_step;
        let is_too_short = !closes_fresh && length <= SHORTEST * interval.impact_step;
        if closes_at_once || is_too_short || self.rejections > MOST_SECOND_ORDER_REJECTIONS {
            self.euler_length = interval.impact_step.min(0.5 * length);
            clock.euler_time = IMPACT * self.euler_length;
        } else if closes_fresh {
            (clock.next, clock.ends_at_closing) = (trial.closing.at.min(0.95 * length), true);
        } else if !is_sunk_only {
            clock.next = scaled(length, trial.deviation, 0.15).min(0.6 * length);
        }
    }

    /// Ends steps; sets the time without accumulated round-off at the end of the interval.
    fn end_step<M: Model>(&mut self, interval: &Interval, body: &mut Body<M>, passed: u32) {
        body.statistics.steps += passed - self.steps;
        self.steps = passed;
        self.rejections = 0;
        body.begin_step();
        if passed == interval.steps {
            body.state.time = body.interval_start() + interval.duration;
        }
    }
}

/// A length that deviates by [`AIM`], from one that deviated by `deviation`, and not less than `least` of it. A deviation
/// grows with the square or the cube of the length: whichever gives the shorter one counts.
fn scaled(length: f64, deviation: f64, least: f64) -> f64 {
    // A deviation that is not a number shortens the most.
    let share = AIM / deviation;
    let factor = if share > 1.0 { share.cbrt() } else { share.sqrt() };
    if factor >= least { length * factor } else { length * least }
}

/// Share of the allowed deviation that the next part aims at.
const AIM: f64 = 0.25;

/// Largest growth from part to part.
const LARGEST_GROWTH: f64 = 2.0;

/// Share of what is left beyond which a part takes all of it, and that for a part that must not be longer than wanted.
const STRETCHED: f64 = 0.8;
const ALMOST: f64 = 0.999;

/// Euler parts of an impact.
const IMPACT: f64 = 2.0;

/// Time to a closing, in Euler parts, below which they begin at once.
const AT_ONCE: f64 = 1.2;

/// Shortest part of second order that is divided into others, in Euler parts.
const SHORTEST: f64 = 1.0 / 64.0;

/// Length of the part after an impact, in Euler parts; and growth of Euler parts from the third on.
const AFTER_IMPACT: f64 = 4.0;
const LONGER: f64 = 1.5;

/// Equal Euler parts after which shorter ones than those of an impact grow: closings in every one of them would keep them
/// as short.
const MOST_EQUAL: f64 = 64.0;

/// Growth of the longest part that is tried after one that took a link too deep.
const GROWTH_AFTER_SINKING: f64 = 1.2;

/// Longest Euler part over the shortest that is halved for a penetration: by then links that move at metres per second
/// travel less than a millimetre.
const LONGEST_OVER_SHORTEST_EULER: f64 = 64.0;

/// How many parts of one step may be rejected before the rest of it is taken in Euler parts that are accepted, and how
/// many before each further one is replaced by Euler parts. Robots whose light links spin at hundreds of metres per second
/// would otherwise be divided thousands of times, and a link that sinks at any length without end.
const MOST_REJECTIONS: u32 = 64;
const MOST_SECOND_ORDER_REJECTIONS: u32 = 40;

/// Laws of the plan under verdicts that no robot would give.
#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;

    use super::*;
    use crate::environment::rng::Rng;
    use crate::gait::{JointTarget, Reference};
    use crate::obstacles::ObstacleGrid;
    use crate::planar::Planar;
    use crate::robot::{Robot, RobotConfig};
    use crate::stepping::Closing;

    /// A reference that jumps at all multiples of a time \[s\].
    struct Jumping(f64);

    impl Reference<JointTarget> for Jumping {
        fn target(&self, _: usize, _: f64) -> JointTarget {
            JointTarget::default()
        }

        fn next_jump(&self, time: f64) -> f64 {
            ((time / self.0).floor() + 1.0) * self.0
        }
    }

    /// One of `values`, or a number between 1e-`decades` and 1e`decades` times `unit`.
    fn drawn(rng: &mut Rng, values: &[f64], decades: f64, unit: f64) -> f64 {
        let choice = rng.uniform(0.0, values.len() as f64 + 1.0) as usize;
        values.get(choice).copied().unwrap_or_else(|| unit * 10f64.powf(rng.around_zero(decades)))
    }

    /// A trial of a part of the given length, of any deviation and any closings.
    fn drawn_trial(rng: &mut Rng, length: f64) -> Trial {
        let deviation = drawn(rng, &[f64::NAN, f64::INFINITY, 0.0, 1e-300, 1e300, 1.0], 3.0, 1.0);
        let at = drawn(rng, &[f64::INFINITY, f64::INFINITY, 0.0, length, 0.5 * length], 3.0, length);
        let forecast = drawn(rng, &[f64::INFINITY, f64::INFINITY, 0.0, 1e-300], 3.0, length);
        let crossing = drawn(rng, &[f64::INFINITY, f64::INFINITY, 0.999 * length], 3.0, length);
        Trial { deviation, closing: Closing { at, forecast, crossing } }
    }

    proptest! {
        #![proptest_config(ProptestConfig {
            cases: 3000, failure_persistence: None, rng_seed: RngSeed::Fixed(7), ..ProptestConfig::default()
        })]

        /// A rejected part is followed by a shorter one or by Euler parts, and no more than `MOST_REJECTIONS` parts of a
        /// step are rejected, whatever is found out about them.
        #[test]
        fn every_interval_ends(seed: u64, order in 1u32..3, refusals in prop::array::uniform2(0.0f64..1.3)) {
            let mut rng = Rng::new(seed, 0);
            let step = 0.025;
            let impact_step = Some(step * 10f64.powf(-rng.uniform(0.0, 3.0)));
            let config = ImplicitConfig { order, impact_step, ..ImplicitConfig::default() };
            let interval = Interval::new(&config, &config.accuracy(&Planar::ACCURACY), 2.0 * step);
            let robot = Robot::new(&RobotConfig { links: 2, ..RobotConfig::default() }).expect("admissible");
            let jumps = Jumping(drawn(&mut rng, &[f64::INFINITY], 1.0, step));
            let mut body = Body::<Planar>::new(&robot, ObstacleGrid::default());
            let robot = Driven { body: &mut body, reference: &jumps };
            robot.body.clock.next = drawn(&mut rng, &[step, f64::INFINITY], 9.0, step);
            robot.body.begin();
            let mut plan = StepPlan::at_start(&interval);
            // Lengths that 64 rejections have left grow again, by a fifth from part to part.
            let most = 2000.0 + 2.0 * interval.duration / interval.impact_step;
            let mut parts = 0;
            while !plan.has_ended(&interval) {
                parts += 1;
                prop_assert!(f64::from(parts) < most, "{parts} parts");
                plan.choose_part(&interval, &robot);
                let Part { length, is_euler, may_fail } = plan.part;
                prop_assert!(length > 0.0 && length <= interval.step() / STRETCHED, "{:?}", plan);
                robot.body.trial = drawn_trial(&mut rng, length);
                if may_fail && rng.unit() < refusals[usize::from(is_euler)] {
                    plan.reject(&interval, robot.body);
                    let rejected = plan.part;
                    let mut next = plan;
                    next.choose_part(&interval, &robot);
                    // A border may lie at the very end of a part.
                    let most = if plan.to_border.is_finite() { 1.0 } else { 0.96 };
                    let is_shorter = next.part.length < most * rejected.length;
                    prop_assert!(is_shorter || next.part.is_euler && !rejected.is_euler);
                    prop_assert!(plan.rejections <= MOST_REJECTIONS);
                } else {
                    robot.body.state.time += length;
                    plan.accept(&interval, robot.body);
                }
            }
        }
    }
}
