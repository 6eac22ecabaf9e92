//! Momentum, energy, symmetry and the joints over long runs.

use nalgebra::Vector2;
use snake_core::control::ControllerConfig;
use snake_core::gait::Wave;
use snake_core::planar::{Planar, PlanarState, Pose, Twist};
use snake_core::robot::{PerLink, RobotConfig};
use snake_core::scene::{Peg, SceneConfig};
use snake_core::simulation::{Scheme, SchemeConfig, Simulation};
use snake_test_support::planar::{Hold, LIMP, build, ground, links, momentum, moving_chain};

use crate::{fit_for_the_gait, schemes};

/// A robot with unequal links, bent, spinning and translating.
fn tumbling<C: SchemeConfig<Planar>>(
    links: usize,
    friction: [f64; 2],
    integrator: &C,
    pd: &ControllerConfig,
    lively: f64,
) -> Simulation<Planar, C::Scheme> {
    let each = |base: f64, step: f64| PerLink::Each((0..links).map(|i| base * (1.0 + step * i as f64)).collect());
    let robot = RobotConfig {
        links,
        mass: each(0.5, 0.1),
        length: each(0.1, 0.05),
        inertia: each(1e-3, 0.08),
        ..RobotConfig::default()
    };
    let mut simulation = build(&robot, &ground(friction), pd, integrator);
    let joints: Vec<f64> = (0..links - 1).map(|j| 0.4 * (1.7 * j as f64).sin()).collect();
    simulation.place_chain(0.2, -0.1, 0.3, &joints);
    let omega: Vec<f64> = (1..links).map(|i| lively * (1.0 + (2.3 * i as f64).cos())).collect();
    let state = moving_chain(simulation.robot(), &simulation.state().pose, Twist::new(0.3, -0.2, lively), &omega);
    simulation.place(&state);
    simulation
}

/// Without ground and pegs the joints and motors are internal forces: linear momentum changes by
/// round-off only; angular momentum by the order of the scheme, since a joint's two impulses meet at
/// one point only up to the movement within a step. The observed order is printed and asserted.
#[test]
fn momentum_is_conserved_without_ground_and_pegs_with_motors_on() {
    let pd = ControllerConfig { kp: 20.0, kd: 0.2, ..ControllerConfig::default() };
    for which in 0..schemes(1e-3).len() {
        let mut errors = [0.0; 2];
        for (k, step) in [2e-3, 1e-3].into_iter().enumerate() {
            let (name, integrator) = schemes(step)[which];
            let mut simulation = tumbling(6, [0.0, 0.0], &integrator, &pd, 1.0);
            let (linear, angular) = momentum(simulation.robot(), simulation.state());
            let report = simulation.advance(0.5, &Wave::default());
            assert_eq!(report.unconverged, 0);
            let (linear_end, angular_end) = momentum(simulation.robot(), simulation.state());
            let drift = (linear_end - linear).norm();
            // About 250 to 500 steps, each adding an ulp or two of the momenta of six links.
            assert!(drift < 1e-12, "{name}: linear momentum off by {drift:e} N s");
            errors[k] = (angular_end - angular).abs();
            println!("{name} h {step}: linear {drift:.1e} N s, angular {:.2e} of {angular:.3} N m s", errors[k]);
        }
        let order = (errors[0] / errors[1]).log2();
        let name = schemes(1e-3)[which].0;
        let expected = if name == "implicit 2" { 2.0 } else { 1.0 };
        println!("{name} order of angular momentum: {order:.2}");
        assert!(order > expected - 0.4, "{order}");
    }
}

/// The midpoint scheme and implicit Euler give |u_E|^2 = |u_A|^2 - |u_E - u_A|^2 + 2 (work of laws) in
/// the norm of M, so without actuation energy cannot grow, step by step, whatever the step. The
/// two-stage scheme is not algebraically stable (M_11 < 0): it may create (1 - gamma)(3 gamma - 1) h^2
/// |f_1|^2 / 2 in a step and loses as much in the next; asserted over the run and printed.
#[test]
fn energy_never_grows_without_actuation() {
    for friction in [[0.0, 0.0], [0.05, 0.2]] {
        for (name, integrator) in schemes(5e-3) {
            let mut simulation = tumbling(6, friction, &integrator, &LIMP, 4.0);
            let start = simulation.kinetic_energy();
            let (mut before, mut largest_rise) = (start, 0.0_f64);
            for _ in 0..200 {
                simulation.advance(5e-3, &Hold(0.0));
                let now = simulation.kinetic_energy();
                largest_rise = largest_rise.max(now - before);
                before = now;
            }
            println!(
                "{name} mu {friction:?}: {start:.4} -> {before:.4} J, largest rise in a step {largest_rise:.1e} J"
            );
            if name == "implicit 2" {
                assert!(before <= start * 1.0001 && largest_rise < 3e-5 * start, "{largest_rise:e}");
            } else {
                // The solver's slip of 1e-10 m/s times impulses of 0.01 N s.
                assert!(largest_rise < 1e-11, "{name}: {largest_rise:e}");
            }
        }
    }
}

fn move_scene<S: Scheme<Planar>>(simulation: &mut Simulation<Planar, S>, turn: f64, shift: Vector2<f64>, mirror: bool) {
    let (sin, cos) = turn.sin_cos();
    let flip = if mirror { -1.0 } else { 1.0 };
    let image = |x: f64, y: f64| Vector2::new(cos * x - sin * flip * y, sin * x + cos * flip * y);
    let pegs: Vec<Peg> = simulation
        .pegs()
        .iter()
        .map(|peg| {
            let centre = image(peg.x, peg.y) + shift;
            Peg { radius: peg.radius, x: centre.x, y: centre.y }
        })
        .collect();
    let state = simulation.state();
    let pose = state.pose.iter().map(|q| {
        let p = image(q.x, q.y) + shift;
        Pose::new(p.x, p.y, flip * q.z + turn)
    });
    let twist = state.twist.iter().map(|u| {
        let v = image(u.x, u.y);
        Twist::new(v.x, v.y, flip * u.z)
    });
    let moved = PlanarState { time: state.time, pose: pose.collect(), twist: twist.collect(), movables: Vec::new() };
    simulation.set_scene_pegs(&pegs);
    simulation.place(&moved);
}

/// Largest distance between a run and the image of another, over one second on the course.
fn symmetry_defect(
    integrator: &impl SchemeConfig<Planar>,
    turn: f64,
    shift: [f64; 2],
    mirror: bool,
    scene: &SceneConfig,
    duration: f64,
) -> f64 {
    let wave = Wave::default();
    let mirrored = Wave { amplitude: -wave.amplitude, gamma: -wave.gamma, ..wave };
    let mut original = snake_test_support::planar::aiko(scene, snake_core::scene::START_7_5, integrator);
    let mut moved = original.clone();
    let shift = Vector2::from(shift);
    move_scene(&mut moved, turn, shift, mirror);
    original.advance(duration, &wave);
    moved.advance(duration, if mirror { &mirrored } else { &wave });
    move_scene(&mut original, turn, shift, mirror);
    let pairs = original.state().pose.iter().zip(&moved.state().pose);
    pairs.map(|(a, b)| (a.xy() - b.xy()).norm()).fold(0.0, f64::max)
}

/// Nothing in the model knows where it is or which hand is right. The runs differ by round-off and by
/// where the solvers stop (1e-10 m/s and 1e-10 N s), carried along by a dissipative motion; closing
/// contacts a step earlier or later in one of the runs would cost orders more.
#[test]
fn motion_is_the_same_wherever_the_scene_lies_and_in_the_mirror() {
    let course = snake_test_support::planar::table_7_5();
    let free = ground([0.2, 0.5]);
    for (scene_name, scene) in [("course", &course), ("free", &free)] {
        for (name, integrator) in fit_for_the_gait(5e-3, 1e-9) {
            let duration = if name == "thesis" && scene_name == "course" { 0.2 } else { 0.5 };
            let moved = symmetry_defect(&integrator, 0.8, [3.0, -2.0], false, scene, duration);
            let mirrored = symmetry_defect(&integrator, 0.0, [0.0, 0.0], true, scene, duration);
            println!("{scene_name} {name}: rigid motion {moved:.1e} m, mirror {mirrored:.1e} m");
            assert!(moved < 1e-6 && mirrored < 1e-6, "{scene_name} {name}");
        }
    }
}

/// Closing the joints rebuilds the chain from link 1 in every step, so the gap is the round-off of one
/// step, at most a few ulps of the coordinates, after a million steps as after one.
#[test]
fn joints_stay_closed_over_a_million_steps() {
    let (name, integrator, duration) = crate::for_a_long_run();
    let pd = ControllerConfig { kp: 20.0, kd: 0.2, ..ControllerConfig::default() };
    let mut simulation = build(&links(3), &ground([0.2, 0.5]), &pd, &integrator);
    simulation.place_chain(0.0, 0.0, 0.0, &[0.2, -0.3]);
    simulation.advance(duration, &Wave::default());
    let size = simulation.state().pose.iter().map(|q| q.xy().norm()).fold(1.0, f64::max);
    println!("{name}: joint gap {:.1e} m after {duration} s, {size:.1} m away", simulation.joint_gap());
    assert!(simulation.joint_gap() < 4.0 * f64::EPSILON * size);
}
