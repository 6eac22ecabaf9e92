//! Pegs thrown at random, with passages between them.

use crate::scene::Peg;

use super::{LARGEST_PEG, Site};
use crate::environment::rng::Rng;

/// Width of the narrowest passage in body widths, at difficulty zero and one.
const PASSAGE: [f64; 2] = [1.2, 2.0];

/// Darts thrown for each square of one body width: the field is nearly full.
const DARTS: f64 = 0.5;

/// Poisson disc sampling by throwing darts: a peg stays if a passage remains to all earlier ones.
pub fn poisson(difficulty: f64, site: &Site, rng: &mut Rng, pegs: &mut Vec<Peg>) {
    let width = 2.0 * site.body_radius;
    let passage = width * (PASSAGE[0] + difficulty * (PASSAGE[1] - PASSAGE[0]));
    let area = (site.x[1] - site.x[0]) * 2.0 * site.half_width;
    let darts = (DARTS * area / (width * width)) as usize;
    for _ in 0..darts {
        let radius = site.radius(LARGEST_PEG, difficulty, rng);
        let x = rng.uniform(site.x[0], site.x[1]);
        let y = site.centre_line + rng.around_zero(site.half_width);
        let free = |other: &Peg| (other.x - x).hypot(other.y - y) >= other.radius + radius + passage;
        if pegs.iter().all(free) {
            pegs.push(Peg { radius, x, y });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::field::tests::aiko_site;

    #[test]
    fn the_robot_fits_between_any_two_pegs() {
        let (site, mut pegs) = (aiko_site(), Vec::new());
        for difficulty in [0.0, 0.5, 1.0] {
            pegs.clear();
            poisson(difficulty, &site, &mut Rng::new(3, 1), &mut pegs);
            assert!(pegs.len() > 15, "{} pegs", pegs.len());
            for (i, a) in pegs.iter().enumerate() {
                for b in &pegs[..i] {
                    assert!((a.x - b.x).hypot(a.y - b.y) - a.radius - b.radius > 0.105);
                }
            }
        }
    }
}
