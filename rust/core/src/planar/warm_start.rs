use nalgebra::{Vector2, Vector3};
use serde::{Deserialize, Serialize};

use crate::contact::{ContactMemory, LINK_CONTACTS_PER_LINK, LINK_PAIR_CONTACTS, NearObstacles};
use crate::obstacles::ObstacleGrid;
use crate::stepping;

/// What a stage passes to the next one: forces as an initial guess, and which contacts were closed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WarmStart {
    /// Friction force on each link, and on what it can push, in its own frame \[N\].
    pub friction: Vec<Vector2<f64>>,
    /// Moment of the ground against the spin of each link, empty where it does not resist it \[N m\].
    #[serde(default)]
    pub spin: Vec<f64>,
    /// tau_C of each joint at the end of the last step, thesis sign (T 3.51) \[N m\].
    pub joint_torque: Vec<f64>,
    pub near: NearObstacles,
    /// Contacts of the robot with itself.
    pub self_contacts: ContactMemory,
    /// Twists of the links with which a postponed stage is solved again; empty where none is.
    #[serde(skip)]
    pub guess: Vec<Vector3<f64>>,
    /// Forces at both stops of each joint, empty where none presses \[N\].
    pub joint_stops: Vec<[f64; 2]>,
    /// Position of each joint in its backlash, phi less the motor's angle \[rad\].
    pub backlash: Vec<f64>,
    /// Torque of the friction in the gear of each joint's motor, empty without motors \[N m\].
    pub gear_friction: Vec<f64>,
}

impl stepping::WarmStart for WarmStart {
    type Saved = Self;

    fn new(links: usize) -> Self {
        Self {
            friction: vec![Vector2::zeros(); links],
            spin: Vec::new(),
            joint_torque: vec![0.0; links - 1],
            near: NearObstacles::with_capacity(links),
            self_contacts: ContactMemory::with_capacity(LINK_CONTACTS_PER_LINK * links),
            guess: Vec::with_capacity(links),
            joint_stops: Vec::with_capacity(links - 1),
            backlash: vec![0.0; links - 1],
            gear_friction: Vec::new(),
        }
    }

    fn clear(&mut self) {
        self.friction.clear();
        self.friction.resize(self.joint_torque.len() + 1, Vector2::zeros());
        self.spin.clear();
        self.joint_torque.fill(0.0);
        self.near.clear();
        self.self_contacts.clear();
        self.guess.clear();
        self.joint_stops.clear();
        self.backlash.fill(0.0);
        self.gear_friction.clear();
    }

    fn save(&self) -> Self {
        self.clone()
    }

    fn resume(&mut self, saved: &Self) {
        let Self { friction, spin, joint_torque, near, self_contacts, guess, joint_stops, backlash, gear_friction } =
            saved;
        self.friction.clone_from(friction);
        self.spin.clone_from(spin);
        self.joint_torque.clone_from(joint_torque);
        self.near.copy_from(near);
        self.self_contacts.copy_from(self_contacts);
        self.guess.clone_from(guess);
        self.joint_stops.clone_from(joint_stops);
        self.backlash.clone_from(backlash);
        self.gear_friction.clone_from(gear_friction);
    }

    fn fits(saved: &Self, links: usize, obstacles: &ObstacleGrid) -> bool {
        let nodes = links + obstacles.movables().len();
        [links, nodes].contains(&saved.friction.len())
            && [0, links, nodes].contains(&saved.spin.len())
            && saved.joint_torque.len() == links - 1
            && [0, links - 1].contains(&saved.joint_stops.len())
            && saved.backlash.len() == links - 1
            && [0, links - 1].contains(&saved.gear_friction.len())
            && saved.near.fits(nodes, obstacles)
            && saved.self_contacts.fits(links, obstacles, LINK_PAIR_CONTACTS)
    }
}
