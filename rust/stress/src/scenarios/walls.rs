//! Corners of walls: convex ones that meet the body, concave ones that the body is pushed into, and rooms too small for it.

use snake_core::control::ControllerConfig;
use snake_core::gait::Wave;
use snake_core::obstacles::{Obstacle, Shape};

use crate::case::{Case, Motion};

/// Robots thrown and driven into the corners, coiled and knotted between them; `friction` at the walls.
pub fn corners(friction: f64, duration: f64) -> Vec<Case> {
    let ways = [
        ("thrown", [-3.0, 0.0], Motion::Hold(0.0)),
        ("undulating", [-0.3, 0.0], Motion::Wave(Wave { amplitude: 0.5, omega: 4.0, ..Wave::default() })),
        ("jumping", [-0.3, 0.2], Motion::Jump { angle: 1.2, rate: 1.3 }),
        ("coiling", [-0.3, 0.0], Motion::Hold(1.1)),
    ];
    let mut cases = Vec::new();
    for (place, obstacles) in places(friction) {
        for (way, velocity, motion) in ways {
            for (step, torque_limit) in [(1e-2, None), (2.5e-2, Some(10.0)), (5e-2, None)] {
                let mut case = Case::straight(format!("{way}, {place}, h {step} s"), step, duration);
                case.scene.obstacles = obstacles.clone();
                case.controller = ControllerConfig { torque_limit, ..ControllerConfig::default() };
                (case.velocity, case.motion) = (velocity, motion);
                cases.push(case);
            }
        }
    }
    cases
}

/// What is around the robot, which lies from x = -0.1 m, its head, to 1.32 m.
fn places(friction: f64) -> [(&'static str, Vec<Obstacle>); 5] {
    let rough = |shape| Obstacle { friction, ..Obstacle::endless(shape) };
    let wall = |start, end| rough(Shape::Segment { start, end });
    let square = |x, y, angle| rough(Shape::Box { size: [0.3, 0.3], x, y, angle });
    let triangle = |tip: [f64; 2], to: f64| {
        rough(Shape::Polygon { vertices: vec![tip, [tip[0] - 0.15, tip[1] + to], [tip[0] + 0.15, tip[1] + to]] })
    };
    [
        // Corners that point at the head and at the flank.
        ("corners of boxes", vec![square(-0.4, 0.02, 0.7), square(0.35, 0.32, 0.8), square(0.8, -0.3, 0.75)]),
        // Tips at the joints, from either side in turns: the body is held like a rope between teeth.
        ("teeth", (0..9).map(|k| teeth(&triangle, k)).collect()),
        ("a corner of 35 degrees", vec![wall([-0.6, 0.0], [1.5, 0.66]), wall([-0.6, 0.0], [1.5, -0.66])]),
        ("a room of 1.6 m x 0.3 m", room([-0.25, -0.15], [1.35, 0.15]).map(|[a, b]| wall(a, b)).to_vec()),
        // The mouth is narrower than two links side by side, the pocket wider.
        (
            "a pocket",
            vec![
                square(-0.15, 0.225, 0.0),
                square(-0.15, -0.225, 0.0),
                wall([-0.3, 0.375], [-0.9, 0.375]),
                wall([-0.3, -0.375], [-0.9, -0.375]),
                wall([-0.9, 0.375], [-0.9, -0.375]),
            ],
        ),
    ]
}

fn teeth(triangle: &impl Fn([f64; 2], f64) -> Obstacle, k: i32) -> Obstacle {
    let side = if k % 2 == 0 { 1.0 } else { -1.0 };
    triangle([0.122 * (f64::from(k) + 0.5), side * 0.0535], side * 0.3)
}

/// The sides of a rectangle.
fn room([left, low]: [f64; 2], [right, high]: [f64; 2]) -> [[[f64; 2]; 2]; 4] {
    let corners = [[left, low], [right, low], [right, high], [left, high]];
    std::array::from_fn(|side| [corners[side], corners[(side + 1) % 4]])
}
