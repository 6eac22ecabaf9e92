//! What is measured while a scenario runs.

use nalgebra::Vector2;
use serde::Serialize;
use snake_core::contact::link_peg_contact;
use snake_core::planar::{PlanarState, Pose};
use snake_core::robot::Link;
use snake_core::scene::Peg;
use snake_core::simulation::{PlanarSimulation, StepReport};

/// Figures of one case, worst over its steps.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Figures {
    /// Steps of the integrator.
    pub steps: u64,
    /// Linear solves.
    pub iterations: u64,
    /// Stages that no solver brought to its tolerance.
    pub misses: u64,
    /// Stages that the fallback solved, and those of them whose contacts contradicted each other.
    pub fallbacks: u64,
    pub eased: u64,
    /// Steps, and parts of steps, retaken because a peg's force changed abruptly.
    pub events: u64,
    /// States that were not finite or absurd.
    pub broken: u64,
    /// Links found on the other side of a peg.
    pub tunnels: u64,
    /// Certified residual \[m/s\], over steps that report neither a miss nor an eased stage, and over the others.
    pub residual: f64,
    pub counted_residual: f64,
    /// Duality gap over the energy at hand, over the same steps.
    pub relative_gap: f64,
    /// Deepest penetration \[m\], over all times and at the end.
    pub penetration: f64,
    pub last_penetration: f64,
    /// Widest joint gap \[m\].
    pub joint_gap: f64,
    /// Largest energy that came from nowhere since the start \[J\], and the same over all energy turned over.
    pub created: f64,
    pub relative_created: f64,
    /// Books: net energy created and energy turned over so far \[J\].
    #[serde(skip)]
    books: [f64; 2],
    /// Distance between two states that ought to be one \[m\].
    pub drift: f64,
    /// Longest way of a link in one step \[m\].
    pub travel: f64,
}

impl Figures {
    /// Advances `simulation` with `advance` and takes the measures of it.
    pub fn watch(
        &mut self,
        simulation: &mut PlanarSimulation,
        advance: impl FnOnce(&mut PlanarSimulation) -> StepReport,
    ) {
        let before = simulation.state().clone();
        let energy = before.kinetic_energy(simulation.robot());
        let report = advance(simulation);
        self.count(&report);
        let now = simulation.kinetic_energy();
        let works = report.actuator_work.abs() + report.friction_work.abs();
        if !report.diverged {
            self.book(now - energy - report.actuator_work - report.friction_work, works, energy);
        }
        if report.misses + report.eased == 0 {
            self.relative_gap = worse(self.relative_gap, report.gap / (energy.max(now) + works).max(SMALLEST_ENERGY));
        }
        self.tunnels += tunnels(simulation, &before);
        self.measure(simulation, simulation.state().time - before.time);
    }

    fn book(&mut self, created: f64, works: f64, energy: f64) {
        let [net, turnover] = &mut self.books;
        *turnover = (*turnover + works).max(energy);
        *net += created;
        self.created = worse(self.created, *net);
        self.relative_created = self.created / turnover.max(SMALLEST_ENERGY);
    }

    /// Counters and certificate of an interval.
    pub fn count(&mut self, report: &StepReport) {
        self.steps += u64::from(report.steps);
        self.iterations += u64::from(report.iterations);
        self.misses += u64::from(report.misses);
        self.fallbacks += u64::from(report.fallbacks);
        self.eased += u64::from(report.eased);
        self.events += u64::from(report.events);
        self.broken += u64::from(report.diverged);
        let counted = report.misses + report.eased > 0;
        let residual = if counted { &mut self.counted_residual } else { &mut self.residual };
        *residual = worse(*residual, report.residual);
    }

    /// Takes the measures of the present state, after a step of length `step` \[s\].
    pub fn measure(&mut self, simulation: &PlanarSimulation, step: f64) {
        self.last_penetration = (-simulation.min_gap()).max(0.0);
        self.penetration = worse(self.penetration, self.last_penetration);
        self.joint_gap = worse(self.joint_gap, simulation.joint_gap());
        let fastest = simulation.state().twist.iter().map(|u| u.xy().norm()).fold(0.0, f64::max);
        self.travel = worse(self.travel, fastest * step);
    }

    /// The worst of both.
    pub fn merge(&mut self, other: &Figures) {
        self.steps += other.steps;
        self.iterations += other.iterations;
        self.misses += other.misses;
        self.fallbacks += other.fallbacks;
        self.eased += other.eased;
        self.tunnels += other.tunnels;
        self.events += other.events;
        self.broken += other.broken;
        for (mine, theirs) in self.worst_mut().into_iter().zip(other.clone().worst_mut()) {
            *mine = worse(*mine, *theirs);
        }
    }

    fn worst_mut(&mut self) -> [&mut f64; 10] {
        let Self { residual, counted_residual, relative_gap, penetration, last_penetration, .. } = self;
        let Self { joint_gap, created, relative_created, drift, travel, .. } = self;
        let certificate = [residual, counted_residual, relative_gap];
        let geometry = [penetration, last_penetration, joint_gap];
        let [a, b, c] = certificate;
        let [d, e, f] = geometry;
        [a, b, c, d, e, f, created, relative_created, drift, travel]
    }
}

/// Links that were on one side of a peg at `before` and are on the other now, having passed through its middle half.
fn tunnels(simulation: &PlanarSimulation, before: &PlanarState) -> u64 {
    let mut count = 0;
    let poses = before.pose.iter().zip(&simulation.state().pose);
    for ((from, to), link) in poses.zip(&simulation.robot().links) {
        let travel = (to - from).xy().norm();
        for peg in simulation.pegs() {
            let width = peg.radius + link.radius;
            let close = (from.x - peg.x).hypot(from.y - peg.y) < travel + link.reach() + peg.radius;
            if close && travel > 0.5 * width {
                let [start, end] = [from, to].map(|pose| offset_from_peg(pose, link, peg));
                let passed = start.dot(&end) < 0.0 && start.perp(&end).abs() < 0.25 * width * (end - start).norm();
                count += u64::from(passed);
            }
        }
    }
    count
}

/// From the peg's centre to the nearest point of the link's centre line \[m\].
fn offset_from_peg(pose: &Pose, link: &Link, peg: &Peg) -> Vector2<f64> {
    let (sin, cos) = pose.z.sin_cos();
    let contact = link_peg_contact(pose, cos, sin, link, peg);
    contact.direction.xy() * (contact.gap + peg.radius + link.radius)
}

/// The larger; NaN counts as infinite.
fn worse(a: f64, b: f64) -> f64 {
    if b.is_nan() { f64::INFINITY } else { a.max(b) }
}

/// A gap is compared with at least this energy \[J\]: that of Aiko at 0.5 mm/s.
const SMALLEST_ENERGY: f64 = 1e-6;
