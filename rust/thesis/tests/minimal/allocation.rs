//! Nothing allocates in an implicit step of the minimal model: every request to the allocator is counted.

use snake_core::control::{ControllerConfig, Treatment};
use snake_core::noise::NoiseConfig;
use snake_test_support::allocation::REQUESTS;
use snake_thesis::minimal::{MinimalConfig, pd};

use crate::robots::{default_config, io_for_period, soft_start, straight};

#[test]
fn an_implicit_step_does_not_allocate() {
    let limited = ControllerConfig { torque_limit: Some(10.0), ..ControllerConfig::io() };
    let held = ControllerConfig { treatment: Treatment::Step, ..io_for_period(0.02) };
    let cases = [(pd(), 0.0), (ControllerConfig::io(), 0.0), (limited, 0.0), (held, 1e-5)];
    for (controller, joint_angle) in cases {
        let noise = NoiseConfig { joint_angle, ..NoiseConfig::default() };
        let mut simulation = straight(&MinimalConfig { controller, noise, ..default_config() });
        let reference = soft_start();
        assert!(simulation.advance(0.05, &reference));
        let before = REQUESTS.get();
        assert!(simulation.advance(1.0, &reference));
        assert_eq!(REQUESTS.get() - before, 0, "{controller:?}");
    }
}
