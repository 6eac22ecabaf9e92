//! Properties of the force laws.

mod derivatives;
mod projection;
mod skin;
