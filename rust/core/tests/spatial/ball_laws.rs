//! What holds of balls: they roll, slide, fall, and meet robots, each other and everything that is fixed.

use std::sync::Arc;

use nalgebra::{Vector2, Vector3};
use snake_core::control::ControllerConfig;
use snake_core::obstacles::{GroundFriction, Heights, Moved, Obstacle, ObstacleGrid, OutOfPlane, Shape};
use snake_core::robot::{Robot, RobotConfig};
use snake_core::scene::{START_FREE, Scene, SceneConfig};
use snake_core::simulation::SpatialSimulation;
use snake_core::slope::Slope;
use snake_core::spatial::{Spatial, SpatialSystem, twist_of};
use snake_core::stepping::ImplicitConfig;
use snake_test_support::flat::{Still, lying};
use snake_test_support::planar::{LIMP, Random, ground, links};
use snake_test_support::pushing::{
    a_run_continues_from_a_copy_or_snapshot_and_allocates_nothing, boxed, random_motion,
    require_alike_in_every_company, solved,
};
use snake_test_support::spatial::{implicit, in_gait, sidewinding, undulation};

use super::movable_laws::some_gait;

const GRAVITY: f64 = 9.81;

fn ball(radius: f64, centre: [f64; 3], mass: f64, [sliding, rolling_friction]: [f64; 2]) -> Obstacle {
    let shape = Shape::Sphere { radius, centre, rolling_friction };
    Obstacle { mass: Some(mass), ground_friction: sliding, ..Obstacle::endless(shape) }
}

/// Obstacles far from a robot at rest, on ground that rises along x.
fn beside(obstacles: Vec<Obstacle>, slope: f64, step: f64) -> SpatialSimulation {
    let scene = SceneConfig { obstacles, slope: Slope { angle: slope, direction: 0.0 }, ..ground([0.9, 0.9]) };
    lying(&links(2), &scene, &ControllerConfig::default(), &implicit(step, 2), ([0.0, -9.0, 0.0], &[0.0]))
}

fn push_off(simulation: &mut SpatialSimulation, number: usize, velocity: [f64; 3], spin: [f64; 3]) {
    let mut state = simulation.state().clone();
    let moved = &mut state.movables[number];
    moved.twist = Vector3::new(velocity[0], velocity[1], spin[2]);
    moved.out_of_plane = OutOfPlane { rise: velocity[2], roll: [spin[0], spin[1]], ..moved.out_of_plane };
    simulation.place(&state);
}

fn moved(simulation: &SpatialSimulation, number: usize) -> Moved {
    simulation.state().movables[number]
}

/// Down a slope with 5/7 g sin where friction lets it roll, and else with g (sin - mu cos), while it spins up.
#[test]
fn on_a_slope_it_rolls_or_slides() {
    let (radius, angle, weak) = (0.07, 0.4_f64, 0.05);
    let obstacles = vec![
        ball(radius, [0.0, 0.0, radius], 0.5, [0.6, 0.0]),
        ball(radius, [0.0, 1.0, radius], 0.5, [weak, 0.0]),
        ball(radius, [0.0, 2.0, radius], 0.5, [0.6, 0.03]),
    ];
    let mut simulation = beside(obstacles, angle, 5e-3);
    solved(simulation.advance(0.5, &Still));
    let (down, pressed) = (GRAVITY * angle.sin(), GRAVITY * angle.cos());
    let accelerations = [5.0 / 7.0 * down, down - weak * pressed, 5.0 / 7.0 * (down - 0.03 * pressed)];
    let spins = [accelerations[0] / radius, 2.5 * weak * pressed / radius, accelerations[2] / radius];
    for (k, (acceleration, spin)) in accelerations.into_iter().zip(spins).enumerate() {
        let Moved { pose, twist, out_of_plane: OutOfPlane { height, rise, roll } } = moved(&simulation, k);
        assert!(
            (pose.x + 0.125 * acceleration).abs() < 1e-5 && (twist.x + 0.5 * acceleration).abs() < 1e-5,
            "{k}: {} {}",
            pose.x + 0.125 * acceleration,
            twist.x + 0.5 * acceleration
        );
        assert!((roll[1] + 0.5 * spin).abs() < 1e-3 && roll[0].abs() < 1e-9, "{k}: {roll:?} {spin}");
        assert!((height - radius).abs() < 1e-7 && rise.abs() < 1e-6, "{k}: {height} {rise}");
    }
}

/// Pushed without spin it slides to 5/7 of its speed at 2 v / (7 mu g); rolling friction then stops it, for good.
#[test]
fn a_pushed_ball_slides_rolls_and_comes_to_rest() {
    let (radius, friction, rolling, speed) = (0.1, 0.2, 0.04, 1.4);
    let mut simulation = beside(vec![ball(radius, [0.0, 0.0, radius], 2.0, [friction, rolling])], 0.0, 5e-3);
    push_off(&mut simulation, 0, [0.6 * speed, 0.8 * speed, 0.0], [0.0; 3]);
    // Both frictions brake it while it slides.
    let brakes = (friction + rolling) * GRAVITY;
    let rolls_at = speed / (brakes + 2.5 * friction * GRAVITY);
    solved(simulation.advance(rolls_at + 0.1, &Still));
    let rolls = speed - brakes * rolls_at;
    let slower = rolls - 5.0 / 7.0 * rolling * GRAVITY * 0.1;
    let Moved { twist, out_of_plane, .. } = moved(&simulation, 0);
    assert!((twist.xy().norm() - slower).abs() < 1e-3, "{} {slower}", twist.xy().norm());
    let surface = Vector2::new(twist.x - radius * out_of_plane.roll[1], twist.y + radius * out_of_plane.roll[0]);
    assert!(surface.norm() < 1e-6, "{surface}");
    solved(simulation.advance(6.0, &Still));
    let way = speed * rolls_at - 0.5 * brakes * rolls_at * rolls_at + 0.7 * rolls * rolls / (rolling * GRAVITY);
    let rested = moved(&simulation, 0);
    assert!((rested.pose.xy().norm() - way).abs() < 2e-3 * way, "{} {way}", rested.pose.xy().norm());
    assert!(rested == rested.stopped(), "{rested:?}");
    solved(simulation.advance(1.0, &Still));
    assert!(moved(&simulation, 0) == rested);
}

/// From the air: a free fall, and no bounce; a ball on top of another comes to lie between two others.
#[test]
fn dropped_balls_come_to_lie() {
    let radius = 0.05;
    let height = 0.5;
    let place = |x: f64, y: f64, z: f64| ball(radius, [x, y, z], 0.2, [0.5, 0.02]);
    let obstacles = vec![
        place(0.0, 3.0, radius + height),
        place(0.0, 0.0, radius),
        place(2.02 * radius, 0.0, radius),
        place(0.9 * radius, 0.01 * radius, 3.5 * radius),
    ];
    let mut simulation = beside(obstacles, 0.0, 5e-3);
    let falls = (2.0 * height / GRAVITY).sqrt();
    push_off(&mut simulation, 0, [0.3, 0.0, 0.0], [0.0; 3]);
    solved(simulation.advance(0.9 * falls, &Still));
    assert!((moved(&simulation, 0).pose.x - 0.27 * falls).abs() < 1e-9, "nothing rubs in the air");
    let fallen = radius + height * (1.0 - 0.81);
    let high = moved(&simulation, 0).out_of_plane.height;
    assert!((high - fallen).abs() < 1e-4, "{high} {fallen}");
    let mut energy = simulation.energy();
    for _ in 0..400 {
        solved(simulation.advance(1e-2, &Still));
        assert!(simulation.energy() < energy + 1e-9 && simulation.min_gap() > -1e-4, "{}", simulation.min_gap());
        energy = simulation.energy();
    }
    let landed = moved(&simulation, 0);
    assert!((landed.out_of_plane.height - radius).abs() < 1e-6 && (landed.pose.y - 3.0).abs() < 1e-9);
    for number in 0..4 {
        let one = moved(&simulation, number);
        assert!(one.twist.norm() < 1e-6 && one.out_of_plane.height > radius - 1e-4, "{number}: {one:?}");
    }
}

/// One that runs centrally into another on ice shares its momentum; a higher one is met below its widest circle.
#[test]
fn balls_of_any_size_share_their_momentum() {
    for [small, large] in [[0.05, 0.05], [0.05, 0.12]] {
        let obstacles =
            vec![ball(small, [0.0, 0.0, small], 0.3, [0.0, 0.0]), ball(large, [0.4, 0.03, large], 0.9, [0.0, 0.0])];
        let mut simulation = beside(obstacles, 0.0, 2e-3);
        push_off(&mut simulation, 0, [2.0, 0.0, 0.0], [0.0, 3.0, 1.0]);
        let energy = simulation.energy();
        for _ in 0..200 {
            solved(simulation.advance(2e-3, &Still));
            assert!(simulation.min_gap() > -1e-4 && simulation.energy() < energy + 1e-9);
        }
        let [first, second] = [0, 1].map(|k| moved(&simulation, k));
        let momentum = first.twist.xy() * 0.3 + second.twist.xy() * 0.9;
        assert!((momentum - Vector2::new(0.6, 0.0)).norm() < 1e-9, "{momentum}");
        assert!(second.twist.x > 0.3 && second.out_of_plane.rise.abs() < 1e-6, "{second:?}");
        // Smooth: no moment on either.
        assert!(first.out_of_plane.roll == [0.0, 3.0] && second.out_of_plane.roll == [0.0, 0.0]);
    }
}

/// Off the edge of a step, down a ramp and over flat and tilted fields, as on the ground.
#[test]
fn it_rolls_on_all_that_is_ground() {
    let radius = 0.06;
    let step = Obstacle {
        height: Some(0.2),
        ..Obstacle::endless(Shape::Box { size: [1.0, 1.0], x: 0.0, y: 0.0, angle: 0.0 })
    };
    let tangent = 0.3_f64;
    let corner = |k: usize| {
        let (x, y) = ([4.0, 6.0][k % 2], [-0.5, 0.5][k / 2 % 2]);
        [x, y, if k < 4 { 0.0 } else { 0.4 + tangent * (x - 4.0) }]
    };
    let ramp =
        Obstacle { friction: 0.8, ..Obstacle::endless(Shape::Polyhedron { vertices: (0..8).map(corner).collect() }) };
    let field = |slope: f64, x: f64| {
        let height = (0..21).map(|i| vec![slope * 0.1 * f64::from(i); 11]).collect();
        let heights = Heights { height, spacing: 0.1, origin: [x, -0.5], friction: GroundFriction::Coefficient(0.8) };
        Obstacle::endless(Shape::HeightField(Arc::new(heights)))
    };
    let raised = radius * tangent.hypot(1.0);
    let obstacles = vec![
        step,
        ramp,
        field(0.0, 8.0),
        field(tangent, 12.0),
        ball(radius, [0.3, 0.0, 0.2 + radius], 0.2, [0.8, 0.0]),
        ball(radius, [5.5, 0.0, 0.4 + 1.5 * tangent + raised], 0.2, [0.8, 0.0]),
        ball(radius, [8.5, 0.03, radius], 0.2, [0.8, 0.0]),
        ball(radius, [13.5, 0.03, 1.5 * tangent + raised], 0.2, [0.8, 0.0]),
    ];
    let mut simulation = beside(obstacles, 0.0, 2e-3);
    push_off(&mut simulation, 0, [0.5, 0.0, 0.0], [0.0, 0.5 / radius, 0.0]);
    push_off(&mut simulation, 2, [0.5, 0.0, 0.0], [0.0, 0.5 / radius, 0.0]);
    solved(simulation.advance(0.35, &Still));
    let level = moved(&simulation, 0);
    assert!((level.pose.x - 0.475).abs() < 1e-6 && level.out_of_plane.rise.abs() < 1e-6, "{level:?}");
    let angle = tangent.atan();
    let acceleration = 5.0 / 7.0 * GRAVITY * angle.sin();
    let way = 0.5 * acceleration * 0.35 * 0.35;
    for (number, from) in [(1, 5.5), (3, 13.5)] {
        let down = from - moved(&simulation, number).pose.x;
        assert!((down - way * angle.cos()).abs() < 1e-4, "{number}: {down} {}", way * angle.cos());
    }
    let flat = moved(&simulation, 2);
    assert!((flat.pose.x - 8.675).abs() < 1e-6 && (flat.out_of_plane.height - radius).abs() < 1e-6, "{flat:?}");
    let energy = simulation.energy();
    solved(simulation.advance(0.6, &Still));
    let landed = moved(&simulation, 0);
    assert!((landed.out_of_plane.height - radius).abs() < 1e-4 && landed.pose.x > 0.6, "{landed:?}");
    assert!(simulation.energy() < energy && simulation.min_gap() > -2e-4, "{}", simulation.min_gap());
}

/// At the height of the plane, but above a hollow, nothing holds it.
#[test]
fn above_a_hollow_it_falls() {
    let heights = Heights {
        height: vec![vec![-0.2; 3]; 3],
        spacing: 0.5,
        origin: [0.0, 0.0],
        friction: GroundFriction::OfGround,
    };
    let hollow = Obstacle::endless(Shape::HeightField(Arc::new(heights)));
    let mut simulation = beside(vec![hollow, ball(0.05, [0.5, 0.4, 0.05], 0.2, [0.5, 0.02])], 0.0, 5e-3);
    solved(simulation.advance(0.5, &Still));
    let height = moved(&simulation, 0).out_of_plane.height;
    assert!((height + 0.15).abs() < 1e-5, "{height}");
}

/// A limp robot on ice runs into balls lower and higher than itself: horizontal momentum is kept, and the normal is that of
/// the capsule.
#[test]
fn a_robot_that_runs_into_a_ball_shares_its_momentum() {
    let link = links(5);
    for radius in [0.03, 0.08, 0.2] {
        let obstacles = vec![ball(radius, [-0.35, 0.01, radius], 1.5, [0.0, 0.0])];
        let scene = SceneConfig { obstacles, ..ground([0.0, 0.0]) };
        let mut simulation =
            lying(&link, &scene, &LIMP, &implicit(2e-3, 2), ([0.0, 0.0, 0.0], &[0.1, -0.1, 0.1, -0.1]));
        let mut state = simulation.state().clone();
        state.twist.fill(twist_of(Vector3::new(-0.5, 0.0, 0.0), Vector3::zeros()));
        simulation.place(&state);
        let momentum = |simulation: &SpatialSimulation| {
            let links = simulation.robot().links.iter().zip(&simulation.state().twist);
            let of_links: Vector2<f64> = links.map(|(link, twist)| Vector2::new(twist[0], twist[1]) * link.mass).sum();
            of_links + moved(simulation, 0).twist.xy() * 1.5
        };
        let (before, mut energy) = (momentum(&simulation), simulation.energy());
        for _ in 0..500 {
            solved(simulation.advance(2e-3, &Still));
            assert!(simulation.energy() < energy + 1e-6 && simulation.min_gap() > -1e-4, "{}", simulation.min_gap());
            energy = simulation.energy();
        }
        let after = momentum(&simulation);
        assert!(moved(&simulation, 0).twist.x < -0.1, "{radius}: {:?}", moved(&simulation, 0));
        assert!((after - before).norm() < 1e-9, "{radius}: {before} {after}");
    }
}

/// It stops at pegs, walls and boxes that can be pushed, which it meets at the height of its centre.
#[test]
fn it_meets_upright_bodies() {
    let obstacles = vec![
        Obstacle::endless(Shape::Segment { start: [1.0, -1.0], end: [1.0, 1.0] }),
        [0.1, 1.0, 3.0].into(),
        ball(0.1, [0.0, 0.0, 0.1], 1.0, [0.0, 0.0]),
        ball(0.1, [0.0, 3.0, 0.1], 1.0, [0.0, 0.0]),
        ball(0.1, [0.0, 5.0, 0.1], 1.0, [0.0, 0.0]),
        boxed([0.2, 0.2], [0.5, 5.0, 0.0], 1.0, 0.0),
    ];
    let mut simulation = beside(obstacles, 0.0, 5e-3);
    for number in 0..3 {
        push_off(&mut simulation, number, [2.0, 0.5, 0.0], [0.0; 3]);
    }
    push_off(&mut simulation, 2, [2.0, 0.0, 0.0], [0.0; 3]);
    solved(simulation.advance(0.6, &Still));
    assert!((moved(&simulation, 0).pose.xy() - Vector2::new(0.9, 0.3)).norm() < 1e-4);
    assert!(moved(&simulation, 1).pose.y > 3.3 && simulation.min_gap() > -1e-4);
    let pair = [2, 3].map(|k| moved(&simulation, k).twist.x);
    assert!((pair[0] - 1.0).abs() < 1e-6 && (pair[1] - 1.0).abs() < 1e-6, "{pair:?}");
}

fn scattered(random: &mut Random, count: usize) -> Vec<Obstacle> {
    let one = |k: usize, random: &mut Random| {
        let (radius, x) = (random.between(0.03, 0.12), 1.35 + 0.45 * (k % 3) as f64);
        let y = 0.45 * (k / 3) as f64 - 0.5;
        ball(radius, [x, y, radius], random.magnitude(0.1, 1.0), [random.between(0.0, 0.5), random.between(0.0, 0.05)])
    };
    (0..count).map(|k| one(k, random)).collect()
}

/// With none to six balls, pegs, boxes and a step around them, in two gaits.
#[test]
fn the_width_of_the_registers_and_the_neighbours_do_not_matter_among_balls() {
    let scene =
        Scene::new(&SceneConfig { slope: Slope { angle: 0.05, direction: 2.0 }, ..ground([0.1, 0.5]) }).unwrap();
    let controller = ControllerConfig { torque_limit: Some(10.0), ..ControllerConfig::default() };
    let system = SpatialSystem::new(Robot::new(&RobotConfig::default()).unwrap(), &scene, controller).unwrap();
    let robot = |k: usize| {
        let mut obstacles = scattered(&mut Random::new(7 + k as u64), (2 * k) % 7);
        if k.is_multiple_of(2) {
            obstacles.extend([[0.1, -0.9, 0.1].into(), boxed([0.2, 0.1], [1.5, 1.2, 0.3], 0.5, 0.2)]);
        }
        let gait = if k % 3 == 1 { sidewinding() } else { undulation() };
        in_gait(&system.robot, ObstacleGrid::of(&obstacles), START_FREE, gait)
    };
    require_alike_in_every_company(&system, robot);
}

#[test]
fn a_run_among_balls_continues_from_a_snapshot_and_allocates_nothing() {
    let balls = [ball(0.06, [1.0, 0.1, 0.06], 0.3, [0.3, 0.02]), ball(0.04, [0.95, -0.15, 0.04], 0.1, [0.3, 0.02])];
    a_run_continues_from_a_copy_or_snapshot_and_allocates_nothing::<Spatial>(&balls);
}

/// Balls of any size, a box and a step.
#[test]
fn random_motion_among_balls_leaves_no_overlap_and_no_stage_unsolved_unreported() {
    let mut random = Random::new(31);
    let mut pushing = 0;
    for _ in 0..3 {
        let mut obstacles: Vec<Obstacle> = (0..6)
            .map(|k| {
                let (radius, x) = (random.between(0.02, 0.12), -0.9 + 0.45 * f64::from(k));
                let frictions = [random.between(0.0, 0.6), random.between(0.0, 0.05)];
                ball(radius, [x, [0.1, 1.0][k as usize % 2], radius], random.between(0.05, 1.0), frictions)
            })
            .collect();
        let step = Shape::Box { size: [0.4, 0.3], x: 1.2, y: -0.5, angle: 0.2 };
        obstacles.push(boxed([0.15, 0.1], [1.3, 0.5, 0.3], 0.4, 0.2));
        obstacles.push(Obstacle { height: Some(0.08), ..Obstacle::endless(step) });
        pushing += random_motion::<Spatial>(&mut random, obstacles, 300, some_gait);
    }
    assert!(pushing > 9, "{pushing}");
}

#[test]
fn what_a_ball_cannot_be_is_refused() {
    let error = |obstacles: Vec<Obstacle>| {
        let scene = SceneConfig { obstacles, ..ground([0.2, 0.2]) };
        let pd = ControllerConfig::default();
        SpatialSimulation::new(&links(2), &scene, &pd, &ImplicitConfig::default()).map(|_| ()).unwrap_err().to_string()
    };
    let one = ball(0.1, [3.0, 0.0, 0.1], 1.0, [0.2, 0.02]);
    for (broken, field) in [
        (Obstacle { mass: None, ..one.clone() }, "mass"),
        (Obstacle { height: Some(0.1), ..one.clone() }, "height"),
        (Obstacle { friction: 0.1, ..one.clone() }, "friction"),
        (ball(0.1, [3.0, 0.0, 0.1], 1.0, [0.2, -0.1]), "rolling_friction"),
        (ball(-0.1, [3.0, 0.0, 0.1], 1.0, [0.2, 0.0]), "radius"),
        (ball(0.1, [3.0, 0.0, f64::NAN], 1.0, [0.2, 0.0]), "z"),
    ] {
        let message = error(vec![broken]);
        assert!(message.contains(&format!("obstacles[0].{field}")), "{message}");
    }
    let message = error(vec![ball(0.1, [3.0, 0.0, 0.05], 1.0, [0.2, 0.0])]);
    assert!(message.contains("scene.obstacles[0]") && message.contains("0.0500 m inside"), "{message}");
    let above = [ball(0.1, [3.0, 0.0, 0.1], 1.0, [0.2, 0.0]), ball(0.1, [3.0, 0.0, 0.25], 1.0, [0.2, 0.0])];
    let message = error(above.to_vec());
    assert!(message.contains("scene.obstacles[1]") && message.contains("0.0500 m inside"), "{message}");
}
