//! Force laws as convex sets: each projection is the nearest point, each support function the
//! supremum, and Fenchel's equality holds exactly for the pairs that obey the law.

use nalgebra::{Vector2, Vector3};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use snake_core::laws::{Ball, Cone, ConvexSet, Disc, Ellipse, HalfLine, Interval};

/// Round-off of a handful of operations, relative to the sizes involved.
const ROUND_OFF: f64 = 1e-14;

fn magnitude() -> impl Strategy<Value = f64> {
    (-12.0..12.0_f64).prop_map(|e| 10f64.powf(e))
}

fn component() -> impl Strategy<Value = f64> {
    prop_oneof![1 => Just(0.0), 9 => (magnitude(), any::<bool>()).prop_map(|(x, s)| if s { x } else { -x })]
}

fn vector() -> impl Strategy<Value = Vector2<f64>> {
    (component(), component()).prop_map(|(x, y)| Vector2::new(x, y))
}

/// Semi-axes with ratios up to 1e3, or with a zero among them.
fn axes() -> impl Strategy<Value = Vector2<f64>> {
    let ratio = (-3.0..3.0_f64).prop_map(|e| 10f64.powf(e));
    prop_oneof![
        8 => (magnitude(), ratio).prop_map(|(a, r)| Vector2::new(a, a * r)),
        1 => magnitude().prop_map(|a| Vector2::new(a, 0.0)),
        1 => magnitude().prop_map(|a| Vector2::new(0.0, a)),
        1 => magnitude().prop_map(|a| Vector2::new(a, a)),
        1 => Just(Vector2::zeros()),
    ]
}

/// Points near the size of the set, inside and outside, besides any others.
fn point_for(axes: Vector2<f64>) -> impl Strategy<Value = Vector2<f64>> {
    let near = (-3.0..3.0_f64, -3.0..3.0_f64).prop_map(move |(x, y)| Vector2::new(x, y) * axes.max());
    let scaled = (-1.5..1.5_f64, -1.5..1.5_f64).prop_map(move |(x, y)| Vector2::new(x * axes.x, y * axes.y));
    prop_oneof![near, scaled, vector()]
}

/// Of friction, also none.
fn coefficient() -> impl Strategy<Value = f64> {
    prop_oneof![1 => Just(0.0), 9 => 1e-3..3.0_f64]
}

/// (normal, along, across), also without a friction part.
fn impulse() -> impl Strategy<Value = Vector3<f64>> {
    let part = || -1.0..1.0_f64;
    prop_oneof![
        9 => (part(), part(), part()).prop_map(|(x, y, z)| Vector3::new(x, y, z)),
        1 => part().prop_map(|x| Vector3::new(x, 0.0, 0.0)),
    ]
}

fn ellipse_and_points() -> impl Strategy<Value = (Ellipse, Vector2<f64>, Vector2<f64>)> {
    axes().prop_flat_map(|axes| (Just(Ellipse { axes }), point_for(axes), point_for(axes)))
}

/// How far outside the ellipse a point lies, relative to the ellipse.
fn excess(set: &Ellipse, p: Vector2<f64>) -> f64 {
    let part = |x: f64, a: f64| if x == 0.0 { 0.0 } else { (x / a).powi(2) };
    (part(p.x, set.axes.x) + part(p.y, set.axes.y)).sqrt() - 1.0
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 4000, failure_persistence: None, rng_seed: RngSeed::Fixed(7), ..ProptestConfig::default() })]

    #[test]
    fn ellipse_projection_is_inside_idempotent_and_non_expansive((set, x, y) in ellipse_and_points()) {
        let (px, py) = (set.project(x), set.project(y));
        // Newton's last step leaves |f| of a few ulps, and f is the squared relative radius.
        prop_assert!(excess(&set, px) <= ROUND_OFF, "outside by {:e}", excess(&set, px));
        // The projection of a point a few ulps outside moves it by a few ulps of the larger axis.
        prop_assert!((set.project(px) - px).norm() <= 1e-14 * set.axes.max());
        let size = set.axes.max() + x.norm().min(y.norm()) * f64::EPSILON;
        prop_assert!((px - py).norm() <= (x - y).norm() * (1.0 + ROUND_OFF) + 1e-12 * size);
    }

    /// x - P(x) lies in the normal cone: (x - Px) . (z - Px) <= 0 for every z in the set.
    #[test]
    fn ellipse_residual_is_normal((set, x, _) in ellipse_and_points(), direction in 0.0..std::f64::consts::TAU) {
        let p = set.project(x);
        let z = Vector2::new(set.axes.x * direction.cos(), set.axes.y * direction.sin());
        let scale = (x - p).norm() * set.axes.max();
        // p carries a relative error of ratio^2 ulps along the boundary at worst (1e6 * 1e-16),
        // and at most 1e-13 of the larger axis across directions in the cases drawn here.
        prop_assert!((x - p).dot(&(z - p)) <= 1e-12 * scale, "{:e}", (x - p).dot(&(z - p)) / scale);
        let radial = set.support(x - p) - (x - p).dot(&p);
        prop_assert!(radial.abs() <= 1e-12 * scale, "Fenchel's equality at P(x): {:e}", radial / scale);
    }

    /// The support function is the supremum over the set: attained, and never exceeded.
    #[test]
    fn ellipse_support_is_the_supremum((set, v, z) in ellipse_and_points()) {
        let support = set.support(v);
        let inside = set.project(z);
        prop_assert!(inside.dot(&v) <= support * (1.0 + ROUND_OFF) + f64::MIN_POSITIVE);
        let weighted = set.axes.component_mul(&v);
        if weighted.norm() > 0.0 {
            let maximiser = set.axes.component_mul(&weighted) / weighted.norm();
            prop_assert!((maximiser.dot(&v) - support).abs() <= ROUND_OFF * support);
        }
    }

    /// (T 3.64): lambda = prox(lambda - r gamma) if and only if -gamma in N_C(lambda), in Fenchel's form.
    #[test]
    fn fenchel_equality_holds_exactly_on_the_law((set, x, _) in ellipse_and_points(), r in 1e-3..1e3_f64) {
        let lambda = set.project(x);
        let gamma = (lambda - x) / r;
        let scale = gamma.norm() * set.axes.max();
        let defect = set.support(-gamma) + lambda.dot(&gamma);
        prop_assert!(defect.abs() <= 1e-12 * scale);
        // Off the law the inequality is strict: the opposite velocity dissipates the wrong way.
        if gamma.norm() > 0.0 && set.axes.min() > 0.0 {
            prop_assert!(set.support(gamma) - lambda.dot(&gamma) > 0.1 * set.support(gamma));
        }
    }

    #[test]
    fn disc_projection_is_radial(radius in magnitude(), x in vector(), y in vector()) {
        let set = Disc { radius };
        let (p, q) = (set.project(x), set.project(y));
        prop_assert!(p.norm() <= radius * (1.0 + ROUND_OFF));
        prop_assert!((p - q).norm() <= (x - y).norm() * (1.0 + ROUND_OFF) + ROUND_OFF * radius);
        prop_assert!((x.x * p.y - x.y * p.x).abs() <= ROUND_OFF * x.norm() * p.norm());
        prop_assert!(p == x || (p.norm() - radius).abs() <= ROUND_OFF * radius);
        prop_assert_eq!(set.support(x), radius * x.norm());
    }

    #[test]
    fn ball_projection_is_radial(radius in magnitude(), x in vector(), y in vector(), z in component(), w in component()) {
        let (set, x, y) = (Ball { radius }, x.push(z), y.push(w));
        let (p, q) = (set.project(x), set.project(y));
        prop_assert!(p.norm() <= radius * (1.0 + ROUND_OFF));
        prop_assert!((p - q).norm() <= (x - y).norm() * (1.0 + ROUND_OFF) + ROUND_OFF * radius);
        prop_assert!(x.cross(&p).norm() <= ROUND_OFF * x.norm() * p.norm());
        prop_assert!(p == x || (p.norm() - radius).abs() <= ROUND_OFF * radius);
        prop_assert!((set.support(x) - radius * x.norm()).abs() <= ROUND_OFF * radius * x.norm());
    }

    /// p is the nearest point of a closed convex cone if and only if it lies in it, and x - p in its polar and across p.
    #[test]
    fn cone_projection_is_the_nearest_point(coefficient in coefficient(), x in impulse(), y in impulse()) {
        let set = Cone { coefficient };
        let (p, q) = (set.project(x), set.project(y));
        let left = x - p;
        let round_off = ROUND_OFF * x.norm() * (1.0 + coefficient);
        prop_assert!(p.x >= 0.0 && p.yz().norm() <= coefficient * p.x + round_off);
        prop_assert!(left.x + coefficient * left.yz().norm() <= round_off);
        prop_assert!(left.dot(&p).abs() <= ROUND_OFF * x.norm_squared());
        prop_assert!((p - q).norm() <= (x - y).norm() + ROUND_OFF * (x.norm() + y.norm()));
        prop_assert_eq!(set.support(-x), if x.x >= coefficient * x.yz().norm() { 0.0 } else { f64::INFINITY });
    }

    #[test]
    fn cone_derivative_predicts_the_projection(coefficient in coefficient(), x in impulse(), step in impulse()) {
        let set = Cone { coefficient };
        let size = 1e-6 * x.norm();
        let ends = [-1.0, 1.0].map(|sign| set.evaluate(&(x + step * (sign * size))));
        let derivative = set.evaluate(&x).1;
        // On either side of a kink there is another derivative.
        prop_assume!(ends.iter().all(|end| (end.1 - derivative).norm() < 1e-3));
        prop_assert!(((ends[1].0 - ends[0].0) / (2.0 * size) - derivative * step).norm() <= 1e-3 * step.norm());
    }

    #[test]
    fn ellipse_with_equal_axes_is_the_disc(radius in magnitude(), x in vector()) {
        let disc = Disc { radius }.project(x);
        let ellipse = |y: f64| Ellipse { axes: Vector2::new(radius, y) }.project(x);
        prop_assert_eq!(ellipse(radius), disc);
        // Continuity: a relative change of 1e-9 in an axis moves the nearest point by no more than that.
        prop_assert!((ellipse(radius * (1.0 + 1e-9)) - disc).norm() <= 2e-9 * radius);
    }

    #[test]
    fn interval_and_half_line_are_their_closed_forms(limit in magnitude(), x in component(), v in component()) {
        let set = Interval { limit };
        let p = set.project(x);
        prop_assert!(p.abs() <= limit && set.project(p) == p && (x - p) * (limit * (x - p).signum() - p) == 0.0);
        prop_assert!(p * v <= set.support(v) && set.support(v) == (limit * v).abs());
        let n = HalfLine.project(x);
        prop_assert!(n >= 0.0 && HalfLine.project(n) == n && (x - n) * n == 0.0 && x - n <= 0.0);
        prop_assert_eq!(HalfLine.support(v), if v <= 0.0 { 0.0 } else { f64::INFINITY });
    }
}

/// Numbers of about 106 bits: an unevaluated sum of two doubles (Dekker, Knuth).
#[derive(Clone, Copy)]
struct Double2(f64, f64);

impl Double2 {
    fn from(x: f64) -> Self {
        Self(x, 0.0)
    }

    fn normalised(high: f64, low: f64) -> Self {
        let sum = high + low;
        Self(sum, low - (sum - high))
    }

    fn plus(self, other: Self) -> Self {
        let sum = self.0 + other.0;
        let part = sum - self.0;
        let error = (self.0 - (sum - part)) + (other.0 - part);
        Self::normalised(sum, error + self.1 + other.1)
    }

    fn times(self, other: Self) -> Self {
        let product = self.0 * other.0;
        let error = self.0.mul_add(other.0, -product);
        Self::normalised(product, error + self.0 * other.1 + self.1 * other.0)
    }

    fn over(self, other: Self) -> Self {
        let first = self.0 / other.0;
        let rest = self.plus(other.times(Self::from(-first)));
        let second = rest.0 / other.0;
        let rest = rest.plus(other.times(Self::from(-second)));
        Self::normalised(first, second).plus(Self::from(rest.0 / other.0))
    }

    fn halved(self) -> Self {
        Self(0.5 * self.0, 0.5 * self.1)
    }
}

/// Nearest point of the ellipse by bisection in about 32 digits, for a point outside it.
fn nearest_by_bisection(a: Vector2<f64>, x: Vector2<f64>) -> Vector2<f64> {
    let d = Double2::from;
    let squares = [d(a.x).times(d(a.x)), d(a.y).times(d(a.y))];
    let point = |t: Double2, k: usize| d(x[k]).times(squares[k]).over(t.plus(squares[k]));
    let outside = |t: Double2| {
        let r = [point(t, 0).over(d(a.x)), point(t, 1).over(d(a.y))];
        r[0].times(r[0]).plus(r[1].times(r[1])).plus(d(-1.0)).0 > 0.0
    };
    let (mut low, mut high) = (d(0.0), d(a.max() * (x.norm() + a.max())));
    for _ in 0..260 {
        let middle = low.plus(high).halved();
        if outside(middle) { low = middle } else { high = middle }
    }
    Vector2::new(point(low, 0).0, point(low, 1).0)
}

/// The worst error, in units of the larger axis, over ratios up to 1e3 and points near, far and on the
/// evolute's side. The nearest point is a 1-Lipschitz function of x, but the root t is found from
/// f(t) = 0 with |f| of a few ulps: measured 4e-16 of the larger axis; the bound leaves a factor of 5.
#[test]
fn ellipse_projection_is_the_nearest_point_to_round_off() {
    let mut random = snake_test_support::planar::Random::new(1);
    let mut worst: f64 = 0.0;
    for _ in 0..20_000 {
        let (size, ratio) = (random.magnitude(1e-9, 1e9), random.magnitude(1e-3, 1e3));
        let a = Vector2::new(size, size * ratio);
        let direction = random.angle();
        let boundary = Vector2::new(a.x * direction.cos(), a.y * direction.sin());
        let x = match random.below(3) {
            0 => boundary * (1.0 + random.magnitude(1e-12, 1.0)),
            1 => Vector2::new(direction.cos(), direction.sin()) * (a.max() * random.magnitude(1.0, 1e9)),
            _ => Vector2::new(boundary.x * random.magnitude(1e-9, 1.0), boundary.y + a.max() * random.unit()),
        };
        if x.component_div(&a).norm() <= 1.0 + 1e-15 {
            continue;
        }
        let error = (Ellipse { axes: a }.project(x) - nearest_by_bisection(a, x)).norm() / a.max();
        worst = worst.max(error);
    }
    println!("worst error of the ellipse's nearest point: {worst:.1e} of the larger axis");
    assert!(worst < 2e-15, "{worst:e}");
}

#[test]
fn ellipse_with_a_zero_axis_is_a_segment_and_with_two_the_origin() {
    let x = Vector2::new(3.0, -4.0);
    assert_eq!(Ellipse { axes: Vector2::new(2.0, 0.0) }.project(x), Vector2::new(2.0, 0.0));
    assert_eq!(Ellipse { axes: Vector2::new(0.0, 2.0) }.project(x), Vector2::new(0.0, -2.0));
    assert_eq!(Ellipse { axes: Vector2::zeros() }.project(x), Vector2::zeros());
    // A thin ellipse tends to the segment: the limit is continuous, within the thin axis.
    let thin = Ellipse { axes: Vector2::new(2.0, 2e-9) }.project(x);
    assert!((thin - Vector2::new(2.0, 0.0)).norm() < 1e-5, "the end of a thin ellipse is at 2 - O(b^(2/3)) at worst");
}
