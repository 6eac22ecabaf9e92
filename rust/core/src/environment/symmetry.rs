//! Left-right symmetry: how quantities change under a reflection in the vertical plane along the goal direction.
//!
//! A reflected robot in a reflected scene moves as the reflection of the first. Observations and actions therefore
//! state for each element whether the reflection keeps its value, changes its sign or moves it to another element;
//! policies that exploit the symmetry read it from there. The phase of a wave counts from half a turn further in the
//! reflection, so its sine and cosine are odd, and so is the amplitude of a vertical wave, which keeps its phase relative
//! to the horizontal one.

/// Behaviour under the reflection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Parity {
    /// The value stays: pitch angles, heights, what points forward.
    Even,
    /// The sign changes: yaw and roll angles, what points to the left.
    Odd,
    /// The value trades places with that of the element as far from the other end of its block.
    Swapped,
}

impl Parity {
    /// Factor on the value, 1 or -1; 0 where it is none.
    pub fn sign(self) -> i8 {
        match self {
            Parity::Even => 1,
            Parity::Odd => -1,
            Parity::Swapped => 0,
        }
    }
}
