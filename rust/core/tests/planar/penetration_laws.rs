//! How deep links may be in pegs and in each other, whatever the action.

use nalgebra::Vector2;
use snake_core::control::ControllerConfig;
use snake_core::environment::rng::Rng;
use snake_core::environment::{ActionMode, EnvConfig, Environment, FieldKind, PlanarRobot, Task};
use snake_core::planar::Twist;
use snake_core::robot::{PerLink, RobotConfig};
use snake_core::scene::{Peg, SceneConfig};
use snake_test_support::planar::{Hold, LIMP, build, ground, implicit, moving_chain};

/// Deepest overlap at the ends of random control periods, and the periods that ended with a flagged robot.
fn crawl(config: &EnvConfig, seed: u64, periods: usize) -> (f64, usize) {
    let mut environment = Environment::<PlanarRobot>::new(config).expect("a valid configuration");
    let mut observation = vec![0.0; environment.observation_size()];
    environment.reset(Some(seed), &mut observation);
    let mut stream = Rng::new(seed, 1);
    let (mut deepest, mut flagged) = (0.0_f64, 0);
    for _ in 0..periods {
        let action: Vec<f64> = (0..environment.action_size()).map(|_| stream.around_zero(1.0).signum()).collect();
        let outcome = environment.step(&action, &mut observation);
        let simulation = environment.simulation();
        deepest = deepest.max(-simulation.min_gap()).max(-simulation.self_gap());
        flagged += usize::from(environment.summary().diverged);
        if outcome.terminated || outcome.truncated {
            environment.reset(None, &mut observation);
        }
    }
    (deepest, flagged)
}

#[test]
fn no_action_pushes_links_more_than_a_millimetre_into_anything() {
    for action_mode in
        [ActionMode::Gait, ActionMode::Joints, ActionMode::Residual, ActionMode::Velocities, ActionMode::Torques]
    {
        for (seed, task) in [Task::COURSE, Task::MAZE, Task::FIELD].into_iter().enumerate() {
            let config = EnvConfig { task, action_mode, difficulty: 1.0, ..EnvConfig::default() };
            let (deepest, flagged) = crawl(&config, seed as u64, 400);
            assert!(deepest < 1e-3, "{action_mode:?} {task:?}: {deepest} m");
            assert_eq!(flagged, 0, "{action_mode:?} {task:?}");
        }
    }
}

/// Three slender links of which the middle one turns about its CG and takes the others along: its end would be beyond a thin
/// peg one step later.
#[test]
fn a_slender_link_that_turns_does_not_pass_through_a_peg() {
    let robot = RobotConfig {
        links: 3,
        length: PerLink::Same(1.0),
        contact_half_length: PerLink::Same(0.45),
        radius: PerLink::Same(1e-3),
        inertia: PerLink::Same(0.06),
        ..RobotConfig::default()
    };
    for spin in [10.0, 15.0, 20.0] {
        for place in 0..20 {
            let peg = Peg { radius: 5e-4, x: 0.43, y: 0.03 + 0.004 * f64::from(place) };
            let scene = SceneConfig { obstacles: vec![peg.into()], ..ground([0.0; 2]) };
            let mut simulation = build(&robot, &scene, &LIMP, &implicit(0.01, 2));
            simulation.place_chain(-1.0, 0.0, 0.0, &[0.0; 2]);
            let pose = simulation.state().pose.clone();
            let state = moving_chain(simulation.robot(), &pose, Twist::new(0.0, -0.5 * spin, 0.0), &[spin, 0.0]);
            simulation.place(&state);
            let mut was_pushed = false;
            for _ in 0..25 {
                simulation.advance(0.01, &Hold(0.0));
                was_pushed |= simulation.contact_impulse().iter().any(|impulse| impulse.norm() > 0.0);
                let link = simulation.state().pose[1];
                let (axis, offset) = (Vector2::new(link.z.cos(), link.z.sin()), Vector2::new(peg.x, peg.y) - link.xy());
                let is_beside = offset.dot(&axis).abs() < 0.45;
                assert!(!is_beside || axis.perp(&offset) > 0.0, "{spin} rad/s, peg {place}: passed through");
            }
            assert!(was_pushed, "{spin} rad/s, peg {place}");
        }
    }
}

/// While the links of a chain turn, its joints draw them closer together, by a length of second order in the step that adds
/// up along the chain: 0.5 mm in a step of 6 ms here. Contacts that leave it out sink in every step, which is divided for it
/// and takes more than twice as many solves.
#[test]
fn steps_of_two_hundred_links_that_slide_along_pegs_are_not_divided_for_sinking() {
    let config = EnvConfig {
        task: Task::FIELD,
        field: FieldKind::Track,
        difficulty: 0.0,
        robot: RobotConfig { links: 200, ..RobotConfig::default() },
        controller: ControllerConfig::default(),
        start_jitter: 0.0,
        ..EnvConfig::default()
    };
    let mut environment = Environment::<PlanarRobot>::new(&config).expect("a valid configuration");
    let mut observation = vec![0.0; environment.observation_size()];
    environment.reset(Some(0), &mut observation);
    let (periods, mut solves) = (20, 0);
    for _ in 0..periods {
        environment.step(&vec![0.0; environment.action_size()], &mut observation);
        solves += environment.summary().iterations;
    }
    // Two steps of some 20 each.
    assert!(solves < 60 * periods, "{solves} solves in {periods} periods");
}
