//! What is shown of the findings of a file: so many, each of a bounded length, and how many are left out.

use std::borrow::Cow;

use crate::{Diagnostic, Related, Report, Severity};

/// The most findings of one file that are shown.
pub const MAXIMUM_SHOWN: usize = 100;

/// The most findings that a reader keeps of one file; then it stops.
pub const MAXIMUM_FINDINGS: usize = 10_000;

/// The longest message or help that is shown, in characters.
pub const MAXIMUM_MESSAGE: usize = 1_000;

/// The longest text at a place that is shown, in characters.
const MAXIMUM_LABEL: usize = 200;

/// The most further places of one finding that are shown.
const MAXIMUM_RELATED: usize = 8;

/// The code of the finding that says how many are left out.
const LEFT_OUT: &str = "U0617";

/// `text` in at most `most` characters: what is too long loses its middle.
pub fn shortened(text: &str, most: usize) -> Cow<'_, str> {
    if text.len() <= most || text.chars().nth(most).is_none() {
        return Cow::Borrowed(text);
    }
    let tail = most / 4;
    let head = most.saturating_sub(tail + 1);
    let place = |(place, _)| place;
    let head = text.char_indices().nth(head).map_or(text.len(), place);
    let tail = match tail.checked_sub(1) {
        Some(last) => text.char_indices().rev().nth(last).map_or(0, place),
        None => text.len(),
    };
    Cow::Owned(format!("{}…{}", &text[..head], &text[tail..]))
}

impl Diagnostic {
    /// The error of a reader that stops at `place`, having found [`MAXIMUM_FINDINGS`].
    pub fn too_many(place: usize) -> Self {
        let message = format!(
            "the file has more than {MAXIMUM_FINDINGS} findings, and is not read any further"
        );
        Self::error(LEFT_OUT, message, place..place)
    }

    /// The same finding with texts of a bounded length and few further places.
    fn bounded(&self) -> Self {
        let label = |text: &String| shortened(text, MAXIMUM_LABEL).into_owned();
        let related = self.related.iter().take(MAXIMUM_RELATED);
        Self {
            code: self.code,
            severity: self.severity,
            message: shortened(&self.message, MAXIMUM_MESSAGE).into_owned(),
            span: self.span.clone(),
            label: self.label.as_ref().map(label),
            related: related
                .map(|related| Related {
                    span: related.span.clone(),
                    message: label(&related.message),
                })
                .collect(),
            help: self.help.as_ref().map(|help| shortened(help, MAXIMUM_MESSAGE).into_owned()),
        }
    }
}

impl Report {
    /// At most `most` findings, errors before warnings, in the order of their places; and one more that says how many are left out.
    pub fn shown(&self, most: usize) -> Vec<Diagnostic> {
        let of = |severity| {
            let found = self.diagnostics.iter().enumerate();
            found.filter(move |(_, found)| found.severity == severity)
        };
        let most = most.min(MAXIMUM_SHOWN);
        let chosen = of(Severity::Error).chain(of(Severity::Warning)).take(most);
        let mut chosen: Vec<(usize, &Diagnostic)> = chosen.collect();
        chosen.sort_by_key(|(place, _)| *place);
        let mut shown: Vec<Diagnostic> = chosen.iter().map(|(_, found)| found.bounded()).collect();
        let left = |severity| {
            let kept = chosen.iter().filter(|(_, found)| found.severity == severity);
            of(severity).count() - kept.count()
        };
        let (errors, warnings) = (left(Severity::Error), left(Severity::Warning));
        let message = match (errors, warnings) {
            (0, 0) => return shown,
            (errors, 0) => number(errors, "error"),
            (0, warnings) => number(warnings, "warning"),
            (errors, warnings) => {
                format!("{} and {}", number(errors, "error"), number(warnings, "warning"))
            }
        };
        let severity = if errors > 0 { Severity::Error } else { Severity::Warning };
        let verb = if errors + warnings == 1 { "is" } else { "are" };
        let message = format!("{message} of this file {verb} not shown");
        let rest = Diagnostic::new(severity, LEFT_OUT, message, 0..0);
        shown.push(rest.with_help("fix what is shown, and check the file again"));
        shown
    }
}

fn number(count: usize, what: &str) -> String {
    match count {
        1 => format!("1 more {what}"),
        _ => format!("{count} more {what}s"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_text_loses_its_middle() {
        let check = |text: &str, most, expected: &str| {
            assert_eq!(shortened(text, most), expected);
            assert!(shortened(text, most).chars().count() <= most.max(1));
        };
        check("abc", 3, "abc");
        check("äöü", 3, "äöü");
        check("abcdefghij", 8, "abcde…ij");
        check("äöüäöüäöüä", 8, "äöüäö…üä");
        check("abcd", 2, "a…");
    }

    fn report(errors: usize, warnings: usize) -> Report {
        let warning = |place| Diagnostic::warning("U0002", "a warning", place..place);
        let error = |place| Diagnostic::error("U0001", "x".repeat(5_000), place..place);
        Report {
            name: "a".into(),
            text: " ".repeat(errors + warnings),
            diagnostics: (0..warnings)
                .map(warning)
                .chain((warnings..warnings + errors).map(error))
                .collect(),
        }
    }

    #[test]
    fn errors_are_shown_before_warnings_and_the_rest_is_counted() {
        let check = |errors, warnings, most, expected: [usize; 2], rest: Option<&str>| {
            let shown = report(errors, warnings).shown(most);
            let count = |code| shown.iter().filter(|found| found.code == code).count();
            assert_eq!([count("U0001"), count("U0002")], expected);
            let last = shown.last().filter(|found| found.code == LEFT_OUT);
            assert_eq!(last.map(|found| found.message.as_str()), rest);
        };
        check(3, 2, 5, [3, 2], None);
        check(3, 2, 4, [3, 1], Some("1 more warning of this file is not shown"));
        check(
            3,
            2,
            1,
            [1, 0],
            Some("2 more errors and 2 more warnings of this file are not shown"),
        );
        check(0, 0, 0, [0, 0], None);
        check(2, 0, 0, [0, 0], Some("2 more errors of this file are not shown"));
        check(500, 0, 1_000, [100, 0], Some("400 more errors of this file are not shown"));
    }

    #[test]
    fn texts_and_further_places_are_bounded() {
        let mut report = report(1, 0);
        let mut found = report.diagnostics.remove(0).with_label("y".repeat(5_000));
        for place in 0..50 {
            found = found.with_related(place..place, "z".repeat(5_000));
        }
        report.diagnostics.push(found.with_help("h".repeat(5_000)));
        let shown = report.shown(10);
        let all = format!("{shown:?}");
        assert!(all.len() < 10_000, "{}", all.len());
        assert_eq!(shown[0].related.len(), MAXIMUM_RELATED);
    }
}
