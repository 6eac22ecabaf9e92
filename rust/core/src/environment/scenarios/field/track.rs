//! Pegs that alternate along the natural path of the gait (T 5.5), as in (T Tables 7.3 and 7.5).

use std::f64::consts::FRAC_PI_2;

use crate::scene::Peg;

use crate::environment::rng::Rng;
use crate::environment::scenarios::peg_region::{LARGEST_PEG, PegRegion};

/// Gap between body and peg where the body passes at its closest \[m\].
const THREADING_GAP: f64 = 0.006;

/// Jitter of a peg along and across the track at difficulty one \[m\].
const JITTER: [f64; 2] = [0.06, 0.03];

/// Share of missing pegs at difficulty one.
const MISSING: f64 = 0.25;

/// Distance between parallel tracks \[m\]; between two of them nothing passes, along each the gait does.
const TRACK_PITCH: f64 = 0.55;

/// Tracks to either side of the first.
fn tracks(region: &PegRegion) -> f64 {
    (region.half_width / (TRACK_PITCH * region.scale())).trunc()
}

/// Number of places for pegs, at most.
pub fn places(region: &PegRegion) -> f64 {
    (2.0 * tracks(region) + 1.0) * ((region.x[1] - region.x[0]) / region.path.half_wave() + 1.0)
}

/// A track through the start posture and parallel ones that fill the corridor.
///
/// A peg stands inside each bend of the path, near its centre line, so that the body always has
/// three of them to push against.
pub fn track(difficulty: f64, region: &PegRegion, rng: &mut Rng, pegs: &mut Vec<Peg>) {
    let tracks = tracks(region) as i32;
    let half_wave = region.path.half_wave();
    let crest = region.path.crossing() + FRAC_PI_2;
    let first_crest = region.head[0] + region.path.displacement(0.0, crest).x;
    let first = ((region.x[0] - first_crest) / half_wave).ceil() as i32;
    let last = ((region.x[1] - first_crest) / half_wave).floor() as i32;
    for bend in first..=last {
        let outwards = if bend % 2 == 0 { 1.0 } else { -1.0 };
        let x = first_crest + f64::from(bend) * half_wave;
        for track in -tracks..=tracks {
            let y = region.centre_line + f64::from(track) * TRACK_PITCH * region.scale();
            bend_peg(difficulty, region, [x, y], outwards, rng, pegs);
        }
    }
}

/// The peg inside the bend at `x`; the bend lies on the side `outwards` of its centre line `y`.
fn bend_peg(difficulty: f64, region: &PegRegion, [x, y]: [f64; 2], outwards: f64, rng: &mut Rng, pegs: &mut Vec<Peg>) {
    let radius = region.radius(LARGEST_PEG, difficulty, rng);
    let jitter = JITTER.map(|reach| rng.around_zero(difficulty * reach * region.scale()));
    let missing = rng.chance(difficulty * MISSING);
    let from_bend = region.body_radius + radius + THREADING_GAP * region.scale();
    let y = y + outwards * (region.path.height() - from_bend);
    if !missing {
        pegs.push(Peg { radius, x: x + jitter[0], y: y + jitter[1] });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::scenarios::peg_region::tests::aiko_region;
    use crate::scene::TABLE_7_5;

    #[test]
    fn at_difficulty_zero_the_middle_track_is_the_geometry_of_table_7_5() {
        let (region, mut pegs) = (aiko_region(), Vec::new());
        track(0.0, &region, &mut Rng::new(0, 0), &mut pegs);
        let mut middle: Vec<_> = pegs.iter().filter(|peg| peg.y.abs() < 0.2).collect();
        middle.sort_by(|a, b| a.x.total_cmp(&b.x));
        let [upper, lower] = [0.178, 0.003];
        for pair in middle.windows(2) {
            assert!((pair[1].x - pair[0].x - 0.3673).abs() < 1e-3);
            assert_eq!(pair[0].radius, TABLE_7_5[0][0]);
            // The table's rows, printed to a millimetre, spread by 5 mm.
            assert!(((pair[1].y - pair[0].y).abs() - (upper - lower)).abs() < 0.01, "{}", pair[1].y - pair[0].y);
        }
    }
}
