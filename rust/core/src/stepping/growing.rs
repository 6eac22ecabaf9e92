use super::body::Clock;
use super::plan::{Division, Ends, Interval, Part};
use super::start::{first_step, longest_step};

/// Halves parts that have to be retaken, and doubles those that follow unless the last deviation rules that out.
///
/// * A part in which forces change abruptly is halved and halved again, and at last taken in Euler steps.
/// * A part ends where the joints' reference jumps, as in soft start: forces before the jump do not predict those after
///   it. Parts then double, beginning with a short one that resolves how the joints jump after it.
/// * The first parts after a robot was placed are short.
#[derive(Debug, Clone, Copy)]
pub struct Growing {
    /// Elapsed part of the step \[s\].
    done: f64,
    ends: PartEnd,
    /// Longest part to be tried \[s\].
    next: f64,
    /// Remaining Euler steps, if any.
    euler: Option<EulerSteps>,
}

/// What bounds a part of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum PartEnd {
    Nothing,
    Step,
    EulerSteps,
    Jump,
}

/// A piece of a step that is taken in Euler steps.
#[derive(Debug, Clone, Copy)]
struct EulerSteps {
    /// Where it ends, after the start of the step \[s\].
    end: f64,
    /// Length of the steps, which are halved where links sink \[s\].
    step: f64,
}

impl Division for Growing {
    fn begin_step(interval: &Interval, _: f64, clock: &mut Clock, _: impl Fn(f64) -> f64) -> Self {
        let euler = interval.is_euler.then_some(EulerSteps { end: interval.step, step: interval.step });
        let mut next = interval.step;
        while next > interval.shortest() && clock.last_part.rules_out(next) {
            next *= 0.5;
        }
        Self { done: 0.0, ends: PartEnd::Nothing, next, euler }
    }

    fn next_part(&mut self, interval: &Interval, time: f64, clock: &mut Clock, next_jump: impl Fn(f64) -> f64) -> Part {
        let (mut left, mut longest);
        (left, self.ends, longest) = match self.euler {
            Some(EulerSteps { end, step }) => (end - self.done, PartEnd::EulerSteps, step),
            None => {
                let longest = longest_step(interval.configured, clock.since_start);
                (interval.step - self.done, PartEnd::Step, longest)
            }
        };
        let to_jump = next_jump(time) - time;
        if to_jump < left {
            (left, self.ends) = (to_jump, PartEnd::Jump);
        }
        if self.euler.is_none() {
            longest = longest.min(first_step(interval.configured) + clock.since_jump);
        }
        // Two equal parts rather than a long and a tiny one.
        let wanted = self.next.min(longest);
        let length;
        (length, self.ends) = match wanted / left {
            ALMOST..=f64::INFINITY => (left, self.ends),
            0.5..ALMOST => (0.5 * left, PartEnd::Nothing),
            _ => (wanted, PartEnd::Nothing),
        };
        let may_fail = self.euler.is_none_or(|euler| length > euler.step * SHORTEST_EULER);
        Part { length, is_euler: self.euler.is_some(), may_fail }
    }

    fn accept(&mut self, interval: &Interval, part: &Part, clock: &mut Clock) -> Ends {
        self.done += part.length;
        let doubled = 2.0 * part.length;
        self.next = if clock.last_part.rules_out(doubled) { part.length } else { doubled };
        match self.ends {
            PartEnd::Nothing => Ends::Nothing,
            PartEnd::Jump => {
                clock.since_jump = 0.0;
                Ends::Jump
            }
            PartEnd::EulerSteps if interval.step - self.done > (1.0 - ALMOST) * interval.step => {
                (self.euler, self.next) = (None, interval.step);
                Ends::Nothing
            }
            PartEnd::EulerSteps | PartEnd::Step => Ends::Step,
        }
    }

    fn reject(&mut self, interval: &Interval, part: &Part, _: &mut Clock) {
        self.next = 0.5 * part.length;
        if self.euler.is_none() && self.next < ALMOST * interval.shortest() {
            self.next = part.length / f64::from(interval.euler_steps);
            self.euler = Some(EulerSteps { end: self.done + part.length, step: self.next });
        }
    }
}

/// Share of the remaining step beyond which a part takes all of it.
const ALMOST: f64 = 0.999;

/// Shortest Euler step for links that sink, over the first one tried.
const SHORTEST_EULER: f64 = 1.0 / 64.0 + 1e-3;
