//! Locating obstacles: the nearest ones in the view of the leading link, and the nearest one of each link (T 5.4).

use nalgebra::Vector2;

use crate::obstacles::{ObstacleGrid, PlacedMovable, WallGrid};

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
    /// Its number, which decides between equal distances.
    number: usize,
}

/// Range of the sensor of each link, where all links have one, as a share of the robot's length.
const REACH: f64 = 0.25;

/// What there is to locate; walls are known exactly.
#[derive(Debug, Clone, Copy)]
pub struct Surroundings<'a, M> {
    pub obstacles: &'a ObstacleGrid,
    pub walls: &'a WallGrid,
    /// Obstacles that can be pushed, where they are.
    pub movables: M,
}

impl<'a> Surroundings<'a, std::iter::Empty<PlacedMovable<'a>>> {
    /// Nothing that can be pushed.
    pub fn fixed(obstacles: &'a ObstacleGrid, walls: &'a WallGrid) -> Self {
        Self { obstacles, walls, movables: std::iter::empty() }
    }
}

/// Which links have a sensor.
#[derive(Debug, Clone)]
pub struct PegView {
    /// From the leading link.
    pub ahead: PegSensor,
    /// From each link; none where only the leading one has a sensor.
    pub along: Vec<PegSensor>,
    /// Pegs that may be in the range of a link.
    nearby: Vec<usize>,
}

impl PegView {
    /// Of a robot of `links` links and this length \[m\] that locates at most `count` obstacles from its leading link.
    pub fn new(perception: Perception, count: usize, links: usize, length: f64) -> Self {
        let watchful = if perception == Perception::Body { links } else { 0 };
        let along = vec![PegSensor::new(1, REACH * length); watchful];
        Self { ahead: PegSensor::new(count, length), along, nearby: Vec::with_capacity(NEARBY) }
    }

    /// Updates the sensors of the links; `link` returns their poses.
    pub fn scan<'a, M: Iterator<Item = PlacedMovable<'a>> + Clone>(
        &mut self,
        link: impl Fn(usize) -> LinkPose,
        around: &Surroundings<M>,
    ) {
        self.ahead.scan(&link(0), around);
        let Self { along, nearby, .. } = self;
        let Some(sensor) = along.first() else { return };
        let centre = link(along.len() / 2);
        let squared_distance = |pose: LinkPose| (pose.x - centre.x).powi(2) + (pose.y - centre.y).powi(2);
        let extent = (0..along.len()).map(|i| squared_distance(link(i))).fold(0.0, f64::max).sqrt();
        nearby.clear();
        nearby.extend(around.obstacles.near(centre.x, centre.y, extent + sensor.range));
        for (i, sensor) in along.iter_mut().enumerate() {
            sensor.scan_among(nearby.iter().copied(), &link(i), around);
        }
    }
}

/// Finds the obstacles nearest to a link.
#[derive(Debug, Clone)]
pub struct PegSensor {
    count: usize,
    range: f64,
    located: Vec<LocatedPeg>,
}

impl PegSensor {
    /// A sensor that locates at most `count` obstacles not farther than `range` \[m\].
    pub fn new(count: usize, range: f64) -> Self {
        Self { count, range, located: Vec::with_capacity(count + 1) }
    }

    /// Number of obstacles located at most.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Farthest distance at which a peg is located \[m\].
    pub fn range(&self) -> f64 {
        self.range
    }

    /// The obstacles located last, nearest first.
    pub fn located(&self) -> &[LocatedPeg] {
        &self.located
    }

    /// Locates the obstacles and walls from a link at `pose`; a wall, or a polygon that can be pushed, appears as a
    /// peg without size at its nearest point.
    pub fn scan<'a, M: Iterator<Item = PlacedMovable<'a>> + Clone>(
        &mut self,
        pose: &LinkPose,
        around: &Surroundings<M>,
    ) {
        self.scan_among(around.obstacles.near(pose.x, pose.y, self.range), pose, around);
    }

    /// The same where only these obstacles may be in range.
    fn scan_among<'a, M: Iterator<Item = PlacedMovable<'a>> + Clone>(
        &mut self,
        numbers: impl Iterator<Item = usize>,
        pose: &LinkPose,
        around: &Surroundings<M>,
    ) {
        self.located.clear();
        let Surroundings { obstacles, walls, movables } = around;
        let mut movables = movables.clone().enumerate().peekable();
        if self.count == 0 || obstacles.is_empty() && walls.walls().is_empty() && movables.peek().is_none() {
            return;
        }
        let mut farthest = self.range;
        let fixed = obstacles.pegs().len() + walls.walls().len();
        let discs = movables.clone().filter_map(|(k, movable)| Some((fixed + k, movable.disc()?)));
        numbers.map(|number| (number, obstacles.pegs()[number])).chain(discs).for_each(|(number, peg)| {
            let (x, y) = (peg.x - pose.x, peg.y - pose.y);
            let (squared, reach) = (x * x + y * y, farthest + peg.radius);
            if squared <= reach * reach * (1.0 + ROUNDING) {
                self.keep_if_near(LocatedPeg { forward: x, left: y, distance: squared.sqrt() - peg.radius, number });
                farthest = self.farthest_kept();
            }
        });
        let place = Vector2::new(pose.x, pose.y);
        for wall in walls.near(place, self.range) {
            let (distance, away) = walls.walls()[wall].polygon.signed_distance(&place);
            let number = obstacles.pegs().len() + wall;
            let (forward, left) = (-distance * away.x, -distance * away.y);
            self.keep_if_near(LocatedPeg { forward, left, distance, number });
        }
        for (k, movable) in movables {
            let Some((outline, turn)) = movable.outline() else { continue };
            let (distance, away) = outline.signed_distance(&(turn.inverse() * (place - movable.pose.xy())));
            let to_it = turn * away * -distance;
            self.keep_if_near(LocatedPeg { forward: to_it.x, left: to_it.y, distance, number: fixed + k });
        }
        self.turn_to_link(pose.angle);
    }

    /// Distance beyond which no peg is kept \[m\].
    fn farthest_kept(&self) -> f64 {
        if self.located.len() < self.count { self.range } else { self.located[self.count - 1].distance }
    }

    /// Keeps a peg, its position in the world's axes, if it is in range and nearer than what has been kept.
    fn keep_if_near(&mut self, peg: LocatedPeg) {
        let place = self.located.partition_point(|kept| (kept.distance, kept.number) < (peg.distance, peg.number));
        if peg.distance < self.range && place < self.count {
            self.located.truncate(self.count - 1);
            self.located.insert(place, peg);
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

/// Pegs reserved for near a robot; a denser field grows the list once.
const NEARBY: usize = 128;

/// Allowance for rounding where squared distances are compared.
const ROUNDING: f64 = 1e-9;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::obstacles::Peg;
    use std::f64::consts::PI;

    #[test]
    fn finds_the_nearest_pegs_in_the_frame_of_the_leading_link() {
        // The link looks along +x: theta is pi.
        let pose = LinkPose { x: 1.0, y: 0.0, angle: PI };
        let obstacles = [[0.1, 1.5, 0.2], [0.1, 1.3, -0.1], [0.3, 0.2, 0.0], [0.1, 9.0, 0.0]].map(Peg::from);
        let mut sensor = PegSensor::new(2, 1.0);
        sensor.scan(&pose, &Surroundings::fixed(&ObstacleGrid::new(&obstacles), &WallGrid::default()));
        let [first, second] = sensor.located() else { panic!("two obstacles of the three in range") };
        assert!((first.forward - 0.3).abs() < 1e-15 && (first.left + 0.1).abs() < 1e-15);
        assert!((second.forward - 0.5).abs() < 1e-15 && (second.left - 0.2).abs() < 1e-15);
        assert!((second.distance - (0.29f64.sqrt() - 0.1)).abs() < 1e-15);
    }

    #[test]
    fn perception_from_all_links_is_that_of_a_sensor_on_each() {
        let obstacles = [[0.1, 0.3, 0.2], [0.1, 1.2, -0.25], [0.05, 2.0, 0.0]].map(Peg::from);
        let link = |i: usize| LinkPose { x: 0.1 + 0.6 * i as f64, y: 0.0, angle: PI + 0.2 * i as f64 };
        let mut peg_view = PegView::new(Perception::Body, 2, 3, 1.2);
        peg_view.scan(link, &Surroundings::fixed(&ObstacleGrid::new(&obstacles), &WallGrid::default()));
        for (i, along) in peg_view.along.iter().enumerate() {
            let mut alone = PegSensor::new(1, 0.3);
            alone.scan(&link(i), &Surroundings::fixed(&ObstacleGrid::new(&obstacles), &WallGrid::default()));
            assert_eq!(along.located(), alone.located());
        }
        let seen: Vec<usize> = peg_view.along.iter().map(|sensor| sensor.located().len()).collect();
        assert_eq!(seen, [1, 0, 1], "a quarter of its length reaches a peg from the first and from the last link");
        assert_eq!(peg_view.ahead.located().len(), 2);
        assert!(PegView::new(Perception::Pegs, 2, 3, 1.2).along.is_empty());
    }

    #[test]
    fn of_pegs_at_the_same_distance_the_first_is_kept() {
        let obstacles = [[0.1, 0.0, 0.5], [0.1, 0.0, -0.5], [0.1, -0.5, 0.0], [0.1, 0.5, 0.0]].map(Peg::from);
        let mut sensor = PegSensor::new(3, 1.0);
        sensor.scan(
            &LinkPose { x: 0.0, y: 0.0, angle: PI },
            &Surroundings::fixed(&ObstacleGrid::new(&obstacles), &WallGrid::default()),
        );
        let numbers: Vec<usize> = sensor.located().iter().map(|peg| peg.number).collect();
        assert_eq!(numbers, [0, 1, 2], "however the grid visits them");
    }

    #[test]
    fn agrees_with_sorting_all_pegs() {
        let obstacles: Vec<Peg> = (0..40)
            .map(|k| Peg {
                radius: 0.01 + 0.002 * f64::from(k % 9),
                x: 0.3 * f64::from(k % 7),
                y: 0.2 * f64::from(k % 11),
            })
            .collect();
        let pose = LinkPose { x: 0.9, y: 0.7, angle: 1.0 };
        let mut sensor = PegSensor::new(6, 0.8);
        sensor.scan(&pose, &Surroundings::fixed(&ObstacleGrid::new(&obstacles), &WallGrid::default()));
        let distance = |p: &Peg| ((p.x - 0.9).powi(2) + (p.y - 0.7).powi(2)).sqrt() - p.radius;
        let mut all: Vec<f64> = obstacles.iter().map(distance).collect();
        all.sort_by(f64::total_cmp);
        let near: Vec<f64> = all.into_iter().filter(|d| *d < 0.8).take(6).collect();
        assert_eq!(sensor.located().iter().map(|peg| peg.distance).collect::<Vec<_>>(), near);
    }
}
