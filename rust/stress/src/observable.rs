//! What the stress suite observes of a simulation, for either model.

use nalgebra::Vector2;
use snake_core::contact::{PlacedLink, link_peg_contact};
use snake_core::obstacles::{CentreLine, Wall};
use snake_core::planar::{Planar, PlanarState, Pose};
use snake_core::robot::{Link, Robot};
use snake_core::scene::Peg;
use snake_core::simulation::{PlanarSimulation, SimulatedModel, Simulation, SpatialSimulation};
use snake_core::spatial::{self, Spatial, SpatialState, nearest_point};
use snake_core::stepping::StateOf;

use crate::geometry::LinkPlace;

/// A model whose simulations can be observed step by step.
pub trait Observable: SimulatedModel<Pose: LinkPlace> {
    /// How far orientations are from rotations \[-\].
    fn skew(state: &StateOf<Self>) -> f64;
    /// Speed of the fastest link's CG \[m/s\].
    fn fastest(state: &StateOf<Self>) -> f64;
    /// Links that passed through a peg or, in the plane, a wall since `before`.
    fn tunnels(simulation: &Simulation<Self>, before: &StateOf<Self>) -> u64;
    /// How far any link moved since `before` \[m\].
    fn moved(now: &StateOf<Self>, before: &StateOf<Self>) -> f64;
}

impl Observable for Planar {
    fn skew(_: &PlanarState) -> f64 {
        0.0
    }

    fn fastest(state: &PlanarState) -> f64 {
        state.twist.iter().map(|u| u.xy().norm()).fold(0.0, f64::max)
    }

    fn tunnels(simulation: &PlanarSimulation, before: &PlanarState) -> u64 {
        let (robot, poses) = (simulation.robot(), [&before.pose[..], &simulation.state().pose]);
        let through_pegs = tunnels(robot, simulation.pegs(), poses, |pose| pose.xy(), offset_in_plane);
        through_pegs + through_walls(simulation.body().obstacles.walls().walls(), 2.0 * robot.links[0].radius, poses)
    }

    fn moved(now: &PlanarState, before: &PlanarState) -> f64 {
        now.pose.iter().zip(&before.pose).map(|(now, then)| (now - then).norm()).fold(0.0, f64::max)
    }
}

impl Observable for Spatial {
    fn skew(state: &SpatialState) -> f64 {
        let norm = |pose: &spatial::Pose| (pose.orientation.quaternion().norm() - 1.0).abs();
        state.pose.iter().map(norm).fold(0.0, f64::max)
    }

    fn fastest(state: &SpatialState) -> f64 {
        state.twist.iter().map(|u| u.fixed_rows::<3>(0).norm()).fold(0.0, f64::max)
    }

    fn tunnels(simulation: &SpatialSimulation, before: &SpatialState) -> u64 {
        let offset =
            |pose: &spatial::Pose, link: &Link, peg: &Peg| nearest_point(link, &pose.position, &pose.axis(), peg).0;
        let poses = [&before.pose[..], &simulation.state().pose];
        tunnels(simulation.robot(), simulation.pegs(), poses, |pose| pose.position.xy(), offset)
    }

    fn moved(now: &SpatialState, before: &SpatialState) -> f64 {
        let poses = now.pose.iter().zip(&before.pose);
        poses.map(|(now, then)| (now.position - then.position).norm()).fold(0.0, f64::max)
    }
}

/// Smallest gap of a link to an obstacle or to another link now \[m\].
pub fn least_gap<M: Observable>(simulation: &Simulation<M>) -> f64 {
    simulation.min_gap().min(simulation.self_gap())
}

/// Links that were on one side of a peg at `before` and are on the other now, having passed through its middle half.
fn tunnels<P>(
    robot: &Robot,
    pegs: &[Peg],
    [before, now]: [&[P]; 2],
    place: impl Fn(&P) -> Vector2<f64>,
    offset_from_peg: impl Fn(&P, &Link, &Peg) -> Vector2<f64>,
) -> u64 {
    let mut count = 0;
    for ((from, to), link) in before.iter().zip(now).zip(&robot.links) {
        let travel = (place(to) - place(from)).norm();
        for peg in pegs {
            let width = peg.radius + link.radius;
            let close = (place(from) - Vector2::new(peg.x, peg.y)).norm() < travel + link.reach() + peg.radius;
            if close && travel > 0.5 * width {
                let [start, end] = [from, to].map(|pose| offset_from_peg(pose, link, peg));
                let passed = start.dot(&end) < 0.0 && start.perp(&end).abs() < 0.25 * width * (end - start).norm();
                count += u64::from(passed);
            }
        }
    }
    count
}

/// Links whose CG crossed a wall, of those that travelled less than their `width`: others may have gone around a corner in
/// the parts of one step.
fn through_walls(walls: &[Wall], width: f64, [before, now]: [&[Pose]; 2]) -> u64 {
    let ways = before
        .iter()
        .zip(now)
        .map(|(from, to)| CentreLine { middle: 0.5 * (from.xy() + to.xy()), half: 0.5 * (to.xy() - from.xy()) });
    let short = ways.filter(|way| 2.0 * way.half.norm() < width);
    short.map(|way| walls.iter().filter(|wall| wall.polygon.distance(&way) < 0.0).count() as u64).sum()
}

/// From the peg's centre to the nearest point of the link's centre line \[m\].
fn offset_in_plane(pose: &Pose, link: &Link, peg: &Peg) -> Vector2<f64> {
    let contact = link_peg_contact(&PlacedLink::new(link, *pose), peg);
    contact.direction.xy() * (contact.gap + peg.radius + link.radius)
}
