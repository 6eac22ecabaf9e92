//! Measures snake-core and prints results as JSON, one object per line; progress goes to standard error.
//!
//!     snake-bench PART... [--quick] [--scenes NAME,...] [--cache FOLDER]
//!
//! Parts: `precision`, `growth`, `width`, `skip`, `certificate`, `spatial`.

mod certificate;
mod clock;
mod environments;
mod feature_cost;
mod fleet;
mod growth;
mod methods;
mod point;
mod precision;
mod reference;
mod report;
mod scenes;
mod spatial;
mod timed_fleet;

use std::path::PathBuf;
use std::process::ExitCode;

use scenes::Scenario;

const USAGE: &str = "usage: snake-bench PART... [--quick] [--scenes NAME,...] [--cache FOLDER]
parts: precision, growth, width, skip, certificate, spatial";

fn main() -> ExitCode {
    match Options::parse(std::env::args().skip(1)).and_then(|options| options.run()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("{message}\n{USAGE}");
            ExitCode::from(2)
        }
    }
}

/// The command line.
#[derive(Debug)]
struct Options {
    parts: Vec<String>,
    quick: bool,
    scenes: Vec<Scenario>,
    cache: Option<PathBuf>,
}

impl Options {
    fn parse(mut arguments: impl Iterator<Item = String>) -> Result<Self, String> {
        let mut options = Self { parts: Vec::new(), quick: false, scenes: scenes::all(), cache: None };
        while let Some(argument) = arguments.next() {
            let mut value = || arguments.next().ok_or(format!("{argument} needs a value"));
            match argument.as_str() {
                "--quick" => options.quick = true,
                "--scenes" => options.scenes = chosen(&value()?)?,
                "--cache" => options.cache = Some(value()?.into()),
                part => options.parts.push(part.to_owned()),
            }
        }
        if options.parts.is_empty() { Err("nothing to measure".into()) } else { Ok(options) }
    }

    fn run(&self) -> Result<(), String> {
        for part in &self.parts {
            match part.as_str() {
                "precision" => precision::measure(&self.scenes, self.quick, self.cache.as_deref()),
                "growth" => growth::measure(self.quick),
                "width" => growth::measure_width(self.quick),
                "skip" => feature_cost::measure(self.quick),
                "spatial" => precision::measure(&spatial::all(), self.quick, self.cache.as_deref()),
                "certificate" => certificate::measure(&self.scenes, self.quick),
                _ => return Err(format!("{part}: no such part")),
            }
            .map_err(|error| error.to_string())?;
        }
        Ok(())
    }
}

/// The scenes of a list of names.
fn chosen(names: &str) -> Result<Vec<Scenario>, String> {
    let all = scenes::all();
    let find =
        |name: &str| all.iter().find(|scene| scene.name == name).cloned().ok_or(format!("{name}: no such scene"));
    names.split(',').map(find).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(line: &str) -> Result<Options, String> {
        Options::parse(line.split_whitespace().map(str::to_owned))
    }

    #[test]
    fn the_command_line_chooses_parts_and_scenes() {
        let options = parse("precision --quick --scenes jam,free").unwrap();
        assert!(options.quick && options.parts == ["precision"]);
        assert_eq!(options.scenes.iter().map(|scene| scene.name).collect::<Vec<_>>(), ["jam", "free"]);
    }

    #[test]
    fn what_is_not_known_is_named() {
        assert!(parse("precision --scenes moon").unwrap_err().contains("moon"));
        assert!(parse("").is_err() && parse("precision --cache").is_err());
        assert!(parse("sleep").unwrap().run().unwrap_err().contains("sleep"));
    }
}
