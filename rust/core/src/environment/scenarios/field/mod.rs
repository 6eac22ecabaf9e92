//! A random field of pegs, new in each episode.
//!
//! `difficulty` in \[0, 1\] orders the fields. At zero the pegs are large and regular and stand where the gait of the
//! thesis needs them; with it grow the spread of radii, the jitter of positions, the share of missing pegs and (Poisson
//! disc) the distance between pegs.

mod lattice;
mod poisson;
mod track;

use std::sync::Arc;

use crate::environment::config::FieldKind;
use crate::environment::rng::Rng;
use crate::environment::start::StartJitter;
use crate::scene::Peg;

use super::open_ground::OpenGround;
use super::peg_region::PegRegion;
use super::{EpisodeStart, Family, Placement, Scenario};

pub const FAMILY: Family = Family {
    name: "field",
    id: "SnakeField-v1",
    description: "A new random field of pegs each episode. Three generators draw it: a threaded track with jitter, a \
                  staggered lattice, and random pegs (Poisson disc). `difficulty` in [0, 1] sets how irregular it is. The robot never starts inside a peg.",
    scenario: |config, robot| {
        let ground = OpenGround::new(config, robot, |region| places(config.field, region))?;
        Ok(Arc::new(Field { ground, kind: config.field }))
    },
    ..Family::DEFAULT
};

#[derive(Debug)]
struct Field {
    ground: OpenGround,
    kind: FieldKind,
}

impl Scenario for Field {
    fn draw(&self, placement: &mut Placement, difficulty: f64, jitter: &StartJitter, rng: &mut Rng) -> EpisodeStart {
        self.ground.draw(placement, jitter, |region, pegs| {
            random_field(self.kind, difficulty, region, rng, pegs);
            None
        })
    }
}

/// Number of places at which a peg may be tried.
fn places(kind: FieldKind, region: &PegRegion) -> f64 {
    let places = |kind| match kind {
        FieldKind::Lattice => lattice::places(region),
        FieldKind::Poisson => poisson::places(region),
        FieldKind::Track | FieldKind::Mixed => track::places(region),
    };
    if kind == FieldKind::Mixed { KINDS.map(places).iter().sum() } else { places(kind) }
}

/// The generators, of which a mixed field draws one.
const KINDS: [FieldKind; 3] = [FieldKind::Track, FieldKind::Lattice, FieldKind::Poisson];

/// Replaces `pegs` by a random field.
fn random_field(kind: FieldKind, difficulty: f64, region: &PegRegion, rng: &mut Rng, pegs: &mut Vec<Peg>) {
    pegs.clear();
    match if kind == FieldKind::Mixed { KINDS[rng.index(KINDS.len())] } else { kind } {
        FieldKind::Lattice => lattice::lattice(difficulty, region, rng, pegs),
        FieldKind::Poisson => poisson::poisson(difficulty, region, rng, pegs),
        FieldKind::Track | FieldKind::Mixed => track::track(difficulty, region, rng, pegs),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::rng::Rng;
    use crate::environment::scenarios::peg_region::tests::aiko_region;
    use crate::environment::scenarios::peg_region::{LARGEST_PEG, SMALLEST_PEG};
    use crate::environment::start::StartLine;
    use crate::gait::Wave;
    use crate::robot::{Robot, RobotConfig};
    use proptest::prelude::*;

    const ALL: [FieldKind; 4] = [FieldKind::Mixed, FieldKind::Track, FieldKind::Lattice, FieldKind::Poisson];

    proptest! {
        #[test]
        fn the_start_never_penetrates_and_radii_stay_in_range(
            seed in 0..1000u64, kind in 0..4usize, difficulty in 0.0..=1.0f64, scale in 0.0..=1.0f64,
        ) {
            let robot = Robot::new(&RobotConfig::default()).unwrap();
            let (region, line) = (aiko_region(), StartLine::at_origin(Wave::default(), &robot));
            let mut rng = Rng::new(seed, 0);
            let start = line.deviated(&robot, &StartJitter::draw(&mut rng, scale));
            let mut placement = Placement::new(&robot);
            placement.assemble(&line, &start);
            random_field(ALL[kind], difficulty, &region, &mut rng, &mut placement.pegs);
            placement.clear_pegs(region.clearance(), region.smallest_radius());
            prop_assert!(placement.pegs.len() > 10);
            prop_assert!(placement.smallest_gap() > 0.999 * region.clearance());
            for peg in &placement.pegs {
                prop_assert!(peg.radius >= SMALLEST_PEG && peg.radius <= LARGEST_PEG);
            }
        }
    }

    #[test]
    fn fields_cover_the_corridor_from_start_to_goal() {
        let (region, mut pegs) = (aiko_region(), Vec::new());
        for kind in ALL {
            for seed in 0..20 {
                random_field(kind, 0.5, &region, &mut Rng::new(seed, 0), &mut pegs);
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
        let (region, mut first, mut second) = (aiko_region(), Vec::new(), Vec::new());
        random_field(FieldKind::Mixed, 0.7, &region, &mut Rng::new(5, 2), &mut first);
        random_field(FieldKind::Mixed, 0.7, &region, &mut Rng::new(5, 3), &mut second);
        assert_ne!(first, second);
        random_field(FieldKind::Mixed, 0.7, &region, &mut Rng::new(5, 2), &mut second);
        assert_eq!(first, second);
    }

    #[test]
    fn difficulty_makes_a_track_less_regular() {
        let (region, mut pegs) = (aiko_region(), Vec::new());
        let mut irregularity = |difficulty: f64| {
            let mut smallest = f64::INFINITY;
            let mut count = 0;
            for seed in 0..50 {
                random_field(FieldKind::Track, difficulty, &region, &mut Rng::new(seed, 0), &mut pegs);
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
