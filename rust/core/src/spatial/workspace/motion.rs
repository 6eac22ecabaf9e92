//! How the robots of a register move during a stage.

use crate::math::{Laned, Real};
use crate::robot::Link;
use crate::spatial::spatial_vector::{difference, inner};
use crate::spatial::{
    ChainShape, ChainVelocity, Configuration, Frame, LinkAxis, Momentum, SpatialSystem, SpatialVector, Twist,
};

/// Configurations and velocities of a stage.
pub struct Motion<T> {
    pub shape: ChainShape<T>,
    /// Robots at the start of the step.
    pub start: Configuration<T>,
    pub start_velocity: ChainVelocity<T>,
    pub start_momentum: Vec<Momentum<T>>,
    pub start_frames: Vec<Frame<T>>,
    /// Heights of the spheres' lowest points there \[m\].
    pub start_gap: Vec<[T; 2]>,
    /// q_B and the expected end velocity of the stage.
    pub base: Configuration<T>,
    pub base_frames: Vec<Frame<T>>,
    pub guess: ChainVelocity<T>,
    /// Reference momenta p_R, without gravity; of what can be pushed, reference velocities.
    pub momentum: Vec<Momentum<T>>,
    pub moved: Vec<Twist<T>>,
    /// Expected end configuration, and the twists of the guess there.
    pub predicted: Configuration<T>,
    pub frames: Vec<Frame<T>>,
    pub expected: Vec<Twist<T>>,
    /// Longest way of a link's CG from the start of the step to the predicted end of the stage, or to the end of the step \[m\].
    pub way: T,
    /// Time from the start of the step to the end of the stage \[s\].
    pub elapsed: T,
}

/// One link of one robot during a stage.
pub struct StageKinematics<'a> {
    pub link: &'a Link,
    /// At the start of the step, at the base of the stage, and at its predicted end.
    pub start: LinkAxis,
    pub base: LinkAxis,
    pub end: LinkAxis,
    /// Twist with which the end is predicted.
    pub expected: Twist,
}

impl<T: Real> Motion<T> {
    pub fn new(system: &SpatialSystem, movables: usize) -> Self {
        let count = system.robot.link_count();
        let none = || vec![SpatialVector::zero(); count];
        let frames = || vec![Frame::origin(); count];
        Self {
            shape: ChainShape::new(&system.robot),
            start: Configuration::straight(count).among(movables),
            start_velocity: ChainVelocity::rest(count).among(movables),
            start_momentum: none(),
            start_frames: frames(),
            start_gap: vec![[T::zero(); 2]; count],
            base: Configuration::straight(count).among(movables),
            base_frames: frames(),
            guess: ChainVelocity::rest(count).among(movables),
            momentum: none(),
            moved: vec![SpatialVector::zero(); movables],
            predicted: Configuration::straight(count).among(movables),
            frames: frames(),
            expected: vec![SpatialVector::zero(); count + movables],
            way: T::zero(),
            elapsed: T::zero(),
        }
    }

    /// Measures the way of the links to where they are now.
    #[inline(always)]
    pub fn measure_way(&mut self) {
        let mut squared = T::zero();
        for (start, end) in self.start_frames.iter().zip(&self.frames) {
            let way = difference(&end.position, &start.position);
            squared = squared.max(inner(&way, &way));
        }
        self.way = squared.sqrt();
    }

    /// A link of a lane's robot.
    pub fn of_link<'a>(&self, links: &'a [Link], link: usize, lane: usize) -> StageKinematics<'a> {
        StageKinematics {
            link: &links[link],
            start: self.start_frames[link].axis_of(lane),
            base: self.base_frames[link].axis_of(lane),
            end: self.frames[link].axis_of(lane),
            expected: self.expected[link].lane(lane),
        }
    }
}
