use std::time::Duration;

use super::*;
use toml::de::DeTable;

const CODES: Codes = Codes {
    no_toml: "toml",
    unknown_key: "key",
    missing_key: "missing",
    wrong_type: "type",
    out_of_bounds: "bounds",
    unknown_word: "word",
};

/// What `read` makes of `text`, and the findings: each with its code and the text in its place.
fn check<T: PartialEq + std::fmt::Debug>(
    text: &str,
    read: impl FnOnce(&mut Fields<'_, '_>, &mut Vec<Diagnostic>) -> T,
    expected: T,
    findings: &[(&str, &str)],
) {
    let mut diagnostics = Vec::new();
    let root = parse(text, &CODES, &mut diagnostics).expect("it is TOML");
    let table: &DeTable<'_> = root.get_ref();
    let table = Placed { value: table, span: 0..0 };
    let mut fields = Fields::new("a test", table, &CODES);
    assert_eq!(read(&mut fields, &mut diagnostics), expected, "{text}");
    fields.finish(&mut diagnostics);
    let found: Vec<(&str, &str)> =
        diagnostics.iter().map(|found| (found.code, &text[found.span.clone()])).collect();
    assert_eq!(found, findings, "{text}");
}

#[test]
fn a_whole_number_is_in_its_bounds() {
    let check = |text, expected: Option<u64>, findings: &[(&str, &str)]| {
        let read = |fields: &mut Fields<'_, '_>, found: &mut Vec<Diagnostic>| {
            fields.count("a", 2..=20, found).map(|count| count.value)
        };
        check(text, read, expected, findings);
    };
    check("", None, &[]);
    check("a = 2", Some(2), &[]);
    check("a = 0x14", Some(20), &[]);
    check("a = 1", None, &[("bounds", "1")]);
    check("a = 21", None, &[("bounds", "21")]);
    check("a = -3", None, &[("bounds", "-3")]);
    check("a = 3.0", None, &[("type", "3.0")]);
    check("a = \"3\"", None, &[("type", "\"3\"")]);
    check("b = 3", None, &[("key", "b")]);
}

#[test]
fn a_time_is_in_its_bounds() {
    let check = |text, expected: Option<u64>, findings: &[(&str, &str)]| {
        let bounds = Duration::from_millis(1)..=Duration::from_secs(2);
        let read = |fields: &mut Fields<'_, '_>, found: &mut Vec<Diagnostic>| {
            fields.time("a", bounds, found)
        };
        check(text, read, expected.map(Duration::from_millis), findings);
    };
    check("a = \"1ms\"", Some(1), &[]);
    check("a = \"2 s\"", Some(2000), &[]);
    check("a = \"2.1s\"", None, &[("bounds", "\"2.1s\"")]);
    check("a = \"2\"", None, &[("type", "\"2\"")]);
    check("a = 2", None, &[("type", "2")]);
}

#[test]
fn lists_give_what_is_right_in_them() {
    let check = |text, expected: &[&str], findings: &[(&str, &str)]| {
        let read = |fields: &mut Fields<'_, '_>, found: &mut Vec<Diagnostic>| {
            let texts = fields.texts("a", found).into_iter();
            texts.map(|text| text.value.to_owned()).collect()
        };
        let expected: Vec<String> = expected.iter().map(|&text| text.to_owned()).collect();
        check(text, read, expected, findings);
    };
    check("a = \"x\"", &["x"], &[]);
    check("a = [\"x\", \"y\"]", &["x", "y"], &[]);
    check("a = [\"x\", 1, \"y\", true]", &["x", "y"], &[("type", "1"), ("type", "true")]);
    check("a = 1", &[], &[("type", "1")]);
}

#[test]
fn tables_words_and_entries() {
    let read = |fields: &mut Fields<'_, '_>, found: &mut Vec<Diagnostic>| {
        fields.require(&["word", "absent"], found);
        let word = fields.word("word", &["late", "prompt"], found);
        let tables = fields.tables("table", "a table", found);
        let mut sum = 0.0;
        for mut table in tables {
            let number = table.number("number", 0.0..=1.0, found);
            sum += number.map_or(0.0, |number| number.value);
            table.finish(found);
        }
        let entries = fields.get("entries");
        let entries = entries.map_or_else(Vec::new, |value| value.entries("a table", found));
        let entries = entries.into_iter();
        let bits: Vec<Option<bool>> =
            entries.map(|(_, value)| value.flag(found).map(|bit| bit.value)).collect();
        (word, sum, bits)
    };
    let text = "word = \"prompt\"\nentries = { x = true, y = 1 }\n[[table]]\nnumber = 0.5\n[[table]]\nnumber = 2\nother = 1\n";
    let findings = [("missing", ""), ("bounds", "2"), ("key", "other"), ("type", "1")];
    check(text, read, (1, 0.5, vec![Some(true), None]), &findings);
    check(
        "word = \"latt\"\nabsent = 1",
        read,
        (0, 0.0, vec![]),
        &[("word", "\"latt\""), ("key", "absent")],
    );
}

#[test]
fn a_text_that_is_no_toml_says_only_that() {
    let mut diagnostics = Vec::new();
    assert!(parse("a = = 1\nb", &CODES, &mut diagnostics).is_none());
    assert!(diagnostics.iter().all(|found| found.code == "toml"));
    assert!(!diagnostics.is_empty());
}
