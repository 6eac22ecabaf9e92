//! Distances of links from obstacles and from each other, and what passed through what between two instants.
//!
//! The formulas share nothing with the simulator. A link is a capsule: the points within a radius of its centre line. One
//! of the planar model lies at the height of its radius. Obstacles are vertical cylinders and prisms without end.

use nalgebra::{SVector, Vector2, Vector3};
use snake_core::obstacles::{Obstacle, Shape};
use snake_core::planar;
use snake_core::robot::{Link, Robot};
use snake_core::spatial::{self, joint_angle};

/// A link.
#[derive(Debug, Clone, Copy)]
pub struct Capsule {
    pub middle: Vector3<f64>,
    /// Unit vector along the centre line.
    pub axis: Vector3<f64>,
    /// Of the centre line \[m\].
    pub half_length: f64,
    pub radius: f64,
}

/// A pose of a link, from which poses between two instants follow.
pub trait LinkPlace: Copy {
    fn capsule(&self, link: &Link) -> Capsule;
    /// Largest angle of the joint between this link and the next one, to either side \[rad\].
    fn bend(&self, next: &Self) -> f64;
    /// Direction of the centre line when the link has turned by `share` of its way to `end`, steadily.
    fn axis_towards(&self, end: &Self, share: f64) -> Vector3<f64>;
}

impl LinkPlace for planar::Pose {
    fn capsule(&self, link: &Link) -> Capsule {
        Capsule::of(link, Vector3::new(self.x, self.y, link.radius), direction(self.z))
    }

    fn bend(&self, next: &Self) -> f64 {
        (next.z - self.z).abs()
    }

    fn axis_towards(&self, end: &Self, share: f64) -> Vector3<f64> {
        direction(self.z + share * (end.z - self.z))
    }
}

impl LinkPlace for spatial::Pose {
    fn capsule(&self, link: &Link) -> Capsule {
        Capsule::of(link, self.position, self.axis())
    }

    fn bend(&self, next: &Self) -> f64 {
        joint_angle(self, next).amax()
    }

    fn axis_towards(&self, end: &Self, share: f64) -> Vector3<f64> {
        self.axis().lerp(&end.axis(), share).normalize()
    }
}

fn direction(angle: f64) -> Vector3<f64> {
    Vector3::new(angle.cos(), angle.sin(), 0.0)
}

impl Capsule {
    fn of(link: &Link, cg: Vector3<f64>, axis: Vector3<f64>) -> Self {
        Self { middle: cg + axis * link.cg_offset, axis, half_length: link.contact_half_length, radius: link.radius }
    }

    fn ends(&self) -> [Vector3<f64>; 2] {
        [-1.0, 1.0].map(|side| self.middle + self.axis * (side * self.half_length))
    }

    fn reach(&self) -> f64 {
        self.half_length + self.radius
    }

    /// Gap to another link: the squared distance of two points of the centre lines is a convex quadratic of their two
    /// coordinates, whose minimum over the rectangle of both lies inside or on one of the four sides.
    fn gap_to(&self, other: &Self) -> f64 {
        if (self.middle - other.middle).norm() > self.reach() + other.reach() {
            return f64::INFINITY;
        }
        let lines = [self.ends(), other.ends()];
        let to_line = |line: usize, end: usize| distance_to_segment(&lines[line][end], &lines[1 - line]);
        let of_ends = to_line(0, 0).min(to_line(0, 1)).min(to_line(1, 0)).min(to_line(1, 1));
        let offset = self.middle - other.middle;
        let (cosine, a, b) = (self.axis.dot(&other.axis), self.axis.dot(&offset), other.axis.dot(&offset));
        let squared_sine = (1.0 - cosine * cosine).max(1e-30);
        let [s, t] = [(cosine * b - a) / squared_sine, (b - cosine * a) / squared_sine];
        let inside = s.abs() <= self.half_length && t.abs() <= other.half_length;
        let of_lines = if inside { (offset + self.axis * s - other.axis * t).norm() } else { f64::INFINITY };
        of_ends.min(of_lines) - self.radius - other.radius
    }
}

/// What is left of the way to the limit of a joint, at the end of half a link \[m\]: the least of all joints, infinite
/// without limits.
pub fn gap_to_stops<P: LinkPlace>(robot: &Robot, poses: &[P]) -> f64 {
    let joints = robot.links.iter().zip(poses.windows(2));
    let gap = |(link, pair): (&Link, &[P])| 0.5 * link.length * (robot.joint_limit() - pair[0].bend(&pair[1]));
    joints.map(gap).fold(f64::INFINITY, f64::min)
}

/// The obstacles of a scene.
#[derive(Debug, Clone, Default)]
pub struct Surroundings {
    /// Centre and radius.
    pegs: Vec<(Vector2<f64>, f64)>,
    walls: Vec<Outline>,
}

/// Corners of a convex polygon in order, two of a segment, and a circle around them.
#[derive(Debug, Clone)]
struct Outline {
    corners: Vec<Vector2<f64>>,
    centre: Vector2<f64>,
    extent: f64,
}

/// Smallest gaps of a robot, infinite where nothing is near \[m\]; from a wall at least minus a radius.
#[derive(Debug, Clone, Copy)]
pub struct Gaps {
    pub peg: f64,
    pub wall: f64,
    pub ground: f64,
    pub link: f64,
}

impl Gaps {
    pub fn least(&self) -> f64 {
        self.peg.min(self.wall).min(self.ground).min(self.link)
    }
}

impl Surroundings {
    pub fn new(obstacles: &[Obstacle]) -> Self {
        let mut all = Self::default();
        for obstacle in obstacles {
            assert!(obstacle.height.is_none(), "obstacles without end");
            let corners = match &obstacle.shape {
                Shape::Circle(peg) => {
                    all.pegs.push((Vector2::new(peg.x, peg.y), peg.radius));
                    continue;
                }
                Shape::Segment { start, end } => vec![*start, *end],
                Shape::Box { size: [length, width], x, y, angle } => {
                    let (sin, cos) = angle.sin_cos();
                    let corner = |a: f64, b: f64| {
                        [x + a * length * cos - b * width * sin, y + a * length * sin + b * width * cos]
                    };
                    vec![corner(-0.5, -0.5), corner(0.5, -0.5), corner(0.5, 0.5), corner(-0.5, 0.5)]
                }
                Shape::Polygon { vertices } => vertices.clone(),
                other => unreachable!("no vertical body: {other:?}"),
            };
            all.walls.push(Outline::new(corners.into_iter().map(Vector2::from).collect()));
        }
        all
    }

    /// Smallest gaps of a robot whose links are `capsules`.
    pub fn gaps(&self, capsules: &[Capsule]) -> Gaps {
        let mut gaps = Gaps { peg: f64::INFINITY, wall: f64::INFINITY, ground: f64::INFINITY, link: f64::INFINITY };
        for (i, capsule) in capsules.iter().enumerate() {
            let [start, end] = capsule.ends();
            let shadow = [start.xy(), end.xy()];
            let middle = capsule.middle.xy();
            for (centre, radius) in &self.pegs {
                if (middle - centre).norm() <= capsule.reach() + radius {
                    gaps.peg = gaps.peg.min(distance_to_segment(centre, &shadow) - capsule.radius - radius);
                }
            }
            for wall in &self.walls {
                if (middle - wall.centre).norm() <= capsule.reach() + wall.extent {
                    gaps.wall = gaps.wall.min(wall.distance(&shadow) - capsule.radius);
                }
            }
            gaps.ground = gaps.ground.min(start.z.min(end.z) - capsule.radius);
            for other in capsules.iter().skip(i + 2) {
                gaps.link = gaps.link.min(capsule.gap_to(other));
            }
        }
        gaps
    }

    /// Whether a link passed through an obstacle or another link on the way from `start` to `end`: whether it is deep inside
    /// one when the robot is interpolated. Links that swing beside a wall come deep into it in this way; those that pass
    /// through it also come onto it with their centre lines.
    pub fn passed_through<P: LinkPlace>(&self, robot: &Robot, start: &[P], end: &[P]) -> bool {
        let thinnest = robot.links.iter().map(|link| link.radius).fold(f64::INFINITY, f64::min);
        let between = Interpolation::new(robot, start, end);
        if between.farthest() <= thinnest {
            return false;
        }
        let smallest_peg = self.pegs.iter().map(|(_, radius)| *radius).fold(f64::INFINITY, f64::min);
        let mut is_near_wall = false;
        for part in 1..=BETWEEN {
            let gaps = self.gaps(&between.at(f64::from(part) / f64::from(BETWEEN + 1)));
            if gaps.peg < -CROSSED * (thinnest + smallest_peg) || gaps.link < -CROSSED * 2.0 * thinnest {
                return true;
            }
            is_near_wall |= gaps.wall < -CROSSED * thinnest;
        }
        is_near_wall
            && (0..CLOSELY).any(|part| {
                let share = f64::from(part) / f64::from(CLOSELY - 1);
                self.gaps(&between.at(share)).wall < -ON_THE_WALL * thinnest
            })
    }
}

/// The motion of a robot between two instants: its links turn steadily, and the mean of their CGs moves steadily.
struct Interpolation<'a, P> {
    robot: &'a Robot,
    start: &'a [P],
    end: &'a [P],
    /// Capsules at both.
    capsules: [Vec<Capsule>; 2],
}

impl<'a, P: LinkPlace> Interpolation<'a, P> {
    fn new(robot: &'a Robot, start: &'a [P], end: &'a [P]) -> Self {
        Self { robot, start, end, capsules: [start, end].map(|poses| capsules(robot, poses)) }
    }

    /// How far the point of a centre line moves that moves farthest \[m\].
    fn farthest(&self) -> f64 {
        let [start, end] = &self.capsules;
        let moved = |(a, b): (&Capsule, &Capsule)| {
            let ([a0, a1], [b0, b1]) = (a.ends(), b.ends());
            (a0 - b0).norm().max((a1 - b1).norm())
        };
        start.iter().zip(end).map(moved).fold(0.0, f64::max)
    }

    /// The links after a share of the motion, their joints closed.
    fn at(&self, share: f64) -> Vec<Capsule> {
        let links = &self.robot.links;
        let mut placed = self.capsules[0].clone();
        let mut joint = Vector3::zeros();
        for (i, capsule) in placed.iter_mut().enumerate() {
            capsule.axis = self.start[i].axis_towards(&self.end[i], share);
            let arm = capsule.axis * (0.5 * links[i].length);
            capsule.middle = joint + arm;
            joint += 2.0 * arm;
        }
        let [start, end] = &self.capsules;
        let shift = mean(start).lerp(&mean(end), share) - mean(&placed);
        placed.iter_mut().for_each(|capsule| capsule.middle += shift);
        placed
    }
}

fn mean(capsules: &[Capsule]) -> Vector3<f64> {
    capsules.iter().map(|capsule| capsule.middle).sum::<Vector3<f64>>() / capsules.len() as f64
}

/// The links of a robot.
pub fn capsules<P: LinkPlace>(robot: &Robot, poses: &[P]) -> Vec<Capsule> {
    poses.iter().zip(&robot.links).map(|(pose, link)| pose.capsule(link)).collect()
}

impl Outline {
    fn new(corners: Vec<Vector2<f64>>) -> Self {
        let centre = corners.iter().sum::<Vector2<f64>>() / corners.len() as f64;
        let extent = corners.iter().map(|corner| (corner - centre).norm()).fold(0.0, f64::max);
        Self { corners, centre, extent }
    }

    /// Distance of a line, zero where it meets the outline or lies inside.
    fn distance(&self, line: &[Vector2<f64>; 2]) -> f64 {
        if self.contains(&line[0]) {
            return 0.0;
        }
        let sides = if self.corners.len() == 2 { 1 } else { self.corners.len() };
        let to_side = |side: usize| {
            let side = [self.corners[side], self.corners[(side + 1) % self.corners.len()]];
            if intersect(line, &side) {
                return 0.0;
            }
            let from_line = distance_to_segment(&line[0], &side).min(distance_to_segment(&line[1], &side));
            from_line.min(distance_to_segment(&side[0], line)).min(distance_to_segment(&side[1], line))
        };
        (0..sides).map(to_side).fold(f64::INFINITY, f64::min)
    }

    /// Whether a point lies inside; none lies inside a segment.
    fn contains(&self, point: &Vector2<f64>) -> bool {
        let count = self.corners.len();
        let turn = |i: usize| turn(&self.corners[i], &self.corners[(i + 1) % count], point);
        count > 2 && ((0..count).all(|i| turn(i) > 0.0) || (0..count).all(|i| turn(i) < 0.0))
    }
}

/// Whether two segments cross.
fn intersect([a, b]: &[Vector2<f64>; 2], [c, d]: &[Vector2<f64>; 2]) -> bool {
    turn(a, b, c) * turn(a, b, d) < 0.0 && turn(c, d, a) * turn(c, d, b) < 0.0
}

fn turn(a: &Vector2<f64>, b: &Vector2<f64>, c: &Vector2<f64>) -> f64 {
    (b - a).perp(&(c - a))
}

fn distance_to_segment<const D: usize>(point: &SVector<f64, D>, [start, end]: &[SVector<f64, D>; 2]) -> f64 {
    let along = end - start;
    let share = ((point - start).dot(&along) / along.norm_squared().max(1e-30)).clamp(0.0, 1.0);
    (point - start - along * share).norm()
}

/// Interpolated poses per control period.
const BETWEEN: u32 = 5;

/// Overlap of an interpolated pose, relative to the sum of the radii, that counts as passing through; a wall is then looked
/// at more closely.
const CROSSED: f64 = 0.5;

/// Interpolated poses per control period of a robot that may have passed through a wall.
const CLOSELY: u32 = 100;

/// Overlap with a wall, relative to the radius, of a centre line that lies on it, up to the way between such poses.
const ON_THE_WALL: f64 = 0.95;
