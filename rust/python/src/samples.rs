//! The columns of a `Trajectory`.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use snake_core::obstacles::{Movable, Moved};

use crate::numbers::set_array;

/// Columns by name, all of one length.
#[derive(Default)]
pub struct Samples {
    columns: Vec<Column>,
    /// \[m\]
    pub max_joint_gap: f64,
    /// \[m\]
    pub max_penetration: f64,
}

struct Column {
    name: &'static str,
    /// Of one row.
    shape: Vec<usize>,
    rows: usize,
    /// Row by row.
    values: Vec<f64>,
}

impl Samples {
    /// Adds a row, of the given shape, to a column; the first one makes it.
    pub fn put(&mut self, name: &'static str, shape: &[usize], row: impl IntoIterator<Item = f64>) {
        let known = self.columns.iter().position(|column| column.name == name);
        let k = known.unwrap_or_else(|| {
            self.columns.push(Column { name, shape: shape.to_vec(), rows: 0, values: Vec::new() });
            self.columns.len() - 1
        });
        self.columns[k].rows += 1;
        self.columns[k].values.extend(row);
    }

    /// Adds where obstacles that can be pushed are, if there are any, and heights if some of them are balls.
    pub fn put_movables<'a>(&mut self, movables: impl Iterator<Item = (&'a Movable, &'a Moved)> + Clone) {
        let (count, moved) = (movables.clone().count(), movables.clone().map(|(_, moved)| moved));
        if count > 0 {
            let places = moved.clone().flat_map(|moved| [moved.pose.x, moved.pose.y]);
            self.put("obstacle_position", &[count, 2], places);
            self.put("obstacle_angle", &[count], moved.clone().map(|moved| moved.pose.z));
        }
        if movables.map(|(movable, _)| movable.ball).any(|ball| ball.is_some()) {
            self.put("obstacle_height", &[count], moved.map(|moved| moved.out_of_plane.height));
        }
    }

    /// And how fast they move.
    pub fn put_movable_velocities(&mut self, movables: &[Moved]) {
        if !movables.is_empty() {
            let velocities = movables.iter().flat_map(|moved| [moved.twist.x, moved.twist.y]);
            self.put("obstacle_velocity", &[movables.len(), 2], velocities);
        }
    }

    /// Memory of all columns.
    pub fn bytes(&self) -> f64 {
        self.columns.iter().map(|column| size_of_val(&column.values[..]) as f64).sum()
    }

    /// The fields of `Trajectory`.
    pub fn into_dict(self, py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
        let dict = PyDict::new(py);
        for Column { name, shape, rows, values } in self.columns {
            set_array(&dict, name, values, &[&[rows], &shape[..]].concat())?;
        }
        dict.set_item("max_joint_gap", self.max_joint_gap)?;
        dict.set_item("max_penetration", self.max_penetration)?;
        Ok(dict)
    }
}
