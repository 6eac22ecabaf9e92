//! Friction that falls in sliding (T 7.5.4), seen from outside: order of accuracy, work. What holds for every scheme is in scheme_laws.rs.

use snake_core::gait::Wave;
use snake_core::laws::Stribeck;
use snake_core::scene::{START_7_5, SceneConfig};
use snake_test_support::friction_scenes::{G, sliding};
use snake_test_support::planar::{Hold, implicit, links};

use crate::scheme_laws::{EFFECT, falling};

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
            let mut simulation = sliding(&links(2), &falling([mu, mu], EFFECT), [v, 0.0], &implicit(h, order));
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
        let mut limp = sliding(&links(11), &falling([0.2, 0.5], effect), [0.5, -0.3], &integrator);
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

#[test]
fn an_effect_that_is_none_is_named() {
    for (field, stribeck) in [
        ("stribeck.drop", Stribeck { drop: 1.1, ..EFFECT }),
        ("stribeck.drop", Stribeck { drop: f64::NAN, ..EFFECT }),
        ("stribeck.speed", Stribeck { speed: 0.0, ..EFFECT }),
    ] {
        let scene = falling([0.2, 0.2], stribeck);
        assert_eq!(snake_core::scene::Scene::new(&scene).unwrap_err().field, field);
    }
}
