//! Contact between links and pegs: gap functions and force directions (T 3.3.2), (T 3.4).

mod gap;
mod near;
pub mod recovery;

pub use gap::{LinkPegContact, gap, link_peg_contact};
pub use near::{NearPair, NearPegs, PAIRS_PER_LINK};
