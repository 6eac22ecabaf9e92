//! Ground contact of the spatial model: gaps against closed forms.

use std::f64::consts::PI;

use nalgebra::Vector3;
use snake_core::robot::{Link, Robot, RobotConfig};
use snake_core::spatial::{End, Pose, assemble_chain, ground_gap, orientation_of, rest_on_ground};
use snake_test_support::planar::{Random, links};
use snake_test_support::spatial_random::{random_angle, random_pose};

#[test]
fn ground_gap_is_the_height_of_the_sphere_above_the_ground() {
    let link = Link { cg_offset: 0.013, ..Robot::new(&RobotConfig::default()).unwrap().links[0] };
    let at = |pitch: f64, roll: f64| Pose {
        position: Vector3::new(0.3, -0.2, 0.2),
        orientation: orientation_of(0.7, pitch, roll),
    };
    for (pitch, roll) in [(0.0, 0.0), (0.4, 0.0), (-1.2, 2.0), (0.5 * PI, 0.3)] {
        let [front, rear] = [0.013 + 0.0393, 0.013 - 0.0393].map(|along| 0.2 + along * pitch.sin() - 0.0525);
        assert!((ground_gap(&link, &at(pitch, roll), End::Front) - front).abs() < 1e-15);
        assert!((ground_gap(&link, &at(pitch, roll), End::Rear) - rear).abs() < 1e-15);
    }
}

#[test]
fn a_chain_put_on_the_ground_touches_it_and_nowhere_enters_it() {
    let mut random = Random::new(52);
    for _ in 0..200 {
        let robot = Robot::new(&links(6)).unwrap();
        let mut pose = vec![Pose::identity(); 6];
        let angles: Vec<_> = (0..5).map(|_| random_angle(&mut random, 1.0)).collect();
        assemble_chain(&robot, random_pose(&mut random), &angles, &mut pose);
        rest_on_ground(&robot, &mut pose);
        let gaps = robot.links.iter().zip(&pose).flat_map(|(link, q)| End::BOTH.map(|end| ground_gap(link, q, end)));
        let lowest = gaps.fold(f64::INFINITY, f64::min);
        assert!(lowest.abs() < 1e-15);
    }
}
