//! Hard stage problems of the planar model, saved from simulations.

use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use snake_core::planar::{Certificate, Fallback, Stage, StageSolution, Twist, certify};
use snake_core::rows::SavedStage;
use snake_core::solver::SolveStatus;

use crate::planar::Random;
use crate::planar_stage as dense;

/// Stages without a solution.
pub const CONTRADICTORY: [&str; 3] = ["deep", "impact", "wedge"];

/// \[m/s\]
pub const TOLERANCE: f64 = 1e-10;

/// Duality gap of a solution over the energies of its stage.
pub const RELATIVE_GAP: f64 = 1e-10;

/// A hard stage by its name.
pub struct Golden {
    pub name: String,
    pub stage: Stage,
}

/// The stages saved in a folder, with the names of their files.
pub fn saved_stages<S: DeserializeOwned>(folder: &Path) -> Vec<(String, S)> {
    let mut paths: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    let read = |path: &PathBuf| {
        let saved: SavedStage<S> = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
        (path.file_stem().unwrap().to_str().unwrap().to_owned(), saved.stage)
    };
    paths.iter().map(read).collect()
}

/// The files of `rust/core/tests/golden`, and two stages too large for one: 200 links, and 200 links with 100 contacts.
pub fn golden() -> Vec<Golden> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../core/tests/golden");
    let mut all: Vec<Golden> = saved_stages(&folder).into_iter().map(|(name, stage)| Golden { name, stage }).collect();
    for contacts in [0, 100] {
        let kind = dense::Kind {
            links: 200,
            contacts,
            stiff: true,
            limited: true,
            friction: true,
            mass_ratio: 1.0,
            orthotropy: 3.0,
        };
        let stage = dense::random_stage(kind, &mut Random::new(200 + contacts as u64));
        all.push(Golden { name: format!("200 links, {contacts} contacts"), stage });
    }
    all
}

/// All but [`CONTRADICTORY`].
pub fn solvable() -> impl Iterator<Item = Golden> {
    golden().into_iter().filter(|golden| !CONTRADICTORY.contains(&golden.name.as_str()))
}

/// The solution that the fallback finds.
pub fn closed_by_fallback(golden: &Golden) -> StageSolution {
    let mut solution = StageSolution::cold(&golden.stage);
    let (_, closing) = Fallback::new(golden.stage.links.len()).solve_hard(&golden.stage, &mut solution, TOLERANCE);
    assert_eq!(closing, SolveStatus::Solved, "{}: {:?}", golden.name, certify(&golden.stage, &solution));
    solution
}

/// Distance of two velocities over what their gaps, or the round-off of the energies, admit: at most 1.
pub fn disagreement(stage: &Stage, a: &[Twist], b: &[Twist], gaps: &[Certificate]) -> f64 {
    let d = dense::stacked(a) - dense::stacked(b);
    let mass = stage.links.iter().flat_map(|link| [link.mass, link.mass, link.inertia]);
    let distance: f64 = d.iter().zip(mass).map(|(d, m)| 0.5 * m * d * d).sum();
    let admitted: f64 = gaps.iter().map(|certificate| certificate.gap.max(RELATIVE_GAP * stage.energy()).sqrt()).sum();
    distance.sqrt() / admitted
}
