//! Robots at rest on many contacts.

use nalgebra::Vector2;
use snake_core::control::ControllerConfig;

use crate::case::Motion;
use crate::spatial_case::{CardanMotion, SpatialCase};

/// Lying straight: 22 normal impulses on 12 freedoms.
pub fn flat() -> Vec<SpatialCase> {
    vec![SpatialCase::straight("straight", 1e-2, 0.0)]
}

/// Lying in a curve, with joints that push against friction below its limit.
pub fn pushed() -> Vec<SpatialCase> {
    let curved = |name: &str, step, bend, angle| {
        let mut case = SpatialCase::straight(name, step, 0.0);
        case.posture = Some(curve(bend));
        case.motion = CardanMotion { yaw: Motion::Hold(angle), ..CardanMotion::still() };
        case.controller = ControllerConfig { kp: 0.5, kd: 0.05, ..ControllerConfig::default() };
        case
    };
    vec![curved("curved", 1e-2, 0.5, 0.1), curved("curved, 50 ms", 5e-2, 0.4, 0.05)]
}

/// A robot that straightened itself: contacts stand where they stopped sliding.
pub fn straightened() -> Vec<SpatialCase> {
    let mut case = SpatialCase::straight("straightened itself", 1e-2, 0.0);
    case.posture = Some(curve(0.4));
    vec![case]
}

fn curve(bend: f64) -> Vec<Vector2<f64>> {
    (0..10).map(|j| Vector2::new(bend * (f64::from(j) * 1.7).sin(), 0.0)).collect()
}
