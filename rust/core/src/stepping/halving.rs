use super::body::Clock;
use super::plan::{Division, Ends, Interval, Part};
use super::start::longest_step;

/// Halves a step repeatedly.
///
/// * A part in which a peg's force changes abruptly is halved, and at last taken in Euler steps. Such parts come in
///   groups, so the next ones are not tried where they would be rejected if forces changed as they just did: the step
///   after a divided one is halved at once, as is one that is too long for the last deviation, and a part after Euler
///   steps of abrupt changes is taken in Euler steps itself.
/// * An Euler step that takes a link too deep into a peg or another link is halved until it does not, or is too short.
///   Two halves that were taken are followed by a step of their common length.
/// * A robot starts from rest with a reference in motion, so its first step is halved towards the start until it
///   resolves the boundary layer of a stiff controller, and the steps that follow grow slowly.
/// * A piece of a step ends where the reference jumps (T 7.2.2): links that a jump sets in motion are treated like
///   those of a robot just placed. A step across would smear the jump over its length.
///
/// Parts of all robots have one of few lengths, whatever their number.
#[derive(Debug, Clone, Copy)]
pub struct Halving {
    /// The current piece, up to a jump of the reference or the end of the step \[s\].
    piece: f64,
    ends: Ends,
    /// End of a step with jumps \[s\]; steps without are not measured by the clock, which has round-off.
    step_end: f64,
    /// Depth of the current part, and for each depth whether it is in the second half.
    depth: u32,
    second_half: u32,
    /// The current part was rejected at this depth: it is divided.
    is_rejected: bool,
    /// Remaining Euler steps of the current part, in how many the part is divided, and how often they were halved.
    euler_left: u32,
    euler_parts: u32,
    euler_halvings: u32,
    /// Parts of the step that were rejected.
    rejections: u32,
}

impl Halving {
    fn length(&self) -> f64 {
        self.piece / f64::from(1u32 << self.depth)
    }

    /// Begins the piece of a step with jumps that starts at `time`, from where on the reference jumps after `jump`.
    fn begin_piece(&mut self, time: f64, jump: f64) {
        (self.piece, self.ends) =
            if jump >= self.step_end { (self.step_end - time, Ends::Step) } else { (jump - time, Ends::Jump) };
        (self.depth, self.second_half) = (0, 0);
    }

    fn halve(&mut self) {
        self.depth += 1;
        self.second_half &= !(1 << self.depth);
    }

    /// Takes the current part in `parts` Euler steps.
    fn begin_euler(&mut self, parts: u32) {
        (self.euler_left, self.euler_parts, self.euler_halvings) = (parts, parts, 0);
    }

    fn euler_part(&self) -> Part {
        let length = self.length() / f64::from(self.euler_parts);
        let may_fail = self.euler_halvings < MOST_EULER_HALVINGS && self.rejections < MOST_REJECTIONS;
        Part { length, is_euler: true, may_fail }
    }

    fn halve_euler(&mut self) {
        self.euler_left *= 2;
        self.euler_parts *= 2;
        self.euler_halvings += 1;
    }

    /// Moves on after an Euler step; returns whether it was the part's last.
    fn advance_euler(&mut self) -> bool {
        self.euler_left -= 1;
        while self.euler_halvings > 0 && self.euler_left.is_multiple_of(2) {
            self.euler_left /= 2;
            self.euler_parts /= 2;
            self.euler_halvings -= 1;
        }
        self.euler_left == 0
    }

    /// Moves on after a finished part; returns whether the piece is done.
    fn advance(&mut self) -> bool {
        while self.depth > 0 && self.second_half >> self.depth & 1 == 1 {
            self.depth -= 1;
        }
        self.second_half |= 1 << self.depth;
        self.depth == 0
    }
}

impl Division for Halving {
    fn begin_step(interval: &Interval, time: f64, _: &mut Clock, next_jump: impl Fn(f64) -> f64) -> Self {
        let (jump, step_end) = (next_jump(time), time + interval.step);
        let mut division = Self {
            piece: interval.step,
            ends: Ends::Step,
            step_end,
            depth: 0,
            second_half: 0,
            is_rejected: false,
            euler_left: 0,
            euler_parts: 1,
            euler_halvings: 0,
            rejections: 0,
        };
        if jump < step_end {
            division.begin_piece(time, jump);
        }
        division
    }

    fn next_part(&mut self, interval: &Interval, time: f64, clock: &mut Clock, next_jump: impl Fn(f64) -> f64) -> Part {
        if self.ends == Ends::Jump && self.second_half & 1 == 1 {
            self.begin_piece(time, next_jump(time));
        }
        if std::mem::take(&mut self.is_rejected) {
            if self.euler_left > 0 {
                self.halve_euler();
            } else if self.depth < interval.halvings {
                self.halve();
            } else {
                self.begin_euler(interval.euler_steps);
            }
        } else if interval.is_euler && self.euler_left == 0 {
            self.begin_euler(1);
        }
        if self.euler_left > 0 {
            return self.euler_part();
        }
        if self.depth == 0 {
            let is_divided = std::mem::take(&mut clock.was_divided) || clock.last_part.rules_out(self.length());
            if is_divided && interval.halvings > 0 {
                self.halve();
            }
        }
        while self.length() > longest_step(interval.configured, clock.since_start) {
            self.halve();
        }
        if self.depth >= interval.halvings && clock.last_part.was_abrupt() {
            clock.was_divided = true;
            self.begin_euler(interval.euler_steps);
            return self.euler_part();
        }
        Part { length: self.length(), is_euler: false, may_fail: true }
    }

    fn accept(&mut self, _: &Interval, _: &Part, clock: &mut Clock) -> Ends {
        if self.euler_left > 0 && !self.advance_euler() {
            return Ends::Nothing;
        }
        if !self.advance() {
            return Ends::Nothing;
        }
        self.second_half = 1;
        if self.ends == Ends::Jump {
            clock.since_start = 0.0;
        }
        self.ends
    }

    fn reject(&mut self, _: &Interval, _: &Part, clock: &mut Clock) {
        self.is_rejected = true;
        self.rejections += 1;
        clock.was_divided = true;
    }
}

/// How often an Euler step is halved before a robot that still sinks is flagged: by then links that move at metres per
/// second travel less than a millimetre.
const MOST_EULER_HALVINGS: u32 = 6;

/// How many parts of one step may be rejected. Robots whose light links spin at hundreds of metres per second would
/// otherwise be divided thousands of times.
const MOST_REJECTIONS: u32 = 64;
