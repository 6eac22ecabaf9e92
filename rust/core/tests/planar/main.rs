//! Laws, accuracy and solver of the planar model.

mod actuation_laws;
mod allocation;
mod backlash_laws;
mod chain_sweep;
mod conservation_laws;
mod contact_geometry;
mod convergence;
mod fallback;
mod fleet_lanes;
mod friction_laws;
mod golden;
mod impact_laws;
mod io_control;
mod joint_limit_laws;
mod link_pair_geometry;
mod obstacle_friction;
mod operation_count;
mod penetration_laws;
mod reference;
mod self_contact_laws;
mod self_contact_stage;
mod stribeck_laws;
mod wall_geometry;
