//! Friction that differs forward and backward: its proximal form against the inequality that defines it, its derivative, and
//! the judge against the principle of maximal dissipation.

use nalgebra::Vector2;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use snake_core::judge;
use snake_core::laws::{Coulomb, Disc, Halves, Skin, Unit};

/// Semi-axes along for forces with P_x >= 0 and P_x < 0, and across; one of the three may be zero.
fn semi_axes() -> impl Strategy<Value = [f64; 3]> {
    let axis = || prop_oneof![1 => Just(0.0), 9 => 0.1..2.0_f64];
    [axis(), axis(), axis()].prop_filter("two halves that differ", |[forward, backward, _]| forward != backward)
}

fn vector() -> impl Strategy<Value = Vector2<f64>> {
    (-3.0..3.0_f64, -3.0..3.0_f64).prop_map(|(x, y)| Vector2::new(x, y))
}

fn law([forward, backward, across]: [f64; 3]) -> (Coulomb<f64, Unit>, Skin) {
    let (shape, skin) = Skin::of([forward, across], Some(backward));
    (Coulomb { shape, disc: Disc { radius: Unit } }, skin.expect("two halves"))
}

/// A point of the set by an angle and a part of the way to its boundary.
fn point([forward, backward, across]: [f64; 3], angle: f64, part: f64) -> Vector2<f64> {
    let along = if angle.cos() >= 0.0 { forward } else { backward };
    Vector2::new(along * angle.cos(), across * angle.sin()) * part
}

fn points(axes: [f64; 3]) -> impl Iterator<Item = Vector2<f64>> {
    let angles = (0..400).map(|k| f64::from(k) * std::f64::consts::TAU / 400.0);
    angles.flat_map(move |angle| [0.0, 0.3, 1.0].map(|part| point(axes, angle, part)))
}

/// The force that the law gives at a slip around the multiplier of an impulse of the set.
fn force(law: &Coulomb<f64, Unit>, skin: Skin, impulse: &Vector2<f64>, r: f64, slip: &Vector2<f64>) -> Vector2<f64> {
    let own = impulse.zip_map(&law.shape, |p, axis| if axis > 0.0 { p / axis } else { 0.0 });
    law.scaled(&law.evaluate(skin, &skin.gradient(&own), r, slip).value)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, rng_seed: RngSeed::Fixed(41), ..ProptestConfig::default() })]

    /// P is the minimum of h(Q) - y . Q with h = |S^-1 Q|^2 / 2 over the set: no point of it is better. Zero axes are
    /// segments, where h has no part along them.
    #[test]
    fn no_point_of_the_set_is_nearer(axes in semi_axes(), angle in 0.0..6.3_f64, part in 0.0..1.0_f64, slip in vector(), r in 0.3..3.0_f64) {
        let ((law, skin), before) = (law(axes), point(axes, angle, part));
        let [forward, backward, across] = axes;
        let square = |x: f64, axis: f64| if axis > 0.0 { (x / axis).powi(2) } else { 0.0 };
        let h = |p: &Vector2<f64>| 0.5 * (square(p.x, if p.x >= 0.0 { forward } else { backward }) + square(p.y, across));
        let over = |x: f64, axis: f64| if axis > 0.0 { x / (axis * axis) } else { 0.0 };
        let gradient = Vector2::new(over(before.x, if before.x >= 0.0 { forward } else { backward }), over(before.y, across));
        let y = gradient - slip * r;
        let p = force(&law, skin, &before, r, &slip);
        let best = h(&p) - y.dot(&p);
        for q in points(axes) {
            prop_assert!(best <= h(&q) - y.dot(&q) + 1e-12, "{p} is worse than {q} for {y}");
        }
    }

    /// The stiffness is the derivative of the force by the slip, the slope along a ray that of the evaluation; the kink is
    /// where the force is smallest before its projection.
    #[test]
    fn derivatives_are_those_of_the_force(axes in semi_axes(), slip in vector(), rate in vector(), r in 0.3..3.0_f64) {
        let ((law, skin), centre, step) = (law(axes), Vector2::new(0.2, -0.1), 1e-6);
        let longer = axes[0].max(axes[1]);
        let side = |x: f64| if x >= 0.0 { axes[0] / longer } else { axes[1] / longer };
        let argument = |alpha: f64| {
            let x = centre - law.scaled(&(slip + rate * alpha)) * r;
            Vector2::new(x.x * side(x.x), x.y)
        };
        let x = argument(0.0);
        let raw = centre.x - r * law.shape.x * slip.x;
        prop_assume!((x.norm() - 1.0).abs() > 1e-4 && raw.abs() > 1e-4);
        let k = law.evaluate(skin, &centre, r, &slip).stiffness;
        let at = |alpha: f64| law.scaled(&law.evaluate(skin, &centre, r, &(slip + rate * alpha)).value);
        let expected = (at(step) - at(-step)) / (2.0 * step);
        let found = -Vector2::new(k.xx * rate.x + k.xy * rate.y, k.xy * rate.x + k.yy * rate.y);
        prop_assert!((found - expected).norm() < 1e-5 * (1.0 + expected.norm()), "{found} against {expected}");
        let (first, second) = law.along(skin, &centre, r, &slip, &rate, 0.0);
        prop_assert!((first + at(0.0).dot(&rate)).abs() < 1e-12);
        prop_assert!((second + found.dot(&rate)).abs() < 1e-9);
        let kink = law.kink(skin, &centre, r, &slip, &rate);
        for away in [-1e-3, 1e-3] {
            prop_assert!(kink.is_nan() || argument(kink).norm() <= argument(kink + away).norm() + 1e-12);
        }
    }

    /// Of all forces of the set a slip meets the one that takes the most power. The judge accepts that, and by how much it
    /// refuses another one is at least a fixed part of the distance between them, as long as that force slips.
    #[test]
    fn the_judge_accepts_the_force_of_maximal_dissipation(axes in semi_axes(), slip in vector(), mass in 0.3..3.0_f64) {
        let (law, skin) = law(axes);
        let shares = Some(skin.shares());
        let sliding = force(&law, skin, &Vector2::zeros(), 1e9, &slip);
        let power = points(axes).map(|q| -q.dot(&slip)).fold(f64::NEG_INFINITY, f64::max);
        // A polygon of 400 sides.
        prop_assert!((-sliding.dot(&slip) - power).abs() <= 1e-4 * power.abs() + 1e-7, "{sliding}: {power}");
        let judged = |p: &Vector2<f64>| judge::ground(&law.shape, shares, &slip, p, mass);
        let right = judged(&sliding);
        prop_assert!(right.squared < 1e-13 && right.gap.abs() < 1e-6, "{right:?}");
        for q in points(axes) {
            prop_assert!(judged(&q).gap >= -1e-12);
        }
        let mirrored = Vector2::new(-sliding.x, sliding.y);
        if sliding.x.abs() > 0.05 && slip.x.abs() > 0.05 {
            prop_assert!(judged(&mirrored).squared.sqrt() > 1e-3, "{mirrored}");
            prop_assert!(judged(&(sliding * 1.02)).squared.sqrt() > 1e-4);
        }
    }
}
