//! Runs scenarios and formats their figures.

use std::fmt::Write;
use std::time::Instant;

use rayon::prelude::*;
use serde::Serialize;

use crate::figures::Figures;
use crate::requirements::{Bounds, broken};
use crate::scenarios::Scenario;

/// A scenario's figures, merged, and the requirements it violates.
#[derive(Debug, Serialize)]
pub struct Row {
    pub name: String,
    pub cases: usize,
    pub figures: Figures,
    pub bounds: Bounds,
    /// Case and requirement.
    pub broken: Vec<(String, String)>,
    pub seconds: f64,
}

/// Runs all jobs of a scenario on all cores.
pub fn measure(scenario: &Scenario) -> Row {
    let start = Instant::now();
    let results: Vec<(String, Figures)> = scenario.jobs.par_iter().map(|job| (job.name.clone(), (job.run)())).collect();
    let mut figures = Figures::default();
    let mut all_broken = Vec::new();
    for (name, case) in &results {
        figures.merge(case);
        all_broken.extend(broken(case, &scenario.bounds).into_iter().map(|what| (name.clone(), what)));
    }
    Row {
        name: scenario.name.to_owned(),
        cases: results.len(),
        figures,
        bounds: scenario.bounds,
        broken: all_broken,
        seconds: start.elapsed().as_secs_f64(),
    }
}

pub const HEADER: &str = "\
| scenario | cases | steps | linear solves per step | fallbacks | relaxed | unconverged | residual [m/s] | relative gap \
| penetration [m] | flagged | joint gap [m] | energy created | passed pegs | travel per step [m] | drift [m] |
| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |";

impl Row {
    /// The row as a line of a Markdown table.
    pub fn line(&self) -> String {
        let f = &self.figures;
        let solves = f.iterations as f64 / f.steps as f64;
        let mut line = format!("| {} | {} | {} | {solves:.1} ", self.name, self.cases, f.steps);
        let _ = write!(line, "| {} | {} | {} ", f.fallbacks, f.relaxed, f.unconverged);
        let _ = write!(line, "| {:.0e} | {:.0e} | {:.1e} ", f.residual, f.relative_gap, f.penetration);
        let _ = write!(line, "| {} | {:.0e} | {:.0e} ", f.flagged, f.joint_gap, f.relative_created);
        let _ = write!(line, "| {} | {:.0e} | {:.0e} |", f.tunnels, f.travel, f.drift);
        line
    }
}
