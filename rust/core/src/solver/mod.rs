//! What the solvers of all models share: the augmented Lagrangian iteration, the exact ray search, the proximal form of
//! friction, Newton's method with Coulomb's law as it stands, corrections of low rank, and what is reported of a solve.
//! `README.md` in this folder derives the method.

mod actuator_term;
mod augmented_lagrangian;
mod coulomb_contacts;
mod coulomb_laws;
mod coulomb_newton;
mod coulomb_sweep;
mod coupled_chain;
mod friction_term;
mod low_rank;
mod motor_term;
mod outcome;
mod ray_search;
mod surface_term;

pub(crate) use actuator_term::ActuatorTerm;
pub use augmented_lagrangian::{LawForm, NewtonStep, StageProblem, Tuning, solve};
pub(crate) use coulomb_contacts::Contacts;
pub use coulomb_laws::CoulombForm;
pub(crate) use coulomb_laws::{DiscTangent, LawImpulse, UnilateralLaw};
pub(crate) use coulomb_newton::converge;
pub use coulomb_newton::{CoupledStage, Defect};
pub(crate) use coulomb_sweep::{Balance, ChainLink};
pub(crate) use coupled_chain::{CoupledChain, CoupledLink, DrivenAxis, Head};
pub use friction_term::FrictionTerm;
pub(crate) use low_rank::{Coupling, EliminatedChain, LinkStep, LowRank};
pub(crate) use motor_term::MotorTerm;
pub(crate) use outcome::{EXACT, STRAIN, greatest_impulse};
pub use outcome::{Outcome, RESIDUAL_LIMIT, SolveStatus, is_unsolved, residual_limit};
pub use ray_search::{NearestKink, Ray, Search, add, step_length};
pub(crate) use surface_term::SurfaceTerm;
