//! One step: Algorithm 4.2 against matrices, and the judge against it.

use nalgebra::{DMatrix, DVector, Vector2};
use snake_core::robot::Robot;
use snake_core::spatial::{End, Pose, StackedTwist, assemble_chain, mass_diagonal, orientation_of, rest_on_ground};
use snake_test_support::planar::{Random, links};
use snake_test_support::spatial_random::{random_angle, random_peg, random_twist};
use snake_thesis::spatial::{
    ContactPenalties, GroundImpulse, ModifiedNewton, Step, StepGround, StepLink, StepPeg, StepSolution, ground_contact,
    joint_rows, peg_contact, step_residual,
};

const R: ContactPenalties = ContactPenalties { normal: 0.1, friction: 0.05, rolling: 0.05, peg: 0.1 };

/// A chain near the ground in some motion, with all end spheres and a few pegs in contact.
fn random_step(random: &mut Random, count: usize, pegs: usize) -> (Step, StepSolution) {
    let robot = Robot::new(&links(count)).unwrap();
    let mut pose = vec![Pose::identity(); count];
    let head = Pose { orientation: orientation_of(random.angle(), 0.1, random.angle()), ..Pose::identity() };
    let angles: Vec<_> = (1..count).map(|_| random_angle(random, 0.7)).collect();
    assemble_chain(&robot, head, &angles, &mut pose);
    rest_on_ground(&robot, &mut pose);
    let mut step = Step::with_capacity(count, Vector2::new(0.2, 0.5), 0.02);
    for (i, (link, q)) in robot.links.iter().zip(&pose).enumerate() {
        let inverse_mass = mass_diagonal(link).map(f64::recip);
        step.links.push(StepLink { reference: random_twist(random), inverse_mass });
        step.ground.extend(End::BOTH.map(|end| StepGround { link: i, rows: ground_contact(link, q, end) }));
    }
    for _ in 0..pegs {
        let link = random.below(count);
        let peg = random_peg(random, &robot.links[link], &pose[link]);
        step.pegs.push(StepPeg { link, direction: peg_contact(&robot.links[link], &pose[link], &peg).direction });
    }
    let pairs = robot.links.windows(2).zip(pose.windows(2));
    step.joints.extend(pairs.map(|(link, q)| joint_rows(&link[0], &q[0], &link[1], &q[1])));
    let mut solution = StepSolution::new(count);
    solution.ground.resize(step.ground.len(), GroundImpulse::default());
    solution.peg.resize(pegs, 0.0);
    (step, solution)
}

/// W_J of all joints, 6 n x 4 (n - 1) (T 4.68).
fn joint_matrix(step: &Step) -> DMatrix<f64> {
    let mut w = DMatrix::zeros(6 * step.links.len(), 4 * step.joints.len());
    for (j, rows) in step.joints.iter().enumerate() {
        w.view_mut((6 * j, 4 * j), (6, 4)).copy_from(&rows.near);
        w.view_mut((6 * j + 6, 4 * j), (6, 4)).copy_from(&rows.far);
    }
    w
}

/// -(W_J^T M^-1 W_J)^-1 W_J^T u_R without contacts, and W_J^T u_E = 0 with them.
#[test]
fn joint_impulses_hold_the_joints() {
    let mut random = Random::new(60);
    for count in [2, 3, 11, 40] {
        let (mut step, mut solution) = random_step(&mut random, count, 0);
        step.ground.clear();
        solution.ground.clear();
        let (iterations, converged) = ModifiedNewton::new(count).solve(&step, &mut solution, R, 1e-12, 10);
        assert!(converged && iterations == 1, "without contacts one elimination is exact");
        let w = joint_matrix(&step);
        let stacked = |of: &dyn Fn(usize) -> StackedTwist| {
            DVector::from_iterator(6 * count, (0..count).flat_map(|i| of(i).iter().copied().collect::<Vec<_>>()))
        };
        let reference = stacked(&|i| step.links[i].reference);
        let inverse_mass = DMatrix::from_diagonal(&stacked(&|i| step.links[i].inverse_mass));
        let system = w.transpose() * &inverse_mass * &w;
        let impulse = -system.lu().solve(&(w.transpose() * &reference)).expect("joints of a chain are independent");
        let twist = &reference + &inverse_mass * &w * &impulse;
        let found = DVector::from_iterator(4 * (count - 1), solution.joint.iter().flat_map(|p| p.iter().copied()));
        assert!((found - &impulse).amax() < 1e-10 * (1.0 + impulse.amax()), "{count} links");
        assert!((stacked(&|i| solution.twist[i]) - &twist).amax() < 1e-10);
        assert!((w.transpose() * stacked(&|i| solution.twist[i])).amax() < 1e-11);
    }
}

#[test]
fn the_iteration_ends_where_the_judge_is_satisfied() {
    let mut random = Random::new(61);
    for trial in 0..20 {
        let (step, mut solution) = random_step(&mut random, 6, trial % 4);
        let (_, converged) = ModifiedNewton::new(6).solve(&step, &mut solution, R, 1e-11, 200_000);
        assert!(converged);
        let residual = step_residual(&step, &solution);
        assert!(residual < 1e-7, "{residual:e}");
        for impulse in &solution.ground {
            assert!(impulse.normal >= 0.0);
            let bounds = Vector2::new(0.2, 0.5) * impulse.normal;
            if impulse.normal > 0.0 {
                assert!(impulse.tangent.component_div(&bounds).norm() < 1.0 + 1e-12);
            }
            assert!(impulse.rolling.norm() <= 0.02 * impulse.normal * (1.0 + 1e-12));
        }
    }
}

#[test]
fn the_judge_reports_every_kind_of_error() {
    let mut random = Random::new(62);
    let (step, mut solution) = random_step(&mut random, 6, 3);
    ModifiedNewton::new(6).solve(&step, &mut solution, R, 1e-11, 200_000);
    let judged = |change: &dyn Fn(&mut StepSolution)| {
        let mut wrong = solution.clone();
        change(&mut wrong);
        step_residual(&step, &wrong)
    };
    let pressed = (0..12).max_by(|&a, &b| solution.ground[a].normal.total_cmp(&solution.ground[b].normal)).unwrap();
    assert!(judged(&|s| s.twist[2].x += 1e-3) > 5e-4);
    assert!(judged(&|s| s.twist[3][5] += 1e-2) > 5e-5);
    assert!(judged(&|s| s.joint[1].x += 1e-3) > 5e-4);
    assert!(judged(&|s| s.joint[1].w += 1e-5) > 1e-4);
    assert!(judged(&|s| s.ground[pressed].normal += 1e-3) > 5e-4);
    assert!(judged(&|s| s.ground[pressed].tangent.x += 1e-3) > 5e-4);
    assert!(judged(&|s| s.ground[pressed].rolling.y += 1e-3) > 1e-4);
    assert!(judged(&|s| s.peg[0] += 1e-3) > 5e-4);
    assert!(judged(&|s| s.peg[0] = -1e-3) > 5e-4);
}
