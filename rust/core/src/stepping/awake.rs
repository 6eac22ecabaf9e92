//! Which of the obstacles that can be pushed take part in a step.
//!
//! Where one lies still and the ground holds it, the solution of a stage is known: it stays where it is. It *sleeps*: the
//! stages have no node for it, and it costs next to nothing. Once something that is awake comes near it, it wakes, and is a
//! node from that stage on; the stages before would have left it as it was at the start of the step. What starts slightly
//! inside something is not pushed out before one of both moves.

use std::ops::Range;

use nalgebra::{Vector2, Vector3};

use crate::contact::{ContactId, PlacedLink, movable_contacts};
use crate::math::{Laned, MAX_LANES, Real};
use crate::obstacles::{Movable, Moved, Nodes, OutOfPlane};

/// By their numbers in the scene, lane by lane.
pub struct Awake {
    /// In the order of their nodes behind the links.
    awake: [Vec<usize>; MAX_LANES],
    asleep: [Vec<usize>; MAX_LANES],
}

impl Awake {
    pub fn none() -> Self {
        let none = || std::array::from_fn(|_| Vec::new());
        Self { awake: none(), asleep: none() }
    }

    /// Begins the step of a lane's robot, with what it can push; `is_awake` tells by its number whether one moves or may.
    pub fn begin(&mut self, lane: usize, count: usize, is_awake: impl Fn(usize) -> bool) {
        let [awake, asleep] = [&mut self.awake[lane], &mut self.asleep[lane]];
        for list in [&mut *awake, &mut *asleep] {
            list.clear();
            list.reserve(count);
        }
        (0..count).for_each(|number| if is_awake(number) { &mut *awake } else { &mut *asleep }.push(number));
    }

    pub fn of(&self, lane: usize) -> &[usize] {
        &self.awake[lane]
    }

    pub fn asleep(&self, lane: usize) -> &[usize] {
        &self.asleep[lane]
    }

    /// Of the lane that has the most.
    pub fn most(&self) -> usize {
        self.awake.iter().map(Vec::len).fold(0, usize::max)
    }

    /// Whether all that touch each other in a contact of a lane's robot of `links` links sleep.
    pub fn sleeps(&self, lane: usize, links: usize, id: ContactId) -> bool {
        let sleeps = |node: usize| node.checked_sub(links).is_some_and(|number| self.asleep[lane].contains(&number));
        sleeps(id.link) && id.pair().is_none_or(|[_, second]| sleeps(second))
    }

    /// Wakes what sleeps within `margin` of a lane's nodes, of which these are the centres, and within it of what wakes \[m\];
    /// returns the places behind the chain of what has woken. Sleepers lie at the poses `lying`; `meets` tells of a node and
    /// its number whether one is within the margin.
    pub fn wake_near(
        &mut self,
        lane: usize,
        (nodes, margin): (Nodes, f64),
        lying: impl Fn(usize) -> Vector3<f64>,
        centre: impl Fn(usize) -> Vector2<f64>,
        meets: impl Fn(usize, usize, &PlacedLink) -> bool,
    ) -> Range<usize> {
        let (chain, [awake, asleep]) = (nodes.links.len(), [&mut self.awake[lane], &mut self.asleep[lane]]);
        let before = awake.len();
        if asleep.is_empty() {
            return before..before;
        }
        let reach = |number: usize| nodes.get(chain + number).reach();
        let sleeper = |number: usize| PlacedLink::new(nodes.get(chain + number), lying(number));
        let is_near = |number: usize, there: Vector2<f64>, around: f64| {
            let touching = reach(number) + margin + around;
            (lying(number).xy() - there).norm_squared() < touching * touching
        };
        // A circle around all links, so that one look does for what is far.
        let middle = centre(chain / 2);
        let farthest = |link: usize| (centre(link) - middle).norm() + nodes.links[link].reach();
        let around = (0..chain).map(farthest).fold(0.0, f64::max);
        asleep.retain(|&number| {
            let touches = |node: usize, other: usize| {
                is_near(number, centre(node), nodes.get(other).reach()) && meets(node, other, &sleeper(number))
            };
            let mut others = awake[..before].iter().zip(chain..);
            let wakes = (is_near(number, middle, around) && (0..chain).any(|link| touches(link, link)))
                || others.any(|(other, node)| touches(node, chain + other));
            if wakes {
                awake.push(number);
            }
            !wakes
        });
        let mut waking = before;
        while let Some(&other) = awake.get(waking) {
            asleep.retain(|&number| {
                let wakes = is_near(number, lying(other).xy(), reach(other))
                    && are_within(margin, [&sleeper(other), &sleeper(number)]);
                if wakes {
                    awake.push(number);
                }
                !wakes
            });
            waking += 1;
        }
        before..awake.len()
    }

    /// Copies what there is of each in the scene to the nodes of a lane's robot.
    pub fn write<T: Real, X: Laned<T>>(&self, lane: usize, to: &mut [X], from: &[X::One]) {
        for (to, &number) in to.iter_mut().zip(&self.awake[lane]) {
            to.set_lane(lane, &from[number]);
        }
    }

    /// And back; what there is of those that sleep remains.
    pub fn read<T: Real, X: Laned<T>>(&self, lane: usize, from: &[X], to: &mut [X::One]) {
        for (from, &number) in from.iter().zip(&self.awake[lane]) {
            to[number] = from.lane(lane);
        }
    }
}

/// Whether a node and something that can be pushed would have a contact with this margin \[m\].
pub fn are_within(margin: f64, pair: [&PlacedLink; 2]) -> bool {
    movable_contacts(pair, margin).next().is_some()
}

/// Friction of the ground on something that lies still, force and moment \[N\], \[N m\]; `None` where it moves, or where the
/// ground cannot hold it against gravity \[m/s^2\] and its spring.
pub fn holding(movable: &Movable, moved: &Moved, gravity: &Vector3<f64>) -> Option<Vector3<f64>> {
    let Moved { pose, twist, out_of_plane: OutOfPlane { height, rise, roll } } = moved;
    let stiffness = movable.spring.map_or(0.0, |spring| spring.stiffness);
    let force = movable.deflection(&pose.xy()) * stiffness - gravity.xy() * movable.link.mass;
    let most = movable.friction(-gravity.z).x;
    // Without friction what creeps goes on.
    let slowest = if most > 0.0 { AT_REST } else { 0.0 };
    let is_still = twist.iter().chain([rise]).chain(roll).all(|rate| rate.abs() <= slowest);
    let is_lying = movable.ball.is_none() || (height - movable.link.radius).abs() <= LYING;
    (is_still && is_lying && force.norm() <= HELD * most).then(|| force.push(0.0))
}

/// Velocity that counts as none \[m/s\], \[rad/s\].
pub const AT_REST: f64 = 1e-7;

/// From the plane of the ground to a ball that lies there, at most \[m\].
const LYING: f64 = 1e-6;

/// Share of friction that must do to hold what sleeps: with all of it, it could as well creep.
const HELD: f64 = 0.99;
