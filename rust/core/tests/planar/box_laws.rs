//! What holds of convex polygons that can be pushed.

use nalgebra::{Rotation2, Vector2, Vector3};
use snake_core::contact::{PlacedLink, link_obstacle_contact, link_pair_contact, link_pair_gap, movable_contacts};
use snake_core::gait::Wave;
use snake_core::obstacles::{Movable, Moved, Node, Obstacle, ObstacleGrid, Shape};
use snake_core::planar::{
    Fallback, Heading, InteriorPoint, Newton, Planar, Pose, Scripted, Stage, StageContact, StageLink,
    StageObstacleFriction, StagePair, StageSolution, Twist, certify,
};
use snake_core::robot::Robot;
use snake_core::scene::START_FREE;
use snake_core::simulation::PlanarSimulation;
use snake_core::solver::SolveStatus;
use snake_test_support::flat::Still;
use snake_test_support::planar::{Random, links, posture};
use snake_test_support::planar_stage::{self as dense, Kind};
use snake_test_support::pushing::{
    GRAVITY, a_run_continues_from_a_copy_or_snapshot_and_allocates_nothing, beside, boxed, disc, movable, moved,
    push_off, random_motion, require_alike_in_every_company, solved, work_is_energy_and_dissipation,
};

use crate::movable_laws::{some_wave, system_among_bodies};

fn polygon(vertices: &[[f64; 2]], mass: f64, ground_friction: f64) -> Obstacle {
    movable(Shape::Polygon { vertices: vertices.to_vec() }, mass, ground_friction)
}

fn body(simulation: &PlanarSimulation, body: usize) -> Movable {
    simulation.movables().nth(body).unwrap().0.clone()
}

/// A box has the mass, the moment of inertia and the lever of the textbook; it brakes over v^2 / (2 mu g) and over
/// omega^2 I / (2 mu m g lever), and then rests exactly.
#[test]
fn a_box_brakes_by_the_friction_of_the_ground() {
    let (size, mass, friction) = ([0.3, 0.2], 2.0, 0.3);
    let mut simulation = beside::<Planar>(vec![boxed(size, [0.4, -0.1, 0.6], mass, friction)], 1e-2, 2);
    let Movable { link, start, spin_lever, .. } = body(&simulation, 0);
    assert!((link.inertia - mass * (0.3 * 0.3 + 0.2 * 0.2) / 12.0).abs() < 1e-15 && link.mass == mass);
    assert!((Vector2::from(start) - Vector2::new(0.4, -0.1)).norm() < 1e-15);
    push_off(&mut simulation, &[Twist::new(0.42, 0.56, 0.0)]);
    solved(simulation.advance(1.0, &Still));
    let way = moved(&simulation, 0).pose - Pose::new(0.4, -0.1, 0.0);
    let exact = 0.7 * 0.7 / (2.0 * friction * GRAVITY);
    assert!((way.xy() - Vector2::new(0.6, 0.8) * exact).norm() < 2e-3 * exact && way.z.abs() < 1e-12, "{way}");
    push_off(&mut simulation, &[Twist::new(0.0, 0.0, 5.0)]);
    solved(simulation.advance(1.0, &Still));
    let Moved { pose, twist, .. } = moved(&simulation, 0);
    let exact = 25.0 * link.inertia / (2.0 * friction * mass * GRAVITY * spin_lever);
    assert!((pose.z - exact).abs() < 2e-3 * exact && twist.norm() < 1e-12, "{} of {exact} rad, {twist}", pose.z);
    solved(simulation.advance(1.0, &Still));
    assert!((moved(&simulation, 0).pose - pose).norm() < 1e-12);
}

/// A box that slides and turns follows the ellipsoid's equations, integrated in small steps, and not those of separate bounds
/// on force and moment, which brake it sooner.
#[test]
fn force_and_moment_of_the_ground_are_coupled_by_the_limit_surface() {
    let (mass, friction, start) = (1.5, 0.25, Twist::new(0.9, 0.2, 6.0));
    let mut simulation = beside::<Planar>(vec![boxed([0.4, 0.1], [0.0; 3], mass, friction)], 1e-3, 2);
    let Movable { link, spin_lever, .. } = body(&simulation, 0);
    push_off(&mut simulation, &[start]);
    let force = friction * mass * GRAVITY;
    let follow = |coupled: bool| {
        let (mut u, mut q, h) = (start, Pose::zeros(), 1e-5);
        for _ in 0..30_000 {
            let turning = spin_lever * u.z;
            let speeds = if coupled { [u.xy().push(turning).norm(); 2] } else { [u.xy().norm(), turning.abs()] };
            u -= Twist::new(
                h * force / mass * u.x / speeds[0],
                h * force / mass * u.y / speeds[0],
                h * force * spin_lever / link.inertia * turning / speeds[1],
            );
            q += u * h;
        }
        q
    };
    solved(simulation.advance(0.3, &Still));
    let Moved { pose, .. } = moved(&simulation, 0);
    let [coupled, separate] = [follow(true), follow(false)];
    assert!((pose - coupled).norm() < 1e-4, "{pose} {coupled}");
    assert!((pose - separate).norm() > 0.05, "{pose} {separate}");
}

/// An impact off the centre is inelastic at the point of contact: p = v / (1/m + 1/M + e^2 / I), and the box turns with p e / I.
#[test]
fn a_box_that_is_hit_off_its_centre_turns_as_the_impact_says() {
    let (mass, heavy, speed) = (0.5, 2.0, 1.0);
    for (arm, step, order) in [(0.0, 1e-3, 2), (0.1, 1e-3, 2), (-0.14, 1e-3, 1), (0.1, 1e-2, 2)] {
        for angle in [0.0, 0.7] {
            let turn = Rotation2::new(angle);
            let at: Vector2<f64> = turn * Vector2::new(-0.3, arm);
            let obstacles = vec![disc([0.05, at.x, at.y], mass, 0.0), boxed([0.2, 0.4], [0.0, 0.0, angle], heavy, 0.0)];
            let mut simulation = beside::<Planar>(obstacles, step, order);
            let velocity = turn * Vector2::new(speed, 0.0);
            push_off(&mut simulation, &[velocity.push(0.0), Twist::zeros()]);
            solved(simulation.advance(0.16, &Still));
            let inertia = body(&simulation, 1).link.inertia;
            let impulse = speed / (1.0 / mass + 1.0 / heavy + arm * arm / inertia);
            let [hitting, hit] = [0, 1].map(|k| moved(&simulation, k).twist);
            let [slower, faster] = [hitting, hit].map(|twist| turn.inverse() * twist.xy());
            let exact = [speed - impulse / mass, impulse / heavy, -impulse * arm / inertia];
            let error = [slower.x - exact[0], faster.x - exact[1], hit.z - exact[2]];
            // Within the 10 ms after the impact the box turns by up to 0.04 rad, and the normal with it.
            let allowed = [3e-3, 3e-3, 0.03 * exact[2].abs() + 1e-9];
            assert!(
                error.iter().zip(allowed).all(|(e, most)| e.abs() < most),
                "arm {arm}, {angle}: {error:?}, {exact:?}"
            );
            assert!((velocity * mass - hitting.xy() * mass - hit.xy() * heavy).norm() < 1e-9, "momentum");
            assert!(hitting.z == 0.0, "frictionless contacts turn no disc");
        }
    }
}

/// Flat against a wall a box stops on two corners, and keeps its motion along it; on a corner it turns until it lies flat.
#[test]
fn a_box_stays_outside_walls_and_pegs() {
    let wall = Obstacle::endless(Shape::Segment { start: [0.5, -3.0], end: [0.5, 3.0] });
    let solid = Obstacle::endless(Shape::Box { size: [0.2, 6.0], x: 0.6, y: 0.0, angle: 0.0 });
    for (wall, order) in [(&wall, 2), (&wall, 1), (&solid, 2)] {
        let peg = [0.1, -0.6, 0.0].into();
        let mut simulation =
            beside::<Planar>(vec![wall.clone(), boxed([0.2, 0.3], [0.0; 3], 1.0, 0.0), peg], 1e-2, order);
        push_off(&mut simulation, &[Twist::new(0.8, 0.6, 0.0)]);
        solved(simulation.advance(1.0, &Still));
        let Moved { pose, twist, .. } = moved(&simulation, 0);
        assert!((pose - Pose::new(0.4, 0.6, 0.0)).norm() < 1e-6, "{pose}");
        assert!((twist - Twist::new(0.0, 0.6, 0.0)).norm() < 1e-9, "{twist}");
        let mut state = simulation.state().clone();
        state.movables[0] = Moved::flat(Pose::zeros(), Twist::new(-0.8, 0.0, 0.0));
        simulation.place(&state);
        solved(simulation.advance(1.0, &Still));
        let Moved { pose, twist, .. } = moved(&simulation, 0);
        assert!((pose - Pose::new(-0.4, 0.0, 0.0)).norm() < 1e-6 && twist.norm() < 1e-9, "{pose} {twist}");
        state.movables[0] = Moved::flat(Pose::new(0.2, 0.0, 0.3), Twist::new(1.0, 0.0, 0.0));
        simulation.place(&state);
        for _ in 0..30 {
            solved(simulation.advance(0.05, &Still));
            assert!(simulation.min_gap() > -1e-4, "{}", simulation.min_gap());
        }
    }
}

/// The second of two boxes in a row takes half the momentum of both; friction of the ground then stops them together.
#[test]
fn two_boxes_in_a_row_move_on_together() {
    let row = |friction, off| {
        vec![boxed([0.2, 0.3], [0.0; 3], 1.0, friction), boxed([0.2, 0.1], [0.5, off, 0.0], 3.0, friction)]
    };
    let mut simulation = beside::<Planar>(row(0.0, 0.02), 2e-3, 2);
    push_off(&mut simulation, &[Twist::new(1.0, 0.0, 0.0)]);
    solved(simulation.advance(0.32, &Still));
    let [first, second] = [0, 1].map(|k| moved(&simulation, k));
    // 2 cm off each other they stay flat against each other and turn: v_1 - v_2 = 0.02 omega, (I_1 + I_2) omega = 0.02 p.
    let inertia: f64 = [0, 1].map(|k| body(&simulation, k).link.inertia).iter().sum();
    let impulse = 1.0 / (4.0 / 3.0 + 0.02 * 0.02 / inertia);
    let rate = 0.02 * impulse / inertia;
    for (twist, exact) in [(first.twist, 1.0 - impulse), (second.twist, impulse / 3.0)] {
        assert!((twist.x - exact).abs() < 2e-3 && (twist.z - rate).abs() < 5e-3, "{twist}, {exact} {rate}");
    }
    let mut simulation = beside::<Planar>(row(0.1, 0.0), 2e-3, 2);
    push_off(&mut simulation, &[Twist::new(1.0, 0.0, 0.0)]);
    solved(simulation.advance(2.0, &Still));
    let [first, second] = [0, 1].map(|k| moved(&simulation, k));
    let braking = 2.0 * 0.1 * GRAVITY;
    let way = 0.3 + (1.0 - braking * 0.3) / 16.0 / braking;
    assert!((first.pose.x - way).abs() < 2e-3 && (second.pose.x - way - 0.2).abs() < 2e-3, "{} of {way}", first.pose.x);
    assert!(first.twist.norm() < 1e-12 && second.twist.norm() < 1e-12);
}

/// Equal boxes whose sides are flush: every vertex meets another one, and is on two edges at once.
#[test]
fn equal_boxes_in_line_do_not_pass_each_other() {
    for angle in [0.0, 0.3] {
        let along = Vector2::new(f64::cos(angle), f64::sin(angle));
        let row = [0.0, 0.5, 0.7].map(|at| boxed([0.2; 2], [at * along.x, at * along.y, angle], 1.0, 0.0));
        let mut simulation = beside::<Planar>(row.to_vec(), 5e-3, 2);
        push_off(&mut simulation, &[Twist::new(along.x, along.y, 0.0)]);
        solved(simulation.advance(1.0, &Still));
        for (k, at) in [(0, 0.0), (1, 0.2), (2, 0.4)] {
            let Moved { pose, twist, .. } = moved(&simulation, k);
            // 0.3 m until they meet, then all at a third of the speed.
            let way = 0.3 + 0.7 / 3.0 + at;
            assert!((twist.xy() - along / 3.0).norm() < 1e-3 && twist.z.abs() < 1e-2, "{k}: {twist}");
            assert!((pose.xy() - along * way).norm() < 2e-3, "{k}: {pose} of {way}");
        }
    }
}

/// Directions of contacts are derivatives of their gaps, which are continuous through the contact, for all pairs of bodies.
#[test]
fn gaps_of_polygons_change_as_their_directions_say() {
    let robot = Robot::new(&links(2)).unwrap();
    let quad = polygon(&[[0.0, 0.0], [0.3, 0.05], [0.25, 0.25], [-0.05, 0.2]], 1.0, 0.1).movable().unwrap();
    let slab = boxed([0.5, 0.1], [0.0; 3], 1.0, 0.1).movable().unwrap();
    let round = disc([0.1, 0.0, 0.0], 1.0, 0.1).movable().unwrap();
    let fixed =
        [[0.1, 0.0, 0.0].into(), Obstacle::endless(Shape::Box { size: [0.4, 0.2], x: 0.0, y: 0.0, angle: 0.2 })];
    let scene = ObstacleGrid::of(&fixed);
    let nodes: [Node; 4] = [(&robot.links[0]).into(), (&round).into(), (&quad).into(), (&slab).into()];
    let (mut random, mut seen) = (Random::new(5), 0);
    let mut compare =
        |gap: &dyn Fn(&[Pose; 2]) -> f64, direction: &[Vector3<f64>; 2], poses: &[Pose; 2], what: &str| {
            for (body, axis) in (0..2).flat_map(|body| (0..3).map(move |axis| (body, axis))) {
                let at = |step: f64| {
                    let mut other = *poses;
                    other[body][axis] += step;
                    gap(&other)
                };
                let (up, down, here) = (at(1e-6), at(-1e-6), at(0.0));
                // Where another vertex or face becomes the nearest one, the gap has a kink.
                if (up + down - 2.0 * here).abs() < 1e-10 {
                    let rate = (up - down) / 2e-6;
                    assert!((rate - direction[body][axis]).abs() < 1e-5, "{what}: {rate} {direction:?} {poses:?}");
                    seen += 1;
                }
            }
        };
    for round in 0..3000 {
        let (i, j) = (round % 4, 2 + round / 4 % 2);
        let spread = random.between(0.1, 0.5);
        let poses = [
            Pose::new(
                random.between(-1.0, 1.0) * spread,
                random.between(-1.0, 1.0) * spread,
                7.0 * random.between(-1.0, 1.0),
            ),
            Pose::new(0.0, 0.0, 7.0 * random.between(-1.0, 1.0)),
        ];
        let placed = |poses: &[Pose; 2]| [PlacedLink::new(nodes[i], poses[0]), PlacedLink::new(nodes[j], poses[1])];
        let at = placed(&poses);
        for (feature, contact) in movable_contacts([&at[0], &at[1]], f64::INFINITY) {
            let gap = |poses: &[Pose; 2]| {
                let at = placed(poses);
                link_pair_contact([&at[0], &at[1]], feature).gap
            };
            // A link that crosses a polygon leaves it by the shortest way, which turning changes.
            if contact.gap > -0.01 {
                compare(&gap, &contact.direction, &poses, &format!("pair {i} {j}, {feature}"));
            }
        }
        let swapped = link_pair_gap([&at[1], &at[0]]);
        assert!((swapped - link_pair_gap([&at[0], &at[1]])).abs() < 1e-12, "either order");
        for (obstacle, feature) in [(0, 0), (1, 0), (1, 3), (1, 5), (1, 7)] {
            if i < 2 {
                continue;
            }
            let of = |pose: Pose| link_obstacle_contact(&PlacedLink::new(nodes[i], pose), &scene, (obstacle, feature));
            let contact = of(poses[0]);
            let gap = |poses: &[Pose; 2]| of(poses[0]).gap;
            compare(&gap, &[contact.direction, Vector3::zeros()], &poses, &format!("obstacle {obstacle}, {feature}"));
        }
    }
    assert!(seen > 20_000, "{seen} derivatives");
}

/// The gap is the least distance of points of both outlines, found by brute force.
#[test]
fn the_gap_of_polygons_is_that_of_their_nearest_points() {
    let quad = polygon(&[[0.0, 0.0], [0.3, 0.05], [0.25, 0.25], [-0.05, 0.2]], 1.0, 0.1).movable().unwrap();
    let slab = boxed([0.5, 0.1], [0.0; 3], 1.0, 0.1).movable().unwrap();
    let points = |body: &Movable, pose: &Pose| -> Vec<Vector2<f64>> {
        let vertices = body.outline.as_ref().unwrap().vertices();
        let edges = vertices.iter().zip(vertices.iter().cycle().skip(1));
        let turn = Rotation2::new(pose.z);
        let on_edge = |(a, b): (&Vector2<f64>, &Vector2<f64>)| {
            let (a, b) = (*a, *b);
            (0..200).map(move |k| a + (b - a) * (f64::from(k) / 200.0))
        };
        edges.flat_map(on_edge).map(|point| turn * point + pose.xy()).collect()
    };
    let mut random = Random::new(8);
    for _ in 0..100 {
        let poses = [Pose::new(0.0, 0.0, random.between(-3.0, 3.0)), Pose::new(0.5, 0.3, random.between(-3.0, 3.0))];
        let [a, b] = [points(&quad, &poses[0]), points(&slab, &poses[1])];
        let least = a.iter().flat_map(|p| b.iter().map(move |q| (p - q).norm())).fold(f64::INFINITY, f64::min);
        let gap = link_pair_gap([&PlacedLink::new(&quad, poses[0]), &PlacedLink::new(&slab, poses[1])]);
        assert!(gap <= least + 1e-12 && least - gap < 2e-4, "{gap} {least}");
    }
}

fn some_body(random: &mut Random, centre: [f64; 2], largest: f64) -> Obstacle {
    let (mass, friction) = (random.magnitude(0.05, 5.0), random.between(0.1, 0.6));
    let (size, [x, y]) = (random.between(0.3, 1.0) * largest, centre);
    match (3.0 * random.between(0.0, 1.0)) as u32 {
        0 => disc([size, x, y], mass, friction),
        1 => boxed([1.8 * size, random.between(0.4, 1.2) * size], [x, y, random.between(-3.0, 3.0)], mass, friction),
        _ => {
            let first = random.between(0.0, 6.0);
            let corner = |k: u32| first + f64::from(k) * std::f64::consts::TAU / 5.0;
            let corners: Vec<_> =
                (0..5).map(|k| [x + size * corner(k).cos(), y + 0.7 * size * corner(k).sin()]).collect();
            polygon(&corners, mass, friction)
        }
    }
}

/// Bodies of all kinds.
#[test]
fn random_motion_among_boxes_leaves_no_overlap_and_no_stage_unsolved_unreported() {
    let mut random = Random::new(30);
    let mut pushing = 0;
    for _ in 0..4 {
        let places =
            [[-0.9, 0.2], [-0.3, 0.2], [0.3, 0.25], [0.9, 0.2], [-0.6, 1.0], [0.0, 1.1], [0.7, 1.0], [1.3, 0.9]];
        let obstacles = places.map(|place| some_body(&mut random, place, 0.14)).to_vec();
        pushing += random_motion::<Planar>(&mut random, obstacles, 500, some_wave);
    }
    assert!(pushing > 20, "{pushing}");
}

/// The robot ends with boxes that rest exactly where nothing pushes them.
#[test]
fn work_of_a_robot_among_boxes_is_energy_and_dissipation() {
    let places = [[1.0, 0.12], [0.9, -0.17], [0.4, 0.27], [-3.0, 0.0]];
    let obstacles = places.map(|[x, y]| boxed([0.12, 0.1], [x, y, 0.4], 0.3, 0.3));
    for step in [1e-2, 2.5e-3] {
        let ways = work_is_energy_and_dissipation::<Planar>(&obstacles, step, 500);
        assert!(ways.iter().any(|way| way.xy().norm() > 0.1 && way.z.abs() > 0.05), "{ways:?}");
    }
}

/// With bodies of all kinds and some rough pegs around them.
#[test]
fn the_width_of_the_registers_and_the_neighbours_do_not_matter_among_boxes() {
    let system = system_among_bodies();
    require_alike_in_every_company(&system, |k| {
        let mut random = Random::new(40 + k as u64);
        let places = [[1.0, 0.2], [0.9, -0.22], [0.4, 0.33], [0.3, -0.2]];
        let mut obstacles: Vec<_> =
            places.into_iter().take(k % 5).map(|place| some_body(&mut random, place, 0.12)).collect();
        if k.is_multiple_of(2) {
            obstacles.push(Obstacle { friction: 0.3, ..[0.1, -0.9, 0.1].into() });
            obstacles.push(Obstacle { friction: 0.3, ..[0.05, 0.35, 0.5].into() });
        }
        let wave = Wave { omega: 1.0 + 0.2 * k as f64, ..Wave::default() };
        Scripted::new(&system.robot, ObstacleGrid::of(&obstacles), START_FREE, &posture(&wave, 10), wave)
    });
}

#[test]
fn a_run_among_boxes_continues_from_a_snapshot_and_allocates_nothing() {
    let wall = Obstacle::endless(Shape::Segment { start: [0.5, 0.5], end: [1.5, 0.6] });
    let boxes = [boxed([0.12, 0.1], [1.0, 0.15, 0.4], 0.3, 0.3), boxed([0.1, 0.1], [0.9, -0.2, 0.0], 0.3, 0.3), wall];
    a_run_continues_from_a_copy_or_snapshot_and_allocates_nothing::<Planar>(&boxes);
}

/// A chain with bodies behind it that touch each other, the chain and, with friction, something fixed.
fn coupled_stage(case: usize, rough: bool, random: &mut Random) -> Stage {
    let kind = Kind {
        links: 2 + case % 4,
        contacts: 0,
        stiff: case.is_multiple_of(2),
        limited: case.is_multiple_of(3),
        friction: true,
        mass_ratio: 3.0,
        orthotropy: 1.0,
    };
    let mut stage = dense::random_stage(kind, random);
    let chain = stage.links.len();
    stage.spins = vec![0.0; chain];
    let mut vector = |size: f64| Vector3::from_fn(|_, _| size * random.between(-1.0, 1.0));
    for k in 0..3 {
        let (weight, turn) = (vector(1.0).x.abs() + 0.1, vector(3.0).x);
        let reference = vector(0.5);
        let force = if k == case % 4 { 0.0 } else { 0.2 * weight };
        stage.links.push(StageLink {
            heading: Heading { cos: turn.cos(), sin: turn.sin() },
            reference,
            mass: weight,
            inertia: 0.01 * weight,
            half_length: 0.12,
            cg_offset: 0.0,
            friction: Vector2::repeat(force),
        });
        stage.spins.push(0.06 * force);
    }
    for links in [[0, chain], [chain, chain + 1], [chain - 1, chain + 2], [chain + 1, chain + 2]] {
        let normal = vector(1.0).xy().normalize();
        let direction = [normal.push(0.05 * vector(1.0).x), -normal.push(0.1 * vector(1.0).x)];
        stage.pairs.push(StagePair { links, direction, offset: 0.0 });
    }
    if rough {
        let normal = vector(1.0).xy().normalize();
        let [direction, along] = [normal, Vector2::new(-normal.y, normal.x)].map(|w| w.push(0.05 * vector(1.0).x));
        stage.contacts.push(StageContact { link: chain, direction, offset: 0.0 });
        let along = StageContact { link: chain, direction: along, offset: 0.0 };
        stage.obstacle_friction.push(StageObstacleFriction { normal: 0, along, coefficient: 0.3, bound: 0.0 });
    }
    stage
}

/// Newton's method and the interior point method share the elimination and not the laws.
#[test]
fn stages_with_limit_surfaces_are_solved_alike_by_all_methods() {
    let mut random = Random::new(50);
    let (mut slipping, mut unsolved) = (0, 0);
    for case in 0..60 {
        let stage = coupled_stage(case, false, &mut random);
        let (mut one, mut other) = (StageSolution::cold(&stage), StageSolution::cold(&stage));
        Newton::new(stage.links.len()).solve_one(&stage, &mut one, 1e-10, 200);
        let residual = certify(&stage, &one).residual();
        assert!(residual < 1e-8, "case {case}: {residual:e}");
        InteriorPoint::new(stage.links.len()).solve(&stage, &mut other, 1e-10);
        let apart = one.twist.iter().zip(&other.twist).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        assert!(apart < 1e-5, "case {case}: {apart:e}");
        slipping += one.twist.iter().skip(stage.chain()).filter(|twist| twist.norm() > 1e-3).count();
        // One moment that is wrong is found.
        let node = stage.chain() + usize::from(case % 4 == 0);
        one.spin[node] += 1e-4;
        assert!(certify(&stage, &one).residual() > 1e-6);
        let rough = coupled_stage(case, true, &mut random);
        let mut solution = StageSolution::cold(&rough);
        solution.twist.fill(Twist::repeat(f64::NAN));
        let (_, status) = Fallback::new(rough.links.len()).solve_hard(&rough, &mut solution, 1e-8);
        let residual = certify(&rough, &solution).residual();
        unsolved += u32::from(status != SolveStatus::Solved || residual > 1e-6);
    }
    // Friction whose bound is unknown has no solution for all directions, with ground that holds the bodies or without.
    assert!(slipping > 60 && unsolved < 3, "{slipping} {unsolved}");
}
