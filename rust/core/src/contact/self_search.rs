//! Which links of a robot may touch each other, a search that skips along the chain, and what it can push.

use nalgebra::{SVector, Vector2, Vector3};

use crate::obstacles::Nodes;
use crate::robot::Link;

use super::link_pair::{PlacedLink, link_pair_gap};

/// Visits all pairs `i < j` of links that are not neighbours and whose surfaces may be within `margin` of each other;
/// `centre` gives the positions of the links' CGs, in the plane or in 3D.
///
/// Along the chain the distance of a link from link `i` changes by at most the distance of neighbouring CGs, so that a
/// far link rules out those next to it: a stretched robot takes O(n log n) distances, a coiled one as many as it has
/// close pairs.
pub fn visit_close_pairs<const D: usize>(
    links: &[Link],
    centre: impl Fn(usize) -> SVector<f64, D>,
    margin: f64,
    mut visit: impl FnMut(usize, usize),
) {
    let longest = Link::farthest_neighbours(links);
    let farthest = links.iter().map(Link::reach).fold(0.0, f64::max);
    for i in 0..links.len() {
        let mut j = i + 2;
        while j < links.len() {
            let distance = (centre(j) - centre(i)).norm();
            if distance <= links[i].reach() + links[j].reach() + margin {
                visit(i, j);
            }
            let clear = distance - (links[i].reach() + farthest + margin);
            // Where a state is that of a diverged computation, the number of links to skip saturates.
            j = j.saturating_add(1).saturating_add((clear / longest).max(0.0) as usize);
        }
    }
}

/// Smallest [`link_pair_gap`] of a robot's links that are not neighbours \[m\]; infinite where none are within `margin` of
/// each other.
pub fn self_gap(links: &[Link], poses: &[Vector3<f64>], margin: f64) -> f64 {
    let mut smallest = f64::INFINITY;
    visit_close_pairs(
        links,
        |link| poses[link].xy(),
        margin,
        |i, j| {
            let placed = [i, j].map(|link| PlacedLink::new(&links[link], poses[link]));
            smallest = smallest.min(link_pair_gap([&placed[0], &placed[1]]));
        },
    );
    smallest
}

/// Visits the pairs that may be within `margin` of each other of nodes at these places and, behind them, something that can be
/// pushed; in the order of their numbers, which a contact keeps from step to step.
pub fn visit_movable_pairs(
    nodes: Nodes,
    place: impl Fn(usize) -> Vector2<f64>,
    margin: f64,
    mut visit: impl FnMut(usize, usize),
) {
    for second in nodes.links.len()..nodes.count() {
        let (movable, at) = (nodes.get(second), place(second));
        for first in 0..second {
            let reach = nodes.get(first).reach() + movable.reach() + margin;
            if (place(first) - at).norm_squared() < reach * reach {
                let [before, behind] =
                    if nodes.number(first) < nodes.number(second) { [first, second] } else { [second, first] };
                visit(before, behind);
            }
        }
    }
}
