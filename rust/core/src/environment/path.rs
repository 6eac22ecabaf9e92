//! The natural path of a gait: the curve the body follows when every link moves along itself.
//!
//! With phi_i = A sin(psi + i beta), 0-based, the links of a chain of mean angle theta_m point along
//! `theta_i = theta_m - K cos(psi + (i - 1/2) beta)`, `K = A / (2 sin(beta / 2))`. As psi grows by
//! |beta| (beta < 0), every link takes the direction of the one before it: without slip the robot
//! moves by one link length along its own body, and link 1 draws the path ahead.

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::Vector2;

use crate::gait::Wave;

/// Natural path of a wave with beta < 0, in the frame whose x-axis is the direction of travel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NaturalPath {
    /// Largest angle between body and direction of travel, -K \[rad\].
    swing: f64,
    beta: f64,
    length: f64,
}

impl NaturalPath {
    /// The path of `wave` (without offset gamma) for links of `length` \[m\].
    pub fn new(wave: &Wave, length: f64) -> Self {
        Self { swing: -wave.amplitude / (2.0 * (0.5 * wave.beta).sin()), beta: wave.beta, length }
    }

    /// Angle from the direction of travel to the forward direction of link 1 at phase psi \[rad\].
    pub fn direction(&self, phase: f64) -> f64 {
        self.swing * (phase - 0.5 * self.beta).cos()
    }

    /// Displacement of link 1 while the phase grows from `from` to `to` \[m\].
    pub fn displacement(&self, from: f64, to: f64) -> Vector2<f64> {
        let steps = ((to - from).abs() / PHASE_STEP).ceil().max(1.0);
        let step = (to - from) / steps;
        let speed = self.length / self.beta.abs();
        let mut sum = Vector2::zeros();
        let mut phase = from + 0.5 * step;
        for _ in 0..steps as usize {
            let (sin, cos) = self.direction(phase).sin_cos();
            sum += Vector2::new(cos, sin);
            phase += step;
        }
        sum * (speed * step)
    }

    /// Distance between neighbouring crests and troughs along the direction of travel \[m\].
    pub fn half_wave(&self) -> f64 {
        self.displacement(0.0, PI).x
    }

    /// Phase at which link 1 crosses the centre line upwards; crest and trough lie a quarter turn
    /// after and before.
    pub fn crossing(&self) -> f64 {
        0.5 * self.beta
    }

    /// Distance from the centre line to the middle of the straight link at a crest \[m\].
    pub fn height(&self) -> f64 {
        let curve = self.displacement(self.crossing(), self.crossing() + FRAC_PI_2).y;
        // A chord of length L lies L^2 / 8 times the curvature |K beta| / L inside its arc.
        curve - self.length * (self.swing * self.beta).abs() / 8.0
    }
}

/// Step of the midpoint rule \[rad\]; its error is below a micrometre for Aiko.
const PHASE_STEP: f64 = PI / 128.0;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gait::Reference;
    use crate::scene::{START_7_5, TABLE_7_5};

    fn aiko() -> NaturalPath {
        NaturalPath::new(&Wave::default(), 0.122)
    }

    #[test]
    fn direction_of_link_1_agrees_with_the_mean_of_a_whole_wave_of_links() {
        let wave = Wave { beta: -PI / 4.0, ..Wave::default() };
        let path = NaturalPath::new(&wave, 0.122);
        // Eight links at 45 degrees make one wave; their mean angle is that of travel plus pi.
        let mut angle = path.direction(0.0) + PI;
        let mut sum = angle;
        for joint in 0..7 {
            angle += wave.target(joint, 0.0).angle;
            sum += angle;
        }
        assert!((sum / 8.0 - PI).abs() < 1e-12, "{}", sum / 8.0 - PI);
    }

    #[test]
    fn the_course_of_table_7_5_lies_along_the_natural_path() {
        let path = aiko();
        let spacing = (TABLE_7_5[6][1] - TABLE_7_5[0][1]) / 6.0;
        assert!((path.half_wave() - spacing).abs() < 1e-3, "printed to a millimetre: {}", path.half_wave());
        // The errata's start was found by search; it is the natural one within half a degree.
        assert!((path.direction(0.0) + PI - START_7_5[2]).abs() < 0.5f64.to_radians());
        // The body passes each peg with a few millimetres to spare.
        let height = 0.5 * (0.178 - 0.003) - 0.125 - 0.0525;
        let clearance = path.height() + height;
        assert!(clearance > 0.0 && clearance < 0.015, "{clearance}");
    }
}
