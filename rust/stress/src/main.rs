//! `make stress`: runs every scenario, prints a table of figures, and fails where a requirement is broken.
//!
//! Rows appear as they are done, so that an interrupted run leaves what it found.

use std::process::ExitCode;

use snake_stress::dump::dump_hard_stages;
use snake_stress::scenarios::{Effort, all};
use snake_stress::table::{HEADER, Row, measure};

const USAGE: &str = "usage: snake-stress [--quick] [--only PART_OF_A_NAME] [--case PART_OF_A_NAME] [--seed SEED] [--json FILE] [--dump FOLDER]";

struct Options {
    effort: Effort,
    /// Parts of the names of scenarios and of their cases.
    only: String,
    case: String,
    /// Of environments and their actions.
    seed: u64,
    json: Option<String>,
    /// Folder for the stages that the fallback gets.
    dump: Option<String>,
}

fn main() -> ExitCode {
    let options = match options(std::env::args().skip(1)) {
        Ok(options) => options,
        Err(message) => {
            eprintln!("{message}\n{USAGE}");
            return ExitCode::from(2);
        }
    };
    let mut chosen = all(options.effort, options.seed);
    chosen.retain(|scenario| scenario.name.contains(&options.only));
    chosen.iter_mut().for_each(|scenario| scenario.jobs.retain(|job| job.name.contains(&options.case)));
    chosen.retain(|scenario| !scenario.jobs.is_empty());
    if let Some(folder) = options.dump
        && let Err(error) = dump_hard_stages(folder.clone().into())
    {
        eprintln!("{folder}: {error}");
        return ExitCode::from(2);
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
    let mut options =
        Options { effort: Effort::Long, only: String::new(), case: String::new(), seed: 0, json: None, dump: None };
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().ok_or(format!("{argument} needs a value"));
        match argument.as_str() {
            "--quick" => options.effort = Effort::Quick,
            "--only" => options.only = value()?,
            "--case" => options.case = value()?,
            "--seed" => {
                options.seed = value()?.parse().map_err(|_| "--seed takes a non-negative integer".to_owned())?;
            }
            "--json" => options.json = Some(value()?),
            "--dump" => options.dump = Some(value()?),
            _ => return Err(format!("unknown argument {argument}")),
        }
    }
    Ok(options)
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
