//! A staggered lattice of pegs with jitter.

use crate::scene::Peg;

use super::{LARGEST_PEG, Site};
use crate::environment::rng::Rng;

/// Distance between pegs of one column \[m\].
const ROW_PITCH: f64 = 0.38;

/// Jitter at difficulty one, as a share of the distance between columns and rows.
const JITTER: f64 = 0.15;

/// Share of missing pegs at difficulty one.
const MISSING: f64 = 0.25;

/// Columns half a wave of the gait apart, every other one shifted by half a row; the lattice as a whole
/// stands anywhere relative to the robot.
pub fn lattice(difficulty: f64, site: &Site, rng: &mut Rng, pegs: &mut Vec<Peg>) {
    let pitch = [site.path.half_wave(), ROW_PITCH * site.scale()];
    let origin = [rng.unit() * 2.0 * pitch[0], rng.unit() * pitch[1]];
    let columns = ((site.x[1] - site.x[0]) / pitch[0]) as i32 + 2;
    let rows = (2.0 * site.half_width / pitch[1]) as i32 + 2;
    for column in -1..columns {
        let stagger = if column % 2 == 0 { 0.0 } else { 0.5 };
        for row in -1..rows {
            let jitter = pitch.map(|pitch| rng.around_zero(difficulty * JITTER * pitch));
            let x = site.x[0] + origin[0] + f64::from(column) * pitch[0] + jitter[0];
            let y = origin[1] + (f64::from(row) + stagger) * pitch[1] - site.half_width + jitter[1];
            let radius = site.radius(LARGEST_PEG, difficulty, rng);
            let missing = rng.chance(difficulty * MISSING);
            let inside = (site.x[0]..site.x[1]).contains(&x) && y.abs() <= site.half_width;
            if inside && !missing {
                pegs.push(Peg { radius, x, y: site.centre_line + y });
            }
        }
    }
}
