//! The arena: lays out pegs and places the robot at the start of an episode.

use crate::contact::gap;
use crate::planar::{Pose, assemble_chain};
use crate::robot::Robot;
use crate::scene::Peg;
use crate::simulation::PlanarSimulation;

use super::config::{EnvConfig, FieldKind, Task};
use super::field::{Site, course, keep_clear, random_field};
use super::random::Stream;
use super::start::{Start, StartJitter, StartLine};

/// What an episode's start is drawn from, and memory to do so.
#[derive(Debug, Clone)]
pub struct Arena {
    task: Task,
    field: FieldKind,
    difficulty: f64,
    jitter: f64,
    line: StartLine,
    site: Site,
    robot: Robot,
    pegs: Vec<Peg>,
    joint_angle: Vec<f64>,
    pose: Vec<Pose>,
}

impl Arena {
    pub fn new(config: &EnvConfig, robot: &Robot) -> Self {
        let line = StartLine::new(config.task, robot);
        let site = site(config, robot, &line);
        let mut arena = Self {
            task: config.task,
            field: config.field,
            difficulty: config.difficulty,
            jitter: config.start_jitter,
            line,
            site,
            robot: robot.clone(),
            pegs: Vec::new(),
            joint_angle: vec![0.0; robot.joint_count()],
            pose: vec![Pose::zeros(); robot.link_count()],
        };
        if arena.task == Task::Course {
            course(arena.site.x[1], &mut arena.pegs);
        }
        arena
    }

    /// The nominal start.
    pub fn line(&self) -> &StartLine {
        &self.line
    }

    /// Draws start and pegs from the episode's stream and sets the simulation up; returns the start.
    pub fn prepare(&mut self, stream: &mut Stream, simulation: &mut PlanarSimulation) -> Start {
        let jitter = StartJitter::draw(stream, self.jitter);
        let start = match self.task {
            Task::Free => self.line.deviated(&jitter),
            Task::Course => self.free_start(&jitter),
            Task::Field => {
                let start = self.line.deviated(&jitter);
                random_field(self.field, self.difficulty, &self.site, stream, &mut self.pegs);
                self.assemble(&start);
                keep_clear(&self.site, &self.robot, &self.pose, &mut self.pegs);
                start
            }
        };
        self.assemble(&start);
        simulation.set_scene_pegs(&self.pegs);
        simulation.place_chain(start.position.x, start.position.y, start.angle, &self.joint_angle);
        start
    }

    /// The start nearest to the full deviation, in halvings, that clears the pegs; the nominal one does.
    fn free_start(&mut self, jitter: &StartJitter) -> Start {
        let mut factor = 1.0;
        while factor > SMALLEST_JITTER {
            let start = self.line.deviated(&jitter.scaled(factor));
            self.assemble(&start);
            if self.smallest_gap() > COURSE_CLEARANCE {
                return start;
            }
            factor *= 0.5;
        }
        self.line.nominal
    }

    /// Joint angles and poses of the robot at `start`.
    fn assemble(&mut self, start: &Start) {
        let angle = self.line.joint_angles(start.phase);
        self.joint_angle.iter_mut().enumerate().for_each(|(joint, value)| *value = angle(joint));
        let first = Pose::new(start.position.x, start.position.y, start.angle);
        assemble_chain(&self.robot, first, &self.joint_angle, &mut self.pose);
    }

    fn smallest_gap(&self) -> f64 {
        let links = || self.robot.links.iter().zip(&self.pose);
        let gaps = self.pegs.iter().flat_map(|peg| links().map(move |(link, q)| gap(q, link, peg)));
        gaps.fold(f64::INFINITY, f64::min)
    }
}

/// Gap that a jittered start keeps to the pegs of the course \[m\].
const COURSE_CLEARANCE: f64 = 5e-4;

/// Share of the drawn jitter below which the nominal start is taken.
const SMALLEST_JITTER: f64 = 0.01;

/// The ground to cover: from behind the tail to beyond the head at the goal, half a wave more, and a
/// fifth of the robot's length beside the corridor.
fn site(config: &EnvConfig, robot: &Robot, line: &StartLine) -> Site {
    let head = line.nominal.position;
    let half_wave = line.path.half_wave();
    let to_head = head.x - line.gravity_centre.x;
    let tail = line.gravity_centre.x - to_head;
    Site {
        x: [tail - half_wave, head.x + config.goal_distance + half_wave],
        centre_line: line.centre_line,
        half_width: config.corridor_half_width + 0.2 * robot.total_length(),
        head: [head.x, head.y],
        path: line.path,
        body_radius: robot.links.iter().map(|link| link.radius).fold(0.0, f64::max),
    }
}
