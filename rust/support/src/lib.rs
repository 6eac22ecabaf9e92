//! What several tests of the core share: robots, scenes, references, random stages and dense solvers to compare with.

pub mod allocation;
pub mod flat;
pub mod friction_scenes;
pub mod golden;
pub mod lanes;
pub mod pair;
pub mod planar;
pub mod planar_stage;
pub mod pushing;
pub mod spatial;
pub mod spatial_random;
pub mod spatial_stage;
