//! The tags `(T 3.66)` in the source and the tables of `docs/equations.md` say the same.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

fn crate_path(relative: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(relative)
}

fn rust_files(directory: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(directory).expect("a readable directory") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            files.extend(rust_files(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
    files
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
    let source = text_of(&rust_files(&crate_path("src")));
    let (mut tags, mut deviations) = (BTreeSet::new(), BTreeSet::new());
    for piece in source.split("(T ").skip(1) {
        let Some((tag, _)) = piece.split_once(')') else { continue };
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
            let path = crate_path("src").join(place);
            let files = if path.is_dir() { rust_files(&path) } else { vec![path] };
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
    let tests = text_of(&rust_files(&crate_path("tests")));
    for row in register {
        assert_eq!(row.len(), 5, "{row:?}");
        assert!(tests.contains(&format!("fn {}(", row[4])), "{}: no test {}", row[0], row[4]);
    }
}
