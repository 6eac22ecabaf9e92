//! A stage of the spatial model solved the slow way: full matrices and projected Gauss-Seidel on its contacts.

use nalgebra::{DMatrix, DVector, Vector2, Vector3};
use snake_core::spatial::{ChainShape, ChainVelocity, Frame, Momentum, SpatialVector, Stage, Twist};

/// The stage on matrices: unknowns are the twist of link 1 and the joint rates.
pub struct Dense {
    /// Twists of all links, stacked, per unknown.
    jacobian: DMatrix<f64>,
    /// Velocity without contacts.
    free: DVector<f64>,
    /// Inverse of the inertia with the drives' stiffness.
    inverse: DMatrix<f64>,
    /// Rows of all contact velocities: per link two times (normal, along, across), then rolling x and y; then pegs,
    /// then pairs of links.
    pub contact: DMatrix<f64>,
}

impl Dense {
    pub fn new(stage: &Stage) -> Self {
        let jacobian = jacobian_of(stage);
        let (mass, momentum) = inertia_of(stage);
        let mut inertia = jacobian.transpose() * mass * &jacobian;
        let mut load = jacobian.transpose() * momentum;
        for (k, (j, axis)) in axes_of(stage).enumerate() {
            let drive = &stage.joints[j][axis];
            inertia[(6 + k, 6 + k)] += drive.stiffness;
            load[6 + k] += drive.drive;
        }
        let inverse = inertia.try_inverse().expect("regular");
        let contact = contact_rows(stage) * &jacobian;
        Self { free: &inverse * load, jacobian, inverse, contact }
    }

    /// Twists of all links, stacked: projected Gauss-Seidel on the contacts, sweep after sweep, until velocities stand
    /// still.
    pub fn solve(&self, stage: &Stage) -> DVector<f64> {
        let n = stage.links.len();
        let columns = &self.inverse * self.contact.transpose();
        let delassus = &self.contact * &columns;
        let mut velocity = self.free.clone();
        let mut impulse: DVector<f64> = DVector::zeros(self.contact.nrows());
        for _ in 0..200_000 {
            let before = velocity.clone();
            let change = |row: usize, to: f64, impulse: &mut DVector<f64>, velocity: &mut DVector<f64>| {
                *velocity += columns.column(row) * (to - impulse[row]);
                impulse[row] = to;
            };
            let at = |row: usize, velocity: &DVector<f64>| self.contact.row(row).transpose().dot(velocity);
            let openings = (0..2 * n).map(|k| (8 * (k / 2) + 3 * (k % 2), stage.links[k / 2].ground[k % 2]));
            let offsets = stage.contacts.iter().map(|peg| peg.offset).chain(stage.pairs.iter().map(|pair| pair.offset));
            let others = offsets.enumerate().map(|(k, offset)| (8 * n + k, offset));
            for (row, offset) in openings.chain(others) {
                let wanted = impulse[row] - (at(row, &velocity) + offset) / delassus[(row, row)];
                change(row, wanted.max(0.0), &mut impulse, &mut velocity);
            }
            for k in 0..3 * n {
                let (link, part) = (k / 3, k % 3);
                let row = if part < 2 { 8 * link + 3 * part + 1 } else { 8 * link + 6 };
                let normal = |end: usize| impulse[8 * link + 3 * end];
                let mut radius = if part < 2 {
                    stage.friction.sliding * normal(part)
                } else {
                    Vector2::repeat(stage.friction.rolling * (normal(0) + normal(1)))
                };
                let rate = 0.9 / (delassus[(row, row)] + delassus[(row + 1, row + 1)]);
                let slip = Vector2::new(at(row, &velocity), at(row + 1, &velocity));
                if let Some(skin) = stage.friction.skin.filter(|_| part < 2) {
                    radius.x *= skin.shares()[usize::from(impulse[row] < rate * slip.x)];
                }
                // In the coordinates in which the ellipse is a disc.
                let metric = radius.component_mul(&radius) / radius.max().powi(2).max(1e-300);
                let wanted = Vector2::new(impulse[row], impulse[row + 1]) - slip.component_mul(&metric) * rate;
                let to = into_ellipse(wanted, radius);
                change(row, to.x, &mut impulse, &mut velocity);
                change(row + 1, to.y, &mut impulse, &mut velocity);
            }
            if (&velocity - before).amax() < 1e-13 {
                break;
            }
        }
        &self.jacobian * velocity
    }
}

/// Joint and place of all axes that there are.
fn axes_of(stage: &Stage) -> impl Iterator<Item = (usize, usize)> {
    (0..stage.joints.len()).flat_map(|j| [(j, 0), (j, 1)]).filter(|(j, axis)| stage.axes_of(*j).has(*axis))
}

fn jacobian_of(stage: &Stage) -> DMatrix<f64> {
    let n = stage.links.len();
    let axes: Vec<_> = axes_of(stage).collect();
    let arms =
        stage.links.iter().map(|link| [-1.0, 1.0].map(|side| link.half_length + side * link.cg_offset)).collect();
    let shape = ChainShape { arms, axes: (0..n - 1).map(|j| stage.axes_of(j)).collect() };
    let frames = frames_of(stage);
    let mut jacobian = DMatrix::zeros(6 * n, 6 + axes.len());
    for k in 0..jacobian.ncols() {
        let mut speed = ChainVelocity::rest(n);
        match k {
            0..3 => speed.head.linear[k] = 1.0,
            3..6 => speed.head.angular[k - 3] = 1.0,
            _ => {
                let (j, axis) = axes[k - 6];
                speed.rate[j][axis] = 1.0;
            }
        }
        let mut twist = vec![Twist::zero(); n];
        speed.twists(&frames, &shape, &mut twist);
        jacobian.set_column(k, &stacked(&twist));
    }
    jacobian
}

/// Block-diagonal inertia of the links, and the momentum that the stage begins with.
fn inertia_of(stage: &Stage) -> (DMatrix<f64>, DVector<f64>) {
    let n = stage.links.len();
    let mut mass = DMatrix::zeros(6 * n, 6 * n);
    for (i, link) in stage.links.iter().enumerate() {
        for k in 0..6 {
            let mut unit = Twist::zero();
            if k < 3 {
                unit.linear[k] = 1.0
            } else {
                unit.angular[k - 3] = 1.0
            }
            mass.view_mut((6 * i, 6 * i + k), (6, 1)).copy_from(&stacked(&[link.momentum_of(&unit)]));
        }
    }
    let momentum: Vec<Momentum> = stage.links.iter().map(|link| link.momentum).collect();
    (mass, stacked(&momentum))
}

fn frames_of(stage: &Stage) -> Vec<Frame> {
    let mut frames: Vec<Frame> = Vec::new();
    for link in &stage.links {
        let rear = frames.last().map_or(Vector3::zeros(), |before| {
            let last = &stage.links[frames.len() - 1];
            before.position + before.axes[2] * (last.half_length + last.cg_offset)
        });
        let position = rear + link.axes[2] * (link.half_length - link.cg_offset);
        frames.push(Frame { position, axes: link.axes });
    }
    frames
}

fn contact_rows(stage: &Stage) -> DMatrix<f64> {
    let n = stage.links.len();
    let mut rows = DMatrix::zeros(8 * n + stage.contacts.len() + stage.pairs.len(), 6 * n);
    let mut set = |row: usize, link: usize, force: Vector3<f64>, moment: Vector3<f64>| {
        rows.view_mut((row, 6 * link), (1, 3)).copy_from(&force.transpose());
        rows.view_mut((row, 6 * link + 3), (1, 3)).copy_from(&moment.transpose());
    };
    for (i, link) in stage.links.iter().enumerate() {
        let along = link.tangent.push(0.0);
        for end in 0..2 {
            let reach = link.cg_offset + if end == 0 { link.sphere } else { -link.sphere };
            let arm = link.axes[2] * reach - Vector3::z() * link.radius;
            for (k, axis) in [Vector3::z(), along, Vector3::z().cross(&along)].iter().enumerate() {
                set(8 * i + 3 * end + k, i, *axis, arm.cross(axis));
            }
        }
        set(8 * i + 6, i, Vector3::zeros(), Vector3::new(0.0, -link.radius, 0.0));
        set(8 * i + 7, i, Vector3::zeros(), Vector3::new(link.radius, 0.0, 0.0));
    }
    for (k, peg) in stage.contacts.iter().enumerate() {
        set(8 * n + k, peg.link, peg.direction.linear, peg.direction.angular);
    }
    for (k, pair) in stage.pairs.iter().enumerate() {
        for (link, w) in pair.links.into_iter().zip(&pair.direction) {
            set(8 * n + stage.contacts.len() + k, link, w.linear, w.angular);
        }
    }
    rows
}

/// Projection onto the ellipse with semi-axes `a`, in the metric of the scaled step: enough for a fixed point.
fn into_ellipse(p: Vector2<f64>, a: Vector2<f64>) -> Vector2<f64> {
    if a.min() <= 0.0 {
        return Vector2::zeros();
    }
    let scaled = p.component_div(&a);
    scaled.component_mul(&a) / scaled.norm().max(1.0)
}

/// Linear and angular parts below each other.
pub fn stacked(vectors: &[SpatialVector]) -> DVector<f64> {
    let numbers = vectors.iter().flat_map(|x| x.linear.iter().chain(x.angular.iter()).copied());
    DVector::from_iterator(6 * vectors.len(), numbers)
}
