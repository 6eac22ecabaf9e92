//! The simulator in a web page: one robot with a task, stepped by a gait or by a shipped policy, among pegs that can be
//! moved. `make playground` compiles this crate to WebAssembly; the page is in `web/`.
//!
//! One direction of imports: `{policy, shown} <- session <- lib`.

mod policy;
mod session;
mod shown;

use serde_json::json;
use snake_core::environment::action::ActionEntry;
use snake_core::environment::{EnvConfig, ModelKind, PlanarRobot, SpatialRobot};
use snake_core::obstacles::Peg;
use wasm_bindgen::prelude::*;

use policy::Policy;
use session::{Play, Session};

/// One robot of either model.
#[wasm_bindgen]
pub struct Playground {
    play: Box<dyn Play>,
}

#[wasm_bindgen]
impl Playground {
    /// A robot at the start of the episode of `seed`.
    ///
    /// `config` holds the keywords of the Python environments as JSON.
    ///
    /// # Errors
    /// Names the keyword, its value and what is admissible.
    #[wasm_bindgen(constructor)]
    pub fn new(config: &str, seed: u32) -> Result<Playground, JsError> {
        let config: EnvConfig = serde_json::from_str(config)?;
        let mut play: Box<dyn Play> = match config.model {
            ModelKind::Planar => Box::new(Session::<PlanarRobot>::new(&config)?),
            ModelKind::Spatial => Box::new(Session::<SpatialRobot>::new(&config)?),
        };
        play.reset(u64::from(seed));
        Ok(Self { play })
    }

    /// Changes the ground, the task or the robot's parameters and goes on from the present state.
    ///
    /// # Errors
    /// Names the keyword, or the model, the number of links or the action mode differ; nothing has changed then.
    pub fn reconfigure(&mut self, config: &str) -> Result<(), JsError> {
        let config: EnvConfig = serde_json::from_str(config)?;
        Ok(self.play.reconfigure(&config)?)
    }

    /// Starts the episode of a seed.
    pub fn reset(&mut self, seed: u32) {
        self.play.reset(u64::from(seed));
    }

    /// Entries of the action, blocks of the observation and shape of the links, as JSON.
    pub fn layout(&self) -> String {
        let describe = |entry: &ActionEntry| {
            json!({"name": entry.name, "low": entry.low(), "high": entry.high(), "centre": entry.centre,
                   "unit": entry.parameter.unit(), "meaning": entry.meaning})
        };
        let entries: Vec<_> = self.play.actions().iter().map(describe).collect();
        let robot = self.play.robot();
        let links: Vec<_> = robot.links.iter().map(|link| [link.contact_half_length, link.radius]).collect();
        json!({"action": entries, "blocks": self.play.blocks(), "links": links, "control_period": self.play.control_period(),
               "torque_limit": self.play.torque_limit()})
        .to_string()
    }

    /// Lets the gait drive, with these values of the first entries of the action, in their units.
    pub fn use_gait(&mut self, values: &[f64]) {
        self.play.use_gait(values);
    }

    /// Lets a policy drive: the bytes of a `policy.safetensors`.
    ///
    /// # Errors
    /// The file is of another kind, or the policy observes something else than this robot does.
    pub fn use_policy(&mut self, bytes: &[u8]) -> Result<(), JsError> {
        let policy = Policy::read(bytes).map_err(|message| JsError::new(&message))?;
        self.play.use_policy(policy).map_err(|message| JsError::new(&message))
    }

    /// One control period.
    pub fn step(&mut self) {
        self.play.step();
    }

    /// Pulls a link towards a point \[m\] with a spring from the next step on.
    pub fn pull(&mut self, link: usize, x: f64, y: f64, z: f64) {
        self.play.pull(Some((link, [x, y, z].into())));
    }

    /// Ends the pull.
    pub fn release(&mut self) {
        self.play.pull(None);
    }

    /// Force of the pull in the last step, frame I \[N\].
    pub fn pull_force(&self) -> Vec<f64> {
        self.play.pull_force().as_slice().into()
    }

    /// Seven numbers for each link: position \[m\], and the quaternion, w last, that turns z into its centre line.
    pub fn links(&self) -> Vec<f64> {
        self.play.links()
    }

    /// Mean force of the pegs on each link over the last control period, three numbers each \[N\].
    pub fn contact_force(&self) -> Vec<f64> {
        self.play.contact_force()
    }

    /// Torques of the actuators in the last step; in 3D yaw and pitch of each joint \[N m\].
    pub fn joint_torque(&self) -> Vec<f64> {
        self.play.joint_torque()
    }

    /// Radius, x and y of each peg, of each ball, or of the circle around a box, where it is \[m\].
    pub fn pegs(&self) -> Vec<f64> {
        self.play.pegs().iter().flat_map(|peg| [peg.radius, peg.x, peg.y]).collect()
    }

    /// Of each peg on a spring its number, and x and y of the place where the spring holds it \[m\].
    pub fn springs(&self) -> Vec<f64> {
        self.play.springs().iter().flat_map(|(peg, home)| [*peg as f64, home.x, home.y]).collect()
    }

    /// Of each box its number among the pegs, its sides \[m\] and its angle \[rad\].
    pub fn boxes(&self) -> Vec<f64> {
        self.play.boxes().iter().flat_map(|(peg, size, angle)| [*peg as f64, size[0], size[1], *angle]).collect()
    }

    /// Of each ball its number among the pegs, and the height of its centre \[m\].
    pub fn balls(&self) -> Vec<f64> {
        self.play.balls().iter().flat_map(|(peg, height)| [*peg as f64, *height]).collect()
    }

    /// Moves a peg towards a point \[m\]; it stops where it would touch the robot, or something that moves.
    pub fn move_peg(&mut self, peg: usize, x: f64, y: f64) {
        self.play.move_peg(peg, x, y);
    }

    /// Adds a peg, `fixed`, on a `spring` or `loose`, or a `box` or a `ball` that can be pushed, or returns false where the robot is in
    /// its place.
    ///
    /// # Errors
    /// There is no such kind.
    pub fn add_peg(&mut self, kind: &str, radius: f64, x: f64, y: f64) -> Result<bool, JsError> {
        let kind = serde_json::from_value(kind.into())?;
        Ok(self.play.add_peg(kind, Peg { radius, x, y }))
    }

    pub fn remove_peg(&mut self, peg: usize) {
        self.play.remove_peg(peg);
    }

    /// x, y and radius of the goal; the radius is 0 for a line, all are not numbers without a goal \[m\].
    pub fn goal(&self) -> Vec<f64> {
        self.play.goal().into()
    }

    /// The current observation.
    pub fn observation(&self) -> Vec<f32> {
        self.play.observation().into()
    }

    /// The current action, in \[-1, 1\].
    pub fn action(&self) -> Vec<f64> {
        self.play.action().into()
    }

    /// Signals of the last step by name, as JSON, and `worst_residual`, the largest residual of the episode.
    pub fn signals(&self) -> String {
        let mut signals = serde_json::Map::new();
        for (name, value) in self.play.signals() {
            signals.insert(name, json!(value));
        }
        signals.insert("worst_residual".into(), json!(self.play.worst_residual()));
        serde_json::Value::from(signals).to_string()
    }

    /// Residual of the last step \[m/s\].
    pub fn residual(&self) -> f64 {
        self.play.residual()
    }

    /// Whether the episode has ended.
    pub fn has_ended(&self) -> bool {
        self.play.has_ended()
    }
}

/// Environment id and keywords that a policy was trained with, as JSON.
///
/// # Errors
/// The bytes are not those of a `policy.safetensors`.
#[wasm_bindgen]
pub fn policy_environment(bytes: &[u8]) -> Result<String, JsError> {
    let policy = Policy::read(bytes).map_err(|message| JsError::new(&message))?;
    Ok(policy.environment().to_string())
}
