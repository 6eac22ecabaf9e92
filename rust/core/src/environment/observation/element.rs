//! Elements of an observation: their names, and what a reflection does to them.

use crate::environment::symmetry::Parity;

/// One number of an observation.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Element {
    pub name: String,
    pub parity: Parity,
}

/// Name and parity of an element; `#` stands for the number of a joint, link or peg.
pub type Pattern = (&'static str, Parity);

/// An element that a reflection leaves as it is.
pub const fn even(name: &'static str) -> Pattern {
    (name, Parity::Even)
}

/// An element whose sign a reflection changes.
pub const fn odd(name: &'static str) -> Pattern {
    (name, Parity::Odd)
}

/// Elements with names of their own.
pub fn named(patterns: &[Pattern]) -> Vec<Element> {
    patterns.iter().map(|&(name, parity)| Element { name: name.to_owned(), parity }).collect()
}

/// The patterns for each number from 1 to `count`.
pub fn each(count: usize, patterns: &[Pattern]) -> Vec<Element> {
    let numbered = |number: usize| {
        let element = move |&(name, parity): &Pattern| Element { name: name.replace('#', &number.to_string()), parity };
        patterns.iter().map(element)
    };
    (1..=count).flat_map(numbered).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patterns_are_numbered_from_one() {
        let elements = each(2, &[odd("yaw_#"), even("pitch_#")]);
        let names: Vec<&str> = elements.iter().map(|element| element.name.as_str()).collect();
        assert_eq!(names, ["yaw_1", "pitch_1", "yaw_2", "pitch_2"]);
        assert_eq!(elements[2].parity, Parity::Odd);
        assert_eq!(elements[3].parity, Parity::Even);
    }
}
