//! What holds of obstacles that can be pushed.

use nalgebra::Vector2;
use snake_core::control::ControllerConfig;
use snake_core::gait::Wave;
use snake_core::obstacles::{Moved, Obstacle, ObstacleGrid, Peg, Shape, Spring};
use snake_core::planar::{Fleet, PlanarState, PlanarSystem, Pose, Scripted, Twist};
use snake_core::robot::{Robot, RobotConfig};
use snake_core::scene::{START_FREE, SceneConfig};
use snake_core::simulation::PlanarSimulation;
use snake_core::slope::Slope;
use snake_core::stepping::{ImplicitConfig, StepStatistics};
use snake_test_support::allocation::REQUESTS;
use snake_test_support::planar::{Hold, LIMP, Random, build, ground, implicit, links, momentum, posture};

const GRAVITY: f64 = 9.81;

fn disc([radius, x, y]: [f64; 3], mass: f64, ground_friction: f64) -> Obstacle {
    Obstacle { mass: Some(mass), ground_friction, ..Obstacle::from([radius, x, y]) }
}

/// A peg that yields.
fn sprung(place: [f64; 3], mass: f64, stiffness: f64, damping: f64, travel: Option<f64>) -> Obstacle {
    Obstacle { spring: Some(Spring { stiffness, damping, travel }), ..disc(place, mass, 0.0) }
}

/// Discs far from a robot at rest.
fn beside(obstacles: Vec<Obstacle>, step: f64, order: u32) -> PlanarSimulation {
    let scene = SceneConfig { obstacles, ..ground([0.2, 0.2]) };
    let mut simulation = build(&links(2), &scene, &ControllerConfig::default(), &implicit(step, order));
    simulation.place_chain(0.0, -5.0, 0.0, &[0.0]);
    simulation
}

fn push_off(simulation: &mut PlanarSimulation, twists: &[Twist]) {
    let mut state = simulation.state().clone();
    state.movables.iter_mut().zip(twists).for_each(|(moved, twist)| moved.twist = *twist);
    simulation.place(&state);
}

fn moved(simulation: &PlanarSimulation, disc: usize) -> Moved {
    simulation.state().movables[disc]
}

fn solved(report: StepStatistics) {
    assert!(report.unconverged == 0 && !report.diverged && !report.penetrated && report.relaxed == 0, "{report:?}");
}

/// v^2 / (2 mu g), whatever the step; and then exact rest.
#[test]
fn a_sliding_disc_stops_after_its_braking_distance() {
    let (speed, friction) = (0.7, 0.3);
    let exact = speed * speed / (2.0 * friction * GRAVITY);
    for (step, order) in [(2e-3, 1), (2e-3, 2), (1e-2, 2), (2.5e-2, 2), (0.1, 2)] {
        let mut simulation = beside(vec![disc([0.1, 0.0, 0.0], 2.0, friction)], step, order);
        push_off(&mut simulation, &[Twist::new(0.6 * speed, 0.8 * speed, 0.0)]);
        solved(simulation.advance(1.0, &Hold(0.0)));
        let Moved { pose, twist, .. } = moved(&simulation, 0);
        let (distance, off) = (pose.xy().dot(&Vector2::new(0.6, 0.8)), pose.xy().dot(&Vector2::new(-0.8, 0.6)));
        // Euler's method errs by half a step's braking, order two only in the part in which the disc stops.
        let allowed = if order == 1 { 0.6 * speed * step } else { 2e-3 * exact };
        assert!((distance - exact).abs() < allowed && off.abs() < 1e-9, "{distance} of {exact} m in steps of {step} s");
        assert!(twist.norm() < 1e-12, "{twist}");
        simulation.advance(1.0, &Hold(0.0));
        assert!((moved(&simulation, 0).pose - pose).norm() < 1e-12);
    }
}

/// The ground resists spin with 2/3 R mu m g: omega^2 R / (8/3 mu g) radians.
#[test]
fn a_spinning_disc_stops_after_its_braking_angle() {
    let (rate, friction, radius) = (3.0, 0.2, 0.15);
    let mut simulation = beside(vec![disc([radius, 0.0, 0.0], 0.5, friction)], 1e-2, 2);
    push_off(&mut simulation, &[Twist::new(0.0, 0.0, rate)]);
    solved(simulation.advance(1.0, &Hold(0.0)));
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
    solved(simulation.advance(0.5, &Hold(0.0)));
    let down = GRAVITY * (angle.sin() - 0.2 * angle.cos());
    assert!((moved(&simulation, 0).pose.x + 0.5 * down * 0.25).abs() < 1e-6, "{}", moved(&simulation, 0).pose);
    assert!((moved(&simulation, 1).pose - Pose::new(0.0, 1.0, 0.0)).norm() < 1e-9);
}

/// Implicit Euler: exactly its recursion. Order two: the damped oscillation of the textbook.
#[test]
fn a_peg_that_yields_oscillates_like_a_damped_spring() {
    let (mass, stiffness, damping, speed) = (0.5, 80.0, 1.5, 0.4);
    for (step, order) in [(1e-2, 1), (1e-2, 2), (2.5e-3, 2)] {
        let mut simulation = beside(vec![sprung([0.1, 0.3, 0.0], mass, stiffness, damping, None)], step, order);
        push_off(&mut simulation, &[Twist::new(0.0, speed, 1.0)]);
        let energy = simulation.energy();
        let report = simulation.advance(1.0, &Hold(0.0));
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
    solved(simulation.advance(5.0, &Hold(0.0)));
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
        let mut simulation = beside(vec![sprung([0.1, 0.0, 0.0], 1.0, 20.0, 0.0, Some(0.05))], step, order);
        push_off(&mut simulation, &[Twist::new(1.0, 0.0, 0.0)]);
        let before = simulation.energy();
        solved(simulation.advance(0.1, &Hold(0.0)));
        let Moved { pose, .. } = moved(&simulation, 0);
        assert!(simulation.energy() < 0.2 * before && pose.x > 0.03, "inelastic: {} J, {pose}", simulation.energy());
        push_off(&mut simulation, &[Twist::new(1.0, across, 0.0)]);
        let mut deepest: f64 = 0.0;
        for _ in 0..40 {
            solved(simulation.advance(0.05, &Hold(0.0)));
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
        let mut simulation = beside(obstacles, 1e-3, order);
        push_off(&mut simulation, &[Twist::new(1.0, 0.0, 2.0), Twist::zeros()]);
        for _ in 0..100 {
            solved(simulation.advance(5e-3, &Hold(0.0)));
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
    let mut simulation = beside(obstacles, 1e-2, 2);
    push_off(&mut simulation, &[Twist::new(0.8, 0.6, 0.0)]);
    solved(simulation.advance(1.0, &Hold(0.0)));
    let Moved { pose, twist, .. } = moved(&simulation, 0);
    assert!((pose.x - 0.4).abs() < 1e-6 && (pose.y - 0.6).abs() < 1e-6, "{pose}");
    assert!(twist.x.abs() < 1e-9 && (twist.y - 0.6).abs() < 1e-9, "{twist}");
    let mut state = simulation.state().clone();
    state.movables[0] = Moved::flat(Pose::new(0.0, 0.0, 0.0), Twist::new(-0.8, 0.0, 0.0));
    simulation.place(&state);
    solved(simulation.advance(1.0, &Hold(0.0)));
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
        solved(simulation.advance(2e-3, &Hold(0.0)));
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

/// A robot under the gait pushes discs about: energy is what actuators and friction leave of it, less what impacts take; it
/// ends with discs that rest exactly where nothing pushes them.
#[test]
fn work_of_a_robot_among_discs_is_energy_and_dissipation() {
    let disc_at = |x: f64, y: f64| disc([0.06, x, y], 0.3, 0.3);
    let obstacles = vec![disc_at(1.0, 0.1), disc_at(0.9, -0.15), disc_at(0.4, 0.25), disc_at(-3.0, 0.0)];
    let scene = SceneConfig { obstacles, ..ground([0.1, 0.6]) };
    let wave = Wave::default();
    let config = RobotConfig::default();
    let mut lost = Vec::new();
    for step in [1e-2, 2.5e-3] {
        let mut simulation = build(&config, &scene, &ControllerConfig::default(), &implicit(step, 2));
        simulation.place_chain(START_FREE[0], START_FREE[1], START_FREE[2], &posture(&wave, 10));
        let (mut work, mut pushed) = (0.0, Vector2::zeros());
        for _ in 0..500 {
            let report = simulation.advance(1e-2, &wave);
            solved(report);
            work += report.friction_work + report.actuator_work;
            pushed += simulation.obstacle_impulse()[..3].iter().map(|impulse| impulse.xy()).sum::<Vector2<f64>>();
            assert!(simulation.min_gap() > -1e-3);
        }
        let way: Vec<f64> =
            simulation.movables().map(|(one, at)| (at.pose.xy() - Vector2::from(one.start)).norm()).collect();
        assert!(way[..3].iter().any(|way| *way > 0.1) && way[3] == 0.0, "{way:?}");
        assert!(pushed.norm() > 0.0);
        lost.push(work - simulation.kinetic_energy());
        let sum: Vector2<f64> = simulation.contact_impulse().iter().map(|impulse| impulse.xy()).sum();
        let of_obstacles: Vector2<f64> = simulation.obstacle_impulse().iter().map(|impulse| impulse.xy()).sum();
        assert!((sum - of_obstacles).norm() < 1e-12);
    }
    println!("impacts and round-off take {lost:?} J");
    assert!(lost.iter().all(|lost| (-1e-3..0.2).contains(lost)), "{lost:?}");
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

/// Eleven robots that push things move the same alone and among others.
pub fn require_alike_in_every_company(robot: impl Fn(&PlanarSystem, usize) -> Scripted<Wave>) {
    let system = PlanarSystem::new(
        Robot::new(&RobotConfig::default()).unwrap(),
        [0.1, 0.5],
        ControllerConfig { torque_limit: Some(10.0), ..ControllerConfig::default() },
    )
    .unwrap();
    let robots = || -> Vec<Scripted<Wave>> { (0..11).map(|k| robot(&system, k)).collect() };
    let run = |robots: &mut [Scripted<Wave>], width: usize| -> Vec<PlanarState> {
        let mut fleet = Fleet::new(ImplicitConfig::default(), &system, width);
        for _ in 0..60 {
            fleet.advance(&system, robots, 0.05, |_| true);
        }
        robots.iter().map(|robot| robot.body.state.clone()).collect()
    };
    let alone: Vec<PlanarState> = (0..11).map(|k| run(std::slice::from_mut(&mut robots()[k]), 1).remove(0)).collect();
    let at_first = robots();
    let pushing =
        at_first.iter().zip(&alone).filter(|(robot, state)| robot.body.state.movables != state.movables).count();
    assert!(pushing > 3, "{pushing} robots push something");
    for width in [2, 11] {
        let together = run(&mut robots(), width);
        let other: Vec<usize> = (0..11).filter(|&k| together[k] != alone[k]).collect();
        assert!(other.is_empty(), "robots {other:?} of a fleet made for {width} robots");
    }
}

/// A robot that pushes some discs moves bit by bit as without others out of reach, which lie exactly still.
#[test]
fn what_sleeps_changes_nothing() {
    let wave = Wave { omega: 2.0, ..Wave::default() };
    let near = vec![disc([0.06, 1.0, 0.1], 0.3, 0.3), disc([0.06, 0.9, -0.2], 0.3, 0.3)];
    let far = (0..12).map(|k| {
        let place = [0.06, 0.4 * f64::from(k), 3.0];
        if k % 2 == 1 { disc(place, 0.5, 0.3) } else { sprung(place, 0.02, 200.0, 2.0, None) }
    });
    let run = |obstacles: Vec<Obstacle>| {
        let scene = SceneConfig { obstacles, ..ground([0.1, 0.6]) };
        let mut simulation: PlanarSimulation =
            build(&RobotConfig::default(), &scene, &ControllerConfig::default(), &implicit(1e-2, 2));
        let [x, y, heading] = START_FREE;
        simulation.place_chain(x, y, heading, &posture(&wave, 10));
        let report = simulation.advance(3.0, &wave);
        (simulation.state().clone(), report.iterations)
    };
    let (alone, solves) = run(near.clone());
    let (among, same) = run(near.iter().cloned().chain(far).collect());
    assert!(alone.movables.iter().any(|one| one.pose.x > 1.02), "pushed: {:?}", alone.movables);
    assert!((among.pose, among.twist, same) == (alone.pose, alone.twist, solves));
    assert_eq!(among.movables[..2], alone.movables[..]);
    for (k, moved) in (0..).zip(&among.movables[2..]) {
        assert!(moved.pose.x == 0.4 * f64::from(k) && moved.twist == Twist::zeros(), "{moved:?}");
    }
}

/// Places of discs in a row, of which three touch.
const ROW: [f64; 5] = [0.0, 0.2, 0.4, 0.5, 0.6];

/// A row of discs on ice, the first of which runs into the others: those that sleep till they are met move like those that are
/// awake, since they creep across.
#[test]
fn a_row_of_discs_wakes_in_turn() {
    let run = |creeping: f64| -> Vec<Vec<Moved>> {
        let row = ROW.map(|x| disc([0.05, x, 0.0], 1.0, 0.0)).to_vec();
        let mut simulation = beside(row, 5e-3, 2);
        let creep = Twist::new(0.0, creeping, 0.0);
        push_off(&mut simulation, &[Twist::new(1.0, creeping, 0.0), creep, creep, creep, creep]);
        let step = |_| {
            solved(simulation.advance(5e-3, &Hold(0.0)));
            assert!(simulation.min_gap() > -1e-4);
            simulation.state().movables.clone()
        };
        (0..300).map(step).collect()
    };
    let (sleeping, creeping) = (run(0.0), run(1e-12));
    for (ours, theirs) in sleeping.iter().flatten().zip(creeping.iter().flatten()) {
        assert!(
            (ours.twist - theirs.twist).norm() < 1e-7 && (ours.pose - theirs.pose).norm() < 1e-7,
            "{ours:?} {theirs:?}"
        );
    }
    let still = |moved: &Moved| moved.twist == Twist::zeros();
    // 10 cm at 1 m/s, and as far again at half of that.
    for (k, met) in [(1, 20), (2, 60), (3, 60), (4, 60)] {
        let asleep = sleeping.iter().take_while(|bodies| still(&bodies[k])).count();
        assert!((met - 2..=met).contains(&asleep), "{k} sleeps for {asleep} steps");
        assert!(sleeping[..asleep].iter().all(|bodies| bodies[k].pose.x == ROW[k]));
    }
}

/// With none to four discs and some pegs around them.
#[test]
fn the_width_of_the_registers_and_the_neighbours_do_not_matter_among_discs() {
    require_alike_in_every_company(|system, k| {
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

/// A snapshot in the middle of pushing continues bit for bit; nothing allocates in a step.
#[test]
fn a_run_among_discs_continues_from_a_snapshot_and_allocates_nothing() {
    let yields = sprung([0.06, 0.9, -0.15], 0.3, 100.0, 2.0, Some(0.02));
    let obstacles = vec![disc([0.06, 1.0, 0.1], 0.3, 0.3), yields];
    let scene = SceneConfig { obstacles, ..ground([0.1, 0.6]) };
    let wave = Wave::default();
    let new = || {
        let mut simulation = build(&RobotConfig::default(), &scene, &ControllerConfig::default(), &implicit(1e-2, 2));
        simulation.place_chain(START_FREE[0], START_FREE[1], START_FREE[2], &posture(&wave, 10));
        simulation
    };
    let mut simulation = new();
    simulation.advance(2.0, &wave);
    let saved = serde_json::to_string(&simulation.snapshot()).unwrap();
    let before = REQUESTS.get();
    simulation.advance(2.0, &wave);
    assert_eq!(REQUESTS.get() - before, 0);
    let mut again = new();
    let snapshot = serde_json::from_str(&saved).unwrap();
    again.restore(&snapshot);
    again.advance(2.0, &wave);
    assert_eq!(again.state(), simulation.state());
    assert_ne!(again.state().movables, new().state().movables);
}

/// Another gait every two seconds, to which the joints jump, in a room with walls, pegs, and heavy and light discs.
#[test]
fn random_motion_in_clutter_leaves_no_overlap_and_no_stage_unsolved_unreported() {
    let mut random = Random::new(20);
    for _ in 0..4 {
        let mut obstacles = cluttered(&mut random, 6);
        obstacles.extend([[0.08, -0.5, 1.4].into(), [0.1, 0.6, -0.5].into()]);
        let corners = [[-1.3, -0.9], [1.7, -0.9], [1.7, 1.6], [-1.3, 1.6]];
        obstacles
            .extend((0..4).map(|k| Obstacle::endless(Shape::Segment { start: corners[k], end: corners[(k + 1) % 4] })));
        let scene = SceneConfig { obstacles, ..ground([0.05, 0.5]) };
        let robot = RobotConfig { links: 7, ..RobotConfig::default() };
        let pd = ControllerConfig { torque_limit: Some(10.0), ..ControllerConfig::default() };
        let mut simulation = build(&robot, &scene, &pd, &ImplicitConfig::default());
        simulation.place_chain(-0.4, 0.6, 0.0, &[0.0; 6]);
        let mut deepest: f64 = 0.0;
        let start = (-simulation.min_gap()).max(0.0);
        let mut wave = Wave::default();
        let (mut worst, mut flagged, mut pushing, mut unsolved) = (0.0_f64, 0, 0, 0);
        for period in 0..500 {
            if period % 20 == 0 {
                let (amplitude, omega) = (random.between(0.4, 0.9), random.between(1.0, 4.0));
                wave = Wave { amplitude, omega, gamma: random.between(-0.3, 0.3), ..Wave::default() };
            }
            let report = simulation.advance(0.1, &wave);
            pushing += u32::from(simulation.obstacle_impulse()[2..].iter().any(|impulse| impulse.norm() > 0.0));
            unsolved += report.unconverged;
            assert!(!report.diverged);
            worst = worst.max(if report.unconverged == 0 { report.residual } else { 0.0 });
            let depth = -simulation.min_gap();
            flagged += u32::from(report.penetrated);
            if period > 20 && !report.penetrated {
                deepest = deepest.max(depth);
            }
        }
        println!(
            "{start:.1e} m at first, then {deepest:.1e} m, residual {worst:.1e} m/s, {flagged} periods flagged, {unsolved} \
             stages unsolved, {pushing} periods with a push"
        );
        assert!(deepest < 1e-3 && worst < 1e-3 && flagged + unsolved < 5 && pushing > 30);
    }
}
