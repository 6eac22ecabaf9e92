//! Friction against spin: the ground under a link as a disc of uniform pressure that turns in place.
//!
//! A point at r e_phi of a disc with the load N and the radius R slips across e_phi, and resists with the pressure times
//! `s(phi) = sqrt((mu_x sin phi)^2 + (mu_y cos phi)^2)`, the support of the ellipse of friction in that direction. The
//! moment of all points is `2/3 N R <s>`, with the mean over all directions; `-theta' in N_[-T, T](moment)` with this T.

use nalgebra::Vector2;

use super::Skin;

/// `2/3 <s>`: the largest moment over load and radius. With a skin one half of the disc slides forward, the other backward.
pub fn spin_coefficient(friction: &Vector2<f64>, skin: Option<Skin>) -> f64 {
    let along = skin.map_or([1.0; 2], |skin| skin.shares()).map(|share| share * friction.x);
    along.map(|along| mean_radius(along, friction.y)).iter().sum::<f64>() / 3.0
}

/// Mean of `sqrt((a sin phi)^2 + (b cos phi)^2)`, the perimeter of an ellipse over 2 pi, by Gauss's arithmetic-geometric
/// mean.
fn mean_radius(a: f64, b: f64) -> f64 {
    let (mut larger, mut less) = (a.max(b), a.min(b));
    if less <= 0.0 {
        return larger * std::f64::consts::FRAC_2_PI;
    }
    let (mut sum, mut weight) = (0.5 * (larger * larger + less * less), 1.0);
    while larger - less > 1e-15 * larger {
        let half = 0.5 * (larger - less);
        (larger, less) = (0.5 * (larger + less), (larger * less).sqrt());
        sum -= weight * half * half;
        weight *= 2.0;
    }
    sum / larger
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_over_all_directions_is_that_of_a_quadrature() {
        for (a, b) in [(0.2, 0.2), (0.1, 0.5), (0.5, 0.01), (0.0, 0.3), (0.3, 1e-12), (0.0, 0.0)] {
            let angle = |k: u32| std::f64::consts::TAU * (f64::from(k) + 0.5) / 1e5;
            let mean = (0..100_000).map(|k| (a * angle(k).sin()).hypot(b * angle(k).cos())).sum::<f64>() / 1e5;
            assert!((mean_radius(a, b) - mean).abs() < 1e-9, "{a}, {b}: {}, {mean}", mean_radius(a, b));
        }
        assert!((spin_coefficient(&Vector2::repeat(0.3), None) - 0.2).abs() < 1e-15);
    }
}
