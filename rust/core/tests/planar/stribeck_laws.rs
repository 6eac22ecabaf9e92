//! Friction that falls in sliding (T 7.5.4), seen from outside: stopping distance, breaking away, order of accuracy.

use std::f64::consts::FRAC_PI_2;

use snake_core::gait::Wave;
use snake_core::laws::Stribeck;
use snake_core::scene::{START_7_5, SceneConfig};
use snake_core::stepping::IntegratorConfig;
use snake_test_support::friction_scenes::{G, THRESHOLD, bent_pair, slides_along_the_normal_of_the_ellipse, sliding};
use snake_test_support::planar::{Hold, implicit, links, thesis};

/// Two fifths of the friction are lost, half of that at 5 cm/s.
const EFFECT: Stribeck = Stribeck { drop: 0.4, speed: 0.05 };

fn ground(friction: [f64; 2], stribeck: Stribeck) -> SceneConfig {
    SceneConfig { friction, stribeck, ..SceneConfig::default() }
}

/// v dv / (g mu(v)) integrates in closed form: with w = (v / v_s)^2, mu_d = mu (1 - drop) and D = mu drop,
/// s = v_s^2 / (2 g mu_d) (w - D / mu_d ln((mu_d (1 + w) + D) / mu)).
fn stopping_distance(v: f64, mu: f64, Stribeck { drop, speed }: Stribeck) -> f64 {
    let (w, least, lost) = ((v / speed).powi(2), mu * (1.0 - drop), mu * drop);
    speed * speed / (2.0 * G * least) * (w - lost / least * ((least * (1.0 + w) + lost) / mu).ln())
}

#[test]
fn the_stopping_distance_lies_between_those_of_both_coefficients() {
    let [fast, slow] = [0.8, 0.02].map(|v| stopping_distance(v, 0.2, EFFECT) / (v * v / (2.0 * 0.2 * G)));
    assert!((fast - 1.0 / (1.0 - EFFECT.drop)).abs() < 0.05 && (slow - 1.0).abs() < 0.05, "{fast} {slow}");
}

/// A sliding body stops where the integral says, along and across its links. Bounds follow from a slip that is known
/// before the stage; the two-stage scheme keeps its order until the body comes to rest, implicit Euler and the printed
/// scheme take the speed of a step earlier.
#[test]
fn a_sliding_robot_stops_where_the_integral_of_the_falling_friction_says() {
    let (v, mu, h) = (0.4, 0.2, 2e-3);
    let exact = stopping_distance(v, mu, EFFECT);
    let schemes = [
        ("thesis", thesis(h, 1e-13), 1e-3),
        ("implicit 1", implicit(h, 1), 1e-2),
        ("implicit 2", implicit(h, 2), 1e-4),
    ];
    for axis in 0..2 {
        for (name, integrator, tolerance) in schemes {
            let mut velocity = [0.0; 2];
            velocity[axis] = v;
            let mut friction = [0.7, 0.7];
            friction[axis] = mu;
            let mut simulation = sliding(&links(3), &ground(friction, EFFECT), velocity, &integrator);
            let start = simulation.state().pose[1][axis];
            simulation.advance(0.6, &Hold(0.0));
            let distance = simulation.state().pose[1][axis] - start;
            println!("{name}: slid {distance:.6} m, expected {exact:.6} m");
            assert!((distance / exact - 1.0).abs() < tolerance, "{name}: {distance} for {exact}");
            let speed = simulation.state().twist.iter().map(|u| u.norm()).fold(0.0, f64::max);
            assert!(speed < 1e-9, "{name} still moves at {speed:e} m/s");
        }
    }
}

/// Where links slide on the two-stage scheme keeps order two; implicit Euler has one.
#[test]
fn lagged_bounds_cost_no_order_while_sliding() {
    let (v, mu) = (0.4, 0.2);
    // v' = -g mu(v) by Runge and Kutta's method in steps so small that round-off prevails.
    let deceleration = |v: f64| -G * mu * EFFECT.share(v * v);
    let (mut speed, mut exact, dt) = (v, 0.0, 1e-5);
    for _ in 0..20_000 {
        let a = deceleration(speed);
        let b = deceleration(speed + 0.5 * dt * a);
        let c = deceleration(speed + 0.5 * dt * b);
        let d = deceleration(speed + dt * c);
        exact += dt * (speed + dt * (a + b + c) / 6.0);
        speed += dt * (a + 2.0 * b + 2.0 * c + d) / 6.0;
    }
    assert!(speed > 0.05);
    for (order, slowest, fastest) in [(1, 0.9, 1.1), (2, 1.8, 2.2)] {
        let errors = [0.02, 0.01, 0.005].map(|h| {
            let mut simulation = sliding(&links(2), &ground([mu, mu], EFFECT), [v, 0.0], &implicit(h, order));
            // Past the start, in which steps are shorter than configured.
            simulation.body_mut().clock.next = h;
            let start = simulation.state().pose[0].x;
            simulation.advance(0.2, &Hold(0.0));
            (simulation.state().pose[0].x - start - exact).abs()
        });
        println!("order {order}: {errors:?}");
        for pair in errors.windows(2) {
            let observed = (pair[0] / pair[1]).log2();
            assert!(slowest < observed && observed < fastest, "order {order}: {observed}");
        }
    }
}

/// The ellipse shrinks as a whole, so an orthotropic slide keeps its path: v_y^(mu_x^2) / v_x^(mu_y^2) is constant as
/// under Coulomb friction (see friction_laws.rs), whatever the drop.
#[test]
fn the_drop_leaves_the_direction_of_sliding_as_it_is() {
    let friction = [0.2, 0.3];
    for (name, integrator) in snake_test_support::planar::schemes(1e-3) {
        let simulation = sliding(&links(2), &ground(friction, EFFECT), [0.3, 0.3], &integrator);
        slides_along_the_normal_of_the_ellipse(name, simulation, friction);
    }
}

/// What rests is held by the whole friction, however large the drop.
#[test]
fn a_joint_breaks_away_at_the_static_coefficient() {
    let effect = Stribeck { drop: 0.9, speed: 1e-3 };
    for step in [1e-3, 1e-2] {
        for (name, integrator) in snake_test_support::planar::schemes(step) {
            let mut held = bent_pair(0.999 * THRESHOLD, &ground([0.2, 0.2], effect), &integrator);
            let start = held.state().pose.clone();
            held.advance(200.0 * step, &Hold(3.0));
            let moved = held.state().pose.iter().zip(&start).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
            assert!(moved < 200.0 * step * 1e-8, "{name}, step {step}: {moved:e}");
            let mut loose = bent_pair(1.01 * THRESHOLD, &ground([0.2, 0.2], effect), &integrator);
            let mut coulomb = bent_pair(1.01 * THRESHOLD, &ground([0.2, 0.2], Stribeck::default()), &integrator);
            loose.advance(0.1, &Hold(3.0));
            coulomb.advance(0.1, &Hold(3.0));
            let (loose, coulomb) = (loose.state().joint_angle(0), coulomb.state().joint_angle(0));
            assert!(loose - FRAC_PI_2 > 2.0 * (coulomb - FRAC_PI_2), "{name}: it runs away, {loose} {coulomb}");
        }
    }
}

/// Every stage dissipates, whichever bound it has: no step is too long for that, though one longer than
/// v_s / (0.65 drop mu g) does not see the fall of friction.
#[test]
fn falling_friction_never_does_positive_work_however_long_the_step() {
    let effect = Stribeck { drop: 0.9, speed: 5e-3 };
    for (step, order) in [(5e-2, 1), (5e-2, 2), (5e-3, 2)] {
        let integrator = implicit(step, order);
        let scene = SceneConfig { stribeck: effect, ..snake_test_support::planar::table_7_5() };
        let mut simulation = snake_test_support::planar::aiko(&scene, START_7_5, &integrator);
        for _ in 0..40 {
            let report = simulation.advance(0.05, &Wave::default());
            assert!(!report.diverged && report.unconverged == 0 && report.friction_work <= 1e-12, "{report:?}");
        }
        let mut limp = sliding(&links(11), &ground([0.2, 0.5], effect), [0.5, -0.3], &integrator);
        let mut before = limp.kinetic_energy();
        // The last 2 % of the friction stop it after 0.58 / (0.02 g) seconds.
        for _ in 0..80 {
            limp.advance(0.05, &Hold(0.0));
            // Two stages may lend a step energy that the next one takes, as under Coulomb friction (D12).
            let lent = if order == 1 { 1e-12 } else { 1e-2 };
            assert!(limp.kinetic_energy() <= before * (1.0 + lent) + 1e-20, "{integrator:?}");
            before = limp.kinetic_energy();
        }
        assert!(before < 1e-20, "at rest: {before:e}");
    }
}

/// Explicit in one scheme, lagged in the other: both tend to the same motion.
#[test]
fn the_printed_scheme_and_the_implicit_one_agree_on_falling_friction() {
    let position = |integrator: &IntegratorConfig| {
        let scene = ground([0.2, 0.5], Stribeck { drop: 0.3, speed: 0.05 });
        let mut robot = snake_test_support::planar::aiko(&scene, snake_test_support::planar::START_FREE, integrator);
        robot.advance(1.0, &Wave::default());
        robot.state().pose[5].xy()
    };
    let printed = position(&thesis(1e-4, 1e-9));
    let apart = [5e-3, 2.5e-3].map(|h| (position(&implicit(h, 2)) - printed).norm());
    println!("apart by {apart:?} m");
    assert!(apart[1] < 1e-4, "{apart:?}");
}

#[test]
fn an_effect_that_is_none_is_named() {
    for (field, stribeck) in [
        ("stribeck.drop", Stribeck { drop: 1.1, ..EFFECT }),
        ("stribeck.drop", Stribeck { drop: f64::NAN, ..EFFECT }),
        ("stribeck.speed", Stribeck { speed: 0.0, ..EFFECT }),
    ] {
        let scene = ground([0.2, 0.2], stribeck);
        assert_eq!(snake_core::scene::Scene::new(&scene).unwrap_err().field, field);
    }
}
