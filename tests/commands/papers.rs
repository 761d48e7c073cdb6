//! `docs/evidence/papers.md`: each of its commands runs and prints the values that the page gives for it.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Mutex;
use std::thread;

use crate::book::{folder_of_examples, shell};

/// The columns of every table of the page.
const COLUMNS: [&str; 6] = ["row", "paper", "command", "result", "paper's result", "difference"];

/// One line of a table.
struct Row {
    /// Section and name of the row.
    name: String,
    /// What is run, with the exit status that it ends with.
    command: Option<(String, i32)>,
    /// Texts that the command prints.
    values: Vec<String>,
    difference: String,
}

/// The fields of a line of a table; `\|` is a bar within a field.
fn fields(line: &str) -> Option<Vec<String>> {
    let inside = line.strip_prefix('|')?.strip_suffix('|')?;
    let inside = inside.replace("\\|", "\0");
    Some(inside.split('|').map(|field| field.replace('\0', "|").trim().to_owned()).collect())
}

/// What a field has between backticks.
fn codes(field: &str) -> Vec<String> {
    field.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

fn rows(page: &str) -> Vec<Row> {
    let mut section = "";
    let mut rows = Vec::new();
    let mut lines = page.lines();
    while let Some(line) = lines.next() {
        section = line.strip_prefix("## ").unwrap_or(section);
        let Some(header) = fields(line) else { continue };
        assert_eq!(header, COLUMNS, "a table of {section}");
        lines.next();
        for line in lines.by_ref().take_while(|line| !line.is_empty()) {
            let found = fields(line).unwrap_or_else(|| panic!("{section}: {line}"));
            let [row, _, command, result, _, difference] = &found[..] else {
                panic!("{section}: {} fields in {line}", found.len());
            };
            let status = command.rsplit_once("exit status ");
            let status = status.map_or(0, |(_, number)| number.parse().expect("a status"));
            rows.push(Row {
                name: format!("{section}, {row}"),
                command: codes(command).into_iter().next().map(|command| (command, status)),
                values: codes(result),
                difference: difference.clone(),
            });
        }
    }
    rows
}

/// A text without what only arranges it.
fn words(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[test]
fn each_command_of_the_papers_prints_its_values() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/evidence/papers.md");
    let rows = rows(&std::fs::read_to_string(page).expect("a page"));
    let mut by_command: BTreeMap<&(String, i32), Vec<&Row>> = BTreeMap::new();
    let wrong = Mutex::new(Vec::new());
    for row in &rows {
        match &row.command {
            Some(command) => by_command.entry(command).or_default().push(row),
            None if row.difference.is_empty() => {
                let told = format!("{}: neither a command nor a reason", row.name);
                wrong.lock().expect("no panic").push(told);
            }
            None => {}
        }
    }
    let commands: Mutex<Vec<_>> = Mutex::new(by_command.into_iter().enumerate().collect());
    let work = || {
        loop {
            let next = commands.lock().expect("no panic").pop();
            let Some((place, ((command, status), rows))) = next else { break };
            let folder = folder_of_examples(&format!("papers_{place}"));
            let output = shell(&folder, command);
            let said = [&output.stdout[..], &output.stderr].concat();
            let said = words(&String::from_utf8_lossy(&said));
            let mut wrong = wrong.lock().expect("no panic");
            if output.status.code() != Some(*status) {
                let start: String = said.chars().take(500).collect();
                wrong.push(format!("{command}: {}: {start}", output.status));
            }
            for row in rows {
                assert!(!row.values.is_empty(), "{}: no value to compare", row.name);
                for value in row.values.iter().filter(|value| !said.contains(&words(value))) {
                    wrong.push(format!("{}: {command} does not print `{value}`", row.name));
                }
            }
        }
    };
    thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(work);
        }
    });
    let wrong = wrong.into_inner().expect("no panic");
    assert!(rows.len() > 60 && wrong.is_empty(), "{} rows: {wrong:#?}", rows.len());
}
