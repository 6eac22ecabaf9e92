//! Properties of the force laws.

mod projection;
