//! Names of a model as names of a ladder.

use std::collections::HashSet;

use understudy_ladder::{KEYWORDS, MAXIMUM_NAME_LENGTH, Name};

/// Gives every bit of a program a name of its own.
#[derive(Debug, Default)]
pub(crate) struct Names {
    taken: HashSet<String>,
}

impl Names {
    /// Reserves an existing name.
    pub(crate) fn take(&mut self, name: &str) {
        self.taken.insert(name.to_owned());
    }

    /// The name that is nearest to `parts` with dots between them: what a name cannot have becomes `_`, and a number is put
    /// behind one that is taken.
    pub(crate) fn fresh(&mut self, parts: &[&str]) -> Name {
        let parts: Vec<String> =
            parts.iter().filter(|part| !part.is_empty()).map(|part| legal(part)).collect();
        let mut wanted = parts.join(".");
        if !wanted.starts_with(|first: char| first.is_ascii_alphabetic() || first == '_') {
            wanted.insert(0, '_');
        }
        // Room for the number behind it.
        wanted.truncate(MAXIMUM_NAME_LENGTH - 12);
        if KEYWORDS.contains(&wanted.as_str()) {
            wanted.push('_');
        }
        let mut name = wanted.clone();
        let mut number = 2_u64;
        while !self.taken.insert(name.clone()) {
            name = format!("{}_{number}", wanted.trim_end_matches('.'));
            number += 1;
        }
        Name::from(name)
    }
}

/// What a name in a ladder looks like.
pub(crate) const ILLEGAL_NAME: &str = "letters, digits and `_`, single dots between its parts, a letter or `_` first, no word of the format";

/// Whether `name` is valid in a ladder.
pub(crate) fn is_legal(name: &str) -> bool {
    let part = |part: &str| {
        !part.is_empty()
            && part.chars().all(|character| character.is_ascii_alphanumeric() || character == '_')
    };
    name.starts_with(|first: char| first.is_ascii_alphabetic() || first == '_')
        && name.split('.').all(part)
        && name.len() <= MAXIMUM_NAME_LENGTH
        && !KEYWORDS.contains(&name)
}

fn legal(part: &str) -> String {
    let character = |character: char| {
        if character.is_ascii_alphanumeric() { character } else { '_' }
    };
    part.chars().map(character).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(parts: &[&str], expected: &str) {
        let mut names = Names::default();
        names.take("taken");
        let name = names.fresh(parts);
        assert_eq!(name.as_str(), expected);
        assert!(is_legal(&name), "{name}");
    }

    #[test]
    fn any_name_of_a_model_becomes_a_name_of_the_ladder() {
        check(&["q0"], "q0");
        check(&["agv", "1"], "agv.1");
        check(&["", "1"], "_1");
        check(&["AGV1.e10"], "AGV1_e10");
        check(&["rung"], "rung_");
        check(&["taken"], "taken_2");
        check(&["é ü"], "___");
        check(&[&"x".repeat(300)], &"x".repeat(108));
    }
}
