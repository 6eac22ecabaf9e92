//! The tags `(T 3.66)` in the source, Rust and Python, and the tables of `docs/equations.md` say the same; the tables
//! hold every numbered equation of the thesis.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

fn crate_path(relative: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(relative)
}

/// Files in Rust and Python of a folder and those below.
fn sources(directory: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(directory).expect("a readable directory") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            files.extend(sources(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs" || extension == "py") {
            files.push(path);
        }
    }
    files
}

/// The folders whose tags are listed.
fn tagged_sources() -> Vec<PathBuf> {
    ["src", "../thesis/src", "../python/src", "../../snake_env"]
        .iter()
        .flat_map(|folder| sources(&crate_path(folder)))
        .collect()
}

/// A file or folder of the tables: under `rust/core/src/`, after `thesis/` under `rust/thesis/src/`, or from the root of
/// the repository.
fn place(name: &str) -> PathBuf {
    if let Some(name) = name.strip_prefix("thesis/") {
        return crate_path("../thesis/src").join(name);
    }
    let in_core = crate_path("src").join(name);
    if in_core.exists() { in_core } else { crate_path("../..").join(name) }
}

fn text_of(files: &[PathBuf]) -> String {
    files.iter().map(|path| fs::read_to_string(path).expect("readable source") + "\n").collect()
}

/// "3.3.1, T Tables 7.3 and 7.5" is 3.3.1, Table 7.3, Table 7.5; "3.16 != D1" is 3.16 and deviation D1.
fn parts_of(tag: &str) -> (Vec<String>, Option<String>) {
    let (tag, deviation) = match tag.split_once("!=") {
        Some((tag, id)) => (tag, Some(id.trim().to_owned())),
        None => (tag, None),
    };
    let mut parts = Vec::new();
    for part in tag.split(", ") {
        let part = part.trim().trim_start_matches("T ");
        match part.strip_prefix("Tables ") {
            Some(numbers) => parts.extend(numbers.split(" and ").map(|number| format!("Table {number}"))),
            None => parts.push(part.to_owned()),
        }
    }
    (parts, deviation)
}

/// Every `(T ...)` of the source, and every deviation it points to.
fn tags_in_source() -> (BTreeSet<String>, BTreeSet<String>) {
    let source = text_of(&tagged_sources());
    let (mut tags, mut deviations) = (BTreeSet::new(), BTreeSet::new());
    for piece in source.split("(T ").skip(1) {
        let Some((tag, _)) = piece.split_once(')') else { continue };
        if !tag.starts_with(|first: char| first.is_ascii_alphanumeric()) {
            continue; // the shape of an array, "(T - 1, n)"
        }
        let (parts, deviation) = parts_of(tag);
        tags.extend(parts);
        deviations.extend(deviation);
    }
    (tags, deviations)
}

/// Rows of the table under a heading, cell by cell.
fn table(heading: &str) -> Vec<Vec<String>> {
    let text = fs::read_to_string(crate_path("../../docs/equations.md")).expect("docs/equations.md");
    let section = text.split("\n## ").find(|section| section.starts_with(heading)).expect("the section");
    let rows = section.lines().filter(|line| line.starts_with("| ")).skip(2);
    rows.map(|row| row.trim_matches('|').split(" | ").map(|cell| cell.trim().to_owned()).collect()).collect()
}

#[test]
fn every_tag_is_in_the_table_and_every_entry_has_its_tag() {
    let (tags, _) = tags_in_source();
    let listed: BTreeSet<String> = table("Tags").into_iter().map(|row| row[0].clone()).collect();
    let missing: Vec<_> = tags.difference(&listed).collect();
    let stale: Vec<_> = listed.difference(&tags).collect();
    assert!(missing.is_empty(), "tags in the source without an entry in docs/equations.md: {missing:?}");
    assert!(stale.is_empty(), "entries of docs/equations.md without a tag in the source: {stale:?}");
}

#[test]
fn every_entry_names_a_file_that_carries_its_tag() {
    for row in table("Tags") {
        for place in row[1].split(", ") {
            let path = self::place(place);
            let files = if path.is_dir() { sources(&path) } else { vec![path] };
            let text = text_of(&files);
            let carried = text.split("(T ").skip(1).filter_map(|piece| piece.split_once(')'));
            let found = carried.map(|(tag, _)| parts_of(tag).0).any(|parts| parts.contains(&row[0]));
            assert!(found, "{place} does not carry (T {})", row[0]);
        }
    }
}

#[test]
fn every_deviation_is_registered_and_has_a_test() {
    let register = table("Deviations");
    let ids: BTreeSet<String> = register.iter().map(|row| row[0].clone()).collect();
    assert_eq!(ids.len(), register.len(), "an identifier is used twice");
    let (_, cited) = tags_in_source();
    let unknown: Vec<_> = cited.difference(&ids).collect();
    assert!(unknown.is_empty(), "deviations cited in the source but not registered: {unknown:?}");
    let uncited: Vec<_> = ids.difference(&cited).collect();
    assert!(uncited.is_empty(), "deviations registered but not cited in the source: {uncited:?}");
    let tests: String = ["tests", "../thesis/tests", "../../tests"]
        .iter()
        .map(|folder| text_of(&sources(&crate_path(folder))))
        .collect();
    for row in register {
        assert_eq!(row.len(), 5, "{row:?}");
        let found = [format!("fn {}(", row[4]), format!("def {}(", row[4])].iter().any(|head| tests.contains(head));
        assert!(found, "{}: no test {}", row[0], row[4]);
    }
}

/// The highest number in each chapter and in appendix A, 373 in all.
const NUMBERED: [(&str, u32); 7] = [("2", 15), ("3", 81), ("4", 127), ("5", 1), ("6", 119), ("7", 14), ("A", 16)];

/// Chapter and number of an equation, "3.66"; none of sections, tables and remarks.
fn numbered(name: &str) -> Option<(&str, u32)> {
    let (chapter, number) = name.split_once('.')?;
    let known = NUMBERED.iter().any(|(known, _)| *known == chapter);
    Some((chapter, number.parse().ok()?)).filter(|_| known)
}

/// The first cells of the rows that stand for equations: a row of "Tags" may stand for a section, or for both.
fn cells_of_equations() -> Vec<String> {
    let of_equation = |row: &&Vec<String>| !row[2].contains("(section") || row[2].contains(&format!("({})", row[0]));
    let tagged = table("Tags");
    let mut cells: Vec<String> = tagged.iter().filter(of_equation).map(|row| row[0].clone()).collect();
    cells.extend(table("Equations without a tag").into_iter().map(|row| row[0].clone()));
    cells
}

/// How often the tables list each equation; "3.1-3.3, 3.7" are four.
fn listed() -> BTreeMap<String, u32> {
    let mut found = BTreeMap::new();
    for range in cells_of_equations().iter().flat_map(|cell| cell.split(", ")) {
        let (first, last) = range.split_once('-').unwrap_or((range, range));
        let (Some((chapter, first)), Some((_, last))) = (numbered(first), numbered(last)) else { continue };
        for number in first..=last {
            *found.entry(format!("{chapter}.{number}")).or_insert(0) += 1;
        }
    }
    found
}

#[test]
fn every_numbered_equation_is_listed_once() {
    let listed = listed();
    let numbered: BTreeSet<String> =
        NUMBERED.iter().flat_map(|(chapter, last)| (1..=*last).map(move |k| format!("{chapter}.{k}"))).collect();
    assert_eq!(numbered.len(), 373);
    let missing: Vec<_> = numbered.iter().filter(|equation| !listed.contains_key(*equation)).collect();
    assert!(missing.is_empty(), "equations that docs/equations.md does not list: {missing:?}");
    let twice: Vec<_> = listed.iter().filter(|(_, count)| **count > 1).map(|(equation, _)| equation).collect();
    assert!(twice.is_empty(), "equations that docs/equations.md lists twice: {twice:?}");
    let unknown: Vec<_> = listed.keys().filter(|equation| !numbered.contains(*equation)).collect();
    assert!(unknown.is_empty(), "equations that the thesis does not have: {unknown:?}");
}

#[test]
fn an_equation_without_a_tag_names_files_that_exist_and_what_it_is() {
    for row in table("Equations without a tag") {
        assert_eq!(row.len(), 3, "{row:?}");
        assert!(row[1] == "-" || row[1].split(", ").all(|name| place(name).exists()), "{}: no {}", row[0], row[1]);
        assert!(row[2].len() > 10, "{row:?}");
    }
}
