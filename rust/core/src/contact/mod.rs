//! Contact of links with obstacles and with each other: gap functions and force directions (T 3.3.2), (T 3.4).

mod capsule_pair;
mod close_pairs;
mod folding;
mod gap;
mod link_pair;
mod memory;
mod near;
mod outline;
pub mod recovery;
mod self_search;

pub use capsule_pair::{
    CAPSULE_CONTACTS, Capsule, CapsuleContact, capsule_contact, capsule_contacts, capsule_gap, closest_capsule_contact,
};
pub use close_pairs::ClosePairs;
pub use folding::{Folding, FoldingBound};
pub use gap::{
    LinkContact, features, gap, link_obstacle_contact, link_obstacle_gap, link_peg_contact, obstacle_gap,
    touching_distance, wall_gap,
};
pub use link_pair::{
    LINK_CONTACTS_PER_LINK, LINK_PAIR_CONTACTS, LinkPairContact, PlacedLink, centre_lines_cross, link_pair_contact,
    link_pair_contacts, link_pair_gap, movable_contacts, movable_features, pair_features,
};
pub use memory::{ContactId, ContactMemory, KnownContact, Source};
pub use near::{NearObstacles, NearPair, PAIRS_PER_LINK, clear_way};
pub use self_search::{self_gap, visit_close_pairs, visit_movable_pairs};
