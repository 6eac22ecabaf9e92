//! Where an episode starts: the posture of the gait, at rest, ready to move to +x.

use std::f64::consts::PI;

use nalgebra::{Rotation2, Vector2};

use crate::gait::{Reference, Wave};
use crate::planar::{Pose, assemble_chain};
use crate::robot::Robot;

use super::path::NaturalPath;
use super::rng::Rng;

/// Placement of a robot in the posture of the gait.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Start {
    /// CG of link 1 \[m\].
    pub position: Vector2<f64>,
    /// Absolute angle of link 1 \[rad\].
    pub angle: f64,
    /// Phase psi of the wave \[rad\].
    pub phase: f64,
    /// Whether the joints are bent otherwise than by the gait at this phase.
    pub has_own_posture: bool,
}

impl Start {
    /// The posture of the gait at phase zero, from CG and absolute angle of link 1.
    pub fn of_gait(position: Vector2<f64>, angle: f64) -> Self {
        Self { position, angle, phase: 0.0, has_own_posture: false }
    }
}

/// A random deviation from the nominal start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StartJitter {
    /// How far the body slides along its own path, as a phase of the wave \[rad\].
    slide: f64,
    /// Shift and turn of the whole robot about its CG \[m, rad\].
    shift: Vector2<f64>,
    turn: f64,
}

impl StartJitter {
    /// Draws a deviation; `scale` in \[0, 1\].
    pub fn draw(rng: &mut Rng, scale: f64) -> Self {
        Self {
            slide: rng.around_zero(scale * 30f64.to_radians()),
            shift: Vector2::new(rng.around_zero(scale * 0.01), rng.around_zero(scale * 0.01)),
            turn: rng.around_zero(scale * 2f64.to_radians()),
        }
    }

    /// The deviation times `factor`.
    pub fn scaled(&self, factor: f64) -> Self {
        Self { slide: self.slide * factor, shift: self.shift * factor, turn: self.turn * factor }
    }
}

/// The nominal start and the natural path that leads on from it.
#[derive(Debug, Clone)]
pub struct StartLine {
    pub wave: Wave,
    pub path: NaturalPath,
    /// The start without jitter.
    pub nominal: Start,
    /// Centre of gravity of the robot there \[m\].
    pub gravity_centre: Vector2<f64>,
    /// y of the path's centre line, which is also that of the corridor \[m\].
    pub centre_line: f64,
}

impl StartLine {
    /// The start on open ground: the CG at x = 0 and the centre line at y = 0.
    pub fn at_origin(wave: Wave, robot: &Robot) -> Self {
        let path = natural_path(&wave, robot);
        let start = Start::of_gait(Vector2::zeros(), PI + path.direction(0.0));
        let mut line = Self::from_start(start, wave, robot);
        if !follows_path(robot) {
            line.centre_line = line.gravity_centre.y;
            let turn = -askew(robot, &wave, &line.nominal);
            line = line.turned(turn);
        }
        let origin = Vector2::new(line.gravity_centre.x, line.centre_line);
        line.nominal.position -= origin;
        line.gravity_centre -= origin;
        line.centre_line = 0.0;
        line
    }

    /// The robot turned by `angle` about its CG, which comes to lie on the centre line \[rad\].
    pub fn turned(mut self, angle: f64) -> Self {
        let arm = Rotation2::new(angle) * (self.nominal.position - self.gravity_centre);
        self.gravity_centre = Vector2::new(self.gravity_centre.x, self.centre_line);
        self.nominal.position = self.gravity_centre + arm;
        self.nominal.angle += angle;
        self
    }

    /// The start on a course: CG and absolute angle of link 1, `(x, y, theta)` \[m, m, rad\].
    pub fn on_course([x, y, angle]: [f64; 3], robot: &Robot) -> Self {
        Self::from_start(Start::of_gait(Vector2::new(x, y), angle), Wave::default(), robot)
    }

    fn from_start(nominal: Start, wave: Wave, robot: &Robot) -> Self {
        let path = natural_path(&wave, robot);
        let centre_line = nominal.position.y + path.displacement(0.0, path.crossing()).y;
        Self { wave, path, nominal, gravity_centre: gravity_centre(robot, &wave, &nominal), centre_line }
    }

    /// The start after a deviation.
    pub fn deviated(&self, robot: &Robot, jitter: &StartJitter) -> Start {
        if !follows_path(robot) {
            return self.slid_along_centre_line(robot, jitter);
        }
        let phase = self.nominal.phase + jitter.slide;
        // The course's start is turned a little against the natural path.
        let tilt = self.nominal.angle - PI - self.path.direction(self.nominal.phase);
        let slide = Rotation2::new(tilt) * self.path.displacement(self.nominal.phase, phase);
        let off_centre = self.nominal.position + slide - self.gravity_centre;
        Start {
            position: self.gravity_centre + Rotation2::new(jitter.turn) * off_centre + jitter.shift,
            angle: PI + self.path.direction(phase) + tilt + jitter.turn,
            phase,
            has_own_posture: false,
        }
    }

    /// That of a robot that leaves the path: its CG moves by the path's mean advance per phase, where its links point.
    fn slid_along_centre_line(&self, robot: &Robot, jitter: &StartJitter) -> Start {
        let heading = askew(robot, &self.wave, &self.nominal);
        let mut start = Start { phase: self.nominal.phase + jitter.slide, ..self.nominal };
        start.angle += heading - askew(robot, &self.wave, &start) + jitter.turn;
        let (sin, cos) = (heading + jitter.turn).sin_cos();
        let advance = Vector2::new(cos, sin) * (self.path.half_wave() * jitter.slide / PI);
        let cg = self.gravity_centre + advance + jitter.shift;
        start.position += cg - gravity_centre(robot, &self.wave, &start);
        start
    }

    /// Joint angles of the gait's posture at a phase, joint 0 first, zero of joints that do not bend sideways \[rad\].
    pub fn joint_angles<'a>(&'a self, robot: &'a Robot, phase: f64) -> impl Iterator<Item = f64> + 'a {
        posture(robot, &self.wave, phase / self.wave.omega)
    }
}

/// The natural path is that of a robot of which all joints bend sideways.
fn follows_path(robot: &Robot) -> bool {
    robot.axes.iter().all(|axes| axes.yaws())
}

fn posture<'a>(robot: &'a Robot, wave: &'a Wave, time: f64) -> impl Iterator<Item = f64> + 'a {
    let angle = move |joint: usize| wave.target(joint, time).angle;
    robot.axes.iter().enumerate().map(move |(joint, axes)| if axes.yaws() { angle(joint) } else { 0.0 })
}

/// Mean angle from +x to the direction in which the links point \[rad\].
fn askew(robot: &Robot, wave: &Wave, start: &Start) -> f64 {
    let (mut along, mut sum) = (start.angle - PI, start.angle - PI);
    for bend in posture(robot, wave, start.phase / wave.omega) {
        along += bend;
        sum += along;
    }
    sum / robot.link_count() as f64
}

fn natural_path(wave: &Wave, robot: &Robot) -> NaturalPath {
    NaturalPath::new(wave, robot.total_length() / robot.link_count() as f64)
}

fn gravity_centre(robot: &Robot, wave: &Wave, start: &Start) -> Vector2<f64> {
    let joint_angle: Vec<f64> = posture(robot, wave, start.phase / wave.omega).collect();
    let mut pose = vec![Pose::zeros(); robot.link_count()];
    assemble_chain(robot, Pose::new(start.position.x, start.position.y, start.angle), &joint_angle, &mut pose);
    let moment: Vector2<f64> = robot.links.iter().zip(&pose).map(|(link, q)| q.xy() * link.mass).sum();
    moment / robot.total_mass()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::{AxesConfig, OneJoint, RobotConfig};
    use crate::scene::START_7_5;

    #[test]
    fn fields_start_at_the_origin_and_the_course_where_the_thesis_passes() {
        let robot = Robot::new(&RobotConfig::default()).unwrap();
        let field = StartLine::at_origin(Wave::default(), &robot);
        assert!(field.gravity_centre.x.abs() < 1e-12 && field.centre_line.abs() < 1e-12);
        // The CG of one and a half waves lies near the middle of the path.
        assert!(field.gravity_centre.y.abs() < 0.03, "{}", field.gravity_centre.y);
        let course = StartLine::on_course(START_7_5, &robot);
        assert_eq!(course.nominal.position.x, START_7_5[0]);
        assert!((course.centre_line - 0.09).abs() < 0.01, "between the rows of pegs: {}", course.centre_line);
    }

    #[test]
    fn robots_whose_joints_bend_sideways_in_part_start_along_the_path() {
        let axes = (0..10).map(|j| OneJoint::Named(["yaw", "pitch"][j % 2].to_owned())).collect();
        let robot = Robot::new(&RobotConfig { axes: AxesConfig::Each(axes), ..RobotConfig::default() }).unwrap();
        let line = StartLine::at_origin(Wave::default(), &robot);
        assert!(line.gravity_centre.norm() < 1e-12 && line.centre_line.abs() < 1e-12);
        let angles: Vec<f64> = line.joint_angles(&robot, 0.0).collect();
        let mut pose = vec![Pose::zeros(); 11];
        let Start { position, angle, .. } = line.nominal;
        assemble_chain(&robot, Pose::new(position.x, position.y, angle), &angles, &mut pose);
        let mean = pose.iter().map(|q| q.z - PI).sum::<f64>() / 11.0;
        assert!(mean.abs() < 1e-12 && angles.iter().any(|bend| bend.abs() > 0.5), "{mean} rad askew");
    }

    #[test]
    fn robots_whose_joints_bend_sideways_in_part_slide_along_the_centre_line() {
        let alternating = (0..10).map(|j| ["yaw", "pitch"][j % 2]).collect::<Vec<_>>();
        let one_yaw = (0..10).map(|j| if j == 4 { "yaw" } else { "pitch" }).collect();
        for names in [alternating, one_yaw] {
            let axes = names.into_iter().map(|name| OneJoint::Named(name.to_owned())).collect();
            let robot = Robot::new(&RobotConfig { axes: AxesConfig::Each(axes), ..RobotConfig::default() }).unwrap();
            let line = StartLine::at_origin(Wave::default(), &robot).turned(-0.3);
            let still = StartJitter { slide: 0.0, shift: Vector2::zeros(), turn: 0.0 };
            for slide in [0.0, 0.2, 0.5] {
                let starts = [slide, -slide].map(|slide| line.deviated(&robot, &StartJitter { slide, ..still }));
                let cgs = starts.map(|start| gravity_centre(&robot, &line.wave, &start));
                assert!((0.5 * (cgs[0] + cgs[1])).norm() < 1e-12, "{:?}", 1e3 * 0.5 * (cgs[0] + cgs[1]));
                let (sin, cos) = (-0.3f64).sin_cos();
                assert!((cos * cgs[0].y - sin * cgs[0].x).abs() < 1e-12, "off the centre line");
                for start in starts {
                    assert!((askew(&robot, &line.wave, &start) + 0.3).abs() < 1e-12, "slide {slide}: askew");
                }
            }
            let turned = line.deviated(&robot, &StartJitter { turn: 0.1, ..still });
            assert!((askew(&robot, &line.wave, &turned) + 0.2).abs() < 1e-12);
            assert!(gravity_centre(&robot, &line.wave, &turned).norm() < 1e-12);
        }
    }

    #[test]
    fn sliding_by_one_link_moves_every_link_onto_the_one_before() {
        let robot = Robot::new(&RobotConfig::default()).unwrap();
        let line = StartLine::at_origin(Wave::default(), &robot);
        let chain = |jitter: &StartJitter| {
            let start = line.deviated(&robot, jitter);
            let angles: Vec<f64> = line.joint_angles(&robot, start.phase).collect();
            let mut pose = vec![Pose::zeros(); 11];
            assemble_chain(&robot, Pose::new(start.position.x, start.position.y, start.angle), &angles, &mut pose);
            pose
        };
        let still = StartJitter { slide: 0.0, shift: Vector2::zeros(), turn: 0.0 };
        let (before, after) = (chain(&still), chain(&StartJitter { slide: -line.wave.beta, ..still }));
        for i in 1..11 {
            // Link 1 slides along a curve, the chain is a polygon whose CGs lie L cos(phi / 2) apart:
            // in the worst place, where the joint is bent by phi = 40 degrees, 6 % of L between them.
            assert!((after[i].xy() - before[i - 1].xy()).norm() < 0.06 * 0.122, "link {i}");
            assert!((after[i].z - before[i - 1].z).abs() < 1e-9);
        }
    }

    #[test]
    fn no_jitter_is_the_nominal_start() {
        let robot = Robot::new(&RobotConfig::default()).unwrap();
        for line in [StartLine::on_course(START_7_5, &robot), StartLine::at_origin(Wave::default(), &robot)] {
            let start = line.deviated(&robot, &StartJitter::draw(&mut Rng::new(0, 0), 0.0));
            assert!((start.position - line.nominal.position).norm() < 1e-15);
            assert!((start.angle - line.nominal.angle).abs() < 1e-15);
        }
    }
}
