//! Inelastic impacts and impenetrability at large steps; impacts against closed forms are in scheme_laws.rs.

use snake_core::control::ControllerConfig;
use snake_core::gait::Wave;
use snake_core::planar::{Pose, Twist};
use snake_core::scene::{Peg, SceneConfig, TABLE_7_3, TABLE_7_5};
use snake_test_support::planar::{Hold, LIMP, Random, build, ground, implicit, in_front_of, links, moving_chain};

/// Signorini on gap level: the end gap is linearised where the stage is predicted to end, and the
/// distance of convex bodies is convex, so translation cannot penetrate at any step; rotation of a link
/// within a step leaves an error of second order. "Not visible" is half a millimetre. Implicit Euler,
/// whose stage is 3.4 times as long, is left out above 10 ms: it reaches 0.5 mm at 25 and 1.4 mm at 50 ms.
#[test]
fn no_visible_penetration_on_the_courses_at_steps_up_to_50_ms() {
    for (course, pegs, start) in [
        ("7.5", TABLE_7_5.as_slice(), snake_core::scene::START_7_5),
        ("7.3", TABLE_7_3.as_slice(), snake_core::scene::START_7_3),
    ] {
        let scene = SceneConfig { obstacles: pegs.iter().map(|&peg| peg.into()).collect(), ..SceneConfig::default() };
        for (order, step) in [(1, 0.01), (2, 0.01), (2, 0.025), (2, 0.05)] {
            let mut simulation = snake_test_support::planar::aiko(&scene, start, &implicit(step, order));
            let mut deepest = f64::INFINITY;
            for _ in 0..(5.0 / step) as u32 {
                let report = simulation.advance(step, &Wave::default());
                assert!(!report.diverged);
                deepest = deepest.min(simulation.min_gap());
            }
            println!("Table {course}, order {order}, h {step}: smallest gap {deepest:.1e} m");
            assert!(deepest > -5e-4, "{deepest:e}");
        }
    }
}

/// An inelastic impact does not bounce, wherever in a step it falls and although the gap closes in one
/// stage and the rest of the approach velocity goes in the next: a straight chain sliding head-on at v
/// comes to rest. An extrapolated impact would throw it back at up to sqrt 2 v.
#[test]
fn an_impact_does_not_bounce_wherever_in_the_step_it_falls() {
    let (v, step) = (0.5, 1e-2);
    for order in [1, 2] {
        let mut fastest: f64 = 0.0;
        for k in 0..40 {
            let distance = v * step * (1.0 + f64::from(k) / 20.0);
            let peg = Peg { radius: 0.1, x: -(0.0393 + 0.0525 + 0.1 + distance), y: 0.0 };
            let mut simulation = in_front_of(peg, &links(3), &implicit(step, order), |robot, pose| {
                moving_chain(robot, pose, Twist::new(-v, 0.0, 0.0), &[0.0; 2])
            });
            for _ in 0..8 {
                simulation.advance(step, &Hold(0.0));
                fastest = simulation.state().twist.iter().map(|u| u.x).fold(fastest, f64::max);
            }
        }
        println!("order {order}: fastest rebound {fastest:.1e} m/s after {v} m/s");
        assert!(fastest < 1e-8, "order {order}: {fastest:e}");
    }
}

/// A limp robot thrown at a dense field of pegs at 1 m/s: half a link width in a step of 50 ms, where
/// only the second-order stages, which look 15 ms ahead, are expected to hold; implicit Euler to 10 ms.
#[test]
fn a_thrown_robot_does_not_enter_the_pegs() {
    let mut random = Random::new(32);
    for step in [0.01, 0.025, 0.05] {
        for order in [1, 2] {
            if order == 1 && step > 0.02 {
                continue;
            }
            let mut deepest = f64::INFINITY;
            for _ in 0..30 {
                let angle = random.angle();
                let pegs: Vec<Peg> = (0..12)
                    .map(|k| Peg {
                        radius: random.between(0.02, 0.12),
                        x: 0.35 * f64::from(k % 4) - 0.5,
                        y: 0.4 + 0.35 * f64::from(k / 4),
                    })
                    .collect();
                let scene = SceneConfig { obstacles: pegs.into_iter().map(Into::into).collect(), ..ground([0.1, 0.1]) };
                let mut simulation = build(&links(5), &scene, &LIMP, &implicit(step, order));
                simulation.place_chain(0.25, 0.0, 0.0, &[0.0; 4]);
                let shift = Pose::new(-0.4 + random.between(-0.2, 0.2), 0.0, 0.0);
                let pose: Vec<Pose> = simulation.state().pose.iter().map(|q| q + shift).collect();
                let state = moving_chain(simulation.robot(), &pose, Twist::new(0.3 * angle.cos(), 1.0, 0.0), &[0.0; 4]);
                simulation.place(&state);
                if simulation.min_gap() < 0.0 {
                    continue;
                }
                let mut energy = simulation.kinetic_energy();
                for _ in 0..(1.0 / step) as u32 {
                    assert!(!simulation.advance(step, &Hold(0.0)).diverged);
                    deepest = deepest.min(simulation.min_gap());
                    let now = simulation.kinetic_energy();
                    // A contact plane tilted by the prediction may ask for a small separation speed.
                    assert!(now <= energy + 0.02, "{now} after {energy}");
                    energy = now;
                }
            }
            println!("thrown, order {order}, h {step}: smallest gap {deepest:.1e} m");
            assert!(deepest > -5e-3, "{deepest:e}");
        }
    }
}

/// The hardest start: at rest beside a peg with a strong drive that closes a joint within one step.
/// The contact must be seen although nothing moves yet when the step begins.
#[test]
fn a_drive_that_snaps_from_rest_does_not_push_a_link_through_a_peg() {
    for step in [0.01, 0.05] {
        for order in [1, 2] {
            let pd = ControllerConfig { torque_limit: Some(10.0), ..ControllerConfig::default() };
            // 1 cm beside the far end of link 3, on the side towards which it swings.
            let peg = Peg { radius: 0.03, x: 0.27, y: 0.0525 + 0.03 + 0.01 };
            let scene = SceneConfig { obstacles: vec![peg.into()], ..ground([0.2, 0.2]) };
            let mut simulation = build(&links(3), &scene, &pd, &implicit(step, order));
            simulation.place_chain(0.0, 0.0, 0.0, &[0.0; 2]);
            let mut deepest = f64::INFINITY;
            for _ in 0..20 {
                simulation.advance(step, &Hold(0.5));
                deepest = deepest.min(simulation.min_gap());
            }
            println!("snap, order {order}, h {step}: smallest gap {deepest:.1e} m");
            assert!(deepest > -2e-3, "order {order}, h {step}: {deepest:e}");
        }
    }
}

/// However fast a robot is, and however thin the pegs: no link is on the other side after a step, or ever.
#[test]
fn a_fast_robot_does_not_pass_through_pegs() {
    for speed in [3.0, 10.0, 100.0] {
        for step in [0.01, 0.05] {
            for order in [1, 2] {
                // A fence across the way of every link.
                let fence: Vec<Peg> =
                    (0..20).map(|k| Peg { radius: 0.02, x: 0.1 * f64::from(k) - 0.7, y: 0.53 }).collect();
                let scene =
                    SceneConfig { obstacles: fence.into_iter().map(Into::into).collect(), ..ground([0.2, 0.2]) };
                let mut simulation = build(&links(5), &scene, &LIMP, &implicit(step, order));
                simulation.place_chain(0.0, 0.0, 0.0, &[0.0; 4]);
                let pose = simulation.state().pose.clone();
                let state = moving_chain(simulation.robot(), &pose, Twist::new(0.0, speed, 0.0), &[0.0; 4]);
                simulation.place(&state);
                let energy = simulation.kinetic_energy();
                let mut deepest = f64::INFINITY;
                for _ in 0..(0.5 / step) as u32 {
                    assert!(!simulation.advance(step, &Hold(0.0)).diverged);
                    deepest = deepest.min(simulation.min_gap());
                    assert!(simulation.state().pose.iter().all(|q| q.y < 0.53), "{speed} m/s, h {step}, order {order}");
                }
                println!("{speed} m/s, h {step}, order {order}: smallest gap {deepest:.1e} m");
                assert!(deepest > -5e-3, "{speed} m/s, h {step}, order {order}: {deepest:e}");
                assert!(simulation.kinetic_energy() < 0.05 * energy, "the fence has all but stopped the robot");
            }
        }
    }
}
