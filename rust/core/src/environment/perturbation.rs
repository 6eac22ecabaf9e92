//! The thesis's courses with pegs out of place (section 7.3.4, Fig. 7.8 of the thesis).

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

use crate::error::{ConfigError, coordinate, require, within};
use crate::scene::{Peg, START_7_3, START_7_5, START_SPATIAL_7_3, START_SPATIAL_7_5, TABLE_7_3, TABLE_7_5};

use super::config::ModelKind;
use super::rng::Rng;

/// Which course.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Course {
    /// Nine small pegs (T Table 7.3).
    #[serde(rename = "table-7.3")]
    Table73,
    /// Seven pegs of 12.5 cm radius (T Table 7.5), continued to the goal.
    #[serde(rename = "table-7.5")]
    Table75,
    /// One of the two, drawn in each episode.
    #[serde(rename = "mixed")]
    Mixed,
}

impl Course {
    /// The courses that may be drawn.
    pub fn choices(self) -> &'static [Course] {
        match self {
            Course::Table73 => &[Course::Table73],
            Course::Table75 => &[Course::Table75],
            Course::Mixed => &[Course::Table73, Course::Table75],
        }
    }

    /// The thesis's pegs.
    pub fn table(self) -> &'static [[f64; 3]] {
        if self == Course::Table73 { &TABLE_7_3 } else { &TABLE_7_5 }
    }

    /// CG and absolute angle of link 1 at the start.
    pub fn start(self, model: ModelKind) -> [f64; 3] {
        match (self, model) {
            (Course::Table73, ModelKind::Planar) => START_7_3,
            (Course::Table73, ModelKind::Spatial) => START_SPATIAL_7_3,
            (_, ModelKind::Planar) => START_7_5,
            (_, ModelKind::Spatial) => START_SPATIAL_7_5,
        }
    }
}

/// What happens to a course's pegs; pegs count from 1, as in the thesis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Perturbation {
    pub course: Course,
    /// Pegs drawn in each episode, each of which is taken away with the probability `difficulty`.
    pub removed: usize,
    /// Pegs drawn in each episode to be shifted.
    pub shifted: usize,
    /// Longest shift, at difficulty one \[m\]; shifts are uniform in a disc of `difficulty` times this radius.
    pub shift: f64,
    /// Pegs that are always absent.
    pub without: Vec<usize>,
    /// Pegs `(j, dx, dy)` that always stand elsewhere \[m\].
    pub moved: Vec<(usize, f64, f64)>,
}

impl Default for Perturbation {
    /// The longest shift is that of Fig. 7.8 (a), one link diameter.
    fn default() -> Self {
        Self { course: Course::Mixed, removed: 1, shifted: 2, shift: 0.105, without: Vec::new(), moved: Vec::new() }
    }
}

impl Perturbation {
    /// # Errors
    /// Names the field, its value and the admissible range.
    pub fn validate(&self) -> Result<(), ConfigError> {
        let tables = self.course.choices().iter().map(|course| course.table().len());
        let last = tables.min().unwrap_or(0);
        let range = format!("an integer in [1, {last}], the pegs of the course");
        let exists = |field: String, j: usize| require((1..=last).contains(&j), &field, j, &range);
        self.without.iter().enumerate().try_for_each(|(k, &j)| exists(format!("without[{k}]"), j))?;
        for (k, &(j, dx, dy)) in self.moved.iter().enumerate() {
            exists(format!("moved[{k}][0]"), j)?;
            coordinate(&format!("moved[{k}][1]"), dx)?;
            coordinate(&format!("moved[{k}][2]"), dy)?;
        }
        let fixed = self.without.iter().chain(self.moved.iter().map(|(j, ..)| j)).filter(|j| **j >= FIRST).count();
        let free = (last + 1 - FIRST).saturating_sub(fixed);
        require(self.removed <= free, "removed", self.removed, &format!("an integer in [0, {free}]"))?;
        let rest = free - self.removed;
        require(self.shifted <= rest, "shifted", self.shifted, &format!("an integer in [0, {rest}]"))?;
        within("shift", self.shift, 0.0, LONGEST_SHIFT)?;
        Ok(())
    }

    /// The pegs of `course` without the random part; the table's come first.
    pub fn fixed_pegs(&self, course: Course) -> Vec<Option<Peg>> {
        let mut pegs: Vec<Option<Peg>> = course.table().iter().map(|&peg| Some(Peg::from(peg))).collect();
        for &(j, dx, dy) in &self.moved {
            if let Some(peg) = &mut pegs[j - 1] {
                peg.x += dx;
                peg.y += dy;
            }
        }
        self.without.iter().for_each(|j| pegs[j - 1] = None);
        pegs
    }

    /// Draws the pegs that are taken away and those that are shifted, by how much; `pegs` are the table's. As many
    /// numbers are drawn at every difficulty, so that only the difficulty changes a seed's course.
    pub fn draw(&self, difficulty: f64, rng: &mut Rng, pegs: &mut [Option<Peg>], shifts: &mut Vec<Shift>) {
        shifts.clear();
        let is_fixed = |j: usize| self.without.contains(&j) || self.moved.iter().any(|moved| moved.0 == j);
        let mut free: Vec<usize> = (FIRST..=pegs.len()).filter(|j| !is_fixed(*j)).collect();
        for _ in 0..self.removed {
            let peg = free.swap_remove(rng.index(free.len())) - 1;
            if rng.chance(difficulty) {
                pegs[peg] = None;
            }
        }
        for _ in 0..self.shifted {
            let peg = free.swap_remove(rng.index(free.len())) - 1;
            let reach = difficulty * self.shift * rng.unit().sqrt();
            let (sin, cos) = rng.around_zero(std::f64::consts::PI).sin_cos();
            shifts.push(Shift { peg, by: reach * Vector2::new(cos, sin) });
        }
    }
}

/// A peg, by its index, and where it goes \[m\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shift {
    pub peg: usize,
    pub by: Vector2<f64>,
}

/// First peg that may be perturbed: the ones before it lie behind the middle of the robot at the start.
const FIRST: usize = 3;

/// \[m\]
const LONGEST_SHIFT: f64 = 0.5;

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(difficulty: f64, seed: u64) -> (Vec<Option<Peg>>, Vec<Shift>) {
        let perturbation = Perturbation { course: Course::Table73, ..Perturbation::default() };
        let mut pegs = perturbation.fixed_pegs(Course::Table73);
        let mut shifts = Vec::new();
        perturbation.draw(difficulty, &mut Rng::new(seed, 0), &mut pegs, &mut shifts);
        (pegs, shifts)
    }

    #[test]
    fn difficulty_scales_the_shifts_and_the_chance_of_a_gap() {
        let mut absent = [0; 3];
        for seed in 0..400 {
            let draws = [0.0, 0.5, 1.0].map(|difficulty| drawn(difficulty, seed));
            for (count, (pegs, _)) in absent.iter_mut().zip(&draws) {
                *count += pegs.iter().filter(|peg| peg.is_none()).count();
            }
            let [none, half, full] = draws.map(|(_, shifts)| shifts);
            for ((none, half), full) in none.iter().zip(half).zip(full) {
                assert_eq!(none.by.norm(), 0.0);
                assert!((2.0 * half.by - full.by).norm() < 1e-15 && half.peg == full.peg);
                assert!(full.by.norm() <= 0.105 && full.peg + 1 >= FIRST);
            }
        }
        // Five standard deviations of a fair coin thrown 400 times are 50.
        assert!(absent[0] == 0 && absent[1].abs_diff(200) < 50 && absent[2] == 400, "{absent:?}");
    }

    #[test]
    fn the_thesis_cases_are_reached_by_naming_pegs() {
        let moved = vec![(3, 0.0, 0.105)];
        let pegs = Perturbation { moved, ..Perturbation::default() }.fixed_pegs(Course::Table73);
        assert!((pegs[2].unwrap().y - 0.206).abs() < 1e-12);
        let removed = Perturbation { without: vec![3], ..Perturbation::default() }.fixed_pegs(Course::Table73);
        assert!(removed[2].is_none() && removed.iter().flatten().count() == 8);
    }

    #[test]
    fn pegs_that_do_not_exist_or_do_not_suffice_are_named() {
        let good = Perturbation::default();
        let cases = [
            ("without[0]", Perturbation { without: vec![8], ..good.clone() }),
            ("moved[0][0]", Perturbation { moved: vec![(0, 0.0, 0.1)], ..good.clone() }),
            ("moved[0][2]", Perturbation { moved: vec![(4, 0.0, f64::NAN)], ..good.clone() }),
            ("removed", Perturbation { removed: 6, ..good.clone() }),
            ("shifted", Perturbation { shifted: 5, ..good.clone() }),
            ("shift", Perturbation { shift: -0.1, ..good.clone() }),
        ];
        for (field, perturbation) in cases {
            assert!(perturbation.validate().unwrap_err().to_string().contains(field), "{field}");
        }
        assert!(good.validate().is_ok());
        assert!(Perturbation { course: Course::Table73, without: vec![9], ..good }.validate().is_ok());
    }
}
