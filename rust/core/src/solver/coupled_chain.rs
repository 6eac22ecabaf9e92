//! The chain in Newton's method with [Coulomb's law as it stands](super::CoupledStage): twists of `N` numbers, joints of `A`
//! axes, and a ground `G` for each link.

use nalgebra::{SMatrix, SVector};

use crate::rows::{DriveRow, MotorRow};

use super::coulomb_newton::Defect;
use super::coulomb_sweep::{Balance, ChainLink};
use super::{ActuatorTerm, LawForm, MotorTerm};

/// Solver of the balance of a link that hangs on no other.
pub(crate) trait Head<const N: usize> {
    fn of(matrix: SMatrix<f64, N, N>) -> Self;

    /// The change of the twist under a load; NaN where the balance is singular.
    fn solve(&self, load: &SVector<f64, N>) -> SVector<f64, N>;
}

/// A chain, and behind it what it can push.
pub(crate) struct CoupledChain<const N: usize, const A: usize, G, H> {
    pub links: Vec<CoupledLink<N, A, G, H>>,
}

pub(crate) struct CoupledLink<const N: usize, const A: usize, G, H> {
    chain: ChainLink<N, A>,
    /// Whether it hangs on no other link: link 1, and obstacles that can be pushed.
    pub is_free: bool,
    /// Of the joint before the link.
    pub axes: [DrivenAxis; A],
    pub ground: G,
    pub mass_matrix: SMatrix<f64, N, N>,
    momentum: SVector<f64, N>,
    pub mass: f64,
    pub half_length: f64,
    /// Twist, where the Newton step starts, and the step.
    pub twist: SVector<f64, N>,
    start: SVector<f64, N>,
    pub step: SVector<f64, N>,
    /// Imbalance of the link.
    pub missing: SVector<f64, N>,
    /// Of a free link, with all that hangs on it, and its load.
    pub head: Option<H>,
    load: SVector<f64, N>,
    /// Constants of an elimination for another load.
    constant: [f64; A],
}

/// One axis of a joint; its rate is an unknown.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DrivenAxis {
    actuator: ActuatorTerm<f64>,
    motor: Option<MotorTerm<f64>>,
    /// Impulse of the axis \[N m s\], and its stiffness.
    pub moment: f64,
    stiffness: f64,
    pub rate: f64,
    start_rate: f64,
    pub step_rate: f64,
}

impl DrivenAxis {
    /// Of a link that hangs on no other.
    pub fn none() -> Self {
        Self {
            actuator: ActuatorTerm::none(),
            motor: None,
            moment: 0.0,
            stiffness: 0.0,
            rate: 0.0,
            start_rate: 0.0,
            step_rate: 0.0,
        }
    }

    /// A drive, and a motor with the friction of its gear at a lever, that sticks with a stiffness `penalty`.
    pub fn new(drive: &DriveRow, motor: Option<(&MotorRow, &f64)>, lever: f64, penalty: f64, rate: f64) -> Self {
        let motor = motor.map(|(motor, friction)| MotorTerm::new(motor, *friction, lever, penalty));
        Self { actuator: ActuatorTerm::new(drive, 0.0), motor, rate, ..Self::none() }
    }

    /// Impulse of the drive, and friction of the gear where there is a motor \[N m s\].
    pub fn impulses(&self) -> (f64, Option<f64>) {
        (self.actuator.impulse, self.motor.map(|motor| motor.friction))
    }

    /// Laws of the axis at its rate.
    fn evaluate(&mut self) {
        let motor = self.motor.as_mut();
        (self.moment, self.stiffness) = self.actuator.evaluate_with(motor, LawForm::Present, self.rate);
    }
}

impl<const N: usize, const A: usize, G, H: Head<N>> CoupledLink<N, A, G, H> {
    /// A link of this matrix of masses and momentum behind the link before, if it is not free.
    pub fn new(
        (chain, before): (ChainLink<N, A>, Option<SVector<f64, N>>),
        axes: [DrivenAxis; A],
        ground: G,
        (mass_matrix, momentum): (SMatrix<f64, N, N>, SVector<f64, N>),
        (mass, half_length): (f64, f64),
        free_twist: SVector<f64, N>,
    ) -> Self {
        let twist = before.map_or(free_twist, |before| chain.follow(&before, &axes.map(|axis| axis.rate)));
        let none = SVector::zeros();
        Self {
            chain,
            is_free: before.is_none(),
            axes,
            ground,
            mass_matrix,
            momentum,
            mass,
            half_length,
            twist,
            start: twist,
            step: none,
            missing: none,
            head: None,
            load: none,
            constant: [0.0; A],
        }
    }

    /// The impulses that it lacks.
    pub fn imbalance(&self) -> SVector<f64, N> {
        self.mass_matrix * self.twist - self.momentum
    }

    /// Twist behind a link of this twist.
    fn follow(&self, before: &SVector<f64, N>) -> SVector<f64, N> {
        self.chain.follow(before, &self.axes.map(|axis| axis.rate))
    }

    /// Steps of the rates and the twist with these constants of an elimination, given that of the link before.
    fn substitute(&self, constant: &[f64; A], before: &SVector<f64, N>) -> ([f64; A], SVector<f64, N>) {
        match &self.head {
            Some(head) => ([0.0; A], head.solve(&self.load)),
            None => self.chain.substitute(constant, before),
        }
    }
}

impl<const N: usize, const A: usize, G, H: Head<N>> CoupledChain<N, A, G, H> {
    pub fn new(links: usize) -> Self {
        Self { links: Vec::with_capacity(links) }
    }

    fn gears(&self) -> impl Iterator<Item = &MotorTerm<f64>> {
        self.links.iter().flat_map(|link| &link.axes).filter_map(|axis| axis.motor.as_ref())
    }

    /// Moves the centres of the gears' friction.
    pub fn recentre_gears(&mut self) {
        let axes = self.links.iter_mut().flat_map(|link| &mut link.axes);
        axes.filter_map(|axis| axis.motor.as_mut()).for_each(|motor| motor.recentre(true));
    }

    /// How far the friction of a gear is from its centre at most \[N s\].
    pub fn gear_error(&self) -> f64 {
        self.gears().map(MotorTerm::centre_error).fold(0.0, f64::max)
    }

    /// Adds what the links lack about the joints, which evaluates these, and of free links, measured by `size`: its square
    /// and itself, given the lever of the link.
    pub fn add_defects(&mut self, defect: &mut Defect, size: impl Fn(&SVector<f64, N>, f64) -> (f64, f64)) {
        let mut behind = SVector::zeros();
        for link in self.links.iter_mut().rev() {
            behind += link.missing;
            let (mass, arm) = (link.mass, link.half_length);
            if link.is_free {
                let (squared, largest) = size(&behind, arm);
                defect.add(squared / mass, largest / mass);
                behind = SVector::zeros();
                continue;
            }
            link.axes.iter_mut().for_each(DrivenAxis::evaluate);
            for (axis, moment) in link.chain.hinge_moments(&behind) {
                defect.add_impulse((moment - link.axes[axis].moment) / arm, mass);
            }
            behind = link.chain.carry_force(&behind);
        }
    }

    /// Computes the Newton step of all twists and rates, without rows between links; `add_link` adds a link with its laws.
    pub fn find_step(&mut self, mut add_link: impl FnMut(usize, &mut CoupledLink<N, A, G, H>, &mut Balance<N>)) {
        let mut behind = Balance::zero();
        for (i, link) in self.links.iter_mut().enumerate().rev() {
            add_link(i, link, &mut behind);
            if link.is_free {
                let Balance { matrix, load } = std::mem::replace(&mut behind, Balance::zero());
                (link.head, link.load) = (Some(H::of(matrix)), load);
            } else {
                let (stiffness, moment) = (link.axes.map(|axis| axis.stiffness), link.axes.map(|axis| axis.moment));
                behind = link.chain.eliminate(behind, stiffness, moment);
            }
        }
        let mut before = SVector::zeros();
        for link in &mut self.links {
            let (rates, step) = link.substitute(&link.chain.constant, &before);
            (link.start, link.step, before) = (link.twist, step, step);
            for (axis, rate) in link.axes.iter_mut().zip(rates) {
                (axis.start_rate, axis.step_rate) = (axis.rate, rate);
            }
        }
    }

    /// Sign of the determinant of the balance, but for what free links leave.
    pub fn orientation(&self) -> f64 {
        self.links.iter().filter(|link| !link.is_free).map(|link| link.chain.orientation()).product()
    }

    /// Visits the steps of rates and twist of all links under a column on two of them, after [`Self::find_step`].
    pub fn respond(
        &mut self,
        of: [usize; 2],
        column: &[SVector<f64, N>; 2],
        mut visit: impl FnMut([f64; A], SVector<f64, N>),
    ) {
        let mut load = SVector::zeros();
        for (i, link) in self.links.iter_mut().enumerate().rev() {
            for (_, w) in of.iter().zip(column).filter(|(of, _)| **of == i) {
                load += w;
            }
            if link.is_free {
                link.load = std::mem::replace(&mut load, SVector::zeros());
            } else {
                (load, link.constant) = link.chain.eliminate_load(load);
            }
        }
        let mut before = SVector::zeros();
        for link in &self.links {
            let (rates, twist) = link.substitute(&link.constant, &before);
            visit(rates, twist);
            before = twist;
        }
    }

    /// Moves twists and rates to a fraction of the step from its start.
    pub fn move_along(&mut self, fraction: f64) {
        let mut before = SVector::zeros();
        for link in &mut self.links {
            for axis in &mut link.axes {
                axis.rate = axis.start_rate + fraction * axis.step_rate;
            }
            before = if link.is_free { link.start + link.step * fraction } else { link.follow(&before) };
            link.twist = before;
        }
    }

    /// Twists of links 2..n from that of link 1 and the rates.
    pub fn follow_joints(&mut self) {
        let mut before = self.links[0].twist;
        for link in self.links.iter_mut().skip(1).filter(|link| !link.is_free) {
            link.twist = link.follow(&before);
            before = link.twist;
        }
    }
}
