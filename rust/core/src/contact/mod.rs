//! Contact between links and pegs: gap functions and force directions (T 3.3.2), (T 3.4).

mod folding;
mod gap;
mod link_pair;
mod near;
pub mod recovery;
mod self_search;

pub use folding::FoldingBound;
pub use gap::{LinkPegContact, gap, link_peg_contact};
pub use link_pair::{
    LinkPairContact, PlacedLink, centre_lines_cross, link_pair_contact, link_pair_ends, link_pair_gap,
};
pub use near::{NearPair, NearPegs, PAIRS_PER_LINK};
pub use self_search::{self_gap, visit_close_pairs};
