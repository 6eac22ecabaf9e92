//! Pegs thrown at random, with passages between them.

use crate::scene::Peg;

use crate::environment::rng::Rng;
use crate::environment::scenarios::peg_region::{LARGEST_PEG, PegRegion};

/// Width of the narrowest passage in body widths, at difficulty zero and one.
const PASSAGE: [f64; 2] = [1.2, 2.0];

/// Darts thrown for each square of one body width: the field is nearly full.
const DARTS: f64 = 0.5;

/// Poisson disc sampling by throwing darts: a peg stays if a passage remains to all earlier ones.
pub fn poisson(difficulty: f64, region: &PegRegion, rng: &mut Rng, pegs: &mut Vec<Peg>) {
    let width = 2.0 * region.body_radius;
    let passage = width * (PASSAGE[0] + difficulty * (PASSAGE[1] - PASSAGE[0]));
    let area = (region.x[1] - region.x[0]) * 2.0 * region.half_width;
    let darts = (DARTS * area / (width * width)) as usize;
    for _ in 0..darts {
        let radius = region.radius(LARGEST_PEG, difficulty, rng);
        let x = rng.uniform(region.x[0], region.x[1]);
        let y = region.centre_line + rng.around_zero(region.half_width);
        let free = |other: &Peg| (other.x - x).hypot(other.y - y) >= other.radius + radius + passage;
        if pegs.iter().all(free) {
            pegs.push(Peg { radius, x, y });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::scenarios::peg_region::tests::aiko_region;

    #[test]
    fn the_robot_fits_between_any_two_pegs() {
        let (region, mut pegs) = (aiko_region(), Vec::new());
        for difficulty in [0.0, 0.5, 1.0] {
            pegs.clear();
            poisson(difficulty, &region, &mut Rng::new(3, 1), &mut pegs);
            assert!(pegs.len() > 15, "{} pegs", pegs.len());
            for (i, a) in pegs.iter().enumerate() {
                for b in &pegs[..i] {
                    assert!((a.x - b.x).hypot(a.y - b.y) - a.radius - b.radius > 0.105);
                }
            }
        }
    }
}
