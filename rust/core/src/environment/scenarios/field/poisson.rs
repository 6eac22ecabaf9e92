//! Pegs thrown at random, with passages between them.

use crate::scene::Peg;

use crate::environment::rng::Rng;
use crate::environment::scenarios::peg_region::{LARGEST_PEG, PegRegion};

/// Width of the narrowest passage in body widths, at difficulty zero and one.
const PASSAGE: [f64; 2] = [1.2, 2.0];

/// Darts thrown for each square of one body width: the field is nearly full.
const DARTS: f64 = 0.5;

/// Number of darts.
pub fn places(region: &PegRegion) -> f64 {
    let width = 2.0 * region.body_radius;
    let area = (region.x[1] - region.x[0]) * 2.0 * region.half_width;
    DARTS * area / (width * width)
}

/// Poisson disc sampling by throwing darts: a peg stays if a passage remains to all earlier ones.
pub fn poisson(difficulty: f64, region: &PegRegion, rng: &mut Rng, pegs: &mut Vec<Peg>) {
    let width = 2.0 * region.body_radius;
    let passage = width * (PASSAGE[0] + difficulty * (PASSAGE[1] - PASSAGE[0]));
    let mut cells = Cells::new(region, 2.0 * region.scale() * LARGEST_PEG + passage);
    for _ in 0..places(region) as usize {
        let radius = region.radius(LARGEST_PEG, difficulty, rng);
        let x = rng.uniform(region.x[0], region.x[1]);
        let y = region.centre_line + rng.around_zero(region.half_width);
        let free = |other: &Peg| (other.x - x).hypot(other.y - y) >= other.radius + radius + passage;
        if cells.near(x, y).all(|peg| free(&pegs[peg])) {
            cells.add(x, y);
            pegs.push(Peg { radius, x, y });
        }
    }
}

/// Pegs by the square cell in which their centres lie.
struct Cells {
    low: [f64; 2],
    size: f64,
    count: [usize; 2],
    /// The last peg in each cell, and the one before each peg in its cell; `NONE` for none.
    last: Vec<u32>,
    before: Vec<u32>,
}

const NONE: u32 = u32::MAX;

impl Cells {
    /// Cells that a distance of `reach` does not span.
    fn new(region: &PegRegion, reach: f64) -> Self {
        let size = reach * (1.0 + ROUND_OFF);
        let cells = |length: f64| (length / size) as usize + 1;
        let count = [cells(region.x[1] - region.x[0]), cells(2.0 * region.half_width)];
        let low = [region.x[0], region.centre_line - region.half_width];
        Self { low, size, count, last: vec![NONE; count[0] * count[1]], before: Vec::new() }
    }

    fn place(&self, x: f64, y: f64) -> [usize; 2] {
        let index =
            |value: f64, axis: usize| (((value - self.low[axis]) / self.size) as usize).min(self.count[axis] - 1);
        [index(x, 0), index(y, 1)]
    }

    /// All pegs within the reach, and others.
    fn near(&self, x: f64, y: f64) -> impl Iterator<Item = usize> {
        let [column, row] = self.place(x, y);
        let around = |index: usize, axis: usize| index.saturating_sub(1)..(index + 2).min(self.count[axis]);
        let cells =
            around(row, 1).flat_map(move |row| around(column, 0).map(move |column| row * self.count[0] + column));
        let link = |peg: u32| (peg != NONE).then_some(peg as usize);
        cells.flat_map(move |cell| std::iter::successors(link(self.last[cell]), move |&peg| link(self.before[peg])))
    }

    /// Adds the next peg.
    fn add(&mut self, x: f64, y: f64) {
        let [column, row] = self.place(x, y);
        let peg = self.before.len() as u32;
        self.before.push(std::mem::replace(&mut self.last[row * self.count[0] + column], peg));
    }
}

/// Relative excess of a cell over the reach, far above that of a computed cell index.
const ROUND_OFF: f64 = 1e-9;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::scenarios::peg_region::tests::aiko_region;

    #[test]
    fn a_dart_is_compared_with_all_pegs_that_may_refuse_it() {
        let region = aiko_region();
        for (seed, difficulty) in (0..20).flat_map(|seed| [0.0, 0.4, 1.0].map(|difficulty| (seed, difficulty))) {
            let (mut pegs, mut all) = (Vec::new(), Vec::<Peg>::new());
            poisson(difficulty, &region, &mut Rng::new(seed, 0), &mut pegs);
            let (mut rng, passage) = (Rng::new(seed, 0), 0.105 * (PASSAGE[0] + difficulty * (PASSAGE[1] - PASSAGE[0])));
            for _ in 0..places(&region) as usize {
                let radius = region.radius(LARGEST_PEG, difficulty, &mut rng);
                let x = rng.uniform(region.x[0], region.x[1]);
                let y = region.centre_line + rng.around_zero(region.half_width);
                if all.iter().all(|other| (other.x - x).hypot(other.y - y) >= other.radius + radius + passage) {
                    all.push(Peg { radius, x, y });
                }
            }
            assert_eq!(pegs, all, "seed {seed}, difficulty {difficulty}");
        }
    }

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
