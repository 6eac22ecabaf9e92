//! A stage solved the slow way: full matrices and block Gauss-Seidel on the dual problem.
//!
//! Nothing of the solvers' or the judge's code is used: force directions are written out from the
//! print, the joints are eliminated by a null-space basis, and the projection on the ellipse is only
//! ever asked for points next to it.
use nalgebra::{DMatrix, DVector, Vector2};
use snake_core::laws::{ConvexSet, Ellipse};
use snake_core::planar::{Heading, PlanarState, Stage, StageContact, StageJoint, StageLink, StagePair, Twist};
use snake_core::robot::Robot;
use snake_core::rows::FrictionRow;

use crate::planar::Random;

/// M of (T 3.45)-(T 3.46).
pub fn mass_matrix(stage: &Stage) -> DMatrix<f64> {
    let diagonal: Vec<f64> = stage.links.iter().flat_map(|link| [link.mass, link.mass, link.inertia]).collect();
    DMatrix::from_diagonal(&DVector::from_vec(diagonal))
}

/// W_J of (T 3.36)-(T 3.39), one column a constraint.
pub fn joint_directions(stage: &Stage) -> DMatrix<f64> {
    let n = stage.links.len();
    let mut w = DMatrix::zeros(3 * n, 2 * (n - 1));
    for i in 0..n - 1 {
        for (k, sign) in [(i, 1.0), (i + 1, -1.0)] {
            let link = &stage.links[k];
            w[(3 * k, 2 * i)] = sign;
            w[(3 * k + 1, 2 * i + 1)] = sign;
            let arm = link.half_length + sign * link.cg_offset;
            w[(3 * k + 2, 2 * i)] = -arm * link.heading.sin;
            w[(3 * k + 2, 2 * i + 1)] = arm * link.heading.cos;
        }
    }
    w
}

/// Twists after the inelastic impact of a chain at a contact of direction `w`: `u+ = u- + M^-1 (W_J P_J + w P)` with
/// `W_J^T u+ = 0` and `w^T u+ = 0`, the M-orthogonal projection on the constraints.
///
/// # Panics
/// If the constraints depend on each other.
pub fn after_impact(robot: &Robot, state: &PlanarState, w: &DVector<f64>) -> Vec<Twist> {
    impact(robot, state, std::slice::from_ref(w), w).0
}

/// The same with friction along `d`: whether it sticks, and the velocities after an impact with the impulse `P (w + f d)`,
/// where f is what stops `d^T u`, or `mu` in that direction where it would be more.
///
/// # Panics
/// As [`after_impact`].
pub fn after_rough_impact(
    robot: &Robot,
    state: &PlanarState,
    [w, d]: [&DVector<f64>; 2],
    mu: f64,
) -> (bool, Vec<Twist>) {
    let (stuck, [pressed, held]) = impact(robot, state, &[w.clone(), d.clone()], w);
    if held.abs() <= mu * pressed {
        return (true, stuck);
    }
    (false, impact(robot, state, std::slice::from_ref(w), &(w + d * mu.copysign(held))).0)
}

/// Velocities after an impact that ends the rates of all `rows`, and the impulses along the first and the last of them; the
/// impulse of the first one acts along `force`.
fn impact(robot: &Robot, state: &PlanarState, rows: &[DVector<f64>], force: &DVector<f64>) -> (Vec<Twist>, [f64; 2]) {
    let mut stage = Stage::with_capacity(state.pose.len());
    stage.links.extend(robot.links.iter().zip(&state.pose).map(|(link, q)| StageLink {
        heading: Heading::of(q.z),
        reference: Twist::zeros(),
        mass: link.mass,
        inertia: link.inertia,
        half_length: 0.5 * link.length,
        cg_offset: link.cg_offset,
        friction: Vector2::zeros(),
    }));
    let w_j = joint_directions(&stage);
    let joints = w_j.ncols();
    let mut all = w_j.insert_columns(joints, rows.len(), 0.0);
    rows.iter().enumerate().for_each(|(k, row)| all.set_column(joints + k, row));
    let mut forces = all.clone();
    forces.set_column(joints, force);
    let inverse_mass = mass_matrix(&stage).map_diagonal(|m| 1.0 / m);
    let inverse_mass = DMatrix::from_diagonal(&inverse_mass);
    let u = stacked(&state.twist);
    let rates = -all.transpose() * &u;
    let impulses = (all.transpose() * &inverse_mass * &forces).lu().solve(&rates).expect("independent constraints");
    let ends = [impulses[joints], impulses[impulses.len() - 1]];
    (unstacked(&(u + inverse_mass * forces * impulses)), ends)
}

/// Columns span the motions with W_J^T u = 0: translations, then each link's rotation, which carries
/// along everything behind it.
pub fn admissible_motions(stage: &Stage) -> DMatrix<f64> {
    let n = stage.links.len();
    let mut b = DMatrix::zeros(3 * n, n + 2);
    for i in 0..n {
        b[(3 * i, 0)] = 1.0;
        b[(3 * i + 1, 1)] = 1.0;
    }
    for k in 0..n {
        let link = &stage.links[k];
        let lateral = Vector2::new(-link.heading.sin, link.heading.cos);
        let [front, rear] = [-1.0, 1.0].map(|side| lateral * (link.half_length + side * link.cg_offset));
        b[(3 * k + 2, k + 2)] = 1.0;
        // Link 1 turns about its CG; every other link about its near joint.
        let own = if k == 0 { Vector2::zeros() } else { front };
        for i in k..n {
            let moved = if i == k { own } else { own + rear };
            b[(3 * i, k + 2)] = moved.x;
            b[(3 * i + 1, k + 2)] = moved.y;
        }
    }
    b
}

/// Difference of neighbouring angular velocities, one column a joint.
pub fn drive_directions(stage: &Stage) -> DMatrix<f64> {
    let n = stage.links.len();
    let mut w = DMatrix::zeros(3 * n, n - 1);
    for j in 0..n - 1 {
        w[(3 * j + 2, j)] = -1.0;
        w[(3 * j + 5, j)] = 1.0;
    }
    w
}

pub fn stacked(twist: &[Twist]) -> DVector<f64> {
    DVector::from_iterator(3 * twist.len(), twist.iter().flat_map(|u| [u.x, u.y, u.z]))
}

pub fn unstacked(u: &DVector<f64>) -> Vec<Twist> {
    (0..u.len() / 3).map(|i| Twist::new(u[3 * i], u[3 * i + 1], u[3 * i + 2])).collect()
}

/// The dual block of one law: which columns of W it owns and how its impulse follows from a free one.
enum Law {
    /// For forces along the link and against it.
    Friction([Ellipse; 2]),
    Contact,
    Drive {
        limit: f64,
        swallowed: f64,
    },
}

/// The velocity of a stage by block Gauss-Seidel on impulses, to about `accuracy` \[m/s\]; `None` if
/// that takes too long, as in jammed stages, where it creeps.
pub fn solve(stage: &Stage, accuracy: f64) -> Option<Vec<Twist>> {
    let n = stage.links.len();
    let (mass, b) = (mass_matrix(stage), admissible_motions(stage));
    let reduced = b.transpose() * &mass * &b;
    let inverse = &b * reduced.clone().try_inverse().expect("a positive definite mass") * b.transpose();
    let mut columns: Vec<DVector<f64>> = Vec::new();
    let mut laws: Vec<(Law, usize, usize)> = Vec::new();
    let (mut offset, mut compliance) = (Vec::new(), Vec::new());
    for (i, link) in stage.links.iter().enumerate() {
        let shares = stage.skin.map_or([1.0; 2], |skin| skin.shares());
        let sets = shares.map(|share| Ellipse { axes: Vector2::new(share * link.friction.x, link.friction.y) });
        laws.push((Law::Friction(sets), columns.len(), 2));
        for axis in [(link.heading.cos, link.heading.sin), (-link.heading.sin, link.heading.cos)] {
            let mut w = DVector::zeros(3 * n);
            (w[3 * i], w[3 * i + 1]) = axis;
            columns.push(w);
            offset.push(0.0);
            compliance.push(0.0);
        }
    }
    for contact in &stage.contacts {
        laws.push((Law::Contact, columns.len(), 1));
        let mut w = DVector::zeros(3 * n);
        w.fixed_rows_mut::<3>(3 * contact.link).copy_from(&contact.direction);
        columns.push(w);
        offset.push(contact.offset);
        compliance.push(0.0);
    }
    for pair in &stage.pairs {
        laws.push((Law::Contact, columns.len(), 1));
        let mut w = DVector::zeros(3 * n);
        for (link, direction) in pair.links.into_iter().zip(&pair.direction) {
            w.fixed_rows_mut::<3>(3 * link).copy_from(direction);
        }
        columns.push(w);
        offset.push(pair.offset);
        compliance.push(0.0);
    }
    let mut given = DVector::zeros(3 * n);
    let drives = drive_directions(stage);
    for (j, joint) in stage.joints.iter().enumerate() {
        let w = drives.column(j).into_owned();
        if joint.stiffness == 0.0 {
            given += w * joint.drive.clamp(-joint.limit, joint.limit);
            continue;
        }
        // D = clamp(shrink(b - k omega)) is omega + (D - b) / k in -N(D) - (slack / k) sign(D): a compliant law in an
        // interval, whose force has to grow beyond what play swallows.
        let swallowed = joint.slack / joint.stiffness;
        laws.push((Law::Drive { limit: joint.limit, swallowed }, columns.len(), 1));
        columns.push(w);
        offset.push(-joint.drive / joint.stiffness);
        compliance.push(1.0 / joint.stiffness);
    }
    let w = DMatrix::from_columns(&columns);
    let reference: Vec<Twist> = stage.links.iter().map(|link| link.reference).collect();
    let free = &inverse * (&mass * stacked(&reference) + given);
    let delassus = w.transpose() * &inverse * &w + DMatrix::from_diagonal(&DVector::from_vec(compliance));
    let slip = w.transpose() * &free + DVector::from_vec(offset);
    let impulses = gauss_seidel(&delassus, &slip, &laws, accuracy)?;
    Some(unstacked(&(free + inverse * w * impulses)))
}

fn gauss_seidel(
    g: &DMatrix<f64>,
    slip: &DVector<f64>,
    laws: &[(Law, usize, usize)],
    accuracy: f64,
) -> Option<DVector<f64>> {
    let mut p = DVector::zeros(slip.len());
    let mut gamma = slip.clone();
    for _ in 0..50_000 {
        let mut change: f64 = 0.0;
        for (law, at, size) in laws {
            let block = g.view((*at, *at), (*size, *size));
            // Any r below 2 / (largest eigenvalue) converges; the trace bounds the eigenvalue.
            let r = 1.0 / block.trace();
            let before = p.rows(*at, *size).into_owned();
            let wanted = &before - gamma.rows(*at, *size) * r;
            let after = match law {
                Law::Friction(sets) => {
                    let q = sets[usize::from(wanted[0] < 0.0)].project(Vector2::new(wanted[0], wanted[1]));
                    DVector::from_vec(vec![q.x, q.y])
                }
                Law::Contact => wanted.map(|x| x.max(0.0)),
                Law::Drive { limit, swallowed } => {
                    wanted.map(|x| (x.signum() * (x.abs() - r * swallowed).max(0.0)).clamp(-limit, *limit))
                }
            };
            let step = &after - &before;
            change = change.max(step.norm() / r);
            gamma += g.columns(*at, *size) * &step;
            p.rows_mut(*at, *size).copy_from(&after);
        }
        if change < accuracy {
            return Some(p);
        }
    }
    None
}

/// What a random stage contains.
#[derive(Clone, Copy)]
pub struct Kind {
    pub links: usize,
    pub contacts: usize,
    pub stiff: bool,
    pub limited: bool,
    pub friction: bool,
    /// Ratio between the heaviest and the lightest link.
    pub mass_ratio: f64,
    /// Friction semi-axes may differ by this factor, and may be zero.
    pub orthotropy: f64,
}

impl Kind {
    /// The case of this number of a sweep over contacts, stiffness, limits and friction.
    pub fn of_case(links: usize, case: usize) -> Self {
        Self {
            links,
            contacts: case % 3,
            stiff: case.is_multiple_of(2),
            limited: case.is_multiple_of(5),
            friction: !case.is_multiple_of(4),
            mass_ratio: 3.0,
            orthotropy: 1.0,
        }
    }
}

/// A stage of about 10 ms of a robot like Aiko, with every datum drawn at random.
pub fn random_stage(kind: Kind, random: &mut Random) -> Stage {
    let c = random.magnitude(1e-3, 5e-2);
    // From nearly at rest, where links stick, to a fast robot.
    let lively = random.magnitude(1e-2, 1.0);
    let mut stage = Stage::with_capacity(kind.links);
    stage.coefficient = c;
    for _ in 0..kind.links {
        let mass = 0.5 * random.magnitude(1.0, kind.mass_ratio);
        let bound = if kind.friction { 0.2 * mass * 9.81 * c } else { 0.0 };
        let mut friction = Vector2::new(bound, bound / random.magnitude(1.0, kind.orthotropy));
        if kind.orthotropy > 1.0 && random.below(8) == 0 {
            friction[random.below(2)] = 0.0;
        }
        stage.links.push(StageLink {
            heading: snake_core::planar::Heading::of(random.angle()),
            reference: Twist::new(random.between(-0.1, 0.1), random.between(-0.1, 0.1), random.between(-1.0, 1.0))
                * lively,
            mass,
            inertia: mass * random.between(1e-3, 4e-3),
            half_length: random.between(0.04, 0.08),
            cg_offset: 0.0,
            friction,
        });
    }
    for _ in 1..kind.links {
        let gain = random.magnitude(1.0, 1e3);
        let torque = random.between(-3.0, 3.0) * lively;
        stage.joints.push(StageJoint {
            drive: c * torque,
            stiffness: if kind.stiff { c * (c * gain + 2.0) } else { 0.0 },
            limit: if kind.limited { c * random.between(0.1, 2.0) * lively } else { f64::INFINITY },
            slack: 0.0,
        });
    }
    for _ in 0..kind.contacts {
        let (link, normal) = (random.below(kind.links), random.angle());
        let arm = random.between(-0.06, 0.06);
        let lateral = stage.links[link].heading.lateral();
        let n = Vector2::new(normal.cos(), normal.sin());
        let direction = nalgebra::Vector3::new(n.x, n.y, arm * n.dot(&lateral));
        // Offsets are never negative, so that the robot at rest is admissible.
        stage.contacts.push(StageContact { link, direction, offset: random.between(0.0, 0.02) });
    }
    stage.contacts.sort_by_key(|contact| contact.link);
    for link in &mut stage.links {
        link.cg_offset = random.between(-0.9, 0.9) * link.half_length;
    }
    stage
}

/// Adds contacts between links that are not neighbours.
pub fn fold(stage: &mut Stage, pairs: usize, random: &mut Random) {
    let n = stage.links.len();
    for _ in 0..pairs {
        let i = random.below(n - 2);
        let links = [i, i + 2 + random.below(n - i - 2)];
        let normal = random.angle();
        let n = Vector2::new(normal.cos(), normal.sin());
        let mut direction = [Twist::zeros(); 2];
        for (w, (link, sign)) in direction.iter_mut().zip(links.into_iter().zip([1.0, -1.0])) {
            let lateral = stage.links[link].heading.lateral();
            *w = Twist::new(n.x, n.y, random.between(-0.06, 0.06) * n.dot(&lateral)) * sign;
        }
        stage.pairs.push(StagePair { links, direction, offset: random.between(0.0, 2e-3) });
    }
}

/// Gives the contacts between links friction along the surfaces, at a link's radius from their lines.
pub fn roughen(stage: &mut Stage, coefficient: f64, random: &mut Random) {
    let rub = |(normal, pair): (usize, &StagePair)| {
        let turned = |w: Twist, arm: f64| Twist::new(-w.y, w.x, arm);
        let direction = pair.direction.map(|w| turned(w, random.between(-0.06, 0.06)));
        let along = StagePair { direction, offset: 0.0, ..*pair };
        FrictionRow { normal, along, coefficient, bound: 0.0 }
    };
    stage.pair_friction = stage.pairs.iter().enumerate().map(rub).collect();
}

/// Gives the joints backlash: what it swallows is up to twice what the drive asks for at rest.
pub fn loosen(stage: &mut Stage, random: &mut Random) {
    for joint in stage.joints.iter_mut().filter(|joint| joint.stiffness > 0.0) {
        joint.slack = random.between(0.0, 2.0) * joint.drive.abs();
    }
}
