//! The known name that a misspelt one was meant to be: one rule for every reader of files.

/// Names that a suggestion lists at most.
const MAXIMUM_LISTED: usize = 20;

/// The known name that `name` is probably a misspelling of.
pub fn nearest<'n>(name: &str, known: impl IntoIterator<Item = &'n str>) -> Option<&'n str> {
    near(name, known).min().map(|(_, nearest)| nearest)
}

/// The known names that `name` may be a misspelling of, the nearest first.
pub fn alike<'n>(name: &str, known: impl IntoIterator<Item = &'n str>) -> Vec<&'n str> {
    let mut found: Vec<(usize, &str)> = near(name, known).collect();
    found.sort_unstable();
    found.into_iter().map(|(_, name)| name).collect()
}

/// The known names of which at most a third of the letters differ, or one, with the number of letters that do. A name in another
/// case does not differ.
fn near<'n>(
    name: &str,
    known: impl IntoIterator<Item = &'n str>,
) -> impl Iterator<Item = (usize, &'n str)> {
    let furthest = (name.chars().count() / 3).max(1);
    known.into_iter().filter_map(move |known: &'n str| {
        // The distance is never less than the difference of the lengths, and a letter has four bytes at most.
        if known.len().abs_diff(name.len()) > 4 * furthest {
            return None;
        }
        let distance = if known.eq_ignore_ascii_case(name) {
            0
        } else {
            strsim::damerau_levenshtein(name, known)
        };
        (distance <= furthest).then_some((distance, known))
    })
}

/// A question for the known name that `name` is probably a misspelling of.
pub fn question<'n>(name: &str, known: impl IntoIterator<Item = &'n str>) -> Option<String> {
    nearest(name, known).map(|near| format!("did you mean `{near}`?"))
}

/// The help for an unknown name: the nearest known one, or the known ones where none is near.
pub fn suggestion<'n>(name: &str, known: impl IntoIterator<Item = &'n str>) -> String {
    let known: Vec<&str> = known.into_iter().collect();
    if let Some(question) = question(name, known.iter().copied()) {
        return question;
    }
    match known.len() {
        0 => "none is known here".into(),
        count @ ..=MAXIMUM_LISTED => format!("known: {}", known[..count].join(", ")),
        count => format!(
            "known: {}, and {} more",
            known[..MAXIMUM_LISTED].join(", "),
            count - MAXIMUM_LISTED
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_name_is_near() {
        let check = |name, expected| {
            let known = ["period", "deadline", "Press", "ü"];
            assert_eq!(nearest(name, known), expected, "{name}");
        };
        check("perod", Some("period"));
        check("PERIOD", Some("period"));
        check("paeriods", Some("period"));
        check("press", Some("Press"));
        check("dead", None);
        check("u", Some("ü"));
        check("", Some("ü"));
    }

    #[test]
    fn a_suggestion_lists_what_is_known_where_nothing_is_near() {
        let many: Vec<String> = (0..22).map(|number| format!("signal{number}")).collect();
        let many = || many.iter().map(String::as_str);
        assert_eq!(suggestion("signl3", many()), "did you mean `signal3`?");
        assert_eq!(
            suggestion("x", many()),
            "known: signal0, signal1, signal2, signal3, signal4, signal5, signal6, signal7, signal8, signal9, signal10, \
             signal11, signal12, signal13, signal14, signal15, signal16, signal17, signal18, signal19, and 2 more"
        );
        assert_eq!(suggestion("x", ["one", "two"]), "known: one, two");
        assert_eq!(suggestion("x", []), "none is known here");
    }
}
