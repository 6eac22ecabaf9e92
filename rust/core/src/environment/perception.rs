//! Locating pegs: the nearest ones in the view of the leading link, and the nearest one of each link (T 5.4).

use nalgebra::Vector2;

use crate::obstacles::Wall;
use crate::scene::Peg;

use super::config::Perception;

/// A link seen from above.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkPose {
    /// Its CG \[m\].
    pub x: f64,
    pub y: f64,
    /// Angle from +x to its axis, which points to the next link \[rad\].
    pub angle: f64,
}

/// A peg in the frame of a link: x forward, y to the left.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocatedPeg {
    /// Position of the peg's centre \[m\].
    pub forward: f64,
    pub left: f64,
    /// Distance from the link's CG to the peg's rim \[m\].
    pub distance: f64,
}

/// Range of the sensor of each link, where all links have one, as a share of the robot's length.
const REACH: f64 = 0.25;

/// Which links have a sensor.
#[derive(Debug, Clone)]
pub struct PegView {
    /// From the leading link.
    pub ahead: PegSensor,
    /// From each link; none where only the leading one has a sensor.
    pub along: Vec<PegSensor>,
}

impl PegView {
    /// Of a robot of `links` links and this length \[m\] that locates at most `count` pegs from its leading link.
    pub fn new(perception: Perception, count: usize, links: usize, length: f64) -> Self {
        let watchful = if perception == Perception::Body { links } else { 0 };
        Self { ahead: PegSensor::new(count, length), along: vec![PegSensor::new(1, REACH * length); watchful] }
    }

    /// Updates the sensors of the links; `link` returns their poses.
    pub fn scan(&mut self, link: impl Fn(usize) -> LinkPose, pegs: &[Peg], walls: &[Wall]) {
        self.ahead.scan(&link(0), pegs, walls);
        for (i, sensor) in self.along.iter_mut().enumerate() {
            sensor.scan(&link(i), pegs, walls);
        }
    }
}

/// Finds the pegs nearest to a link.
#[derive(Debug, Clone)]
pub struct PegSensor {
    count: usize,
    range: f64,
    located: Vec<LocatedPeg>,
}

impl PegSensor {
    /// A sensor that locates at most `count` pegs not farther than `range` \[m\].
    pub fn new(count: usize, range: f64) -> Self {
        Self { count, range, located: Vec::with_capacity(count + 1) }
    }

    /// Number of pegs located at most.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Farthest distance at which a peg is located \[m\].
    pub fn range(&self) -> f64 {
        self.range
    }

    /// The pegs located last, nearest first.
    pub fn located(&self) -> &[LocatedPeg] {
        &self.located
    }

    /// Locates the pegs and walls from a link at `pose`; a wall appears as a peg without size at its nearest point.
    pub fn scan(&mut self, pose: &LinkPose, pegs: &[Peg], walls: &[Wall]) {
        self.located.clear();
        let mut farthest = self.farthest_kept();
        for peg in pegs {
            let (x, y) = (peg.x - pose.x, peg.y - pose.y);
            let (squared, reach) = (x * x + y * y, farthest + peg.radius);
            if squared > reach * reach * (1.0 + ROUNDING) {
                continue;
            }
            self.keep_if_near(x, y, squared.sqrt() - peg.radius);
            farthest = self.farthest_kept();
        }
        let place = Vector2::new(pose.x, pose.y);
        let range = self.range;
        for wall in walls.iter().filter(|wall| wall.distance_bound(&place) < range) {
            let (distance, away) = wall.polygon.signed_distance(&place);
            self.keep_if_near(-distance * away.x, -distance * away.y, distance);
        }
        self.turn_to_link(pose.angle);
    }

    /// Distance below which a peg is kept \[m\].
    fn farthest_kept(&self) -> f64 {
        if self.located.len() < self.count {
            return self.range;
        }
        self.located.last().map_or(f64::NEG_INFINITY, |farthest| farthest.distance)
    }

    /// Keeps a peg at (x, y) from the link's CG, in the world's axes, if it is nearer than what has been kept.
    fn keep_if_near(&mut self, x: f64, y: f64, distance: f64) {
        if distance < self.farthest_kept() {
            let place = self.located.partition_point(|kept| kept.distance <= distance);
            self.located.truncate(self.count - 1);
            self.located.insert(place, LocatedPeg { forward: x, left: y, distance });
        }
    }

    /// Turns the kept positions from the world's axes to those of a link at `angle`. Forward is -e_x^B: link 1 leads and
    /// its axis points to link 2.
    fn turn_to_link(&mut self, angle: f64) {
        if self.located.is_empty() {
            return;
        }
        let (sin, cos) = angle.sin_cos();
        for peg in &mut self.located {
            let (x, y) = (peg.forward, peg.left);
            (peg.forward, peg.left) = (-(x * cos + y * sin), x * sin - y * cos);
        }
    }
}

/// Allowance for rounding where squared distances are compared.
const ROUNDING: f64 = 1e-9;

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn finds_the_nearest_pegs_in_the_frame_of_the_leading_link() {
        // The link looks along +x: theta is pi.
        let pose = LinkPose { x: 1.0, y: 0.0, angle: PI };
        let pegs = [[0.1, 1.5, 0.2], [0.1, 1.3, -0.1], [0.3, 0.2, 0.0], [0.1, 9.0, 0.0]].map(Peg::from);
        let mut sensor = PegSensor::new(2, 1.0);
        sensor.scan(&pose, &pegs, &[]);
        let [first, second] = sensor.located() else { panic!("two pegs of the three in range") };
        assert!((first.forward - 0.3).abs() < 1e-15 && (first.left + 0.1).abs() < 1e-15);
        assert!((second.forward - 0.5).abs() < 1e-15 && (second.left - 0.2).abs() < 1e-15);
        assert!((second.distance - (0.29f64.sqrt() - 0.1)).abs() < 1e-15);
    }

    #[test]
    fn a_robot_that_looks_from_all_its_links_sees_what_a_sensor_on_each_would() {
        let pegs = [[0.1, 0.3, 0.2], [0.1, 1.2, -0.25], [0.05, 2.0, 0.0]].map(Peg::from);
        let link = |i: usize| LinkPose { x: 0.1 + 0.6 * i as f64, y: 0.0, angle: PI + 0.2 * i as f64 };
        let mut peg_view = PegView::new(Perception::Body, 2, 3, 1.2);
        peg_view.scan(link, &pegs, &[]);
        for (i, along) in peg_view.along.iter().enumerate() {
            let mut alone = PegSensor::new(1, 0.3);
            alone.scan(&link(i), &pegs, &[]);
            assert_eq!(along.located(), alone.located());
        }
        let seen: Vec<usize> = peg_view.along.iter().map(|sensor| sensor.located().len()).collect();
        assert_eq!(seen, [1, 0, 1], "a quarter of its length reaches a peg from the first and from the last link");
        assert_eq!(peg_view.ahead.located().len(), 2);
        assert!(PegView::new(Perception::Pegs, 2, 3, 1.2).along.is_empty());
    }

    #[test]
    fn agrees_with_sorting_all_pegs() {
        let pegs: Vec<Peg> = (0..40)
            .map(|k| Peg {
                radius: 0.01 + 0.002 * f64::from(k % 9),
                x: 0.3 * f64::from(k % 7),
                y: 0.2 * f64::from(k % 11),
            })
            .collect();
        let pose = LinkPose { x: 0.9, y: 0.7, angle: 1.0 };
        let mut sensor = PegSensor::new(6, 0.8);
        sensor.scan(&pose, &pegs, &[]);
        let distance = |p: &Peg| ((p.x - 0.9).powi(2) + (p.y - 0.7).powi(2)).sqrt() - p.radius;
        let mut all: Vec<f64> = pegs.iter().map(distance).collect();
        all.sort_by(f64::total_cmp);
        let near: Vec<f64> = all.into_iter().filter(|d| *d < 0.8).take(6).collect();
        assert_eq!(sensor.located().iter().map(|peg| peg.distance).collect::<Vec<_>>(), near);
    }
}
