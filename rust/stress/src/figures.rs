//! Figures measured while a scenario runs.

use serde::Serialize;
use snake_core::simulation::Simulation;
use snake_core::stepping::StepStatistics;

use crate::observable::{Observable, least_gap};

/// Figures of one case, worst over its steps.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Figures {
    /// Steps of the integrator.
    pub steps: u64,
    /// Linear solves.
    pub iterations: u64,
    /// Stages that stay unconverged.
    pub unconverged: u64,
    /// Stages that the fallback solved, and those of them whose contacts contradicted each other.
    pub fallbacks: u64,
    pub relaxed: u64,
    /// Steps, and parts of steps, retaken because a peg's force changed abruptly.
    pub events: u64,
    /// States that were not finite or absurd.
    pub broken: u64,
    /// Links found on the other side of a peg.
    pub tunnels: u64,
    /// Certified residual \[m/s\], over steps that report neither an unconverged nor a relaxed stage, and over the
    /// others.
    pub residual: f64,
    pub counted_residual: f64,
    /// Duality gap over the energy at hand, over the same steps.
    pub relative_gap: f64,
    /// Steps that left a link deep in what it touches and were flagged for it.
    pub flagged: u64,
    /// Deepest penetration \[m\], over all times at which the robot was neither flagged nor placed like that, and at the
    /// end.
    pub penetration: f64,
    pub last_penetration: f64,
    /// Whether the robot was flagged, or placed in an obstacle, and has not come out since.
    #[serde(skip)]
    is_excused: bool,
    /// Widest joint gap \[m\].
    pub joint_gap: f64,
    /// How far orientations are from rotations \[-\].
    pub skew: f64,
    /// Largest energy created since the start by nothing in the model \[J\], and the same over all energy turned over.
    pub created: f64,
    pub relative_created: f64,
    /// Energy balance: net energy created and energy turned over so far \[J\].
    #[serde(skip)]
    balance: [f64; 2],
    /// Distance between two states that should be equal \[m\].
    pub drift: f64,
    /// Longest travel of a link in one step \[m\].
    pub travel: f64,
}

impl Figures {
    /// Figures of `steps` steps, observed one by one.
    pub fn of_run<M: Observable>(
        mut simulation: Simulation<M>,
        steps: u32,
        advance: impl Fn(&mut Simulation<M>) -> StepStatistics,
    ) -> Self {
        let mut figures = Self { is_excused: -least_gap(&simulation) > FLAGGED_DEPTH, ..Self::default() };
        figures.measure(&simulation, 0.0);
        for _ in 0..steps {
            figures.observe(&mut simulation, &advance);
        }
        figures
    }

    /// Advances `simulation` by `advance` and measures it.
    pub fn observe<M: Observable>(
        &mut self,
        simulation: &mut Simulation<M>,
        advance: impl FnOnce(&mut Simulation<M>) -> StepStatistics,
    ) {
        let (before, energy) = (simulation.state().clone(), simulation.energy());
        let report = advance(simulation);
        self.count(&report);
        let now = simulation.energy();
        let work = report.actuator_work.abs() + report.friction_work.abs();
        if !report.diverged {
            self.add_to_balance(now - energy - report.actuator_work - report.friction_work, work, energy);
        }
        if report.unconverged + report.relaxed == 0 {
            self.relative_gap = worse(self.relative_gap, report.gap / (energy.max(now) + work).max(SMALLEST_ENERGY));
        }
        if !self.is_excused {
            self.tunnels += M::tunnels(simulation, &before);
        }
        self.measure(simulation, simulation.state().time - before.time);
        // A robot may slow down within a step that is divided.
        self.travel = worse(self.travel, M::moved(simulation.state(), &before));
    }

    fn add_to_balance(&mut self, created: f64, work: f64, energy: f64) {
        let [net, turnover] = &mut self.balance;
        *turnover = (*turnover + work).max(energy);
        *net += created;
        self.created = worse(self.created, *net);
        self.relative_created = self.created / turnover.max(SMALLEST_ENERGY);
    }

    /// Counters and certificate of an interval.
    pub fn count(&mut self, report: &StepStatistics) {
        self.steps += u64::from(report.steps);
        self.iterations += u64::from(report.iterations);
        self.unconverged += u64::from(report.unconverged);
        self.fallbacks += u64::from(report.fallbacks);
        self.relaxed += u64::from(report.relaxed);
        self.events += u64::from(report.events);
        self.broken += u64::from(report.diverged);
        self.flagged += u64::from(report.penetrated);
        self.is_excused |= report.penetrated;
        let counted = report.unconverged + report.relaxed > 0;
        let residual = if counted { &mut self.counted_residual } else { &mut self.residual };
        *residual = worse(*residual, report.residual);
    }

    /// Measures one of several robots, whose smallest gap is `gap` \[m\] and whose last step was flagged for its penetration
    /// or not.
    pub fn measure_one<M: Observable>(&mut self, simulation: &Simulation<M>, gap: f64, step: f64, is_flagged: bool) {
        self.flagged += u64::from(is_flagged);
        self.is_excused = is_flagged;
        self.measure_at(simulation, gap, step);
    }

    /// Measures the present state, after a step of length `step` \[s\].
    pub fn measure<M: Observable>(&mut self, simulation: &Simulation<M>, step: f64) {
        self.measure_at(simulation, least_gap(simulation), step);
    }

    fn measure_at<M: Observable>(&mut self, simulation: &Simulation<M>, gap: f64, step: f64) {
        self.last_penetration = (-gap).max(0.0);
        self.is_excused &= self.last_penetration > FLAGGED_DEPTH;
        if !self.is_excused {
            self.penetration = worse(self.penetration, self.last_penetration);
        }
        self.joint_gap = worse(self.joint_gap, simulation.joint_gap());
        self.skew = worse(self.skew, M::skew(simulation.state()));
        self.travel = worse(self.travel, M::fastest(simulation.state()) * step);
    }

    /// The worst of both.
    pub fn merge(&mut self, other: &Figures) {
        self.steps += other.steps;
        self.iterations += other.iterations;
        self.unconverged += other.unconverged;
        self.fallbacks += other.fallbacks;
        self.relaxed += other.relaxed;
        self.tunnels += other.tunnels;
        self.flagged += other.flagged;
        self.events += other.events;
        self.broken += other.broken;
        for (mine, theirs) in self.worst_mut().into_iter().zip(other.clone().worst_mut()) {
            *mine = worse(*mine, *theirs);
        }
    }

    fn worst_mut(&mut self) -> [&mut f64; 11] {
        let Self { residual, counted_residual, relative_gap, penetration, last_penetration, .. } = self;
        let Self { joint_gap, skew, created, relative_created, drift, travel, .. } = self;
        let certificate = [residual, counted_residual, relative_gap];
        let geometry = [penetration, last_penetration, joint_gap];
        let [a, b, c] = certificate;
        let [d, e, f] = geometry;
        [a, b, c, d, e, f, skew, created, relative_created, drift, travel]
    }
}

/// The larger; NaN counts as infinite.
fn worse(a: f64, b: f64) -> f64 {
    if b.is_nan() { f64::INFINITY } else { a.max(b) }
}

/// Penetration that is flagged \[m\].
pub const FLAGGED_DEPTH: f64 = 1e-3;

/// A gap is compared with at least this energy \[J\]: that of Aiko at 0.5 mm/s.
const SMALLEST_ENERGY: f64 = 1e-6;
