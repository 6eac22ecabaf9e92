//! A staggered lattice of pegs with jitter.

use crate::scene::Peg;

use crate::environment::rng::Rng;
use crate::environment::scenarios::peg_region::{LARGEST_PEG, PegRegion};

/// Distance between pegs of one column \[m\].
const ROW_PITCH: f64 = 0.38;

/// Jitter at difficulty one, as a share of the distance between columns and rows.
const JITTER: f64 = 0.15;

/// Share of missing pegs at difficulty one.
const MISSING: f64 = 0.25;

/// Distances between columns and rows \[m\].
fn pitch(region: &PegRegion) -> [f64; 2] {
    [region.path.half_wave(), ROW_PITCH * region.scale()]
}

/// Numbers of columns and rows inside the region, and one more of each.
fn counts(region: &PegRegion) -> [f64; 2] {
    let [column, row] = pitch(region);
    [(region.x[1] - region.x[0]) / column, 2.0 * region.half_width / row].map(|count| count.trunc() + 2.0)
}

/// Number of places for pegs.
pub fn places(region: &PegRegion) -> f64 {
    counts(region).map(|count| count + 1.0).iter().product()
}

/// Columns half a wave of the gait apart, every other one shifted by half a row; the lattice as a whole
/// stands anywhere relative to the robot.
pub fn lattice(difficulty: f64, region: &PegRegion, rng: &mut Rng, pegs: &mut Vec<Peg>) {
    let pitch = pitch(region);
    let origin = [rng.unit() * 2.0 * pitch[0], rng.unit() * pitch[1]];
    let [columns, rows] = counts(region).map(|count| count as i32);
    for column in -1..columns {
        let stagger = if column % 2 == 0 { 0.0 } else { 0.5 };
        for row in -1..rows {
            let jitter = pitch.map(|pitch| rng.around_zero(difficulty * JITTER * pitch));
            let x = region.x[0] + origin[0] + f64::from(column) * pitch[0] + jitter[0];
            let y = origin[1] + (f64::from(row) + stagger) * pitch[1] - region.half_width + jitter[1];
            let radius = region.radius(LARGEST_PEG, difficulty, rng);
            let missing = rng.chance(difficulty * MISSING);
            let inside = (region.x[0]..region.x[1]).contains(&x) && y.abs() <= region.half_width;
            if inside && !missing {
                pegs.push(Peg { radius, x, y: region.centre_line + y });
            }
        }
    }
}
