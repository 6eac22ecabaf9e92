//! What holds of obstacles that can be pushed in 3D: upright discs, boxes and polygons.

use nalgebra::{Vector2, Vector3};
use snake_core::control::ControllerConfig;
use snake_core::gait::{CardanGait, Gait, Wave};
use snake_core::obstacles::{Heights, Moved, Obstacle, ObstacleGrid, Shape};
use snake_core::planar;
use snake_core::robot::{Robot, RobotConfig};
use snake_core::scene::{START_FREE, Scene, SceneConfig};
use snake_core::simulation::{PlanarSimulation, SpatialSimulation};
use snake_core::slope::Slope;
use snake_core::solver::{CoupledStage, SolveStatus};
use snake_core::spatial::{
    CoulombNewton, Fallback, Newton, Pose, Spatial, SpatialSystem, Stage, StageContact, StageLink, StagePair,
    StageSolution, Twist, Wrench, certify, orientation_of, twist_of,
};
use snake_core::stepping::ImplicitConfig;
use snake_test_support::flat::{Still, lying};
use snake_test_support::planar::{LIMP, Random, build, ground, implicit as planar_implicit, links};
use snake_test_support::pushing::{
    GRAVITY, a_row_wakes_in_turn, a_run_continues_from_a_copy_or_snapshot_and_allocates_nothing, beside, boxed, disc,
    movable, moved, push_off, random_motion, require_alike_in_every_company, solved, sprung,
    what_sleeps_changes_nothing, work_is_energy_and_dissipation,
};
use snake_test_support::spatial::{implicit, in_gait, sidewinding, undulation};

use super::stage::moving;

/// v^2 / (2 mu g) and omega^2 I / (2 mu m g lever), and then exact rest.
#[test]
fn what_slides_or_spins_freely_stops_after_its_braking_way() {
    let (mass, friction) = (2.0, 0.3);
    for (step, order) in [(2e-3, 1), (1e-2, 2), (2.5e-2, 2)] {
        let obstacles = vec![disc([0.1, 0.0, 0.0], mass, friction), boxed([0.3, 0.2], [0.0, 2.0, 0.4], mass, friction)];
        let mut simulation = beside::<Spatial>(obstacles, step, order);
        push_off(&mut simulation, &[Vector3::new(0.42, 0.56, 0.0), Vector3::new(0.0, 0.0, 5.0)]);
        solved(simulation.advance(1.0, &Still));
        let (way, turn) = (moved(&simulation, 0).pose, moved(&simulation, 1).pose.z);
        let exact = 0.49 / (2.0 * friction * GRAVITY);
        let (inertia, lever) = simulation.movables().nth(1).map(|(one, _)| (one.link.inertia, one.spin_lever)).unwrap();
        let exact_turn = 25.0 * inertia / (2.0 * friction * mass * GRAVITY * lever);
        let allowed = if order == 1 { 6e-3 } else { 2e-3 };
        assert!(
            (way.xy() - Vector2::new(0.6, 0.8) * exact).norm() < allowed * exact + 0.4 * step * f64::from(2 - order)
        );
        assert!(
            (turn - exact_turn).abs() < allowed * exact_turn + 3.0 * step * f64::from(2 - order),
            "{turn} {exact_turn}"
        );
        let before = simulation.state().movables.clone();
        assert!(before.iter().all(|moved| moved.twist.norm() < 1e-12), "{before:?}");
        simulation.advance(1.0, &Still);
        assert!(simulation.state().movables.iter().zip(&before).all(|(a, b)| (a.pose - b.pose).norm() < 1e-12));
    }
}

/// Down a slope and away from the robot: sliding and spinning together, springs and stops, walls, pegs, impacts on and off the
/// centre.
#[test]
fn without_links_near_they_move_as_in_the_plane() {
    let wall = Obstacle::endless(Shape::Segment { start: [-1.5, -3.0], end: [-1.5, 3.0] });
    let rough =
        Obstacle { friction: 0.4, ..Obstacle::endless(Shape::Box { size: [0.2, 1.0], x: -1.4, y: 8.0, angle: 0.1 }) };
    let obstacles = vec![
        wall,
        [0.1, -0.8, 1.05].into(),
        rough,
        boxed([0.3, 0.2], [0.0, 0.0, 0.4], 1.0, 0.1),
        boxed([0.2, 0.2], [-0.8, 0.1, 0.1], 2.0, 0.4),
        disc([0.12, 0.0, 1.0], 0.5, 0.05),
        sprung([0.08, 0.0, 2.0], 1.0, 60.0, 3.0, None),
        sprung([0.08, 0.0, 2.5], 1.0, 60.0, 3.0, Some(0.02)),
        movable(Shape::Polygon { vertices: vec![[0.0, 3.0], [0.3, 3.0], [0.3, 3.2]] }, 1.0, 0.0),
        boxed([0.3, 0.2], [-1.1, 8.0, 0.4], 1.0, 0.1),
    ];
    let spins = [3.0, 0.0, 1.0, 0.0, 0.0, -2.0, 0.0].map(|spin| Vector3::new(-0.3, 0.1, spin));
    let scene = SceneConfig { obstacles, slope: Slope { angle: 0.3, direction: 0.0 }, ..ground([0.9, 0.9]) };
    let start = ([0.0, -6.0, 0.0], &[0.0][..]);
    let mut spatial: SpatialSimulation =
        lying(&links(2), &scene, &ControllerConfig::default(), &implicit(1e-3, 2), start);
    push_off(&mut spatial, &spins);
    let mut plane: PlanarSimulation = build(&links(2), &scene, &ControllerConfig::default(), &planar_implicit(1e-3, 2));
    plane.place_chain(0.0, -6.0, 0.0, &[0.0]);
    let mut state = plane.state().clone();
    state.movables.clone_from(&spatial.state().movables);
    plane.place(&state);
    let mut farthest: f64 = 0.0;
    for _ in 0..60 {
        solved(spatial.advance(0.02, &Still));
        solved(plane.advance(0.02, &Still));
        for (ours, theirs) in spatial.state().movables.iter().zip(&plane.state().movables) {
            farthest = farthest.max((ours.pose - theirs.pose).amax());
        }
        assert!((spatial.min_gap() - plane.min_gap()).abs() < 1e-3 || spatial.min_gap().abs() < 1e-4);
    }
    let way = spatial
        .state()
        .movables
        .iter()
        .zip(spatial.movables())
        .map(|(moved, (one, _))| one.deflection(&moved.pose.xy()).norm());
    println!("{farthest:.1e} from the plane after ways of {:.2?}", way.collect::<Vec<_>>());
    assert!(farthest < 2e-3, "{farthest}");
}

/// Planar momentum of a robot and of what it pushes.
fn momentum(simulation: &SpatialSimulation) -> (Vector2<f64>, f64) {
    let (mut linear, mut angular) = (Vector2::zeros(), 0.0);
    let mut add = |mass: f64, place: Vector2<f64>, velocity: Vector2<f64>, spin: f64| {
        linear += velocity * mass;
        angular += mass * place.perp(&velocity) + spin;
    };
    let state = simulation.state();
    for ((link, pose), twist) in simulation.robot().links.iter().zip(&state.pose).zip(&state.twist) {
        let inertia = Vector3::new(link.inertia, link.inertia, link.roll_inertia);
        let spin = pose.orientation * inertia.component_mul(&snake_core::spatial::turning(twist));
        add(link.mass, pose.position.xy(), Vector2::new(twist[0], twist[1]), spin.z);
    }
    for (one, Moved { pose, twist, .. }) in simulation.movables() {
        add(one.link.mass, pose.xy(), twist.xy(), one.link.inertia * twist.z);
    }
    (linear, angular)
}

/// A limp robot on ice runs into things on ice: the momentum of all is kept, no energy comes from nowhere, and, lying flat, it
/// moves as in the plane.
#[test]
fn a_robot_that_runs_into_things_shares_its_momentum_and_lies_as_in_the_plane() {
    let things = [
        vec![disc([0.12, -0.4, 0.03], 1.5, 0.0)],
        vec![boxed([0.2, 0.3], [-0.4, 0.06, 0.3], 1.5, 0.0)],
        vec![boxed([0.2, 0.2], [-0.36, 0.02, 0.0], 0.5, 0.0), boxed([0.1, 0.4], [-0.6, 0.1, 0.1], 1.0, 0.0)],
    ];
    for obstacles in things {
        let scene = SceneConfig { obstacles, ..ground([0.0, 0.0]) };
        let yaws = [0.1, -0.1, 0.1, -0.1];
        let mut ours = lying(&links(5), &scene, &LIMP, &implicit(2e-3, 2), ([0.0, 0.0, 0.0], &yaws));
        let mut state = ours.state().clone();
        state.twist.fill(twist_of(Vector3::new(-0.5, 0.0, 0.0), Vector3::zeros()));
        ours.place(&state);
        let mut plane: PlanarSimulation = build(&links(5), &scene, &LIMP, &planar_implicit(2e-3, 2));
        plane.place_chain(0.0, 0.0, 0.0, &yaws);
        let mut state = plane.state().clone();
        state.twist.fill(planar::Twist::new(-0.5, 0.0, 0.0));
        plane.place(&state);
        let (before, energy) = (momentum(&ours), ours.energy());
        let (mut least, mut farthest) = (energy, 0.0_f64);
        for _ in 0..250 {
            solved(ours.advance(2e-3, &Still));
            solved(plane.advance(2e-3, &Still));
            assert!(ours.energy() < least + 1e-6 * energy, "{} after {least}", ours.energy());
            least = least.min(ours.energy());
            assert!(ours.min_gap() > -1e-4, "{}", ours.min_gap());
            let here = ours.state().pose.iter().map(|pose| pose.position.xy());
            let there = plane.state().pose.iter().map(|pose| pose.xy());
            farthest = here.zip(there).map(|(a, b)| (a - b).norm()).fold(farthest, f64::max);
            let bodies = ours.state().movables.iter().zip(&plane.state().movables);
            farthest = bodies.map(|(a, b)| (a.pose - b.pose).norm()).fold(farthest, f64::max);
        }
        let after = momentum(&ours);
        println!("{farthest:.1e} m from the plane, {least} J of {energy} J");
        assert!(moved(&ours, 0).twist.x < -0.1 && least < 0.98 * energy);
        assert!((after.0 - before.0).norm() < 1e-9, "{} {}", after.0, before.0);
        assert!((after.1 - before.1).abs() < 1e-4, "{} {}", after.1, before.1);
        assert!(farthest < 1e-3, "{farthest} m from the plane");
    }
}

/// A raised link pushes with its end, where it is, and turns a box about the vertical alone.
#[test]
fn a_raised_link_pushes_horizontally() {
    let scene = SceneConfig { obstacles: vec![boxed([0.2, 0.3], [0.45, 0.1, 0.0], 1.0, 0.0)], ..ground([0.0, 0.0]) };
    let robot = RobotConfig { gravity: 1e-9, ..links(2) };
    let mut simulation = SpatialSimulation::new(&robot, &scene, &LIMP, &implicit(1e-3, 2)).unwrap();
    let head = Pose { position: Vector3::new(0.0, 0.0, 0.6), orientation: orientation_of(0.0, 0.6, 0.3) };
    simulation.place_chain(head, &[Vector2::new(0.2, -0.1)]);
    let mut state = simulation.state().clone();
    for (pose, twist) in state.pose.iter().zip(&mut state.twist) {
        *twist = twist_of(Vector3::new(0.5, 0.0, 0.0), pose.orientation.inverse() * Vector3::zeros());
    }
    simulation.place(&state);
    let (before, energy) = (momentum(&simulation), simulation.energy());
    solved(simulation.advance(0.6, &Still));
    let (after, Moved { twist, .. }) = (momentum(&simulation), moved(&simulation, 0));
    assert!(twist.x > 0.1 && twist.z.abs() > 0.1, "{twist}");
    assert!((after.0 - before.0).norm() < 1e-6, "{} {}", after.0, before.0);
    assert!((after.1 - before.1).abs() < 1e-4, "about the vertical: {} {}", after.1, before.1);
    let rising: f64 = simulation.state().twist.iter().map(|twist| twist[2]).sum();
    assert!(rising.abs() < 1e-5, "nothing pushes up: {rising}");
    assert!(simulation.energy() < energy && simulation.min_gap() > -1e-4);
}

/// Things apart from each other.
fn cluttered(random: &mut Random, count: usize) -> Vec<Obstacle> {
    let mut all: Vec<([f64; 3], Obstacle)> = Vec::new();
    while all.len() < count {
        let place = [random.between(0.03, 0.12), random.between(-1.2, 1.6), random.between(0.2, 1.0)];
        let (mass, friction) = (random.magnitude(0.05, 5.0), random.between(0.1, 0.6));
        let one = match all.len() % 3 {
            0 => disc(place, mass, friction),
            1 => boxed([place[0]; 2], [place[1], place[2], random.between(0.0, 3.0)], mass, friction),
            _ => sprung(place, mass, random.magnitude(50.0, 5000.0), 1.0, Some(0.03)),
        };
        let gap = |other: &[f64; 3]| (place[1] - other[1]).hypot(place[2] - other[2]) - other[0] - place[0];
        if all.iter().all(|(other, _)| gap(other) > 0.0) {
            all.push((place, one));
        }
    }
    all.into_iter().map(|(_, one)| one).collect()
}

/// Where friction exceeds its tangent nothing creeps; what slides takes what it runs into along.
#[test]
fn a_slope_holds_what_sleeps_and_wakes_what_is_run_into() {
    let (held, slides) = (0.4, 0.1);
    let obstacles = vec![
        boxed([0.2, 0.2], [0.0, 0.0, 0.3], 1.0, held),
        boxed([0.2, 0.2], [0.8, 2.0, 0.0], 1.0, slides),
        boxed([0.2, 0.2], [0.2, 2.0, 0.0], 1.0, held),
    ];
    let scene = SceneConfig { obstacles, slope: Slope { angle: 0.3, direction: 0.0 }, ..ground([0.9, 0.9]) };
    let start = ([0.0, -6.0, 0.0], &[0.0][..]);
    let mut simulation: SpatialSimulation =
        lying(&links(2), &scene, &ControllerConfig::default(), &implicit(5e-3, 2), start);
    let acceleration = GRAVITY * (0.3_f64.sin() - slides * 0.3_f64.cos());
    solved(simulation.advance(0.6, &Still));
    let way = 0.8 - moved(&simulation, 1).pose.x;
    assert!((way - 0.5 * acceleration * 0.36).abs() < 1e-5, "{way}");
    assert!((moved(&simulation, 2).pose - Vector3::new(0.2, 2.0, 0.0)).norm() < 1e-9);
    solved(simulation.advance(0.4, &Still));
    assert!(moved(&simulation, 2).pose.x < 0.1 && simulation.min_gap() > -1e-4, "{}", moved(&simulation, 2).pose);
    assert!(moved(&simulation, 0).pose == Vector3::zeros() && moved(&simulation, 0).twist == Vector3::zeros());
}

/// With none to seven things and some pegs around them, in two gaits, on level ground and on a slope.
#[test]
fn the_width_of_the_registers_and_the_neighbours_do_not_matter_among_things() {
    for angle in [0.0, 0.15] {
        neighbours_do_not_matter(&SceneConfig { slope: Slope { angle, direction: 1.0 }, ..ground([0.1, 0.5]) });
    }
}

fn neighbours_do_not_matter(ground: &SceneConfig) {
    let scene = Scene::new(ground).unwrap();
    let controller = ControllerConfig { torque_limit: Some(10.0), ..ControllerConfig::default() };
    let system = SpatialSystem::new(Robot::new(&RobotConfig::default()).unwrap(), &scene, controller).unwrap();
    let robot = |k: usize| {
        let mut obstacles = cluttered(&mut Random::new(7 + k as u64), (3 * k) % 8);
        for one in &mut obstacles {
            match &mut one.shape {
                Shape::Circle(peg) => peg.y -= 0.6,
                Shape::Box { y, .. } => *y -= 0.6,
                _ => unreachable!("a disc or a box"),
            }
        }
        if k.is_multiple_of(2) {
            obstacles.push([0.1, -0.9, 0.1].into());
        }
        let gait = if k % 3 == 1 { sidewinding() } else { undulation() };
        in_gait(&system.robot, ObstacleGrid::of(&obstacles), START_FREE, gait)
    };
    require_alike_in_every_company(&system, robot);
}

#[test]
fn work_of_a_robot_among_things_is_energy_and_dissipation() {
    let obstacles = [
        disc([0.06, 1.0, 0.1], 0.3, 0.3),
        boxed([0.12, 0.1], [0.9, -0.18, 0.3], 0.3, 0.3),
        sprung([0.06, 0.4, 0.25], 0.3, 200.0, 2.0, Some(0.04)),
        disc([0.06, -3.0, 0.0], 0.3, 0.3),
    ];
    for step in [1e-2, 2.5e-3] {
        let ways = work_is_energy_and_dissipation::<Spatial>(&obstacles, step, 300);
        assert!(ways.iter().any(|way| way.xy().norm() > 0.02), "{ways:?}");
    }
}

#[test]
fn what_sleeps_among_things_changes_nothing() {
    let near = [disc([0.06, 1.0, 0.1], 0.3, 0.3), boxed([0.12, 0.1], [0.9, -0.18, 0.3], 0.3, 0.3)];
    let far = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11].map(|k| match f64::from(k) {
        y if k % 3 == 0 => disc([0.06, 0.3 * y, 3.0], 0.02, 0.3),
        y if k % 3 == 1 => boxed([0.2, 0.1], [0.3 * y, 3.0, y], 5.0, 0.0),
        y => sprung([0.06, 0.3 * y, 3.0], 0.1, 200.0, 2.0, Some(0.04)),
    });
    what_sleeps_changes_nothing::<Spatial>(&near, &far);
}

#[test]
fn a_row_of_discs_wakes_in_turn() {
    a_row_wakes_in_turn::<Spatial>();
}

#[test]
fn a_run_among_things_continues_from_a_snapshot_and_allocates_nothing() {
    let yields = sprung([0.06, 0.9, -0.15], 0.3, 100.0, 2.0, Some(0.02));
    let crate_ = boxed([0.12, 0.1], [1.0, 0.1, 0.2], 0.3, 0.3);
    a_run_continues_from_a_copy_or_snapshot_and_allocates_nothing::<Spatial>(&[crate_, yields]);
}

#[test]
fn random_motion_among_things_leaves_no_overlap_and_no_stage_unsolved_unreported() {
    let mut random = Random::new(20);
    let mut pushing = 0;
    for _ in 0..3 {
        let obstacles = cluttered(&mut random, 6);
        pushing += random_motion::<Spatial>(&mut random, obstacles, 300, some_gait);
    }
    assert!(pushing > 15, "{pushing}");
}

/// One that lifts links, too.
pub fn some_gait(random: &mut Random) -> CardanGait {
    let mut wave = |amplitude: f64| {
        let omega = random.between(1.0, 4.0);
        Gait::Wave(Wave { amplitude, omega, gamma: random.between(-0.3, 0.3), ..Wave::default() })
    };
    CardanGait { yaw: wave(0.6), pitch: wave(0.15) }
}

#[test]
fn what_would_be_no_level_ground_and_no_upright_body_is_refused() {
    let error = |obstacles: Vec<Obstacle>| {
        let scene = SceneConfig { obstacles, ..ground([0.2, 0.2]) };
        let pd = ControllerConfig::default();
        SpatialSimulation::new(&links(2), &scene, &pd, &ImplicitConfig::default()).map(|_| ()).unwrap_err().to_string()
    };
    let crate_ = boxed([0.2, 0.2], [3.0, 0.0, 0.0], 1.0, 0.2);
    let friction = snake_core::obstacles::GroundFriction::OfGround;
    let heights = Heights { height: vec![vec![0.0; 3]; 3], spacing: 0.1, origin: [5.0, 5.0], friction };
    let cylinder = Shape::Cylinder { start: [0.0, 9.0, 0.2], end: [1.0, 9.0, 0.2], radius: 0.1, inside: false };
    for shape in [Shape::HeightField(heights.into()), cylinder] {
        let message = error(vec![crate_.clone(), Obstacle::endless(shape)]);
        assert!(message.contains("scene.obstacles[1]") && message.contains("vertical"), "{message}");
    }
    let message = error(vec![Obstacle { height: Some(0.1), ..crate_.clone() }]);
    assert!(message.contains("obstacles[0].height"), "{message}");
    let message = error(vec![Obstacle { friction: 0.1, ..crate_ }]);
    assert!(message.contains("obstacles[0].friction"), "{message}");
}

/// A chain that meets upright bodies, which meet each other and a wall.
fn stage_with_bodies(random: &mut Random) -> (Stage, StageSolution) {
    let mut stage = moving(random, 6);
    stage.contacts.clear();
    stage.obstacle_friction.clear();
    for k in 0..3 {
        let (mass, inertia) = (random.magnitude(0.2, 3.0), random.magnitude(0.002, 0.02));
        let mut vector = |size: f64| Vector3::from_fn(|_, _| random.between(-size, size));
        let mut body = StageLink { mass, inertia, roll_inertia: inertia, cg_offset: 0.0, ..stage.links[0] };
        body.axes = [Vector3::x(), Vector3::y(), Vector3::z()];
        let reference = vector(0.3).component_mul(&Vector3::new(1.0, 1.0, 10.0));
        body.momentum = body.momentum_of(&upright(reference));
        stage.links.push(body);
        // Sliding, close to sticking, and on ice.
        let force = [0.3, 60.0, 0.0][k] * mass * GRAVITY * stage.coefficient;
        stage.surfaces.push(Vector3::new(force, force, 0.06 * force));
        let normal = vector(1.0).xy().normalize();
        let [near, far] = [0.1, -0.07].map(|lever| Vector3::new(normal.x, normal.y, lever));
        let on_link = Wrench { linear: normal.push(0.0), angular: vector(0.03) };
        let offset = -0.3 + 0.35 * k as f64;
        stage.pairs.push(StagePair { links: [2 * k, 6 + k], direction: [on_link, upright(-near)], offset });
        stage.contacts.push(StageContact { link: 6 + k, direction: upright(far), offset: offset + 0.1 });
    }
    let normal = Vector3::new(0.6, 0.8, 0.05);
    stage.pairs.push(StagePair { links: [6, 7], direction: [upright(normal), upright(-normal)], offset: -0.2 });
    let mut blank = StageSolution::new(6).among(3);
    blank.contact.resize(stage.contacts.len(), 0.0);
    blank.pair.resize(stage.pairs.len(), 0.0);
    (stage, blank)
}

fn upright(planar: Vector3<f64>) -> Twist {
    Twist { linear: planar.xy().push(0.0), angular: Vector3::z() * planar.z }
}

/// By Newton's method in lanes, by the one that knows Coulomb's law, and by the fallback; and no other impulse of friction
/// under a body passes.
#[test]
fn all_solvers_find_the_velocities_of_a_stage_with_bodies() {
    let mut random = Random::new(41);
    let (mut sliding, mut worst) = (0, 0.0_f64);
    for trial in 0..40 {
        let (stage, blank) = stage_with_bodies(&mut random);
        let (mut fast, mut slow, mut hard) = (blank.clone(), blank.clone(), blank);
        assert!(Newton::new(9).solve_one(&stage, &mut fast, 1e-9, 500).converged, "trial {trial}");
        assert!(CoulombNewton::new(9).continuation(&stage, &mut slow, 1e-9, u32::MAX).1, "trial {trial}");
        let (_, status) = Fallback::new(9).solve_hard(&stage, &mut hard, 1e-8, u32::MAX);
        assert!(status == SolveStatus::Solved, "trial {trial}: {status:?}");
        for (name, solution) in [("lanes", &fast), ("coupled", &slow), ("fallback", &hard)] {
            let certificate = certify(&stage, solution);
            assert!(certificate.residual() < 1e-6, "trial {trial}, {name}: {certificate:?}");
            for (a, b) in solution.twist.iter().zip(&slow.twist) {
                worst = worst.max((a.linear - b.linear).amax().max(0.1 * (a.angular - b.angular).amax()));
            }
        }
        for (k, axes) in stage.surfaces.iter().enumerate().take(2) {
            let held = fast.surface[k].component_div(axes).norm();
            sliding += u32::from(held > 1.0 - 1e-6);
            for axis in 0..3 {
                let mut wrong = fast.clone();
                wrong.surface[k][axis] += 0.1 * axes[axis];
                assert!(certify(&stage, &wrong).residual() > 1e-4, "trial {trial}");
            }
        }
        let body = &fast.twist[6];
        assert!(body.linear.z == 0.0 && body.angular.xy() == Vector2::zeros(), "upright");
    }
    println!("{sliding} of 80 bodies slide, {worst:e} m/s apart");
    assert!(worst < 1e-6 && (10..80).contains(&sliding), "{worst:e} {sliding}");
}
