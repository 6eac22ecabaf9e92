//! Pegs and links of the spatial model: the gap against samples of the surfaces.

use nalgebra::Vector2;
use snake_core::spatial::peg_gap;
use snake_test_support::planar::Random;
use snake_test_support::spatial_random::{random_link, random_peg, random_pose};

#[test]
fn peg_gap_is_the_distance_between_the_surfaces() {
    let mut random = Random::new(46);
    for _ in 0..300 {
        let (link, pose) = (random_link(&mut random), random_pose(&mut random));
        let peg = random_peg(&mut random, &link, &pose);
        let places = 20_000;
        let nearest = (0..=places)
            .map(|k| {
                let s = link.cg_offset + link.contact_half_length * (2.0 * f64::from(k) / f64::from(places) - 1.0);
                (pose.position + pose.axis() * s).xy().metric_distance(&Vector2::new(peg.x, peg.y))
            })
            .fold(f64::INFINITY, f64::min);
        let gap = peg_gap(&link, &pose, &peg);
        let sampled = nearest - link.radius - peg.radius;
        assert!(gap <= sampled + 1e-15 && sampled - gap < 2e-5, "samples lie at most 1.5e-5 m apart");
    }
}
