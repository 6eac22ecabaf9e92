use nalgebra::Vector2;

use crate::planar::{Stage, StageSolution};

/// What happened over some interval of time.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Tally {
    pub steps: u32,
    /// Linear solves (`implicit`) or sweeps of Algorithm 3.1 (`thesis`).
    pub iterations: u32,
    /// Steps retaken because a peg contact closed.
    pub events: u32,
    /// Stages whose solver gave up before its tolerance.
    pub misses: u32,
    /// Worst certified residual of a stage \[m/s\].
    pub residual: f64,
    /// Worst duality gap of a stage \[J\].
    pub gap: f64,
    /// Work of the ground friction on the robot, never positive \[J\].
    pub friction_work: f64,
    /// Net work of the actuators \[J\].
    pub actuator_work: f64,
    /// Work of the actuators without what they absorb, joint by joint \[J\].
    pub positive_actuator_work: f64,
    /// Impulse of the pegs on each link, world frame \[N s\]; over an interval's length it is (T 7.6).
    pub contact_impulse: Vec<Vector2<f64>>,
}

impl Tally {
    pub fn new(links: usize) -> Self {
        Self { contact_impulse: vec![Vector2::zeros(); links], ..Self::default() }
    }

    /// Back to zero without giving memory back.
    pub fn clear(&mut self) {
        let mut contact_impulse = std::mem::take(&mut self.contact_impulse);
        contact_impulse.fill(Vector2::zeros());
        *self = Self { contact_impulse, ..Self::default() };
    }

    /// Adds works and impulses of a solved stage, taken `weight` times.
    pub fn add_stage(&mut self, stage: &Stage, solution: &StageSolution, weight: f64) {
        for (i, link) in stage.links.iter().enumerate() {
            let slip = link.heading.to_link(solution.twist[i].xy());
            self.friction_work += weight * solution.friction[i].dot(&slip);
        }
        for (j, drive) in solution.drive.iter().enumerate() {
            let work = weight * drive * (solution.twist[j + 1].z - solution.twist[j].z);
            self.actuator_work += work;
            self.positive_actuator_work += work.max(0.0);
        }
        for (contact, impulse) in stage.contacts.iter().zip(&solution.contact) {
            self.contact_impulse[contact.link] += contact.direction.xy() * (weight * impulse);
        }
    }

    /// Adds works and impulses of another tally.
    pub fn add_work(&mut self, other: &Tally) {
        self.friction_work += other.friction_work;
        self.actuator_work += other.actuator_work;
        self.positive_actuator_work += other.positive_actuator_work;
        for (total, part) in self.contact_impulse.iter_mut().zip(&other.contact_impulse) {
            *total += part;
        }
    }

    /// Takes note of how a stage was solved.
    pub fn add_solve(&mut self, iterations: u32, missed: bool, residual: f64, gap: f64) {
        self.iterations += iterations;
        self.misses += u32::from(missed);
        self.residual = self.residual.max(residual);
        self.gap = self.gap.max(gap);
    }
}
