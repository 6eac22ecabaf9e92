//! Laws, accuracy and solver of the spatial model.

mod accuracy;
mod allocation;
mod ball_laws;
mod body_geometry;
mod capsule_geometry;
mod cg_offset_laws;
mod discrepancy_laws;
mod flight;
mod ground_geometry;
mod hinge_laws;
mod implicit_laws;
mod joint_gain_laws;
mod joint_limit_laws;
mod joints;
mod lanes;
mod motor_laws;
mod movable_laws;
mod obstacle_friction_laws;
mod peg_geometry;
mod penetration_laws;
mod self_contact_laws;
mod self_contact_stage;
mod skin_laws;
mod solid_geometry;
mod stage;
mod top_face_laws;
