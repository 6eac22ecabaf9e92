//! How much arithmetic a linear solve of the planar chain is, counted by a number that counts.
//!
//! `cargo test -p snake-core --test planar operation_count:: -- --nocapture` prints it.

use std::cell::Cell;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

use nalgebra::{Vector2, Vector3};
use snake_core::math::{Kernel, Real};
use snake_core::planar::{Heading, Newton, Stage, StageJoint, StageLink, StageSolution, certify};

thread_local! {
    static COUNT: Cell<Operations> = const { Cell::new(Operations { quick: 0, slow: 0 }) };
}

/// Additions, multiplications and both fused into one, and divisions and square roots.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Operations {
    quick: i64,
    slow: i64,
}

impl Sub for Operations {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self { quick: self.quick - other.quick, slow: self.slow - other.slow }
    }
}

/// A number that counts what is done with it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Counting(f64);

fn quick(result: f64) -> Counting {
    COUNT.set(Operations { quick: COUNT.get().quick + 1, ..COUNT.get() });
    Counting(result)
}

fn slow(result: f64) -> Counting {
    COUNT.set(Operations { slow: COUNT.get().slow + 1, ..COUNT.get() });
    Counting(result)
}

impl Add for Counting {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        quick(self.0 + other.0)
    }
}

impl Sub for Counting {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        quick(self.0 - other.0)
    }
}

impl Mul for Counting {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        quick(self.0 * other.0)
    }
}

impl Div for Counting {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        slow(self.0 / other.0)
    }
}

impl Neg for Counting {
    type Output = Self;
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

impl AddAssign for Counting {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl SubAssign for Counting {
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl Real for Counting {
    const LANES: usize = 1;
    type Mask = bool;

    fn splat(x: f64) -> Self {
        Self(x)
    }

    fn lane(&self, _: usize) -> f64 {
        self.0
    }

    fn set_lane(&mut self, _: usize, x: f64) {
        self.0 = x;
    }

    fn sqrt(self) -> Self {
        slow(self.0.sqrt())
    }

    fn mul_add(self, factor: Self, summand: Self) -> Self {
        quick(self.0.mul_add(factor.0, summand.0))
    }

    fn max(self, other: Self) -> Self {
        Self(Real::max(self.0, other.0))
    }

    fn min(self, other: Self) -> Self {
        Self(Real::min(self.0, other.0))
    }

    fn le(self, other: Self) -> bool {
        self.0 <= other.0
    }

    fn lt(self, other: Self) -> bool {
        self.0 < other.0
    }

    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }

    fn run<K: Kernel>(kernel: K) -> K::Output {
        kernel.run()
    }
}

/// A bent chain that slides, driven at its joints.
fn sliding_chain(links: usize) -> Stage<Counting> {
    let number = Counting;
    let c = 0.01;
    let mut stage = Stage::with_capacity(links);
    stage.coefficient = number(c);
    for i in 0..links {
        let angle = 0.6 * (0.9 * i as f64).sin();
        stage.links.push(StageLink {
            heading: Heading { cos: number(angle.cos()), sin: number(angle.sin()) },
            reference: Vector3::new(0.3, 0.1 * angle, 0.5 - angle).map(number),
            mass: number(0.68),
            inertia: number(1.32e-3),
            half_length: number(0.061),
            cg_offset: number(0.0),
            friction: Vector2::new(1.34 * c, 1.34 * c).map(number),
        });
    }
    let joint = |i: usize| StageJoint {
        drive: number(0.05 * (i as f64).cos()),
        stiffness: number(0.1),
        limit: number(f64::INFINITY),
        slack: number(0.0),
    };
    stage.joints.extend((1..links).map(joint));
    stage
}

/// What `work` counts.
fn operations(work: impl FnOnce()) -> Operations {
    let before = COUNT.get();
    work();
    COUNT.get() - before
}

/// One more linear solve of a chain.
fn of_one_solve(stage: &Stage<Counting>) -> Operations {
    let of_solves = |solves| {
        let mut solution = StageSolution::new(stage.links.len());
        let mut newton = Newton::new(stage.links.len());
        operations(|| {
            let outcome = newton.solve(stage, &mut solution, 1e-14, solves, true);
            assert_eq!(outcome.iterations.0, f64::from(solves), "a stage that takes more solves than these");
        })
    };
    of_solves(2) - of_solves(1)
}

#[test]
fn a_solve_takes_as_much_arithmetic_for_every_link() {
    let [few, more, most] = [11, 22, 33].map(|links| of_one_solve(&sliding_chain(links)));
    assert_eq!(most - more, more - few, "linear in the number of links");
    let per_link = more - few;
    println!(
        "one link in a linear solve: {} additions and multiplications, {} divisions and roots",
        per_link.quick / 11,
        per_link.slow / 11
    );
    println!("one linear solve of 11 links: {} and {}", few.quick, few.slow);
    assert!(per_link.quick / 11 < 260 && per_link.slow / 11 <= 3, "{per_link:?}");
}

#[test]
fn judging_a_stage_costs_less_than_a_solve() {
    let stage = sliding_chain(11);
    let mut solution = StageSolution::new(11);
    Newton::new(11).solve(&stage, &mut solution, 1e-6, 50, true);
    let judged = operations(|| {
        certify(&stage, &solution);
    });
    println!(
        "judging a stage of 11 links: {} additions and multiplications, {} divisions and roots",
        judged.quick, judged.slow
    );
    assert!(judged.quick < of_one_solve(&stage).quick, "{judged:?}");
}
