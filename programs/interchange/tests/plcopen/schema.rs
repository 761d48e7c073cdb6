//! Our table of the schema takes and refuses what `xmllint --schema` takes and refuses.

use understudy_interchange::plcopen::{read, write};

use crate::random::{Dice, random_program};
use crate::support::{PERIOD, data, xmllint};

/// Whether the reader finds the file as the schema wants it.
fn by_the_schema(text: &str) -> bool {
    let reading = read(text, None);
    !reading
        .diagnostics
        .iter()
        .any(|found| matches!(found.code, "U1001" | "U1021"))
}

#[test]
fn public_files_are_judged_as_by_xmllint() {
    let Some(index) = data("ladder/index.json") else {
        return;
    };
    let index = std::fs::read_to_string(index).expect("a file that exists");
    let index: serde_json::Value = serde_json::from_str(&index).expect("an index");
    for (number, entry) in index.as_array().expect("files").iter().enumerate() {
        let file = entry["file"].as_str().expect("a name");
        let Some(path) = data(&format!("ladder/{file}")) else {
            continue;
        };
        let text = std::fs::read_to_string(path).expect("a file that exists");
        // The schema at hand is that of 2.01.
        let text = text.replace("tc6_0200", "tc6_0201");
        if let Some(valid) = xmllint(&format!("public-{number}"), &text) {
            assert_eq!(by_the_schema(&text), valid, "{file}");
        }
    }
}

#[test]
fn changed_files_are_judged_as_by_xmllint() {
    let text = write(&random_program(3, 5), PERIOD);
    assert!(by_the_schema(&text));
    let mut dice = Dice::new(2);
    let lines: Vec<&str> = text.lines().collect();
    let mut refused = 0;
    for number in 0..60 {
        let mut changed = lines.clone();
        let place = 2 + dice.below(lines.len() - 3);
        let line = lines[place];
        let alone = line.trim_end().ends_with("/>") || line.contains("</");
        let replacement;
        match dice.below(4) {
            // An element without children goes, comes twice, or moves.
            0 if alone => drop(changed.remove(place)),
            1 if alone => changed.insert(place, line),
            2 if alone => {
                let line = changed.remove(place);
                changed.insert(2 + dice.below(lines.len() - 4), line);
            }
            _ => {
                replacement = changed_attribute(line, &mut dice);
                changed[place] = &replacement;
            }
        }
        let changed = changed.join("\n");
        if roughly_well_formed(&changed)
            && let Some(valid) = xmllint(&format!("changed-{number}"), &changed)
        {
            assert_eq!(
                by_the_schema(&changed),
                valid,
                "change {number} of line {place}: {line}"
            );
            refused += usize::from(!valid);
        }
    }
    assert!(
        refused > 10
            || data("plcopen/tc6_xml_v201.xsd").is_none()
            || xmllint("none", &text).is_none()
    );
}

fn changed_attribute(line: &str, dice: &mut Dice) -> String {
    let values = [
        "",
        "-1",
        "x",
        "1.5",
        "true",
        "rising",
        "2026-01-01T00:00:00",
    ];
    let quotes: Vec<usize> = line.match_indices('"').map(|(place, _)| place).collect();
    if quotes.len() < 2 {
        return line.to_owned();
    }
    let pair = dice.below(quotes.len() / 2) * 2;
    let value = dice.pick(&values);
    format!(
        "{}{value}{}",
        &line[..=quotes[pair]],
        &line[quotes[pair + 1]..]
    )
}

/// A namespace that was changed makes another file of it.
fn roughly_well_formed(text: &str) -> bool {
    text.contains("xmlns=\"http://www.plcopen.org/xml/tc6_0201\"")
        && text.contains("xmlns:xhtml=\"http://www.w3.org/1999/xhtml\"")
}
