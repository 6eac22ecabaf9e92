//! What holds of obstacles that can be pushed.

use nalgebra::Vector2;
use snake_core::control::ControllerConfig;
use snake_core::gait::Wave;
use snake_core::obstacles::{Moved, Obstacle, ObstacleGrid, Peg, Shape};
use snake_core::planar::{Planar, PlanarSystem, Pose, Scripted, Twist};
use snake_core::robot::{Robot, RobotConfig};
use snake_core::scene::{START_FREE, Scene, SceneConfig};
use snake_core::simulation::PlanarSimulation;
use snake_core::slope::Slope;
use snake_test_support::flat::Still;
use snake_test_support::planar::{LIMP, Random, build, ground, implicit, links, momentum, posture};
use snake_test_support::pushing::{
    GRAVITY, a_row_wakes_in_turn, a_run_continues_from_a_copy_or_snapshot_and_allocates_nothing, beside, disc, moved,
    push_off, random_motion, require_alike_in_every_company, solved, sprung, what_sleeps_changes_nothing,
    work_is_energy_and_dissipation,
};

/// v^2 / (2 mu g), whatever the step; and then exact rest.
#[test]
fn a_sliding_disc_stops_after_its_braking_distance() {
    let (speed, friction) = (0.7, 0.3);
    let exact = speed * speed / (2.0 * friction * GRAVITY);
    for (step, order) in [(2e-3, 1), (2e-3, 2), (1e-2, 2), (2.5e-2, 2), (0.1, 2)] {
        let mut simulation = beside::<Planar>(vec![disc([0.1, 0.0, 0.0], 2.0, friction)], step, order);
        push_off(&mut simulation, &[Twist::new(0.6 * speed, 0.8 * speed, 0.0)]);
        solved(simulation.advance(1.0, &Still));
        let Moved { pose, twist, .. } = moved(&simulation, 0);
        let (distance, off) = (pose.xy().dot(&Vector2::new(0.6, 0.8)), pose.xy().dot(&Vector2::new(-0.8, 0.6)));
        // Euler's method errs by half a step's braking, order two only in the part in which the disc stops.
        let allowed = if order == 1 { 0.6 * speed * step } else { 2e-3 * exact };
        assert!((distance - exact).abs() < allowed && off.abs() < 1e-9, "{distance} of {exact} m in steps of {step} s");
        assert!(twist.norm() < 1e-12, "{twist}");
        simulation.advance(1.0, &Still);
        assert!((moved(&simulation, 0).pose - pose).norm() < 1e-12);
    }
}

/// The ground resists spin with 2/3 R mu m g: omega^2 R / (8/3 mu g) radians.
#[test]
fn a_spinning_disc_stops_after_its_braking_angle() {
    let (rate, friction, radius) = (3.0, 0.2, 0.15);
    let mut simulation = beside::<Planar>(vec![disc([radius, 0.0, 0.0], 0.5, friction)], 1e-2, 2);
    push_off(&mut simulation, &[Twist::new(0.0, 0.0, rate)]);
    solved(simulation.advance(1.0, &Still));
    let exact = rate * rate * radius / (8.0 / 3.0 * friction * GRAVITY);
    let Moved { pose, twist, .. } = moved(&simulation, 0);
    assert!((pose.z - exact).abs() < 1e-4 && twist.norm() < 1e-12, "{} of {exact} rad", pose.z);
}

/// On a slope steeper than friction holds, a disc slides down with g (sin a - mu cos a); on a flatter one it rests.
#[test]
fn a_disc_slides_down_a_slope_that_is_too_steep() {
    let angle: f64 = 0.3;
    let slope = Slope { angle, direction: 0.0 };
    let obstacles = vec![disc([0.1, 0.0, 0.0], 1.0, 0.2), disc([0.1, 0.0, 1.0], 1.0, 0.4)];
    let scene = SceneConfig { obstacles, slope, ..ground([0.5, 0.5]) };
    let mut simulation = build(&links(2), &scene, &ControllerConfig::default(), &implicit(1e-2, 2));
    simulation.place_chain(0.0, -5.0, 0.0, &[0.0]);
    solved(simulation.advance(0.5, &Still));
    let down = GRAVITY * (angle.sin() - 0.2 * angle.cos());
    assert!((moved(&simulation, 0).pose.x + 0.5 * down * 0.25).abs() < 1e-6, "{}", moved(&simulation, 0).pose);
    assert!((moved(&simulation, 1).pose - Pose::new(0.0, 1.0, 0.0)).norm() < 1e-9);
}

/// Implicit Euler: exactly its recursion. Order two: the damped oscillation of the textbook.
#[test]
fn a_peg_that_yields_oscillates_like_a_damped_spring() {
    let (mass, stiffness, damping, speed) = (0.5, 80.0, 1.5, 0.4);
    for (step, order) in [(1e-2, 1), (1e-2, 2), (2.5e-3, 2)] {
        let mut simulation =
            beside::<Planar>(vec![sprung([0.1, 0.3, 0.0], mass, stiffness, damping, None)], step, order);
        push_off(&mut simulation, &[Twist::new(0.0, speed, 1.0)]);
        let energy = simulation.energy();
        let report = simulation.advance(1.0, &Still);
        solved(report);
        let exact = if order == 1 {
            let (mut y, mut v) = (0.0, speed);
            for _ in 0..100 {
                v = (mass * v - step * stiffness * y) / (mass + step * (step * stiffness + damping));
                y += step * v;
            }
            y
        } else {
            let decay = 0.5 * damping / mass;
            let rate = (stiffness / mass - decay * decay).sqrt();
            speed / rate * (-decay).exp() * rate.sin()
        };
        let Moved { pose, twist, .. } = moved(&simulation, 0);
        let allowed = if order == 1 { 1e-12 } else { 60.0 * step * step * speed / (stiffness / mass).sqrt() };
        assert!((pose.y - exact).abs() < allowed, "{} of {exact} m in steps of {step} s", pose.y);
        assert!(pose.x == 0.3 && twist.z == 1.0, "only along the spring's force: {pose} {twist}");
        // What the damper has not taken, the scheme has: nothing to speak of with order two.
        let lost = energy + report.friction_work - simulation.energy();
        assert!(order == 1 && lost > 0.0 || lost.abs() < 0.02 * energy, "{lost} of {energy} J");
    }
}

/// Downhill, the deflection is force over stiffness, or the travel if that is shorter; friction of the ground adds to it.
#[test]
fn a_peg_on_a_slope_rests_where_spring_or_stop_hold_it() {
    let (angle, mass, stiffness) = (0.3_f64, 2.0, 150.0);
    let slope = Slope { angle, direction: 0.5 };
    let peg = |y: f64, travel| sprung([0.05, 0.0, y], mass, stiffness, 30.0, travel);
    let obstacles = vec![peg(0.0, None), peg(1.0, Some(0.1)), peg(2.0, Some(0.02))];
    let scene = SceneConfig { obstacles, slope, ..ground([0.9, 0.9]) };
    let mut simulation = build(&links(2), &scene, &ControllerConfig::default(), &implicit(1e-2, 2));
    simulation.place_chain(0.0, -5.0, 0.0, &[0.0]);
    solved(simulation.advance(5.0, &Still));
    let down = -Vector2::new(0.5_f64.cos(), 0.5_f64.sin());
    let free = mass * GRAVITY * angle.sin() / stiffness;
    for (k, distance) in [free, free, 0.02].into_iter().enumerate() {
        let Moved { pose, twist, .. } = moved(&simulation, k);
        let off = pose.xy() - Vector2::new(0.0, k as f64) - down * distance;
        assert!(off.norm() < 1e-7 && twist.norm() < 1e-8, "{k}: {off} {twist}");
    }
    assert!(simulation.min_gap().abs() < 1e-7);
}

/// The stop takes the speed along the deflection and leaves that across it, whatever the step; then the spring brings the
/// peg back.
#[test]
fn a_peg_that_runs_into_its_stop_stays_inside() {
    for (step, order, across) in [(1e-3, 2, 0.0), (1e-2, 2, 0.0), (1e-2, 1, 0.3), (1e-2, 2, 0.3), (5e-2, 2, 0.3)] {
        let mut simulation = beside::<Planar>(vec![sprung([0.1, 0.0, 0.0], 1.0, 20.0, 0.0, Some(0.05))], step, order);
        push_off(&mut simulation, &[Twist::new(1.0, 0.0, 0.0)]);
        let before = simulation.energy();
        solved(simulation.advance(0.1, &Still));
        let Moved { pose, .. } = moved(&simulation, 0);
        assert!(simulation.energy() < 0.2 * before && pose.x > 0.03, "inelastic: {} J, {pose}", simulation.energy());
        push_off(&mut simulation, &[Twist::new(1.0, across, 0.0)]);
        let mut deepest: f64 = 0.0;
        for _ in 0..40 {
            solved(simulation.advance(0.05, &Still));
            deepest = deepest.max(-simulation.min_gap());
        }
        assert!(deepest < 1e-4, "{deepest} m in steps of {step} s");
    }
}

/// A robot under the gait leans on pegs that yield: what actuators and friction leave is kinetic energy and that of springs,
/// less what impacts take. Stiffer pegs give way less.
#[test]
fn work_of_a_robot_among_pegs_that_yield_is_energy_and_dissipation() {
    let wave = Wave::default();
    let run = |stiffness: f64| {
        let peg = |x: f64, y: f64| sprung([0.06, x, y], 0.3, stiffness, 2.0, Some(0.04));
        let scene =
            SceneConfig { obstacles: vec![peg(1.0, 0.1), peg(0.9, -0.15), peg(0.4, 0.25)], ..ground([0.1, 0.6]) };
        let mut simulation = build(&RobotConfig::default(), &scene, &ControllerConfig::default(), &implicit(2.5e-3, 2));
        simulation.place_chain(START_FREE[0], START_FREE[1], START_FREE[2], &posture(&wave, 10));
        let (mut work, mut farthest) = (0.0, 0.0_f64);
        for _ in 0..500 {
            let report = simulation.advance(1e-2, &wave);
            solved(report);
            work += report.friction_work + report.actuator_work;
            assert!(simulation.min_gap() > -1e-3, "{}", simulation.min_gap());
            for (one, at) in simulation.movables() {
                farthest = farthest.max(one.deflection(&at.pose.xy()).norm());
            }
        }
        let lost = work - simulation.energy();
        println!("{stiffness} N/m: {farthest} m at most, impacts and round-off take {lost} J");
        assert!((-1e-3..0.3).contains(&lost), "{lost}");
        farthest
    };
    let [soft, hard] = [50.0, 5000.0].map(run);
    assert!((soft - 0.04).abs() < 1e-3 && hard < 0.02, "{soft} {hard}");
}

/// Two discs meet head on and obliquely: impacts are inelastic along the line of centres and free across it.
#[test]
fn discs_that_meet_keep_momentum_and_part_along_the_line_of_centres() {
    for (offset, order) in [(0.0, 1), (0.0, 2), (0.1, 1), (0.1, 2), (-0.15, 2)] {
        let obstacles = vec![disc([0.1, 0.0, 0.0], 2.0, 0.0), disc([0.1, 0.5, offset], 1.0, 0.0)];
        let mut simulation = beside::<Planar>(obstacles, 1e-3, order);
        push_off(&mut simulation, &[Twist::new(1.0, 0.0, 2.0), Twist::zeros()]);
        for _ in 0..100 {
            solved(simulation.advance(5e-3, &Still));
            assert!(simulation.min_gap() > -1e-5, "{}", simulation.min_gap());
        }
        let [a, b] = [0, 1].map(|k| moved(&simulation, k).twist);
        // At the impact the centres are 0.2 m apart.
        let sine = offset / 0.2_f64;
        let normal = Vector2::new((1.0 - sine * sine).sqrt(), sine);
        let common = 2.0 / 3.0 * normal.x;
        let exact = [Vector2::new(1.0, 0.0) + normal * (common - normal.x), normal * common];
        assert!((a.xy() - exact[0]).norm() < 2e-3 && (b.xy() - exact[1]).norm() < 2e-3, "{a} {b}, {exact:?}");
        assert!((a.xy() * 2.0 + b.xy() - Vector2::new(2.0, 0.0)).norm() < 1e-9, "momentum");
        assert!((a.z - 2.0).abs() < 1e-12 && b.z == 0.0, "frictionless contacts turn nothing");
    }
}

/// A disc that meets a wall and a peg keeps its motion along them.
#[test]
fn a_disc_stays_outside_walls_and_pegs() {
    let wall = Obstacle::endless(Shape::Segment { start: [0.5, -3.0], end: [0.5, 3.0] });
    let obstacles = vec![wall, disc([0.1, 0.0, 0.0], 1.0, 0.0), Peg { radius: 0.1, x: -0.5, y: 0.0 }.into()];
    let mut simulation = beside::<Planar>(obstacles, 1e-2, 2);
    push_off(&mut simulation, &[Twist::new(0.8, 0.6, 0.0)]);
    solved(simulation.advance(1.0, &Still));
    let Moved { pose, twist, .. } = moved(&simulation, 0);
    assert!((pose.x - 0.4).abs() < 1e-6 && (pose.y - 0.6).abs() < 1e-6, "{pose}");
    assert!(twist.x.abs() < 1e-9 && (twist.y - 0.6).abs() < 1e-9, "{twist}");
    let mut state = simulation.state().clone();
    state.movables[0] = Moved::flat(Pose::new(0.0, 0.0, 0.0), Twist::new(-0.8, 0.0, 0.0));
    simulation.place(&state);
    solved(simulation.advance(1.0, &Still));
    assert!((moved(&simulation, 0).pose.x + 0.3).abs() < 1e-6 && moved(&simulation, 0).twist.norm() < 1e-9);
}

/// A limp robot on ice runs into a disc on ice: momentum of both, and no energy from nowhere.
#[test]
fn a_robot_that_runs_into_a_disc_shares_its_momentum() {
    let scene = SceneConfig { obstacles: vec![disc([0.12, -0.4, 0.03], 1.5, 0.0)], ..ground([0.0, 0.0]) };
    let mut simulation = build(&links(5), &scene, &LIMP, &implicit(2e-3, 2));
    simulation.place_chain(0.0, 0.0, 0.0, &[0.1, -0.1, 0.1, -0.1]);
    let mut state = simulation.state().clone();
    state.twist.fill(Twist::new(-0.5, 0.0, 0.0));
    simulation.place(&state);
    let total = |simulation: &PlanarSimulation| {
        let (mut linear, mut angular) = momentum(simulation.robot(), simulation.state());
        for (movable, Moved { pose, twist, .. }) in simulation.movables() {
            linear += twist.xy() * movable.link.mass;
            angular += movable.link.mass * (pose.x * twist.y - pose.y * twist.x) + movable.link.inertia * twist.z;
        }
        (linear, angular)
    };
    let (before, energy) = (total(&simulation), simulation.kinetic_energy());
    let mut least = energy;
    for _ in 0..250 {
        solved(simulation.advance(2e-3, &Still));
        let now = simulation.kinetic_energy();
        assert!(now < least + 1e-6 * energy, "{now} after {least}");
        least = least.min(now);
        assert!(simulation.min_gap() > -1e-4);
    }
    let after = total(&simulation);
    assert!(moved(&simulation, 0).twist.x < -0.2 && least < 0.95 * energy, "an impact: {least} J of {energy} J");
    assert!((after.0 - before.0).norm() < 1e-9, "{} {}", after.0, before.0);
    assert!((after.1 - before.1).abs() < 1e-4, "{} {}", after.1, before.1);
}

/// Discs and pegs that yield, apart from each other.
fn cluttered(random: &mut Random, count: usize) -> Vec<Obstacle> {
    let mut all: Vec<Obstacle> = Vec::new();
    while all.len() < count {
        let place = [random.between(0.03, 0.12), random.between(-1.2, 1.6), random.between(0.2, 1.0)];
        let (mass, friction) = (random.magnitude(0.05, 5.0), random.between(0.1, 0.6));
        let one = match random.magnitude(50.0, 5000.0) {
            stiffness if stiffness > 1000.0 => {
                Obstacle { ground_friction: 0.0, ..sprung(place, mass, stiffness, 1.0, Some(0.03)) }
            }
            _ => disc(place, mass, friction),
        };
        let gap = |other: &Obstacle| match other.shape {
            Shape::Circle(Peg { radius, x, y }) => (place[1] - x).hypot(place[2] - y) - radius - place[0],
            _ => unreachable!("a disc"),
        };
        if all.iter().all(|other| gap(other) > 0.0) {
            all.push(one);
        }
    }
    all
}

/// The robot ends with discs that rest exactly where nothing pushes them.
#[test]
fn work_of_a_robot_among_discs_is_energy_and_dissipation() {
    let obstacles = [[1.0, 0.1], [0.9, -0.15], [0.4, 0.25], [-3.0, 0.0]].map(|[x, y]| disc([0.06, x, y], 0.3, 0.3));
    for step in [1e-2, 2.5e-3] {
        let ways = work_is_energy_and_dissipation::<Planar>(&obstacles, step, 500);
        assert!(ways.iter().any(|way| way.xy().norm() > 0.1), "{ways:?}");
    }
}

#[test]
fn what_sleeps_among_discs_changes_nothing() {
    let near = [disc([0.06, 1.0, 0.1], 0.3, 0.3), disc([0.06, 0.9, -0.2], 0.3, 0.3)];
    let far = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11].map(|k| {
        let place = [0.06, 0.4 * f64::from(k), 3.0];
        if k % 2 == 1 { disc(place, 0.5, 0.3) } else { sprung(place, 0.02, 200.0, 2.0, None) }
    });
    what_sleeps_changes_nothing::<Planar>(&near, &far);
}

#[test]
fn a_row_of_discs_wakes_in_turn() {
    a_row_wakes_in_turn::<Planar>();
}

/// With none to four discs and some pegs around them.
#[test]
fn the_width_of_the_registers_and_the_neighbours_do_not_matter_among_discs() {
    let system = system_among_bodies();
    require_alike_in_every_company(&system, |k| {
        let mut obstacles = cluttered(&mut Random::new(7 + k as u64), k % 5);
        obstacles.iter_mut().for_each(|one| match &mut one.shape {
            Shape::Circle(peg) => peg.y -= 0.6,
            _ => unreachable!("a disc"),
        });
        if k.is_multiple_of(2) {
            obstacles.push([0.1, -0.9, 0.1].into());
        }
        let wave = Wave { omega: 1.0 + 0.2 * k as f64, ..Wave::default() };
        Scripted::new(&system.robot, ObstacleGrid::of(&obstacles), START_FREE, &posture(&wave, 10), wave)
    });
}

pub fn system_among_bodies() -> PlanarSystem {
    let controller = ControllerConfig { torque_limit: Some(10.0), ..ControllerConfig::default() };
    let ground = Scene::new(&ground([0.1, 0.5])).unwrap();
    PlanarSystem::new(Robot::new(&RobotConfig::default()).unwrap(), &ground, controller).unwrap()
}

#[test]
fn a_run_among_discs_continues_from_a_snapshot_and_allocates_nothing() {
    let yields = sprung([0.06, 0.9, -0.15], 0.3, 100.0, 2.0, Some(0.02));
    a_run_continues_from_a_copy_or_snapshot_and_allocates_nothing::<Planar>(&[
        disc([0.06, 1.0, 0.1], 0.3, 0.3),
        yields,
    ]);
}

/// Heavy and light discs.
#[test]
fn random_motion_among_discs_leaves_no_overlap_and_no_stage_unsolved_unreported() {
    let mut random = Random::new(20);
    let mut pushing = 0;
    for _ in 0..4 {
        let obstacles = cluttered(&mut random, 6);
        pushing += random_motion::<Planar>(&mut random, obstacles, 500, some_wave);
    }
    assert!(pushing > 20, "{pushing}");
}

pub fn some_wave(random: &mut Random) -> Wave {
    let (amplitude, omega) = (random.between(0.4, 0.9), random.between(1.0, 4.0));
    Wave { amplitude, omega, gamma: random.between(-0.3, 0.3), ..Wave::default() }
}
