//! The thesis's courses, by name.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use snake_core::scene::{START_7_3, START_7_5, START_FREE, START_SPATIAL_7_3, START_SPATIAL_7_5, TABLE_7_3, TABLE_7_5};

struct Course {
    name: &'static str,
    /// (radius, x, y)
    obstacles: &'static [[f64; 3]],
    /// (x, y, heading)
    start: [f64; 3],
    /// The same for the spatial model.
    spatial_start: [f64; 3],
}

const COURSES: [Course; 3] = [
    Course { name: "table-7.3", obstacles: &TABLE_7_3, start: START_7_3, spatial_start: START_SPATIAL_7_3 },
    Course { name: "table-7.5", obstacles: &TABLE_7_5, start: START_7_5, spatial_start: START_SPATIAL_7_5 },
    Course { name: "free", obstacles: &[], start: START_FREE, spatial_start: START_FREE },
];

/// The thesis's courses: name -> {"obstacles": [[radius, x, y], ...], "start": [x, y, heading], "spatial_start": ...}.
#[pyfunction]
pub fn courses(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    let courses = PyDict::new(py);
    for Course { name, obstacles, start, spatial_start } in COURSES {
        let course = PyDict::new(py);
        course.set_item("obstacles", obstacles.to_vec())?;
        course.set_item("start", start)?;
        course.set_item("spatial_start", spatial_start)?;
        courses.set_item(name, course)?;
    }
    Ok(courses)
}
