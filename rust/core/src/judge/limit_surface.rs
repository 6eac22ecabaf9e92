use nalgebra::Vector3;

use crate::math::Real;

use super::FrictionViolation;

/// Violation of `-u in N_E(P)` for the ellipsoid with semi-axes `a`, two equal forces and a moment, under a body of mass `mass`
/// that reaches `reach` far \[N s\], \[N m s\].
///
/// Moments count as forces at the lever a_z / a_x, at which the ellipsoid is a ball. Without friction any impulse is a violation.
#[inline(always)]
pub fn limit_surface<T: Real>(
    a: &Vector3<T>,
    twist: &Vector3<T>,
    impulse: &Vector3<T>,
    mass: T,
    reach: T,
) -> FrictionViolation<T> {
    let rough = T::zero().lt(a.x) & T::zero().lt(a.z);
    let lever = T::select(rough, a.z / a.x, reach);
    let radius = T::select(rough, a.x, T::zero());
    let (force, slip) = ([impulse.x, impulse.y, impulse.z / lever], [twist.x, twist.y, twist.z * lever]);
    let length = |v: &[T; 3]| (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
    let moved = [force[0] - mass * slip[0], force[1] - mass * slip[1], force[2] - mass * slip[2]];
    let far = length(&moved);
    let share = T::select(far.le(radius), T::splat(1.0), radius / far);
    let defect = [force[0] - share * moved[0], force[1] - share * moved[1], force[2] - share * moved[2]];
    let work = force[0] * slip[0] + force[1] * slip[1] + force[2] * slip[2];
    let squared = defect[0] * defect[0] + defect[1] * defect[1] + defect[2] * defect[2];
    FrictionViolation { squared, gap: radius * length(&slip) + work }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::limit_surface;

    #[test]
    fn impulses_against_the_slip_at_the_bound_or_at_rest_inside_obey_the_law() {
        let a = Vector3::new(0.5, 0.5, 0.06);
        let slip = Vector3::new(0.3, -0.2, 4.0);
        let squares = a.component_mul(&a);
        let held = -slip.component_mul(&squares) / slip.component_mul(&a).norm();
        let sliding = limit_surface(&a, &slip, &held, 0.7, 0.1);
        assert!(sliding.squared < 1e-30 && sliding.gap.abs() < 1e-15);
        let sticking = limit_surface(&a, &Vector3::zeros(), &(held * 0.9), 0.7, 0.1);
        assert!(sticking.squared < 1e-30 && sticking.gap == 0.0);
        for (impulse, slip) in [(held * 0.9, slip), (held * 1.1, slip), (held * 1.1, Vector3::zeros()), (-held, slip)] {
            assert!(limit_surface(&a, &slip, &impulse, 0.7, 0.1).squared > 1e-4, "{impulse} {slip}");
        }
        // Separate bounds on force and moment would let more pass.
        let corner = Vector3::new(-a.x, 0.0, -a.z);
        assert!(limit_surface(&a, &Vector3::zeros(), &corner, 0.7, 0.1).squared > 1e-3);
    }

    #[test]
    fn without_friction_any_impulse_is_a_violation() {
        let (none, slip) = (Vector3::zeros(), Vector3::new(0.3, 0.1, 2.0));
        assert_eq!(limit_surface(&none, &slip, &none, 0.7, 0.1).squared, 0.0);
        assert!((limit_surface(&none, &slip, &Vector3::new(0.0, 0.0, 0.01), 0.7, 0.1).squared - 0.01).abs() < 1e-15);
        assert!(limit_surface(&none, &slip, &Vector3::new(0.1, f64::NAN, 0.0), 0.7, 0.1).squared.is_nan());
    }
}
