//! The sampler: lays out pegs and places the robot at the start of an episode.

use nalgebra::Vector2;

use crate::contact::gap;
use crate::error::{ConfigError, require};
use crate::planar::{Pose, assemble_chain};
use crate::robot::Robot;
use crate::scene::Peg;

use super::config::{EnvConfig, FieldKind, Task};
use super::default_gait::DefaultGait;
use super::field::{Reach, Route, Site, continued, corridor, keep_clear, maze, random_field};
use super::goal::{Goal, Target};
use super::perturbation::{Course, Perturbation, Shift};
use super::rng::Rng;
use super::start::{Start, StartJitter, StartLine};

/// What an episode's start is drawn from, and memory to do so.
#[derive(Debug, Clone)]
pub struct ScenarioSampler {
    task: Task,
    field: FieldKind,
    perturbation: Perturbation,
    difficulty: f64,
    jitter: f64,
    goal_distance: f64,
    goal_radius: f64,
    turn: f64,
    push_points: usize,
    reach: Reach,
    grounds: Vec<Ground>,
    robot: Robot,
    pegs: Vec<Peg>,
    table: Vec<Option<Peg>>,
    shifts: Vec<Shift>,
    joint_angle: Vec<f64>,
    pose: Vec<Pose>,
}

/// A nominal start, the ground around it, and pegs that always stand there: those of a table, if they have not
/// been taken away, and those that continue it.
#[derive(Debug, Clone)]
struct Ground {
    line: StartLine,
    site: Site,
    table: Vec<Option<Peg>>,
    more: Vec<Peg>,
}

/// What was drawn for an episode, beside the pegs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EpisodeStart {
    pub start: Start,
    pub target: Target,
}

impl ScenarioSampler {
    /// # Errors
    /// A peg that is moved would touch the robot at the start.
    pub fn new(config: &EnvConfig, robot: &Robot) -> Result<Self, ConfigError> {
        let grounds: Vec<Ground> = match config.task {
            Task::Course => vec![Ground::on_course(Course::Table75, config, robot, &Perturbation::default())],
            Task::Perturbed => {
                let courses = config.perturbation.course.choices().iter();
                courses.map(|&course| Ground::on_course(course, config, robot, &config.perturbation)).collect()
            }
            Task::Free | Task::Field | Task::Maze | Task::Corridor => vec![Ground::open(config, robot)],
        };
        let mut sampler = Self {
            task: config.task,
            field: config.field,
            perturbation: config.perturbation.clone(),
            difficulty: config.difficulty,
            jitter: config.start_jitter,
            goal_distance: config.goal_distance,
            goal_radius: config.goal_radius,
            turn: config.turn,
            push_points: config.push_points,
            reach: Reach::new(robot.total_length(), robot.link_count(), grounds[0].site.body_radius),
            grounds,
            robot: robot.clone(),
            pegs: Vec::new(),
            table: Vec::new(),
            shifts: Vec::new(),
            joint_angle: vec![0.0; robot.joint_count()],
            pose: vec![Pose::zeros(); robot.link_count()],
        };
        sampler.require_room()?;
        Ok(sampler)
    }

    pub fn difficulty(&self) -> f64 {
        self.difficulty
    }

    /// The difficulty of the episodes to come, in \[0, 1\].
    pub fn set_difficulty(&mut self, difficulty: f64) {
        self.difficulty = difficulty;
    }

    /// What a robot at its nominal start has to reach; episodes may draw another goal.
    pub fn nominal_target(&self) -> Target {
        self.goal_line(0)
    }

    /// The pegs of the episode prepared last.
    pub fn pegs(&self) -> &[Peg] {
        &self.pegs
    }

    /// The robot's joint angles at its start \[rad\].
    pub fn joint_angle(&self) -> &[f64] {
        &self.joint_angle
    }

    /// Draws start, pegs and goal from the episode's rng.
    pub fn prepare(&mut self, rng: &mut Rng) -> EpisodeStart {
        let jitter = StartJitter::draw(rng, self.jitter);
        let ground = if self.grounds.len() > 1 { rng.index(self.grounds.len()) } else { 0 };
        let scene = match self.task {
            Task::Free => self.on_open_ground(&jitter, |_, _| None),
            Task::Field => self.on_open_ground(&jitter, |sampler, site| {
                random_field(sampler.field, sampler.difficulty, site, rng, &mut sampler.pegs);
                None
            }),
            Task::Maze => self.on_open_ground(&jitter, |sampler, site| {
                let route = sampler.route();
                Some(maze(sampler.difficulty, &route, site, rng, &mut sampler.pegs))
            }),
            Task::Corridor => self.on_open_ground(&jitter, |sampler, site| {
                let route = sampler.route();
                Some(corridor(sampler.difficulty, &route, site, rng, &mut sampler.pegs))
            }),
            Task::Course => self.on_course(ground, &jitter),
            Task::Perturbed => {
                self.perturb(ground, rng);
                self.among_pegs(ground, &jitter)
            }
        };
        self.assemble(ground, &scene.start);
        scene
    }

    /// The robot where it wants to be, the pegs out of its way; `lay_out` draws them and tells the goal point, if
    /// there is any.
    fn on_open_ground(
        &mut self,
        jitter: &StartJitter,
        mut lay_out: impl FnMut(&mut Self, &Site) -> Option<Vector2<f64>>,
    ) -> EpisodeStart {
        let site = self.grounds[0].site;
        let start = self.grounds[0].line.deviated(jitter);
        self.assemble(0, &start);
        let (radius, origin) = (self.goal_radius, self.gravity_centre());
        let mut target = self.goal_line(0);
        for _ in 0..MAX_DRAWS {
            target = lay_out(self, &site).map_or(target, |centre| Target::Disc { centre, radius });
            keep_clear(&site, &self.robot, &self.pose, &mut self.pegs);
            if self.push_points == 0 || self.push_points(&Goal { target, origin }, &self.pegs) >= self.push_points {
                break;
            }
        }
        EpisodeStart { start, target }
    }

    /// The smallest number of push-points in any body length on the way to `goal` among `pegs`.
    pub fn push_points(&self, goal: &Goal, pegs: &[Peg]) -> usize {
        self.reach.push_points(goal, pegs)
    }

    /// The pegs that always stand there, the robot as near to where it wants to be as they allow.
    fn on_course(&mut self, ground: usize, jitter: &StartJitter) -> EpisodeStart {
        let Ground { table, more, .. } = &self.grounds[ground];
        self.pegs.clear();
        self.pegs.extend(table.iter().flatten().chain(more));
        self.among_pegs(ground, jitter)
    }

    fn among_pegs(&mut self, ground: usize, jitter: &StartJitter) -> EpisodeStart {
        EpisodeStart { start: self.free_start(ground, jitter), target: self.goal_line(ground) }
    }

    fn goal_line(&self, ground: usize) -> Target {
        Target::Line { distance: self.goal_distance, centre_line: self.grounds[ground].line.centre_line }
    }

    fn route(&self) -> Route {
        Route { start: self.grounds[0].line.gravity_centre, length: self.goal_distance, turn: self.turn }
    }

    /// Draws the pegs of a perturbed course. A peg that would touch the robot at its nominal start is shifted by
    /// halves of its shift until it does not.
    fn perturb(&mut self, ground: usize, rng: &mut Rng) {
        self.assemble(ground, &self.grounds[ground].line.nominal.clone());
        self.table.clone_from(&self.grounds[ground].table);
        self.perturbation.draw(self.difficulty, rng, &mut self.table, &mut self.shifts);
        for Shift { peg, by } in &self.shifts {
            let Some(peg) = &mut self.table[*peg] else { continue };
            let mut factors = (0..MAX_HALVINGS).map(|k| 0.5f64.powi(k));
            let shifted = |factor: f64| Peg { x: peg.x + factor * by.x, y: peg.y + factor * by.y, ..*peg };
            let clears =
                |peg: &Peg| smallest_gap(&self.robot, &self.pose, std::slice::from_ref(peg)) > COURSE_CLEARANCE;
            *peg = factors.find_map(|factor| Some(shifted(factor)).filter(&clears)).unwrap_or(*peg);
        }
        self.pegs.clear();
        self.pegs.extend(self.table.iter().flatten().chain(&self.grounds[ground].more));
    }

    /// The start nearest to the full deviation, in halvings, that clears the pegs; the nominal one does.
    fn free_start(&mut self, ground: usize, jitter: &StartJitter) -> Start {
        let mut factor = 1.0;
        while factor > SMALLEST_JITTER {
            let start = self.grounds[ground].line.deviated(&jitter.scaled(factor));
            self.assemble(ground, &start);
            if smallest_gap(&self.robot, &self.pose, &self.pegs) > COURSE_CLEARANCE {
                return start;
            }
            factor *= 0.5;
        }
        self.grounds[ground].line.nominal
    }

    /// CG of the assembled robot \[m\].
    fn gravity_centre(&self) -> Vector2<f64> {
        let links = self.robot.links.iter().zip(&self.pose);
        links.map(|(link, q)| q.xy() * link.mass).sum::<Vector2<f64>>() / self.robot.total_mass()
    }

    /// Joint angles and poses of the robot at `start`.
    fn assemble(&mut self, ground: usize, start: &Start) {
        let angle = self.grounds[ground].line.joint_angles(start.phase);
        self.joint_angle.iter_mut().enumerate().for_each(|(joint, value)| *value = angle(joint));
        let first = Pose::new(start.position.x, start.position.y, start.angle);
        assemble_chain(&self.robot, first, &self.joint_angle, &mut self.pose);
    }

    /// Pegs that always stand elsewhere leave room for the robot.
    fn require_room(&mut self) -> Result<(), ConfigError> {
        for ground in 0..self.grounds.len() {
            let start = self.grounds[ground].line.nominal;
            self.assemble(ground, &start);
            for (k, &(j, ..)) in self.perturbation.moved.iter().enumerate() {
                let Some(peg) = self.grounds[ground].table.get(j - 1).copied().flatten() else { continue };
                let gap = smallest_gap(&self.robot, &self.pose, &[peg]);
                let expected = "a place that leaves the robot room at its start";
                let value = format!("{:?}, {gap:.4} m from the robot", [peg.x, peg.y]);
                require(gap > 0.0, &format!("perturbation.moved[{k}]"), value, expected)?;
            }
        }
        Ok(())
    }
}

impl Ground {
    fn open(config: &EnvConfig, robot: &Robot) -> Self {
        let DefaultGait { yaw, travel, .. } = DefaultGait::of(config);
        let line = StartLine::at_origin(yaw, robot).turned(-travel);
        Self { site: site(config, robot, &line), line, table: Vec::new(), more: Vec::new() }
    }

    /// The thesis's start among a course's pegs; Table 7.5 is continued to the goal.
    fn on_course(course: Course, config: &EnvConfig, robot: &Robot, perturbation: &Perturbation) -> Self {
        let line = StartLine::on_course(course.start(config.model), robot);
        let site = site(config, robot, &line);
        let more = if course == Course::Table75 { continued(site.x[1]) } else { Vec::new() };
        Self { line, site, table: perturbation.fixed_pegs(course), more }
    }
}

fn smallest_gap(robot: &Robot, pose: &[Pose], pegs: &[Peg]) -> f64 {
    let links = || robot.links.iter().zip(pose);
    let gaps = pegs.iter().flat_map(|peg| links().map(move |(link, q)| gap(q, link, peg)));
    gaps.fold(f64::INFINITY, f64::min)
}

/// Gap that a jittered start keeps to the pegs of the course \[m\].
const COURSE_CLEARANCE: f64 = 5e-4;

/// Share of the drawn jitter below which the nominal start is taken.
const SMALLEST_JITTER: f64 = 0.01;

/// Fields drawn at most until one has as many push-points as are asked for; the last one stands.
const MAX_DRAWS: u32 = 100;

/// Halvings of a peg's shift before the peg stays where it is.
const MAX_HALVINGS: i32 = 7;

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
