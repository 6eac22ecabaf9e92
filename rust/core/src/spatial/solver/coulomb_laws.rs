//! The [laws with impulses as unknowns of their own](crate::solver::UnilateralLaw) of one link: its contacts with the
//! ground, and with obstacles. The tangent of friction includes the growth of its set with the normal impulse.
//!
//! In coordinates in which the longer semi-axis of an ellipse stays and the shorter one is stretched to it, every set
//! of friction is a disc.

use nalgebra::{Matrix3, Matrix6, SMatrix, SVector, Vector2, Vector3, Vector6};

use crate::laws::{Ball, Cone, ConvexSet, Disc, HalfLine, Halves, Skin};
use crate::solver::{CoulombForm, DiscTangent, LawImpulse, UnilateralLaw};
use crate::spatial::{Stage, StageFriction, StageLink, StageSolution, Wrench};

use super::coulomb_sweep::stacked;

/// Velocities at the laws of a link's ground contacts, per twist: normal of both ends, slip of the front and of the
/// rear one, rolling.
type Rows = SMatrix<f64, LAWS, 6>;
type Impulses = SVector<f64, LAWS>;
const LAWS: usize = 8;

/// Laws along `M` rows of one link, and the change of their impulses with the twist for which the linearised laws hold.
#[derive(Debug, Clone, Copy)]
pub(super) struct LawRows<const M: usize> {
    pub rows: SMatrix<f64, M, 6>,
    pub p: LawImpulse<SVector<f64, M>>,
    pub constant: SVector<f64, M>,
    pub slope: SMatrix<f64, M, 6>,
}

/// First rows of the slips of the ends and of rolling.
const DISCS: [usize; 3] = [2, 4, 6];

/// First row of the limit surface of what can be pushed, which has no ends: two forces, and the moment at a lever.
const BALL: usize = 2;

/// Laws of both end spheres of a link, or of the ground under something that can be pushed.
#[derive(Debug, Clone, Copy)]
pub(super) struct GroundLaws {
    pub laws: LawRows<LAWS>,
    offset: [f64; 2],
    /// Radius of the discs over the normal impulse: sliding at both ends, rolling.
    coefficient: [f64; 3],
    /// Stretched coordinates: semi-axes over the longer one.
    shape: Vector2<f64>,
    skin: Option<Skin>,
    /// Shares of the sides of z.
    side: [f64; 3],
    /// In the convex problem: lags of both ends, and radius of rolling friction.
    lag: [f64; 2],
    rolling: f64,
    /// Of what can be pushed, the largest force of friction \[N s\], and its lever \[m\].
    ball: Option<(f64, f64)>,
}

impl<const M: usize> LawRows<M> {
    pub fn new(rows: SMatrix<f64, M, 6>, impulse: SVector<f64, M>) -> Self {
        Self { rows, p: LawImpulse::new(impulse), constant: SVector::zeros(), slope: SMatrix::zeros() }
    }

    /// Contribution of the linearised laws to the link's tangent and to its load.
    pub fn tangent(&self) -> (Matrix6<f64>, Vector6<f64>) {
        (-self.rows.tr_mul(&self.slope), self.rows.tr_mul(&self.constant))
    }

    /// The impulses as one on the link.
    pub fn force(&self) -> Vector6<f64> {
        self.rows.tr_mul(&self.p.value)
    }

    /// Takes the link's Newton step.
    pub fn find_step(&mut self, twist_step: &Vector6<f64>) {
        self.p.set_step(self.constant + self.slope * twist_step);
    }
}

impl GroundLaws {
    /// Link `i` with the impulses of `solution`.
    pub fn new(stage: &Stage, solution: &StageSolution, i: usize) -> Self {
        let link = &stage.links[i];
        if let Some(k) = i.checked_sub(stage.chain()) {
            return Self::under_body(&stage.surfaces[k], &solution.surface[k]);
        }
        let StageFriction { sliding, rolling, skin } = stage.friction;
        let longer = sliding.max();
        let shape = if longer > 0.0 { sliding / longer } else { Vector2::zeros() };
        let [front, rear] = solution.friction[i].map(|p| stretched(&p, &shape));
        let [n, m] = solution.normal[i];
        let r = &solution.rolling[i];
        let impulse = Impulses::from([n, m, front.x, front.y, rear.x, rear.y, r.x, r.y]);
        Self {
            laws: LawRows::new(rows_of(link, &shape), impulse),
            offset: link.ground,
            coefficient: [link.share[0] * longer, link.share[1] * longer, rolling],
            shape,
            skin,
            side: [1.0; 3],
            lag: [0.0; 2],
            rolling: rolling * (n + m),
            ball: None,
        }
    }

    /// Within these semi-axes, under something that can be pushed; its ends are in the air.
    fn under_body(axes: &Vector3<f64>, impulse: &Vector3<f64>) -> Self {
        let lever = if axes.x > 0.0 { axes.z / axes.x } else { 0.0 };
        let (mut rows, mut own) = (Rows::zeros(), Impulses::zeros());
        (rows[(BALL, 0)], rows[(BALL + 1, 1)], rows[(BALL + 2, 5)]) = (1.0, 1.0, lever);
        let moment = if lever > 0.0 { impulse.z / lever } else { 0.0 };
        own.fixed_rows_mut::<3>(BALL).copy_from(&Vector3::new(impulse.x, impulse.y, moment));
        Self {
            laws: LawRows::new(rows, own),
            offset: [1.0; 2],
            coefficient: [0.0; 3],
            shape: Vector2::zeros(),
            skin: None,
            side: [1.0; 3],
            lag: [0.0; 2],
            rolling: 0.0,
            ball: Some((axes.x, lever)),
        }
    }

    fn velocity(&self, twist: &Vector6<f64>) -> Impulses {
        let mut velocity = self.laws.rows * twist;
        velocity[0] += self.offset[0];
        velocity[1] += self.offset[1];
        velocity
    }

    /// Evaluates all laws at the link's twist. Returns the sum of the squared defects and the largest one \[N s\].
    pub fn measure(&mut self, twist: &Vector6<f64>, form: &CoulombForm) -> (f64, f64) {
        let velocity = self.velocity(twist);
        if form.is_lagged {
            self.project(&velocity, form);
            return (0.0, 0.0);
        }
        let radii = [0, 1, 2].map(|disc| self.radius(disc));
        let skins = [0, 1, 2].map(|disc| self.skin_of(disc));
        let p = &mut self.laws.p;
        p.z = p.argument(velocity, form);
        let mut inside = p.z;
        inside[0] = HalfLine.project(inside[0]);
        inside[1] = HalfLine.project(inside[1]);
        for (disc, first) in DISCS.into_iter().enumerate() {
            let [impulse, centre, slip] = [&p.value, &p.centre, &velocity].map(|of| pair(of, first));
            let (z, side) = form.argument(skins[disc], &impulse, &centre, &slip);
            p.z.fixed_rows_mut::<2>(first).copy_from(&z);
            self.side[disc] = side;
            let nearest = Disc { radius: radii[disc] }.project(z);
            inside.fixed_rows_mut::<2>(first).copy_from(&Vector2::new(side * nearest.x, nearest.y));
        }
        if let Some((radius, _)) = self.ball {
            inside.fixed_rows_mut::<3>(BALL).copy_from(&Ball { radius }.project(triple(&p.z)));
        }
        p.defect = p.value - inside;
        (p.defect.norm_squared(), p.defect.amax())
    }

    /// Impulses of the convex problem and their slopes.
    fn project(&mut self, velocity: &Impulses, form: &CoulombForm) {
        let stiffness = 1.0 / form.compliance;
        let z = self.laws.p.centre - velocity * stiffness;
        let lagged = CoulombForm { weight: stiffness, ..*form };
        for end in 0..2 {
            let of_end = [end, DISCS[end], DISCS[end] + 1];
            let [centre, slip] = [&self.laws.p.centre, velocity].map(|of| pair(of, DISCS[end]));
            let (along, side) = lagged.argument(self.skin_of(end), &centre, &centre, &slip);
            let at = Vector3::new(z[end] - self.lag[end] * stiffness, along.x, along.y);
            let (inside, derivative) = Cone { coefficient: self.coefficient[end] }.evaluate(&at);
            let scale = Matrix3::from_diagonal(&Vector3::new(1.0, side, 1.0));
            let (inside, derivative) = (scale * inside, scale * derivative * scale);
            let rows = SMatrix::<f64, 3, 6>::from_rows(&of_end.map(|row| self.laws.rows.row(row).into_owned()));
            let slope = derivative * rows * -stiffness;
            for (part, row) in of_end.into_iter().enumerate() {
                self.laws.p.value[row] = inside[part];
                self.laws.slope.set_row(row, &slope.row(part));
            }
        }
        let (at, first) = (pair(&z, DISCS[2]), DISCS[2]);
        let tangent = DiscTangent::new(&at, &Vector2::zeros(), self.rolling, &lagged);
        let slope = tangent.from_slip * self.laws.rows.fixed_rows::<2>(first);
        self.laws.p.value.fixed_rows_mut::<2>(first).copy_from(&Disc { radius: self.rolling }.project(at));
        self.laws.slope.fixed_rows_mut::<2>(first).copy_from(&slope);
        self.laws.constant = Impulses::zeros();
        if let Some((radius, _)) = self.ball {
            let tangent = DiscTangent::new(&triple(&z), &Vector3::zeros(), radius, &lagged);
            let slope = tangent.from_slip * self.laws.rows.fixed_rows::<3>(BALL);
            self.laws.p.value.fixed_rows_mut::<3>(BALL).copy_from(&Ball { radius }.project(triple(&z)));
            self.laws.slope.fixed_rows_mut::<3>(BALL).copy_from(&slope);
        }
    }

    /// Lags and radii of the next convex problem: those of the present velocities and normal impulses.
    pub fn lag(&mut self, twist: &Vector6<f64>) {
        let velocity = self.velocity(twist);
        self.lag = [0, 1].map(|end| {
            let slip = pair(&velocity, DISCS[end]);
            let side = self.skin.map_or(1.0, |skin| skin.side(-slip.x));
            self.coefficient[end] * Vector2::new(side * slip.x, slip.y).norm()
        });
        self.rolling = self.radius(2);
    }

    /// Rolling has none.
    fn skin_of(&self, disc: usize) -> Option<Skin> {
        self.skin.filter(|_| disc < 2)
    }

    fn radius(&self, disc: usize) -> f64 {
        let loads = [0, 1].map(|end: usize| self.laws.p.value[end].max(0.0));
        match disc {
            2 => self.coefficient[2] * (loads[0] + loads[1]),
            end => self.coefficient[end] * loads[end],
        }
    }

    /// Computes the change of the impulses with the twist for which the linearised laws hold: `constant + slope x`.
    pub fn linearise(&mut self, form: &CoulombForm) {
        let radii = [0, 1, 2].map(|disc| self.radius(disc));
        let LawRows { rows, p, constant, slope } = &mut self.laws;
        let mut grows = [0.0; 2];
        for (end, grows) in grows.iter_mut().enumerate() {
            let closed = p.z[end] > 0.0;
            let (change, per_velocity) = form.opening_tangent(closed, p.defect[end]);
            constant[end] = change;
            slope.set_row(end, &(rows.row(end) * per_velocity));
            *grows = if closed || p.value[end] > 0.0 { 1.0 } else { 0.0 };
        }
        for (disc, first) in DISCS.into_iter().enumerate() {
            let (z, defect) = (pair(&p.z, first), pair(&p.defect, first));
            let tangent = DiscTangent::on_side(self.side[disc], &z, &defect, radii[disc], form);
            let (load, load_slope) = match disc {
                2 => {
                    let [a, b] = grows.map(|grows| grows * self.coefficient[2]);
                    (a * constant[0] + b * constant[1], slope.row(0) * a + slope.row(1) * b)
                }
                end => {
                    let grows = grows[end] * self.coefficient[end];
                    (grows * constant[end], slope.row(end) * grows)
                }
            };
            let along = tangent.from_slip * rows.fixed_rows::<2>(first) + tangent.outward * load_slope;
            constant.fixed_rows_mut::<2>(first).copy_from(&(tangent.constant + tangent.outward * load));
            slope.fixed_rows_mut::<2>(first).copy_from(&along);
        }
        if let Some((radius, _)) = self.ball {
            let tangent = DiscTangent::new(&triple(&p.z), &triple(&p.defect), radius, form);
            let along = tangent.from_slip * rows.fixed_rows::<3>(BALL);
            constant.fixed_rows_mut::<3>(BALL).copy_from(&tangent.constant);
            slope.fixed_rows_mut::<3>(BALL).copy_from(&along);
        }
    }

    /// Impulses in frame Pi and along the axes of frame I: normal, sliding, rolling.
    pub fn write(&self, solution: &mut StageSolution, i: usize) {
        let p = &self.laws.p.value;
        if let Some((_, lever)) = self.ball {
            let chain = solution.twist.len() - solution.surface.len();
            solution.surface[i - chain] = triple(p).component_mul(&Vector3::new(1.0, 1.0, lever));
            return;
        }
        solution.normal[i] = [p[0].max(0.0), p[1].max(0.0)];
        solution.friction[i] = [pair(p, 2), pair(p, 4)].map(|p| p.component_mul(&self.shape));
        solution.rolling[i] = pair(p, 6);
    }
}

/// Law of a contact with an obstacle.
#[derive(Debug, Clone, Copy)]
pub(super) struct ObstacleLaw {
    pub link: usize,
    pub direction: Vector6<f64>,
    pub law: UnilateralLaw,
    /// Change of the impulse with the twist for which the linearised law holds.
    pub constant: f64,
    pub slope: Vector6<f64>,
}

impl ObstacleLaw {
    pub fn new(stage: &Stage, solution: &StageSolution, k: usize) -> Self {
        let contact = &stage.contacts[k];
        let law = UnilateralLaw::new(contact.offset, solution.contact[k]);
        Self { link: contact.link, direction: stacked(&contact.direction), law, constant: 0.0, slope: Vector6::zeros() }
    }

    /// Returns the defect \[N s\].
    pub fn measure(&mut self, twist: &Vector6<f64>, form: &CoulombForm) -> f64 {
        self.law.measure(self.direction.dot(twist), form)
    }

    pub fn linearise(&mut self, form: &CoulombForm) {
        let (constant, slope) = self.law.tangent(form);
        (self.constant, self.slope) = (constant, self.direction * slope);
    }

    /// As [`LawRows::tangent`].
    pub fn tangent(&self) -> (Matrix6<f64>, Vector6<f64>) {
        (-self.direction * self.slope.transpose(), self.direction * self.constant)
    }

    pub fn force(&self) -> Vector6<f64> {
        self.direction * self.law.p.value
    }

    /// Change of the normal impulse, as far as friction grows with it: constant, and slope by the twist.
    pub fn growth(&self) -> (f64, Vector6<f64>) {
        if self.law.carries() { (self.constant, self.slope) } else { (0.0, Vector6::zeros()) }
    }

    pub fn find_step(&mut self, twist_step: &Vector6<f64>) {
        self.law.p.set_step(self.constant + self.slope.dot(twist_step));
    }
}

fn rows_of(link: &StageLink, shape: &Vector2<f64>) -> Rows {
    let along = link.tangent.push(0.0);
    let across = Vector3::z().cross(&along);
    let mut rows = Rows::zeros();
    let mut set = |row: usize, wrench: Wrench| rows.set_row(row, &stacked(&wrench).transpose());
    for (end, slip) in DISCS.into_iter().take(2).enumerate() {
        let arm = link.ground_arm(end);
        let force = |axis: Vector3<f64>| Wrench { linear: axis, angular: arm.cross(&axis) };
        set(end, force(Vector3::z()));
        set(slip, force(along * shape.x));
        set(slip + 1, force(across * shape.y));
    }
    let turn = |axis: Vector3<f64>| Wrench { linear: Vector3::zeros(), angular: axis };
    set(DISCS[2], turn(Vector3::new(0.0, -link.radius, 0.0)));
    set(DISCS[2] + 1, turn(Vector3::new(link.radius, 0.0, 0.0)));
    rows
}

/// An impulse in stretched coordinates; along an axis without friction there is none.
fn stretched(p: &Vector2<f64>, shape: &Vector2<f64>) -> Vector2<f64> {
    let part = |p: f64, shape: f64| if shape > 0.0 { p / shape } else { 0.0 };
    Vector2::new(part(p.x, shape.x), part(p.y, shape.y))
}

fn pair(p: &Impulses, first: usize) -> Vector2<f64> {
    Vector2::new(p[first], p[first + 1])
}

fn triple(p: &Impulses) -> Vector3<f64> {
    p.fixed_rows::<3>(BALL).into_owned()
}
