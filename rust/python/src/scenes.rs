//! Scenes of Python, each converted once: robots and episodes share their obstacles.

use std::collections::HashMap;
use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::PyWeakrefReference;
use snake_core::ConfigError;
use snake_core::capabilities::{Feature, Method, require_supported_obstacle};
use snake_core::environment::EnvConfig;
use snake_core::error::require;
use snake_core::obstacles::{Obstacle, ObstacleGrid};
use snake_core::scene::{Scene, SceneConfig};

use crate::ffi::CoreError;
use crate::from_python::from_python;

/// The obstacles of the scenes that are alive, by the addresses of their objects, which do not change.
#[derive(Default)]
pub struct Scenes(HashMap<usize, (Py<PyWeakrefReference>, Arc<ObstacleGrid>)>);

impl Scenes {
    /// Forgets the scenes that are gone.
    pub fn forget(&mut self, py: Python<'_>) {
        self.0.retain(|_, (scene, _)| scene.bind(py).upgrade().is_some());
    }

    /// The obstacles of a scene.
    pub fn obstacles(&mut self, scene: &Bound<'_, PyAny>, config: &EnvConfig) -> PyResult<Arc<ObstacleGrid>> {
        let address = scene.as_ptr() as usize;
        if let Some((_, known)) = self.0.get(&address) {
            return Ok(Arc::clone(known));
        }
        let written: SceneConfig = from_python(scene).map_err(|e| CoreError::from(e.inside("scene")))?;
        let obstacles = Arc::new(ObstacleGrid::of(&obstacles_of(&written, config).map_err(CoreError::from)?));
        // Mappings change and cannot be known again.
        if let Ok(alive) = PyWeakrefReference::new(scene) {
            self.0.insert(address, (alive.unbind(), Arc::clone(&obstacles)));
        }
        Ok(obstacles)
    }
}

/// The ground is that of the environment: only obstacles differ between robots.
fn obstacles_of(scene: &SceneConfig, config: &EnvConfig) -> Result<Vec<Obstacle>, ConfigError> {
    let obstacles = Scene::new(scene).map_err(|e| e.inside("scene"))?.obstacles.clone();
    let on = (config.model.name(), Method::Implicit);
    for (j, obstacle) in obstacles.iter().enumerate() {
        let field = format!("scene.obstacles[{j}]");
        Feature::Walls.require(on, obstacle.is_wall(), &field, format!("{:?}", obstacle.shape))?;
        require_supported_obstacle(on, obstacle, &field)?;
    }
    let ground = config.scene(Vec::new());
    let same = SceneConfig { obstacles: Vec::new(), ..scene.clone() } == ground;
    let value = format!("friction {:?}, or another property of the ground", scene.friction);
    let expected = format!("the ground of the environment, friction {:?}: scenes differ in obstacles", ground.friction);
    require(same, "scene", value, &expected)?;
    Ok(obstacles)
}
