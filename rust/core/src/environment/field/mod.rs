//! Fields of pegs: the course of the thesis and seeded random generators.
//!
//! `difficulty` in \[0, 1\] orders the random fields. At zero the pegs are large and regular and stand
//! where the gait of the thesis needs them; with it grow the spread of radii, the jitter of positions,
//! the share of missing pegs and (Poisson disc) the distance between pegs.

mod corridor;
mod course;
mod lattice;
mod maze;
mod poisson;
mod push_points;
mod track;

use nalgebra::Vector2;

use crate::contact::gap;
use crate::planar::Pose;
use crate::robot::Robot;
use crate::scene::Peg;

use super::config::FieldKind;
use super::path::NaturalPath;
use super::rng::Rng;

pub use corridor::corridor;
pub use course::continued;
pub use maze::maze;
pub use push_points::Reach;

/// The ground that a field has to cover and the robot it is made for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Site {
    /// Extent along the corridor, from behind the tail to beyond the head at the goal \[m\].
    pub x: [f64; 2],
    /// Centre line of the corridor and distance of the outermost pegs' centres from it \[m\].
    pub centre_line: f64,
    pub half_width: f64,
    /// Start of link 1 and the path it draws from there.
    pub head: [f64; 2],
    pub path: NaturalPath,
    /// Half width of the robot \[m\]; peg radii and distances are in proportion to it.
    pub body_radius: f64,
}

impl Site {
    /// Lengths relative to Aiko's.
    fn scale(&self) -> f64 {
        self.body_radius / AIKO_RADIUS
    }

    /// A random peg radius \[m\]: `largest` (in Aiko's scale) at difficulty zero, from 2 cm on at one.
    fn radius(&self, largest: f64, difficulty: f64, rng: &mut Rng) -> f64 {
        self.scale() * rng.uniform(largest - difficulty * (largest - SMALLEST_PEG), largest)
    }

    /// Smallest distance kept between a peg and the robot at the start \[m\].
    pub fn clearance(&self) -> f64 {
        0.002 * self.scale()
    }
}

/// The way to a goal point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Route {
    /// CG of the robot at its start; it moves to +x there \[m\].
    pub start: Vector2<f64>,
    /// Length of the way \[m\].
    pub length: f64,
    /// Largest turn of the way, at difficulty one \[rad\].
    pub turn: f64,
}

/// Link radius of Aiko \[m\] (T Table 7.1), for which the lengths below are meant.
const AIKO_RADIUS: f64 = 0.0525;

/// Radii of pegs \[m\]: the smallest of random fields, the one of (T Table 7.5).
const SMALLEST_PEG: f64 = 0.02;
const LARGEST_PEG: f64 = 0.125;

/// Fills `pegs` with a random field.
pub fn random_field(kind: FieldKind, difficulty: f64, site: &Site, rng: &mut Rng, pegs: &mut Vec<Peg>) {
    pegs.clear();
    let kinds = [FieldKind::Track, FieldKind::Lattice, FieldKind::Poisson];
    match if kind == FieldKind::Mixed { kinds[rng.index(kinds.len())] } else { kind } {
        FieldKind::Lattice => lattice::lattice(difficulty, site, rng, pegs),
        FieldKind::Poisson => poisson::poisson(difficulty, site, rng, pegs),
        FieldKind::Track | FieldKind::Mixed => track::track(difficulty, site, rng, pegs),
    }
}

/// Makes room for a robot at `pose`: pegs nearer than the clearance shrink, pegs that would become
/// smaller than the smallest ones are taken away.
pub fn keep_clear(site: &Site, robot: &Robot, pose: &[Pose], pegs: &mut Vec<Peg>) {
    let smallest = site.scale() * SMALLEST_PEG;
    pegs.retain_mut(|peg| {
        let nearest = robot.links.iter().zip(pose).map(|(link, q)| gap(q, link, peg)).fold(f64::INFINITY, f64::min);
        peg.radius -= (site.clearance() - nearest).max(0.0);
        peg.radius >= smallest
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::rng::Rng;
    use crate::environment::start::{StartJitter, StartLine};
    use crate::gait::Wave;
    use crate::planar::assemble_chain;
    use crate::robot::RobotConfig;
    use proptest::prelude::*;

    /// The site of the default environment.
    pub fn aiko_site() -> Site {
        let line = StartLine::at_origin(Wave::default(), &Robot::new(&RobotConfig::default()).unwrap());
        Site {
            x: [-0.9, 3.0],
            centre_line: line.centre_line,
            half_width: 1.0,
            head: [line.nominal.position.x, line.nominal.position.y],
            path: line.path,
            body_radius: 0.0525,
        }
    }

    /// The way of the default environment.
    pub fn aiko_route() -> Route {
        Route { start: Vector2::zeros(), length: 2.0, turn: std::f64::consts::FRAC_PI_2 }
    }

    const KINDS: [FieldKind; 4] = [FieldKind::Mixed, FieldKind::Track, FieldKind::Lattice, FieldKind::Poisson];

    proptest! {
        #[test]
        fn the_start_never_penetrates_and_radii_stay_in_range(
            seed in 0..1000u64, kind in 0..4usize, difficulty in 0.0..=1.0f64, scale in 0.0..=1.0f64,
        ) {
            let robot = Robot::new(&RobotConfig::default()).unwrap();
            let (site, line) = (aiko_site(), StartLine::at_origin(Wave::default(), &robot));
            let mut rng = Rng::new(seed, 0);
            let start = line.deviated(&StartJitter::draw(&mut rng, scale));
            let angles: Vec<f64> = (0..10).map(line.joint_angles(start.phase)).collect();
            let mut pose = vec![Pose::zeros(); 11];
            assemble_chain(&robot, Pose::new(start.position.x, start.position.y, start.angle), &angles, &mut pose);
            let mut pegs = Vec::new();
            random_field(KINDS[kind], difficulty, &site, &mut rng, &mut pegs);
            keep_clear(&site, &robot, &pose, &mut pegs);
            prop_assert!(pegs.len() > 10);
            for peg in &pegs {
                prop_assert!(peg.radius >= SMALLEST_PEG && peg.radius <= LARGEST_PEG);
                for (link, q) in robot.links.iter().zip(&pose) {
                    prop_assert!(gap(q, link, peg) > 0.999 * site.clearance());
                }
            }
        }
    }

    #[test]
    fn fields_cover_the_corridor_from_start_to_goal() {
        let (site, mut pegs) = (aiko_site(), Vec::new());
        for kind in KINDS {
            for seed in 0..20 {
                random_field(kind, 0.5, &site, &mut Rng::new(seed, 0), &mut pegs);
                // Wherever the robot is, a peg is at most a metre away.
                for x in [0.0, 0.5, 1.0, 1.5, 2.0, 2.5] {
                    for y in [-0.8, 0.0, 0.8] {
                        let distance = |peg: &Peg| (peg.x - x).hypot(peg.y - y) - peg.radius;
                        let nearest = pegs.iter().map(distance).fold(f64::INFINITY, f64::min);
                        assert!(nearest < 1.0, "{kind:?}, seed {seed}: {nearest} m at ({x}, {y})");
                    }
                }
            }
        }
    }

    #[test]
    fn a_field_depends_on_seed_and_episode_alone() {
        let (site, mut first, mut second) = (aiko_site(), Vec::new(), Vec::new());
        random_field(FieldKind::Mixed, 0.7, &site, &mut Rng::new(5, 2), &mut first);
        random_field(FieldKind::Mixed, 0.7, &site, &mut Rng::new(5, 3), &mut second);
        assert_ne!(first, second);
        random_field(FieldKind::Mixed, 0.7, &site, &mut Rng::new(5, 2), &mut second);
        assert_eq!(first, second);
    }

    #[test]
    fn difficulty_makes_a_track_less_regular() {
        let (site, mut pegs) = (aiko_site(), Vec::new());
        let mut irregularity = |difficulty: f64| {
            let mut smallest = f64::INFINITY;
            let mut count = 0;
            for seed in 0..50 {
                random_field(FieldKind::Track, difficulty, &site, &mut Rng::new(seed, 0), &mut pegs);
                smallest = pegs.iter().fold(smallest, |smallest, peg| smallest.min(peg.radius));
                count += pegs.len();
            }
            (smallest, count)
        };
        let (easy, medium, hard) = (irregularity(0.0), irregularity(0.5), irregularity(1.0));
        assert!(easy.0 > medium.0 && medium.0 > hard.0, "radii spread");
        assert!(easy.1 > medium.1 && medium.1 > hard.1, "pegs go missing");
    }
}
