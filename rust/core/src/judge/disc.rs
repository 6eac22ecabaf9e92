use nalgebra::Vector2;

use crate::math::Real;

use super::norm;

/// How far an impulse and a slip velocity are from obeying Coulomb's law.
#[derive(Debug, Clone, Copy)]
pub struct FrictionViolation<T> {
    /// Squared distance of the impulse from its projection \[N^2 s^2\].
    pub squared: T,
    /// Fenchel's defect `support(-gamma) + P . gamma`, nonnegative for an admissible impulse \[J\].
    pub gap: T,
}

/// Violation of `-gamma in N_C(P)` for the disc of a `radius` \[N s\] under a link of mass `mass` (T 3.61).
#[inline(always)]
pub(crate) fn disc<T: Real>(radius: T, slip: &Vector2<T>, impulse: &Vector2<T>, mass: T) -> FrictionViolation<T> {
    let step = Vector2::new(mass * slip.x, mass * slip.y);
    let gap = radius * norm(slip.x, slip.y) + impulse.x * slip.x + impulse.y * slip.y;
    FrictionViolation { squared: squared_defect(radius, impulse, &step), gap }
}

/// The same for the ellipse with semi-axes `a` \[N s\] (T 3.63 != D4).
///
/// The projection is taken in coordinates in which the ellipse is the disc of its longer axis: the component along the
/// shorter one is stretched. Along a zero axis any impulse is a violation.
#[inline(always)]
pub fn ellipse<T: Real>(a: &Vector2<T>, slip: &Vector2<T>, impulse: &Vector2<T>, mass: T) -> FrictionViolation<T> {
    let (zero, one) = (T::zero(), T::splat(1.0));
    let x_is_longer = a.y.le(a.x);
    let (longer, shorter) = (T::select(x_is_longer, a.x, a.y), T::select(x_is_longer, a.y, a.x));
    // Both ratios of the axes by one division; zero along a zero axis.
    let inverse = T::select(zero.lt(shorter), one / (longer * shorter), zero);
    let (stretch, shrink) = (longer * longer * inverse, shorter * shorter * inverse);
    let of_shorter = |factor: T| Vector2::new(T::select(x_is_longer, one, factor), T::select(x_is_longer, factor, one));
    let (stretch, shrink) = (of_shorter(stretch), of_shorter(shrink));
    let stretched = Vector2::new(impulse.x * stretch.x, impulse.y * stretch.y);
    let step = Vector2::new(mass * shrink.x * slip.x, mass * shrink.y * slip.y);
    let outside = T::select(zero.lt(shorter), zero, T::select(x_is_longer, impulse.y, impulse.x));
    let gap = norm(a.x * slip.x, a.y * slip.y) + impulse.x * slip.x + impulse.y * slip.y;
    FrictionViolation { squared: squared_defect(longer, &stretched, &step) + outside * outside, gap }
}

/// The same for the ground: an ellipse, or two half-ellipses whose semi-axes along are `shares` of that of `a` for forces
/// along e_x and against it.
///
/// Normals of the set where they meet are across, so impulse and slip obey the law exactly if they obey that of the whole
/// ellipse on the side of P - m gamma. The dissipation of a slip is that of the force against it.
#[inline(always)]
pub fn ground<T: Real>(
    a: &Vector2<T>,
    shares: Option<[f64; 2]>,
    slip: &Vector2<T>,
    impulse: &Vector2<T>,
    mass: T,
) -> FrictionViolation<T> {
    let Some(shares) = shares else { return ellipse(a, slip, impulse, mass) };
    let (with, against) = (T::splat(shares[0]) * a.x, T::splat(shares[1]) * a.x);
    let nearest = Vector2::new(T::select((mass * slip.x).lt(impulse.x), with, against), a.y);
    let resisting = Vector2::new(T::select(slip.x.lt(T::zero()), with, against), a.y);
    let FrictionViolation { squared, .. } = ellipse(&nearest, slip, impulse, mass);
    FrictionViolation { squared, gap: ellipse(&resisting, slip, impulse, mass).gap }
}

/// |p - prox(p - step)|^2 for the disc of a radius.
#[inline(always)]
fn squared_defect<T: Real>(radius: T, p: &Vector2<T>, step: &Vector2<T>) -> T {
    let (x, y) = (p.x - step.x, p.y - step.y);
    let squared = x * x + y * y;
    let shrink = T::select(squared.le(radius * radius), T::splat(1.0), radius / squared.sqrt());
    let (x, y) = (p.x - x * shrink, p.y - y * shrink);
    x * x + y * y
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector2;

    use super::ellipse;

    /// |P - prox(P - m gamma)| with the projection taken where the ellipse is the unit disc, where both axes are positive.
    fn violation_in_unit_coordinates(a: &Vector2<f64>, slip: &Vector2<f64>, impulse: &Vector2<f64>, mass: f64) -> f64 {
        let longest = a.max();
        let p = impulse.component_div(a);
        let x = p - slip.component_mul(a) * (mass / (longest * longest));
        (p - x / x.norm().max(1.0)).norm() * longest
    }

    #[test]
    fn the_violation_does_not_depend_on_how_the_ellipse_is_stretched() {
        let values = [-2.0, -0.3, 0.0, 0.7, 1.9];
        for a in [Vector2::new(0.5, 0.5), Vector2::new(0.2, 0.9), Vector2::new(3.0, 3e-3)] {
            for [px, py] in values.into_iter().flat_map(|x| values.map(|y| [x, y])) {
                for slip in [Vector2::new(0.4, -0.1), Vector2::new(-1e-3, 2.0), Vector2::zeros()] {
                    let impulse = Vector2::new(px * a.x, py * a.y);
                    let expected = violation_in_unit_coordinates(&a, &slip, &impulse, 0.7);
                    let found = ellipse(&a, &slip, &impulse, 0.7).squared.sqrt();
                    assert!((found - expected).abs() < 1e-13 * (1.0 + expected), "{a} {impulse} {slip}");
                }
            }
        }
    }

    #[test]
    fn along_a_zero_axis_any_impulse_is_a_violation() {
        let slip = Vector2::new(0.3_f64, -0.2);
        for (a, x, y) in [(Vector2::new(0.5, 0.0), 0.0, 0.1), (Vector2::new(0.0, 0.5), 0.1, 0.0)] {
            let held = Vector2::new(-slip.x.signum() * a.x, -slip.y.signum() * a.y);
            assert!(ellipse(&a, &slip, &held, 0.7).squared < 1e-30);
            let violation = ellipse(&a, &slip, &(held + Vector2::new(x, y)), 0.7).squared.sqrt();
            assert!((violation - 0.1).abs() < 1e-15);
        }
        let none = Vector2::zeros();
        assert_eq!(ellipse(&none, &slip, &none, 0.7).squared, 0.0);
        assert!((ellipse(&none, &slip, &Vector2::new(0.3, 0.4), 0.7).squared.sqrt() - 0.5).abs() < 1e-15);
    }

    #[test]
    fn an_impulse_that_is_not_a_number_is_a_violation() {
        let violation = ellipse(&Vector2::new(0.5, 0.0), &Vector2::zeros(), &Vector2::new(0.1, f64::NAN), 0.7);
        assert!(violation.squared.is_nan());
    }
}
