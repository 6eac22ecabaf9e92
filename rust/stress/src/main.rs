//! `make stress`: runs every scenario, prints a table of figures, and fails where a requirement is broken.
//!
//! Rows appear as they are done, so that an interrupted run leaves what it found.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use snake_stress::scenarios::{Effort, Scenario, all};
use snake_stress::table::{HEADER, Row, hardest, measure};

const USAGE: &str = "usage: snake-stress [--quick] [--only PART_OF_A_NAME] [--json FILE]
       snake-stress --dump FOLDER [--quick] [--only PART_OF_A_NAME]

--dump writes the stage of each scenario that took the most linear solves as a problem file instead.";

struct Options {
    effort: Effort,
    only: String,
    json: Option<String>,
    dump: Option<PathBuf>,
}

fn main() -> ExitCode {
    let options = match options(std::env::args().skip(1)) {
        Ok(options) => options,
        Err(message) => {
            eprintln!("{message}\n{USAGE}");
            return ExitCode::from(2);
        }
    };
    let scenarios = all(options.effort);
    let chosen: Vec<_> = scenarios.iter().filter(|scenario| scenario.name.contains(&options.only)).collect();
    if let Some(folder) = &options.dump {
        return dump(&chosen, folder);
    }
    println!("{HEADER}");
    let mut rows = Vec::new();
    for (done, scenario) in chosen.iter().enumerate() {
        eprintln!("[{}/{}] {}: {} cases", done + 1, chosen.len(), scenario.name, scenario.jobs.len());
        let row = measure(scenario);
        println!("{}", row.line());
        eprintln!("      {:.1} s", row.seconds);
        rows.push(row);
    }
    if let Some(path) = options.json
        && let Err(error) = std::fs::write(&path, serde_json::to_string_pretty(&rows).expect("rows are plain data"))
    {
        eprintln!("{path}: {error}");
        return ExitCode::from(2);
    }
    report(&rows)
}

fn options(mut arguments: impl Iterator<Item = String>) -> Result<Options, String> {
    let mut options = Options { effort: Effort::Long, only: String::new(), json: None, dump: None };
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().ok_or(format!("{argument} needs a value"));
        match argument.as_str() {
            "--quick" => options.effort = Effort::Quick,
            "--only" => options.only = value()?,
            "--json" => options.json = Some(value()?),
            "--dump" => options.dump = Some(value()?.into()),
            _ => return Err(format!("unknown argument {argument}")),
        }
    }
    Ok(options)
}

/// Writes the hardest stage of each scenario.
fn dump(scenarios: &[&Scenario], folder: &Path) -> ExitCode {
    for scenario in scenarios {
        let Some((solves, problem)) = hardest(scenario) else { continue };
        let name: String = scenario.name.chars().map(|c| if c.is_alphanumeric() { c } else { '-' }).collect();
        let path = folder.join(format!("{name}.json"));
        let text = serde_json::to_string(&problem).expect("a problem is plain data");
        if let Err(error) = std::fs::write(&path, text + "\n") {
            eprintln!("{}: {error}", path.display());
            return ExitCode::from(2);
        }
        println!("{}: {solves} linear solves, {}", path.display(), problem.name);
    }
    ExitCode::SUCCESS
}

/// Says what is broken, ten cases a scenario.
fn report(rows: &[Row]) -> ExitCode {
    let broken: usize = rows.iter().map(|row| row.broken.len()).sum();
    for row in rows {
        for (case, what) in row.broken.iter().take(10) {
            eprintln!("BROKEN {}: {case}: {what}", row.name);
        }
    }
    eprintln!("{} scenarios, {broken} requirements broken", rows.len());
    if broken == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
