//! The minimal model (chapter 6): its matrices, its O(n) algorithms, and an independent third way.

use nalgebra::{DMatrix, DVector, Rotation2, Vector2, Vector3};
use snake_thesis::minimal::{
    Base, ControlPlant, ForwardDynamics, InverseDynamics, Model, Motion, ProcessPlant, SmoothLaw, actuation,
};

use crate::robots::{Uniform, aiko, uneven_model};

const LINKS: [usize; 5] = [2, 3, 5, 11, 24];
const LAWS: [SmoothLaw; 2] = [SmoothLaw::PRINTED, SmoothLaw::Ellipse { smoothing: 1e-3 }];

struct Case {
    model: Model,
    q: Vec<f64>,
    rate: Vec<f64>,
    tau: Vec<f64>,
}

/// Three random robots and states of every number of links.
fn cases() -> impl Iterator<Item = Case> {
    LINKS.into_iter().flat_map(|links| {
        (0..3).map(move |seed| {
            let mut uniform = Uniform::new(100 * links as u64 + seed);
            let model = uneven_model(links, &mut uniform);
            let n = model.degrees();
            let (q, rate) = (uniform.vector(n, 2.0), uniform.vector(n, 3.0));
            let tau = uniform.vector(n - 3, 2.0);
            Case { model, q, rate, tau }
        })
    })
}

impl Case {
    fn plant(&self) -> ProcessPlant {
        ProcessPlant::new(&self.model, SmoothLaw::PRINTED, &self.q, &self.rate)
    }

    /// nu at heading theta: the velocity of O_2 turned into the first link's frame.
    fn nu(&self) -> Vec<f64> {
        let v = Rotation2::new(-self.q[2]) * Vector2::new(self.rate[0], self.rate[1]);
        [v.x, v.y].into_iter().chain(self.rate[2..].iter().copied()).collect()
    }

    fn motion(&self) -> Motion {
        let mut motion = Motion::new(self.model.link_count());
        let base = Base { theta: self.q[2], rate: Vector3::new(self.rate[0], self.rate[1], self.rate[2]) };
        motion.set(&self.model, base, &self.q[3..], &self.rate[3..]);
        motion
    }

    fn moved(&self, time: f64) -> Vec<f64> {
        self.q.iter().zip(&self.rate).map(|(q, v)| q + time * v).collect()
    }
}

fn relative(a: &DVector<f64>, b: &DVector<f64>) -> f64 {
    (a - b).norm() / b.norm().max(1e-300)
}

fn is_positive_definite(m: &DMatrix<f64>) -> bool {
    (m - m.transpose()).norm() < 1e-12 * m.norm() && m.clone().cholesky().is_some()
}

/// Accelerations of (T 6.14).
fn from_process_plant(case: &Case, law: SmoothLaw) -> DVector<f64> {
    let plant = ProcessPlant::new(&case.model, law, &case.q, &case.rate);
    let rate = DVector::from_row_slice(&case.rate);
    let force = actuation(&case.model) * DVector::from_row_slice(&case.tau) + plant.friction() - plant.coriolis * rate;
    plant.mass.cholesky().expect("positive definite").solve(&force)
}

/// The same from (T 6.37), by q'' = T_q' nu + T_q nu' (T 6.34).
fn from_control_plant(case: &Case, law: SmoothLaw) -> DVector<f64> {
    let nu = case.nu();
    let plant = ControlPlant::new(&case.model, law, &case.q[3..], &nu);
    let force = actuation(&case.model) * DVector::from_row_slice(&case.tau) + &plant.g - &plant.h;
    let mut acceleration = plant.mass.cholesky().expect("positive definite").solve(&force);
    let turning = Vector2::new(acceleration[0] - nu[2] * nu[1], acceleration[1] + nu[2] * nu[0]);
    acceleration.fixed_rows_mut::<2>(0).copy_from(&(Rotation2::new(case.q[2]) * turning));
    acceleration
}

/// Maximal coordinates (x, y, theta of each CG) with joint forces as multipliers: nothing shared with the model but
/// the force law.
fn from_maximal_coordinates(case: &Case, law: SmoothLaw) -> DVector<f64> {
    let (links, joints) = (case.model.link_count(), case.model.joint_count());
    let (mut angle, mut omega) = (vec![case.q[2]], vec![case.rate[2]]);
    for j in 0..joints {
        angle.push(angle[j] + case.q[3 + j]);
        omega.push(omega[j] + case.rate[3 + j]);
    }
    let size = 3 * links + 2 * joints;
    let (mut a, mut b) = (DMatrix::zeros(size, size), DVector::zeros(size));
    let mut end = Vector2::new(case.rate[0], case.rate[1]);
    for (i, link) in case.model.links.iter().enumerate() {
        let normal = Vector2::new(-angle[i].sin(), angle[i].cos());
        let velocity = end + normal * (omega[i] * link.half_length);
        end += normal * (2.0 * omega[i] * link.half_length);
        for k in 0..2 {
            a[(3 * i + k, 3 * i + k)] = link.mass;
        }
        a[(3 * i + 2, 3 * i + 2)] = link.inertia;
        for side in [1.0, -1.0] {
            let turn = Rotation2::new(angle[i]);
            let slip = turn.inverse() * (velocity + normal * (omega[i] * side * link.lever));
            let local = link.friction.force(law, slip);
            let force = turn * local;
            b[3 * i] += force.x;
            b[3 * i + 1] += force.y;
            b[3 * i + 2] += side * link.lever * local.y;
        }
        if i > 0 {
            b[3 * i + 2] += case.tau[i - 1];
            b[3 * i - 1] -= case.tau[i - 1];
        }
    }
    // Each joint: acceleration of the far end of link j minus that of the near end of link j + 1 vanishes.
    for j in 0..joints {
        for (i, side) in [(j, 1.0), (j + 1, -1.0)] {
            let half = case.model.links[i].half_length;
            let (sin, cos) = angle[i].sin_cos();
            let row = 3 * links + 2 * j;
            let entries =
                [(0, 3 * i, side), (1, 3 * i + 1, side), (0, 3 * i + 2, -sin * half), (1, 3 * i + 2, cos * half)];
            for (k, column, value) in entries {
                a[(row + k, column)] = value;
                a[(column, row + k)] = value;
            }
            // Centripetal: side * half * -omega^2 e_x, times the side of the link in the difference.
            b[row] += half * omega[i] * omega[i] * cos;
            b[row + 1] += half * omega[i] * omega[i] * sin;
        }
    }
    let x = a.lu().solve(&b).expect("regular");
    let (sin, cos) = case.q[2].sin_cos();
    let half = case.model.links[0].half_length;
    let mut acceleration = DVector::zeros(case.model.degrees());
    // O_2 lies half a link behind G: a = a_G - alpha x half e_x + omega^2 half e_x.
    acceleration[0] = x[0] + sin * half * x[2] + omega[0] * omega[0] * half * cos;
    acceleration[1] = x[1] - cos * half * x[2] + omega[0] * omega[0] * half * sin;
    acceleration[2] = x[2];
    for j in 0..joints {
        acceleration[3 + j] = x[3 * j + 5] - x[3 * j + 2];
    }
    acceleration
}

/// The O(n) sweep that the simulation uses.
fn from_the_sweep(case: &Case, law: SmoothLaw) -> DVector<f64> {
    let mut acceleration = DVector::zeros(case.model.degrees());
    ForwardDynamics::new(case.model.link_count()).accelerations(
        &case.model,
        &case.motion(),
        law,
        &case.tau,
        acceleration.as_mut_slice(),
    );
    acceleration
}

#[test]
fn the_mass_matrices_are_positive_definite() {
    for case in cases() {
        assert!(is_positive_definite(&case.plant().mass));
        let control = ControlPlant::new(&case.model, SmoothLaw::PRINTED, &case.q[3..], &case.nu());
        assert!(is_positive_definite(&control.mass));
        assert!(is_positive_definite(&control.joint_dynamics().mass));
    }
}

#[test]
fn the_viscous_matrix_is_positive_definite_and_gives_the_viscous_friction() {
    for case in cases() {
        let nu = case.nu();
        let at = |law, model: &Model| ControlPlant::new(model, law, &case.q[3..], &nu);
        let plant = at(SmoothLaw::PRINTED, &case.model);
        assert!(is_positive_definite(&plant.viscous));
        let mut without_coulomb = case.model.clone();
        without_coulomb.links.iter_mut().for_each(|link| link.friction.coulomb.fill(0.0));
        let g = at(SmoothLaw::PRINTED, &without_coulomb).g;
        assert!(relative(&(-&plant.viscous * DVector::from_row_slice(&nu)), &g) < 1e-12);
    }
}

#[test]
fn the_rate_of_the_mass_matrix_minus_twice_the_coriolis_matrix_is_skew() {
    for case in cases() {
        let h = 1e-5;
        let mass = |t: f64| ProcessPlant::new(&case.model, SmoothLaw::PRINTED, &case.moved(t), &case.rate).mass;
        let rate = (mass(h) - mass(-h)) / (2.0 * h);
        let skew = rate - 2.0 * case.plant().coriolis;
        let error = (&skew + skew.transpose()).norm() / skew.norm();
        assert!(error < 1e-7, "central differences are good to h^2 and round-off / h: {error}");
    }
}

#[test]
fn the_coriolis_matrix_is_that_of_the_christoffel_symbols() {
    for case in cases().filter(|case| case.model.link_count() <= 5) {
        let n = case.model.degrees();
        let h = 1e-5;
        let derivative: Vec<DMatrix<f64>> = (0..n)
            .map(|k| {
                let mass = |step: f64| {
                    let mut q = case.q.clone();
                    q[k] += step;
                    ProcessPlant::new(&case.model, SmoothLaw::PRINTED, &q, &case.rate).mass
                };
                (mass(h) - mass(-h)) / (2.0 * h)
            })
            .collect();
        let printed = DMatrix::from_fn(n, n, |i, j| {
            (0..n)
                .map(|k| 0.5 * (derivative[k][(i, j)] + derivative[j][(i, k)] - derivative[i][(k, j)]) * case.rate[k])
                .sum()
        });
        let error = (&printed - &case.plant().coriolis).norm() / printed.norm();
        assert!(error < 1e-7, "(6.16)-(6.17) by central differences: {error}");
    }
}

#[test]
fn the_control_plant_does_not_depend_on_the_heading() {
    for case in cases() {
        let nu = case.nu();
        let at = |theta| ControlPlant::at_heading(&case.model, SmoothLaw::PRINTED, theta, &case.q[3..], &nu);
        let (one, other) = (at(0.0), at(1.9));
        assert!((&one.mass - &other.mass).norm() < 1e-13 * one.mass.norm());
        assert!((&one.coriolis - &other.coriolis).norm() < 1e-12 * one.coriolis.norm());
        assert!(relative(&other.g, &one.g) < 1e-12 && relative(&other.h, &one.h) < 1e-12);
    }
}

#[test]
fn process_plant_control_plant_maximal_coordinates_and_sweep_accelerate_alike() {
    for case in cases() {
        for law in LAWS {
            let printed = from_process_plant(&case, law);
            for other in [from_control_plant, from_maximal_coordinates, from_the_sweep] {
                let error = relative(&other(&case, law), &printed);
                assert!(error < 1e-9, "{} links: {error}", case.model.link_count());
            }
        }
    }
}

#[test]
fn the_input_output_linearising_torque_without_matrices_is_that_with_matrices() {
    for case in cases() {
        let u = Uniform::new(7).vector(case.model.joint_count(), 50.0);
        let mut tau = DVector::zeros(u.len());
        let mut sweep = InverseDynamics::new(&case.model);
        sweep.torques(&case.model, &case.motion(), &u, tau.as_mut_slice());
        let plant = ControlPlant::new(&case.model, SmoothLaw::PRINTED, &case.q[3..], &case.nu());
        let printed = plant.joint_dynamics().torque(&DVector::from_row_slice(&u));
        assert!(relative(&tau, &printed) < 1e-11, "round-off grows with the chain: {}", relative(&tau, &printed));
    }
}

#[test]
fn inverse_dynamics_undoes_forward_dynamics() {
    for case in cases() {
        let acceleration = from_the_sweep(&case, SmoothLaw::PRINTED);
        let mut tau = DVector::zeros(case.tau.len());
        let base = InverseDynamics::new(&case.model).torques(
            &case.model,
            &case.motion(),
            &acceleration.as_slice()[3..],
            tau.as_mut_slice(),
        );
        assert!(relative(&tau, &DVector::from_row_slice(&case.tau)) < 1e-9);
        assert!(relative(&DVector::from_row_slice(base.as_slice()), &acceleration.rows(0, 3).into_owned()) < 1e-9);
    }
}

#[test]
fn without_friction_the_joints_change_neither_momentum() {
    for mut case in cases() {
        for link in &mut case.model.links {
            link.friction.coulomb.fill(0.0);
            link.friction.viscous.fill(0.0);
        }
        let acceleration = from_the_sweep(&case, SmoothLaw::PRINTED);
        let plant = case.plant();
        let rate = DVector::from_row_slice(&case.rate);
        // d/dt of sum m v = sum m (J q'' + J' q'): zero; and the power of the actuators is the rate of energy.
        let momentum = (&plant.mass * &acceleration + &plant.coriolis * &rate).rows(0, 3).norm();
        assert!(momentum < 1e-9 * acceleration.norm(), "{momentum}");
        let power: f64 = case.tau.iter().zip(&case.rate[3..]).map(|(tau, rate)| tau * rate).sum();
        let h = 1e-5;
        let energy = |t: f64| {
            let q: Vec<f64> =
                (0..case.q.len()).map(|k| case.q[k] + t * case.rate[k] + 0.5 * t * t * acceleration[k]).collect();
            let v = &rate + &acceleration * t;
            let mass = ProcessPlant::new(&case.model, SmoothLaw::PRINTED, &q, &case.rate).mass;
            0.5 * v.dot(&(mass * &v))
        };
        let measured = (energy(h) - energy(-h)) / (2.0 * h);
        let scale = power.abs().max(1.0);
        assert!((measured - power).abs() < 1e-4 * scale, "central differences: {measured} {power}");
    }
}

#[test]
fn friction_dissipates() {
    let link = aiko().links[0];
    let mut uniform = Uniform::new(3);
    for law in LAWS {
        for scale in [1e-4, 1e-3, 1e-2, 1.0] {
            let v = Vector2::new(uniform.next(-1.0, 1.0), uniform.next(-1.0, 1.0)) * scale;
            assert!(link.friction.force(law, v).dot(&v) < 0.0);
        }
    }
}

#[test]
fn the_printed_law_fills_a_box_and_the_other_an_ellipse() {
    let friction = aiko().links[0].friction;
    let fast = Vector2::new(1.0, 1.0);
    let coulomb = |law| friction.force(law, fast) + friction.viscous.component_mul(&fast);
    let in_units = |law| coulomb(law).component_div(&friction.coulomb);
    assert!((in_units(LAWS[0]) + Vector2::new(1.0, 1.0)).norm() < 2e-3, "both components reach their bound at once");
    assert!((in_units(LAWS[1]).norm() - 1.0).abs() < 1e-3, "the bound is shared");
}
