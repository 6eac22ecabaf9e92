//! Laws of the tasks with goals and courses of their own.

use snake_core::environment::*;

/// Action zero, the thesis's gait, until the episode ends.
fn scripted(config: EnvConfig, seed: u64) -> snake_core::environment::signal::Summary {
    let mut environment = Environment::<PlanarRobot>::new(&config).unwrap();
    let mut observation = vec![0.0; environment.observation_size()];
    environment.reset(Some(seed), &mut observation);
    loop {
        let outcome = environment.step(&[0.0; 4], &mut observation);
        if outcome.terminated || outcome.truncated {
            return *environment.summary();
        }
    }
}

fn table_7_3(without: Vec<usize>, moved: Vec<(usize, f64, f64)>) -> EnvConfig {
    let course = Course::Table73;
    let perturbation = Perturbation { course, removed: 0, shifted: 0, without, moved, ..Perturbation::default() };
    EnvConfig { task: Task::PERTURBED, perturbation, ..EnvConfig::default() }
}

#[test]
fn peg_3_may_be_moved_by_a_link_diameter_but_not_removed() {
    // (T 7.3.4): the gait completes the course of Table 7.3, also with peg 3 moved up, and fails without peg 3.
    for seed in 0..3 {
        assert!(scripted(table_7_3(vec![], vec![]), seed).is_success);
        assert!(scripted(table_7_3(vec![], vec![(3, 0.0, 0.105)]), seed).is_success);
        let without = scripted(table_7_3(vec![3], vec![]), seed);
        assert!(!without.is_success && without.distance < 0.5, "{} m", without.distance);
    }
}

#[test]
fn a_field_drawn_for_push_points_has_them() {
    for task in [Task::FIELD, Task::MAZE] {
        let config = EnvConfig { task, difficulty: 1.0, push_points: 2, ..EnvConfig::default() };
        let mut asked = <Environment>::new(&config).unwrap();
        let mut plain = <Environment>::new(&EnvConfig { push_points: 0, ..config }).unwrap();
        let mut observation = vec![0.0; asked.observation_size()];
        let mut poor = 0;
        for seed in 0..30 {
            asked.reset(Some(seed), &mut observation);
            plain.reset(Some(seed), &mut observation);
            assert!(asked.push_points() >= 2, "{task:?}, seed {seed}");
            // A field that has them already is left as it is.
            assert_eq!(asked.pegs() == plain.pegs(), plain.push_points() >= 2, "{task:?}, seed {seed}");
            poor += u32::from(plain.push_points() < 2);
        }
        assert!(poor > 5, "{task:?}: {poor} of 30 fields were poor");
    }
}

#[test]
fn a_perturbed_course_at_difficulty_zero_is_the_course() {
    let perturbation = Perturbation { course: Course::Table75, ..Perturbation::default() };
    let config = EnvConfig { task: Task::PERTURBED, difficulty: 0.0, perturbation, ..EnvConfig::default() };
    let perturbed = Environment::<PlanarRobot>::new(&config).unwrap();
    let course = Environment::<PlanarRobot>::new(&EnvConfig { task: Task::COURSE, ..EnvConfig::default() }).unwrap();
    assert_eq!(perturbed.pegs(), course.pegs());
    assert_eq!(perturbed.goal(), course.goal());
}

#[test]
fn a_corridor_that_fits_the_gait_leads_it_to_the_goal() {
    for seed in 0..3 {
        let config = EnvConfig { task: Task::CORRIDOR, difficulty: 0.0, ..EnvConfig::default() };
        let summary = scripted(config, seed);
        assert!(summary.is_success && summary.speed > 0.14, "{} m/s", summary.speed);
    }
}

#[test]
fn towards_a_goal_point_all_quantities_are_those_of_its_direction() {
    let config = EnvConfig { task: Task::MAZE, difficulty: 1.0, start_jitter: 0.0, ..EnvConfig::default() };
    let mut environment = Environment::<PlanarRobot>::new(&config).unwrap();
    let mut observation = vec![0.0; environment.observation_size()];
    for seed in 0..5 {
        environment.reset(Some(seed), &mut observation);
        let block = environment.observation_blocks().iter().find(|block| block.row.name == "heading").unwrap().start;
        let to_goal = environment.goal().bearing(environment.goal().origin);
        let heading = f64::from(observation[block]).atan2(f64::from(observation[block + 1]));
        // The mean direction of its one and a half waves of links is 0.14 rad to the left of the way it goes.
        assert!((heading + to_goal - 0.14).abs() < 0.01, "{heading} {to_goal}");
        assert!((environment.summary().heading_error - heading).abs() < 1e-6);
        let mut sum = 0.0;
        for _ in 0..40 {
            environment.step(&[0.3, 0.8, 0.0, -0.4], &mut observation);
            sum += environment.summary().progress;
        }
        assert!((sum - environment.summary().distance).abs() < 1e-12);
    }
}

#[test]
fn a_commanded_direction_and_speed_are_observed_and_rewarded() {
    let config = EnvConfig { task: Task::COMMAND, difficulty: 1.0, ..EnvConfig::default() };
    let mut environment = Environment::<PlanarRobot>::new(&config).unwrap();
    let mut observation = vec![0.0; environment.observation_size()];
    let start = |environment: &Environment, name: &str| {
        environment.observation_blocks().iter().find(|block| block.row.name == name).unwrap().start
    };
    let mut turned: f64 = 0.0;
    for seed in 0..10 {
        environment.reset(Some(seed), &mut observation);
        let (speed, direction) = (environment.goal().speed.unwrap(), environment.goal_direction());
        assert!((0.05..0.2).contains(&speed));
        assert!((f64::from(observation[start(&environment, "command")]) * 0.4 - speed).abs() < 1e-7);
        turned = turned.max(direction.abs());
        for _ in 0..20 {
            let before = environment.model().motion().position;
            let outcome = environment.step(&[0.0; 4], &mut observation);
            let moved = environment.model().motion().position - before;
            let (sin, cos) = direction.sin_cos();
            let commanded = 0.05 * speed;
            let miss = (moved.x - commanded * cos).hypot(moved.y - commanded * sin);
            let reward = environment.summary().reward;
            assert!((reward.get("tracking").unwrap() - (commanded - miss)).abs() < 1e-12);
            assert_eq!(reward.get("progress"), Some(0.0));
            assert!(!outcome.terminated);
        }
    }
    assert!((1.0..1.58).contains(&turned), "up to a right angle to either side: {turned}");
}
