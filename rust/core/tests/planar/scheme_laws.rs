//! Laws that every scheme keeps: of the joint drives, of inelastic impacts (T 3.58) against closed forms, of friction that
//! falls in sliding (T 7.5.4). Nothing allocates in a step.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{DVector, Vector3};
use snake_core::control::ControllerConfig;
use snake_core::gait::Wave;
use snake_core::laws::Stribeck;
use snake_core::planar::{Heading, Twist};
use snake_core::scene::{Peg, START_7_5, SceneConfig};
use snake_test_support::allocation::REQUESTS;
use snake_test_support::friction_scenes::{G, THRESHOLD, bent_pair, slides_along_the_normal_of_the_ellipse, sliding};
use snake_test_support::planar::{
    Hold, LIMP, Random, START_FREE, aiko, build, ground, in_front_of, links, moving_chain, table_7_5,
};
use snake_test_support::planar_stage::{after_impact, stacked};

use crate::{fit_for_the_gait, schemes};

/// A step in which a robot hardly moves \[s\].
const FAST: f64 = 1e-6;

/// A joint below its reference is driven up, and tau_C carries the thesis's sign (T 3.50)-(T 3.51): a
/// positive tau_C acts on link i, so driving phi = theta_2 - theta_1 up takes a negative one.
#[test]
fn the_drive_turns_the_joint_towards_its_reference() {
    let pd = ControllerConfig { kp: 5.0, kd: 0.05, ..ControllerConfig::default() };
    for (name, integrator) in schemes(1e-3) {
        for target in [0.3, -0.3] {
            let mut simulation = build(&links(2), &ground([0.0, 0.0]), &pd, &integrator);
            simulation.advance(1e-3, &Hold(target));
            let rate = simulation.state().joint_rate(0);
            assert!(rate * target > 0.0 && simulation.joint_torque()[0] * target < 0.0, "{name}");
            // From rest the first impulse is k_P phi_d h. By symmetry a straight free pair bends
            // without moving its CGs and without a joint force: the inertia of phi is Theta / 2.
            // Implicit evaluation divides by 1 + h (k_D + h k_P) / (Theta / 2) = 1.083 (order 1).
            let free = 5.0 * target * 1e-3 / (0.5 * 1.32e-3);
            // Both orders solve the linear test equation x' = -a x with their stability functions, so the
            // second order differs from 1 by a h / 2 = 4 %.
            let expected = [("thesis", 1.0), ("implicit 1", 1.0 / 1.0833), ("implicit 2", 0.96)];
            let expected = expected.iter().find(|entry| entry.0 == name).expect("a scheme").1;
            assert!((rate / free - expected).abs() < 3e-3, "{name}: {rate} against {free}");
            simulation.advance(3.0, &Hold(target));
            assert!((simulation.state().joint_angle(0) - target).abs() < 1e-3, "{name}: damped out");
        }
    }
}

/// Before `active_from` nothing moves; after it the drive acts. Both schemes.
#[test]
fn actuators_are_off_before_they_are_switched_on() {
    let pd = ControllerConfig { active_from: 0.1, ..ControllerConfig::default() };
    for (name, integrator) in schemes(2.5e-4) {
        let mut simulation = build(&links(4), &ground([0.0, 0.0]), &pd, &integrator);
        let report = simulation.advance(0.1, &Wave::default());
        assert_eq!(report.actuator_work, 0.0, "{name}");
        assert_eq!(simulation.kinetic_energy(), 0.0, "{name}");
        assert!(simulation.joint_torque().iter().all(|&torque| torque == 0.0));
        simulation.advance(0.001, &Wave::default());
        assert!(simulation.kinetic_energy() > 0.0, "{name}");
    }
}

/// A straight chain that runs head-on into a peg stops dead: every link lies on the line of impact.
#[test]
fn a_straight_chain_loses_all_momentum_in_a_central_impact() {
    let v = 0.7;
    for n in [2, 3, 11] {
        for (name, integrator) in schemes(FAST) {
            let robot = links(n);
            let reach = 0.0393 + 0.0525;
            let peg = Peg { radius: 0.1, x: -(reach + 0.1), y: 0.0 };
            let mut simulation = in_front_of(peg, &robot, &integrator, |robot, pose| {
                moving_chain(robot, pose, Twist::new(-v, 0.0, 0.0), &vec![0.0; n - 1])
            });
            let before = simulation.kinetic_energy();
            simulation.advance(4.0 * FAST, &Hold(0.0));
            let fastest = simulation.state().twist.iter().map(|u| u.norm()).fold(0.0, f64::max);
            println!("{name} {n} links: {before:.3} J, fastest after impact {fastest:.1e} m/s");
            // The iterations stop at 1e-13 N s (thesis, r_H = 0.01: 1e-11 m/s a link) or 1e-10 m/s.
            assert!(fastest < 1e-8, "{name}: {fastest:e}");
            let (impulse, momentum) = (simulation.contact_impulse()[0].x, v * 7.5 / 11.0 * n as f64);
            assert!((impulse - momentum).abs() < 1e-8, "{name}: impulse {impulse}, momentum lost {momentum}");
        }
    }
}

/// Two straight links moving sideways at v, link 1 struck at its CG. With F the lateral joint impulse,
/// link 1 stops (m v = P + F), both links take the moment F L/2, and the joint holds:
/// F = -v / (1/m + L^2 / (2 Theta)), omega = F L / (2 Theta) for both, link 2 keeps v2 = -v - F / m.
#[test]
fn a_free_pair_struck_at_one_cg_moves_as_the_closed_form_says() {
    let (v, m, length, theta) = (0.4, 7.5 / 11.0, 0.122, 1.32e-3);
    let force = -v / (1.0 / m + length * length / (2.0 * theta));
    let omega = force * length / (2.0 * theta);
    for (name, integrator) in schemes(FAST) {
        let peg = Peg { radius: 0.1, x: 0.0, y: -(0.0525 + 0.1) };
        let mut simulation = in_front_of(peg, &links(2), &integrator, |robot, pose| {
            moving_chain(robot, pose, Twist::new(0.0, -v, 0.0), &[0.0])
        });
        simulation.advance(4.0 * FAST, &Hold(0.0));
        let u = simulation.state().twist.clone();
        println!("{name}: omega {:.6} {:.6}, closed form {omega:.6}", u[0].z, u[1].z);
        // Directions turn by omega h ~ 1e-5 during four steps.
        let tolerance = 1e-4 * v / length;
        assert!(u[0].y.abs() < 1e-4 * v, "{name}: the struck CG stays at the peg");
        assert!((u[1].y - (-v - force / m)).abs() < 1e-4 * v, "{name}: {}", u[1].y);
        assert!((u[0].z - omega).abs() < tolerance && (u[1].z - omega).abs() < tolerance, "{name}");
        assert!((simulation.contact_impulse()[0].y - (m * v - force)).abs() < 1e-4 * m * v, "{name}");
    }
}

/// u+ = u- + M^-1 (W_J P_J + w_H P_H) with W_J^T u+ = 0 and w_H^T u+ = 0: the M-orthogonal projection,
/// by full matrices, for bent chains of any length struck anywhere; links of different weight.
#[test]
fn an_off_centre_impact_of_a_bent_chain_is_the_projection_on_the_constraints() {
    let mut random = Random::new(31);
    for n in [2, 3, 5] {
        for case in 0..4 {
            let joints: Vec<f64> = (1..n).map(|_| random.between(-0.7, 0.7)).collect();
            let omega: Vec<f64> = (1..n).map(|_| random.between(-1.0, 1.0)).collect();
            let head = Twist::new(random.between(-0.3, 0.3), random.between(-0.3, 0.3), random.between(-1.0, 1.0));
            let (struck, at) = (random.below(n), random.between(-0.035, 0.035));
            for (name, integrator) in schemes(FAST) {
                let mut simulation = build(&links(n), &ground([0.0, 0.0]), &LIMP, &integrator);
                simulation.place_chain(0.0, 0.0, 0.4, &joints);
                let state = moving_chain(simulation.robot(), &simulation.state().pose, head, &omega);
                let (q, u) = (state.pose[struck], state.twist[struck]);
                // A peg on the side towards which the struck point moves.
                let heading = Heading::of(q.z);
                let side = (u.xy().dot(&heading.lateral()) + at * u.z).signum();
                let centre = q.xy() + heading.axial() * at + heading.lateral() * (side * (0.0525 + 0.05));
                let normal = -heading.lateral() * side;
                simulation.set_scene_pegs(&[Peg { radius: 0.05, x: centre.x, y: centre.y }]);
                simulation.place(&state);
                let mut w = DVector::zeros(3 * n);
                let moment = at * normal.dot(&heading.lateral());
                w.fixed_rows_mut::<3>(3 * struck).copy_from(&Vector3::new(normal.x, normal.y, moment));
                let exact = after_impact(simulation.robot(), &state, &w);
                simulation.advance(4.0 * FAST, &Hold(0.0));
                let defect = (stacked(&simulation.state().twist) - stacked(&exact)).amax();
                // omega^2 h over four steps, and an impulse resolved to 1e-10.
                assert!(defect < 1e-4, "{name}, {n} links, case {case}: {defect:e}");
            }
        }
    }
}

/// Two fifths of the friction are lost, half of that at 5 cm/s.
pub const EFFECT: Stribeck = Stribeck { drop: 0.4, speed: 0.05 };

pub fn falling(friction: [f64; 2], stribeck: Stribeck) -> SceneConfig {
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
    for axis in 0..2 {
        for (name, integrator) in schemes(h) {
            let tolerance = match name {
                "implicit 1" => 1e-2,
                "implicit 2" => 1e-4,
                _ => 1e-3,
            };
            let mut velocity = [0.0; 2];
            velocity[axis] = v;
            let mut friction = [0.7, 0.7];
            friction[axis] = mu;
            let mut simulation = sliding(&links(3), &falling(friction, EFFECT), velocity, &integrator);
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

/// The ellipse shrinks as a whole, so an orthotropic slide keeps its path: v_y^(mu_x^2) / v_x^(mu_y^2) is constant as
/// under Coulomb friction (see friction_laws.rs), whatever the drop.
#[test]
fn the_drop_leaves_the_direction_of_sliding_as_it_is() {
    let friction = [0.2, 0.3];
    for (name, integrator) in schemes(1e-3) {
        let simulation = sliding(&links(2), &falling(friction, EFFECT), [0.3, 0.3], &integrator);
        slides_along_the_normal_of_the_ellipse(name, simulation, friction);
    }
}

/// What rests is held by the whole friction, however large the drop.
#[test]
fn a_joint_breaks_away_at_the_static_coefficient() {
    let effect = Stribeck { drop: 0.9, speed: 1e-3 };
    for step in [1e-3, 1e-2] {
        for (name, integrator) in schemes(step) {
            let mut held = bent_pair(0.999 * THRESHOLD, &falling([0.2, 0.2], effect), &integrator);
            let start = held.state().pose.clone();
            held.advance(200.0 * step, &Hold(3.0));
            let moved = held.state().pose.iter().zip(&start).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
            assert!(moved < 200.0 * step * 1e-8, "{name}, step {step}: {moved:e}");
            let mut loose = bent_pair(1.01 * THRESHOLD, &falling([0.2, 0.2], effect), &integrator);
            let mut coulomb = bent_pair(1.01 * THRESHOLD, &ground([0.2, 0.2]), &integrator);
            loose.advance(0.1, &Hold(3.0));
            coulomb.advance(0.1, &Hold(3.0));
            let (loose, coulomb) = (loose.state().joint_angle(0), coulomb.state().joint_angle(0));
            assert!(loose - FRAC_PI_2 > 2.0 * (coulomb - FRAC_PI_2), "{name}: it runs away, {loose} {coulomb}");
        }
    }
}

/// One warm-up sizes what depends on the pegs; after it, neither stepping with its events, nor placing
/// the robot again, nor changing to a field of no more pegs asks for memory.
#[test]
fn a_step_does_not_allocate() {
    let course = table_7_5();
    let free = ground([0.2, 0.5]);
    let wave = Wave::default();
    for (name, integrator) in fit_for_the_gait(1e-2, 1e-6) {
        for (place, scene, start) in [("course", &course, START_7_5), ("free", &free, START_FREE)] {
            let mut simulation = aiko(scene, start, &integrator);
            let state = simulation.state().clone();
            let pegs = simulation.pegs().to_vec();
            simulation.advance(0.05, &wave);
            let before = REQUESTS.get();
            let report = simulation.advance(1.0, &wave);
            simulation.place(&state);
            simulation.set_scene_pegs(&pegs);
            simulation.advance(0.5, &wave);
            let requests = REQUESTS.get() - before;
            println!("{name} {place}: {requests} requests in {} steps and {} events", report.steps, report.events);
            assert_eq!(requests, 0, "{name} {place}");
        }
    }
}
