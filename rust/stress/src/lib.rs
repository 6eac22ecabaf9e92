//! Scenes and stage problems far harder than any robot should meet, and what must hold in them.

pub mod case;
pub mod draw;
pub mod dump;
pub mod figures;
pub mod geometry;
pub mod observable;
pub mod requirements;
pub mod scenarios;
pub mod spatial_case;
pub mod stages;
pub mod table;
