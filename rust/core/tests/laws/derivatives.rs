//! What solvers need of the laws besides projections: Jacobians against finite differences, behaviour along a ray
//! against direct evaluation, and branches that are held.

use nalgebra::{Vector2, Vector3};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use snake_core::laws::{
    Backlash, ConvexSet, Coulomb, Disc, HalfLine, Interval, LimitSurface, LimitedActuator, Stribeck, Unit, Whole,
};

/// Step of central differences, and their error for functions of size and curvature of about one.
const STEP: f64 = 1e-6;
const DIFFERENCE: f64 = 1e-7;

fn vector() -> impl Strategy<Value = Vector2<f64>> {
    (-3.0..3.0_f64, -3.0..3.0_f64).prop_map(|(x, y)| Vector2::new(x, y))
}

/// A law in disc coordinates: shape of the ellipse, radius, penalty; a zero axis now and then.
fn coulomb() -> impl Strategy<Value = (Coulomb, f64)> {
    let axis = prop_oneof![1 => Just(0.0), 9 => 0.1..2.0_f64];
    (axis.clone(), axis, 0.2..2.0_f64, 0.3..3.0_f64)
        .prop_map(|(x, y, radius, r)| (Coulomb { shape: Vector2::new(x, y), disc: Disc { radius } }, r))
}

fn actuator() -> impl Strategy<Value = LimitedActuator> {
    (-2.0..2.0_f64, 0.0..3.0_f64, 0.1..2.0_f64).prop_map(|(offset, stiffness, limit)| LimitedActuator {
        offset,
        stiffness,
        limit,
    })
}

fn difference(f: impl Fn(f64) -> f64) -> f64 {
    (f(STEP) - f(-STEP)) / (2.0 * STEP)
}

/// Whether x stays on one side of a kink at `size` within the step of a difference.
fn away_from(x: f64, kink: f64) -> bool {
    (x - kink).abs() > 10.0 * STEP
}

/// Impulse within the limit, stiffness its derivative, slope and curvature along a ray those of the evaluation.
fn check_actuator(
    rate: f64,
    change: f64,
    limit: f64,
    evaluate: impl Fn(f64) -> (f64, f64),
    (slope, curvature): (f64, f64),
) -> Result<(), TestCaseError> {
    let (impulse, stiffness) = evaluate(rate);
    prop_assert!(impulse.abs() <= limit);
    prop_assert!((stiffness - difference(|s| -evaluate(rate + s).0)).abs() < DIFFERENCE);
    prop_assert!((slope + impulse * change).abs() < 1e-12);
    prop_assert!((curvature - stiffness * change * change).abs() < 1e-12);
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, rng_seed: RngSeed::Fixed(11), ..ProptestConfig::default() })]

    #[test]
    fn jacobian_of_the_disc_is_the_derivative_of_its_projection(radius in 0.1..2.0_f64, x in vector(), d in vector()) {
        let disc = Disc { radius };
        prop_assume!(away_from(x.norm(), radius));
        let evaluation = disc.evaluate(&x);
        let j = evaluation.jacobian;
        prop_assert_eq!(evaluation.value, disc.project(x));
        let expected = Vector2::from_fn(|k, _| difference(|s| disc.project(x + d * s)[k]));
        let found = Vector2::new(j.xx * d.x + j.xy * d.y, j.xy * d.x + j.yy * d.y);
        prop_assert!((found - expected).norm() < DIFFERENCE * 100.0, "{found} against {expected}");
        let by_radius = Vector2::from_fn(|k, _| difference(|s| Disc { radius: radius + s }.project(x)[k]));
        prop_assert!((evaluation.by_radius - by_radius).norm() < DIFFERENCE, "{} against {by_radius}", evaluation.by_radius);
    }

    /// A contact's function has curvature up to where the contact opens; that of a drive is least where its impulse is zero.
    #[test]
    fn kinks_lie_where_the_slope_changes(
        law in actuator(), x in -2.0..2.0_f64, r in 0.3..3.0_f64, rate in -2.0..2.0_f64, change in 0.1..2.0_f64
    ) {
        let contact = |alpha: f64| HalfLine.along(x - r * alpha * change, r, change).1;
        let kink = HalfLine.kink(x, r, change);
        prop_assert_eq!((contact(kink - 1e-9), contact(kink + 1e-9)), (r * change * change, 0.0));
        prop_assume!(law.stiffness > 0.1);
        let (slope, curvature) = law.along(rate, change, law.kink(rate, change));
        prop_assert!(slope.abs() < 1e-12 && curvature > 0.0);
        let none = LimitedActuator { limit: 0.0, ..law };
        prop_assert!(none.kink(rate, change).is_nan());
    }

    /// The disc of radius 1 takes a shorter way to the same bits.
    #[test]
    fn the_unit_disc_is_the_disc_of_radius_one(x in vector(), d in vector(), r in 0.1..3.0_f64) {
        let (unit, one) = (Disc { radius: Unit }, Disc { radius: 1.0 });
        prop_assert_eq!(unit.evaluate(&x), one.evaluate(&x));
        prop_assert_eq!(unit.along(&x, &d, r), one.along(&x, &d, r));
    }

    /// A contact held on the inner branch has the identity for its projection, wherever its argument lies.
    #[test]
    fn a_held_disc_is_the_identity_but_for_a_point(radius in 0.1..2.0_f64, x in vector()) {
        let held = Disc { radius }.evaluate_held(&x, true);
        prop_assert_eq!((held.value, held.jacobian.xx, held.jacobian.xy, held.jacobian.yy), (x, 1.0, 0.0, 1.0));
        let point = Disc { radius: 0.0 }.evaluate_held(&x, true);
        prop_assert_eq!(point.value, Vector2::zeros());
        prop_assert_eq!((point.jacobian.xx, point.jacobian.yy), (0.0, 0.0));
    }

    /// Of the limit surface too: impulses within it, stiffness minus their derivative, slope and curvature along a ray those of
    /// the evaluation, and the kink where the argument is least.
    #[test]
    fn stiffness_of_a_limit_surface_is_the_derivative_of_its_impulse(
        a in vector(), b in vector(), c in vector(), force in 0.1..2.0_f64, moment in 0.1..2.0_f64, r in 0.3..3.0_f64
    ) {
        let law = LimitSurface { axes: Vector3::new(force, force, moment) };
        let (centre, twist, d) = (a.push(b.x), b.push(a.y), c.push(b.y));
        let argument = |twist: &Vector3<f64>| centre - law.scaled(twist) * r;
        prop_assume!(away_from(argument(&twist).norm(), 1.0) && d.norm() > 0.1);
        let at = law.evaluate(&centre, r, &twist);
        let impulse = |s: f64| law.scaled(&law.evaluate(&centre, r, &(twist + d * s)).value);
        prop_assert!(at.value.norm() < 1.0 + 1e-12);
        let found = at.across.component_mul(&d) - at.along * (at.stiffness * at.along.dot(&d));
        let expected = Vector3::from_fn(|k, _| difference(|s| -impulse(s)[k]));
        prop_assert!((found - expected).norm() < DIFFERENCE * 100.0, "{found} against {expected}");
        let (slope, curvature) = law.along(&centre, r, &(twist - d * 0.7), &d, 0.7);
        prop_assert!((slope + impulse(0.0).dot(&d)).abs() < 1e-11);
        prop_assert!((curvature - found.dot(&d)).abs() < 1e-11);
        let kink = law.kink(&centre, r, &twist, &d);
        let length = |alpha: f64| argument(&(twist + d * alpha)).norm();
        prop_assert!(length(kink) <= length(kink + 1e-3) && length(kink) <= length(kink - 1e-3));
    }

    /// Stiffness is minus the derivative of the impulse by the slip, symmetric and positive semidefinite.
    #[test]
    fn stiffness_of_coulomb_friction_is_the_derivative_of_its_impulse(
        (law, r) in coulomb(), centre in vector(), slip in vector(), d in vector()
    ) {
        let x = centre - law.scaled(&slip) * r;
        prop_assume!(away_from(x.norm(), law.disc.radius));
        let impulse = |slip: Vector2<f64>| law.scaled(&law.evaluate(Whole, &centre, r, &slip).value);
        let k = law.evaluate(Whole, &centre, r, &slip).stiffness;
        let expected = Vector2::from_fn(|i, _| difference(|s| -impulse(slip + d * s)[i]));
        let found = Vector2::new(k.xx * d.x + k.xy * d.y, k.xy * d.x + k.yy * d.y);
        prop_assert!((found - expected).norm() < DIFFERENCE * 1000.0, "{found} against {expected}");
        prop_assert!(found.dot(&d) >= -1e-12);
        prop_assert!((law.evaluate(Whole, &centre, r, &slip).value - law.disc.project(x)).norm() < 1e-14);
    }

    /// Along a ray the slope is minus the power of the impulse, and the curvature its derivative.
    #[test]
    fn coulomb_friction_along_a_ray_is_its_direct_evaluation(
        (law, r) in coulomb(), centre in vector(), slip in vector(), rate in vector(), alpha in 0.0..1.0_f64
    ) {
        let at = slip + rate * alpha;
        let (slope, curvature) = law.along(Whole, &centre, r, &slip, &rate, alpha);
        let impulse = law.scaled(&law.evaluate(Whole, &centre, r, &at).value);
        prop_assert!((slope + impulse.dot(&rate)).abs() < 1e-12);
        let k = law.evaluate(Whole, &centre, r, &at).stiffness;
        let bend = rate.x * (k.xx * rate.x + k.xy * rate.y) + rate.y * (k.xy * rate.x + k.yy * rate.y);
        prop_assert!((curvature - bend).abs() < 1e-11, "{curvature} against {bend}");
    }

    /// At the kink the argument of the projection is shortest.
    #[test]
    fn the_kink_of_coulomb_friction_is_its_shortest_argument(
        (law, r) in coulomb(), centre in vector(), slip in vector(), rate in vector()
    ) {
        prop_assume!(law.scaled(&rate).norm() > 0.1);
        let length = |alpha: f64| (centre - law.scaled(&(slip + rate * alpha)) * r).norm();
        let kink = law.kink(Whole, &centre, r, &slip, &rate);
        prop_assert!(length(kink) <= length(kink + 1e-3) && length(kink) <= length(kink - 1e-3));
    }

    #[test]
    fn unilateral_contact_along_a_ray_is_its_direct_evaluation(x in -2.0..2.0_f64, r in 0.1..3.0_f64, rate in -2.0..2.0_f64) {
        prop_assume!(away_from(x, 0.0));
        let impulse = |s: f64| HalfLine.project(x - r * rate * s);
        let (slope, curvature) = HalfLine.along(x, r, rate);
        prop_assert_eq!(slope, -(impulse(0.0) * rate));
        prop_assert!((curvature - difference(|s| -impulse(s) * rate)).abs() < DIFFERENCE);
        let closed = HalfLine.is_closed(x);
        prop_assert_eq!(HalfLine.evaluate(x, r, closed), (impulse(0.0), if x > 0.0 { r } else { 0.0 }));
        prop_assert_eq!(HalfLine.evaluate(x, r, true), (x, r));
        prop_assert_eq!(HalfLine.evaluate(x, r, false), (0.0, 0.0));
    }

    /// Impulse within the limit, stiffness its derivative, and the same along a ray; with no slack, backlash is none.
    #[test]
    fn actuators_are_monotone_and_along_a_ray_as_evaluated(
        law in actuator(), slack in 0.0..1.0_f64, rate in -3.0..3.0_f64, change in -2.0..2.0_f64, alpha in 0.0..1.0_f64
    ) {
        let loose = Backlash { actuator: law, slack };
        let tight = law.unlimited(rate);
        let kinks = [law.limit, law.limit + slack, slack];
        prop_assume!(kinks.iter().all(|&kink| (tight.abs() - kink).abs() > 10.0 * STEP * (1.0 + law.stiffness)));
        let start = rate - alpha * change;
        check_actuator(rate, change, law.limit, |rate| law.evaluate(rate), law.along(start, change, alpha))?;
        check_actuator(rate, change, law.limit, |rate| loose.evaluate(rate), loose.along(start, change, alpha))?;
        let reference = Interval { limit: law.limit }.project(tight - Interval { limit: slack }.project(tight));
        prop_assert_eq!(loose.evaluate(rate).0, reference);
        prop_assert_eq!(Backlash { actuator: law, slack: 0.0 }.evaluate(rate).0, law.evaluate(rate).0);
    }

    /// On the branch of the present impulse the law is itself.
    #[test]
    fn the_last_branch_of_an_actuator_is_the_law_where_it_has_not_changed(
        law in actuator(), slack in 0.0..1.0_f64, rate in -3.0..3.0_f64
    ) {
        let law = Backlash { actuator: law, slack };
        let (impulse, stiffness) = law.evaluate(rate);
        prop_assert_eq!(law.evaluate_last_branch(rate, impulse), (impulse, stiffness));
        // Saturated on the other side, it stays there.
        let limit = law.actuator.limit;
        prop_assert_eq!(law.evaluate_last_branch(rate, -limit), (-limit, 0.0));
    }


    /// Friction falls from its value at rest to what fast sliding leaves, half-way at the named speed.
    #[test]
    fn stribeck_friction_falls_monotonically(drop in 0.0..1.0_f64, speed in 1e-3..1.0_f64, v in 0.0..2.0_f64) {
        let law = Stribeck { drop, speed };
        let share = law.share(v * v);
        prop_assert_eq!(law.share(0.0), 1.0);
        prop_assert!(share <= 1.0 && share >= 1.0 - drop && law.share(4.0 * v * v) <= share);
        prop_assert!((law.share(speed * speed) - (1.0 - 0.5 * drop)).abs() < 1e-15);
    }
}
