//! Robots that lie flat among obstacles that can be pushed: what holds of them in the plane and on the ground in 3D alike.

use nalgebra::Vector3;
use snake_core::control::ControllerConfig;
use snake_core::gait::Reference;
use snake_core::obstacles::{Moved, Obstacle, Shape, Spring};
use snake_core::robot::RobotConfig;
use snake_core::scene::{START_FREE, SceneConfig};
use snake_core::simulation::Simulation;
use snake_core::stepping::{ImplicitConfig, Model, Scripted, StepStatistics};

use crate::allocation::REQUESTS;
use crate::flat::{Flat, Still, lying};
use crate::lanes::alone_as_among_others;
use crate::planar::{Random, ground, links};

pub const GRAVITY: f64 = 9.81;

pub fn movable(shape: Shape, mass: f64, ground_friction: f64) -> Obstacle {
    Obstacle { mass: Some(mass), ground_friction, ..Obstacle::endless(shape) }
}

pub fn disc(place: [f64; 3], mass: f64, ground_friction: f64) -> Obstacle {
    Obstacle { mass: Some(mass), ground_friction, ..Obstacle::from(place) }
}

pub fn boxed(size: [f64; 2], [x, y, angle]: [f64; 3], mass: f64, ground_friction: f64) -> Obstacle {
    movable(Shape::Box { size, x, y, angle }, mass, ground_friction)
}

/// A peg that yields.
pub fn sprung(place: [f64; 3], mass: f64, stiffness: f64, damping: f64, travel: Option<f64>) -> Obstacle {
    Obstacle { spring: Some(Spring { stiffness, damping, travel }), ..disc(place, mass, 0.0) }
}

/// Obstacles far from a robot at rest.
pub fn beside<M: Flat>(obstacles: Vec<Obstacle>, step: f64, order: u32) -> Simulation<M> {
    let scene = SceneConfig { obstacles, ..ground([0.2, 0.2]) };
    let start = ([0.0, -9.0, 0.0], &[0.0][..]);
    lying(&links(2), &scene, &ControllerConfig::default(), &M::implicit(step, order), start)
}

/// Aiko in the posture of its gait among obstacles.
fn among<M: Flat>(obstacles: Vec<Obstacle>, gait: &M::Gait, step: f64) -> Simulation<M> {
    let scene = SceneConfig { obstacles, ..ground([0.1, 0.6]) };
    let start = (START_FREE, &M::yaws(gait, 10)[..]);
    lying(&RobotConfig::default(), &scene, &ControllerConfig::default(), &M::implicit(step, 2), start)
}

pub fn push_off<M: Flat>(simulation: &mut Simulation<M>, twists: &[Vector3<f64>]) {
    let mut state = simulation.state().clone();
    state.movables.iter_mut().zip(twists).for_each(|(moved, twist)| moved.twist = *twist);
    simulation.place(&state);
}

pub fn moved<M: Flat>(simulation: &Simulation<M>, number: usize) -> Moved {
    simulation.state().movables[number]
}

pub fn solved(report: StepStatistics) {
    assert!(report.unconverged == 0 && !report.diverged && !report.penetrated && report.relaxed == 0, "{report:?}");
}

/// Places of discs in a row, of which three touch.
const ROW: [f64; 5] = [0.0, 0.2, 0.4, 0.5, 0.6];

/// On ice each disc of a row shares the momentum of those that run into it, and lies exactly still till then; the same comes
/// about where none sleeps, since all creep across.
pub fn a_row_wakes_in_turn<M: Flat>() {
    let run = |creeping: f64| -> Vec<Vec<Moved>> {
        let row = ROW.map(|x| disc([0.05, x, 0.0], 1.0, 0.0)).to_vec();
        let mut simulation = beside::<M>(row, 5e-3, 2);
        let creep = Vector3::new(0.0, creeping, 0.0);
        push_off(&mut simulation, &[Vector3::new(1.0, creeping, 0.0), creep, creep, creep, creep]);
        let step = |_| {
            solved(simulation.advance(5e-3, &Still));
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
    let mut met = 1;
    for bodies in &sleeping {
        met = met.max(bodies.iter().filter(|one| one.twist.x > 1e-3).count());
        for (k, one) in bodies.iter().enumerate() {
            let speed = if k < met { 1.0 / met as f64 } else { 0.0 };
            assert!((one.twist.x - speed).abs() < 1e-6, "{k} of {met}: {one:?}");
        }
    }
    assert_eq!(met, 5);
    // 10 cm at 1 m/s, and as far again at half of that; up to 2 cm before, a disc is looked at.
    for (k, met) in [(1, 20), (2, 60), (3, 60), (4, 60)] {
        let asleep = sleeping.iter().take_while(|bodies| bodies[k].twist == Vector3::zeros()).count();
        assert!((met - 10..=met).contains(&asleep), "{k} sleeps for {asleep} steps");
        assert!(sleeping[..asleep].iter().all(|bodies| bodies[k].pose.x == ROW[k]));
    }
}

/// A robot that pushes some things moves bit by bit as without others out of reach, however light these are, which lie exactly
/// still.
pub fn what_sleeps_changes_nothing<M: Flat>(near: &[Obstacle], far: &[Obstacle]) {
    let gait = M::undulation();
    let run = |obstacles: Vec<Obstacle>| {
        let mut simulation = among::<M>(obstacles, &gait, 1e-2);
        let first = simulation.state().movables.clone();
        let report = simulation.advance(3.0, &gait);
        (first, simulation.state().clone(), report.iterations)
    };
    let (first, alone, solves) = run(near.to_vec());
    let (lying, among, same) = run([near, far].concat());
    assert!((0..near.len()).any(|k| alone.movables[k].pose.x > first[k].pose.x + 0.02), "pushed: {:?}", alone.movables);
    assert!((among.pose, among.twist, same) == (alone.pose, alone.twist, solves));
    assert_eq!(among.movables[..near.len()], alone.movables[..]);
    assert_eq!(among.movables[near.len()..], lying[near.len()..]);
}

/// A robot under the gait pushes things about, of which the last is out of reach: energy is what actuators and friction leave
/// of it, less what impacts take, and impulses on obstacles are those on links. Returns how far all were moved.
pub fn work_is_energy_and_dissipation<M: Flat>(obstacles: &[Obstacle], step: f64, periods: u32) -> Vec<Vector3<f64>> {
    let gait = M::undulation();
    let mut simulation = among::<M>(obstacles.to_vec(), &gait, step);
    let (first, start, mut work) = (simulation.energy(), simulation.state().movables.clone(), 0.0);
    for _ in 0..periods {
        let report = simulation.advance(1e-2, &gait);
        solved(report);
        work += report.friction_work + report.actuator_work;
        assert!(simulation.min_gap() > -1e-3, "{}", simulation.min_gap());
        let on_links: Vector3<f64> = simulation.contact_impulse().iter().sum();
        let of_obstacles: Vector3<f64> = simulation.obstacle_impulse().iter().sum();
        assert!((on_links - of_obstacles).norm() < 1e-12);
    }
    let lost = work - (simulation.energy() - first);
    println!("steps of {step} s: impacts and round-off take {lost} J");
    assert!((-1e-3..0.01).contains(&lost), "{lost}");
    let ways: Vec<_> =
        simulation.state().movables.iter().zip(&start).map(|(end, start)| end.pose - start.pose).collect();
    assert!(ways.last().is_some_and(|way| way.norm() == 0.0), "{ways:?}");
    ways
}

/// A copy and a snapshot in the middle of pushing continue bit for bit; nothing allocates in a step.
pub fn a_run_continues_from_a_copy_or_snapshot_and_allocates_nothing<M: Flat>(obstacles: &[Obstacle]) {
    let gait = M::undulation();
    let new = || among::<M>(obstacles.to_vec(), &gait, 1e-2);
    let mut simulation = new();
    simulation.advance(2.0, &gait);
    let saved = serde_json::to_string(&simulation.snapshot()).expect("numbers");
    let mut copy = simulation.clone();
    let before = REQUESTS.get();
    simulation.advance(2.0, &gait);
    assert_eq!(REQUESTS.get() - before, 0);
    copy.advance(2.0, &gait);
    assert_eq!(copy.state(), simulation.state());
    let mut again = new();
    again.restore(&serde_json::from_str(&saved).expect("a snapshot"));
    again.advance(2.0, &gait);
    assert_eq!(again.state(), simulation.state());
    assert_ne!(again.state().movables, new().state().movables);
}

/// Another gait every two seconds, to which the joints jump, in a room with walls, pegs and things that move: no
/// overlap, and no stage unsolved unreported. Returns the periods in which the robot pushes.
pub fn random_motion<M: Flat>(
    random: &mut Random,
    mut obstacles: Vec<Obstacle>,
    periods: u32,
    mut gait: impl FnMut(&mut Random) -> M::Gait,
) -> u32 {
    obstacles.extend([[0.08, -0.5, 1.4].into(), [0.1, 0.6, -0.5].into()]);
    let corners = [[-1.3, -0.9], [1.7, -0.9], [1.7, 1.6], [-1.3, 1.6]];
    obstacles
        .extend((0..4).map(|k| Obstacle::endless(Shape::Segment { start: corners[k], end: corners[(k + 1) % 4] })));
    let scene = SceneConfig { obstacles, ..ground([0.05, 0.5]) };
    let pd = ControllerConfig { torque_limit: Some(10.0), ..ControllerConfig::default() };
    let mut simulation = lying::<M>(&links(7), &scene, &pd, &ImplicitConfig::default(), ([-0.4, 0.6, 0.0], &[0.0; 6]));
    let (start, count) = ((-simulation.min_gap()).max(0.0), simulation.movables().count());
    let (mut deepest, mut worst, mut present) = (0.0_f64, 0.0_f64, M::undulation());
    let (mut flagged, mut pushing, mut unsolved) = (0, 0, 0);
    for period in 0..periods {
        if period % 20 == 0 {
            present = gait(random);
        }
        let report = simulation.advance(0.1, &present);
        let pushed = simulation.obstacle_impulse().iter().rev().take(count);
        pushing += u32::from(pushed.into_iter().any(|impulse| impulse.norm() > 0.0));
        unsolved += report.unconverged;
        assert!(!report.diverged);
        worst = worst.max(if report.unconverged == 0 { report.residual } else { 0.0 });
        flagged += u32::from(report.penetrated);
        if period > 20 && !report.penetrated {
            deepest = deepest.max(-simulation.min_gap());
        }
    }
    println!(
        "{start:.1e} m at first, then {deepest:.1e} m, residual {worst:.1e} m/s, {flagged} periods flagged, {unsolved} \
         stages unsolved, {pushing} periods with a push"
    );
    assert!(deepest < 1e-3 && worst < 1e-3 && flagged + unsolved < 5 && pushing > 0);
    let fastest = simulation.movables().map(|(_, moved)| moved.twist.norm()).fold(0.0, f64::max);
    assert!(fastest < 5.0, "{fastest}");
    pushing
}

/// Eleven robots, of which more than three push something, move the same alone and among others.
pub fn require_alike_in_every_company<M: Model, R: Reference<M::Target>>(
    system: &M::System,
    robot: impl Fn(usize) -> Scripted<R, M>,
) {
    let alone = alone_as_among_others(system, ImplicitConfig::default(), &[11, 13], &[0.05; 60], 11, &robot);
    let pushing = (0..11).filter(|&k| robot(k).body.state.movables != alone[k].0.state.movables).count();
    assert!(pushing > 3, "{pushing} robots push something");
}
