use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Mean acceleration of the link with the sensor over the last control period: the change of its velocity over the period, which holds
/// impacts whole, however short they are.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Accelerometer {
    /// Of the CG at the end of that period \[m/s\].
    velocity: Vector3<f64>,
    /// World frame \[m/s^2\].
    pub acceleration: Vector3<f64>,
}

impl Accelerometer {
    /// Ends a control period of length `period` \[s\] with `velocity` \[m/s\].
    pub fn finish_period(&mut self, velocity: Vector3<f64>, period: f64) {
        self.acceleration = (velocity - self.velocity) / period;
        self.velocity = velocity;
    }
}
