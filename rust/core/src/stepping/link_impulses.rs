//! What has acted on the links of a robot.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Impulses on each link over an interval, world frame \[N s\].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LinkImpulses {
    /// Of the obstacles; over the interval's length it is (T 7.6).
    pub contact: Vec<Vector3<f64>>,
    /// Of the robot's other links.
    pub self_contact: Vec<Vector3<f64>>,
    /// Of the ground's normal forces; zero in models without them.
    pub ground: Vec<f64>,
    /// The same of top faces of obstacles, which `contact` contains.
    pub top: Vec<f64>,
}

impl LinkImpulses {
    pub fn zeros(links: usize) -> Self {
        let (none, zero) = (vec![Vector3::zeros(); links], vec![0.0; links]);
        Self { contact: none.clone(), self_contact: none, ground: zero.clone(), top: zero }
    }

    pub fn clear(&mut self) {
        self.contact.fill(Vector3::zeros());
        self.self_contact.fill(Vector3::zeros());
        self.ground.fill(0.0);
        self.top.fill(0.0);
    }

    /// Number of links, if all lists have as many entries.
    pub fn links(&self) -> Option<usize> {
        let links = self.contact.len();
        let others = [self.self_contact.len(), self.ground.len(), self.top.len()];
        others.iter().all(|others| *others == links).then_some(links)
    }
}
