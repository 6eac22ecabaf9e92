//! Laws, accuracy and solver of the planar model.

mod actuation_laws;
mod allocation;
mod backlash_laws;
mod box_laws;
mod cg_offset_laws;
mod chain_sweep;
mod conservation_laws;
mod contact_geometry;
mod convergence;
mod fallback;
mod fleet_lanes;
mod following_bounds;
mod friction_laws;
mod golden;
mod impact_laws;
mod io_control;
mod joint_gain_laws;
mod joint_limit_laws;
mod link_friction_laws;
mod link_pair_geometry;
mod motor_laws;
mod movable_laws;
mod obstacle_friction;
mod operation_count;
mod penetration_laws;
mod reference;
mod scheme_laws;
mod self_contact_laws;
mod self_contact_stage;
mod skin_laws;
mod spin_laws;
mod stribeck_laws;
mod wall_geometry;

use snake_core::stepping::ImplicitConfig;
use snake_test_support::planar::implicit;

/// The schemes of which scheme_laws.rs and other files hold, by name; the crate of the thesis runs those files with its own.
fn schemes(step: f64) -> [(&'static str, ImplicitConfig); 2] {
    [("implicit 1", implicit(step, 1)), ("implicit 2", implicit(step, 2))]
}

/// Schemes for robots that follow the gait: in steps of this length, or as explicit PD needs them and to `_epsilon` \[N s\].
fn fit_for_the_gait(step: f64, _epsilon: f64) -> [(&'static str, ImplicitConfig); 2] {
    schemes(step)
}

/// A scheme and how long a run with it may take \[s\].
fn for_a_long_run() -> (&'static str, ImplicitConfig, f64) {
    ("implicit 2", implicit(1e-2, 2), 2000.0)
}
