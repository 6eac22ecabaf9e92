//! How deep the end of a step takes links into pegs and into each other.
//!
//! Gaps enter a stage by their linearisation, so that links which turn fast end it inside what they touch. Their true
//! gaps decide whether a step is taken: one that leaves more than [`ALLOWED`] is divided.

/// What a step does to the penetrations of a robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Sinking {
    No,
    /// A shorter step has to be tried.
    TooDeep,
    /// So deep that the robot is flagged if there is no shorter step.
    BeyondRecovery,
}

impl Sinking {
    /// Of a contact whose gap is `start` and `end` at the start and at the end of the step \[m\].
    pub fn of(start: f64, end: f64) -> Self {
        let deepening = start - end;
        // A robot that was placed inside a peg moves out slowly, and is neither divided nor flagged for it.
        let was_inside = start < -EXCESSIVE;
        if end < -EXCESSIVE && !was_inside {
            Self::BeyondRecovery
        } else if end < -ALLOWED && deepening > if was_inside { ALLOWED } else { NEGLIGIBLE } {
            Self::TooDeep
        } else {
            Self::No
        }
    }
}

/// Penetration that a step may leave \[m\].
pub const ALLOWED: f64 = 8e-4;

/// Penetration that is flagged \[m\].
const EXCESSIVE: f64 = 1e-3;

/// Deepening that no shorter step avoids: round-off and the tolerance of the stages \[m\].
const NEGLIGIBLE: f64 = 1e-7;
