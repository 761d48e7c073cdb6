//! Every code has a page, and the example of each page answers with its code.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::Command;
use std::sync::Mutex;
use std::thread;

use understudy_text::pages::{Page, pages};

use crate::{empty_folder, understudy};

#[test]
fn a_code_is_explained() {
    let answer = understudy(&["explain", "u0104"]);
    assert_eq!(answer.status, 0, "{}", answer.errors);
    assert!(answer.output.starts_with("U0104: "), "{}", answer.output);
    assert!(answer.output.contains("/ful"), "{}", answer.output);
    let json = understudy(&["explain", "U0104", "--json"]).json();
    assert_eq!(json["result"]["code"], "U0104");
    let all = understudy(&["explain", "--json"]).json();
    let listed = all["result"]["codes"].as_array().expect("a list").len();
    assert_eq!(listed, pages().count());
    assert_eq!(understudy(&["explain", "sense"]).status, 2);
}

/// The codes in a text: a U and four digits that stand alone.
fn codes(text: &str) -> BTreeSet<String> {
    let belongs = |character: char| character.is_ascii_alphanumeric();
    text.split(|character: char| !belongs(character))
        .filter(|word| {
            let digits = word.strip_prefix('U').unwrap_or_default();
            digits.len() == 4 && digits.bytes().all(|byte| byte.is_ascii_digit())
        })
        .map(str::to_owned)
        .collect()
}

/// Adds the codes in string literals of all sources below `folder`, each with a file that has it.
fn add_sources(folder: &Path, found: &mut BTreeMap<String, String>) {
    for entry in fs::read_dir(folder).expect("a readable folder") {
        let path = entry.expect("a readable entry").path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if path.is_dir() {
            let others = ["tests", "target", "benches", "runs", "docs", "clients"];
            if !others.contains(&name.as_ref()) && !name.starts_with('.') {
                add_sources(&path, found);
            }
        } else if name.ends_with(".rs") && name != "tests.rs" {
            let text = fs::read_to_string(&path).expect("a readable source");
            let (code, _) = text.split_once("#[cfg(test)]").unwrap_or((&text, ""));
            let literals = code.split('"').skip(1);
            for code in literals.flat_map(codes) {
                found.entry(code).or_insert(path.display().to_string());
            }
        }
    }
}

#[test]
fn every_code_has_a_page_and_every_page_a_code() {
    let mut sources = BTreeMap::new();
    add_sources(Path::new(env!("CARGO_MANIFEST_DIR")), &mut sources);
    let explained: BTreeSet<&str> = pages().map(|page| page.code).collect();
    let lacking: Vec<_> =
        sources.iter().filter(|(code, _)| !explained.contains(code.as_str())).collect();
    assert!(lacking.is_empty(), "write a section in docs/errors for each of these: {lacking:?}");
    let orphans: Vec<_> = explained.iter().filter(|code| !sources.contains_key(**code)).collect();
    assert!(orphans.is_empty(), "no source has these: {orphans:?}");
}

/// What the blocks of a page or of a group say.
#[derive(Default)]
struct Example {
    files: Vec<(String, String)>,
    commands: Vec<String>,
    /// Run by the tests of the crate that the code belongs to.
    rust: Vec<String>,
}

impl Example {
    fn of(text: &str) -> Self {
        let mut example = Self::default();
        let mut lines = text.lines();
        while let Some(line) = lines.next() {
            let Some(words) = line.strip_prefix("```") else {
                continue;
            };
            let body: String = lines
                .by_ref()
                .take_while(|line| *line != "```")
                .flat_map(|line| [line, "\n"])
                .collect();
            match words.split_once(' ') {
                Some((_, name)) => example.files.push((name.to_owned(), body)),
                None if words == "sh" => example.commands.push(body),
                None if words == "rust" => example.rust.push(body),
                None => {}
            }
        }
        if example.commands.is_empty() && !example.files.is_empty() {
            let names: Vec<&str> = example.files.iter().map(|file| file.0.as_str()).collect();
            let command = format!("understudy check {}", names.join(" "));
            example.commands.push(command);
        }
        example
    }
}

/// All that the example of `page` answers; where a command does not end, it is ended.
fn answer_of(page: &Page, folder: &Path, path: &str) -> String {
    let mut said = String::new();
    let mut run = |script: &str| {
        let output = Command::new("timeout")
            .args(["120", "sh", "-c", script])
            .current_dir(folder)
            .env("PATH", path)
            .output()
            .expect("a shell");
        said.push_str(&String::from_utf8_lossy(&output.stdout));
        said.push_str(&String::from_utf8_lossy(&output.stderr));
    };
    Example::of(page.group).commands.iter().for_each(|script| run(script));
    let example = Example::of(page.text);
    for (name, text) in &example.files {
        fs::write(folder.join(name), text).expect("written");
    }
    example.commands.iter().for_each(|script| run(script));
    said
}

#[test]
fn the_example_of_each_page_answers_with_its_code() {
    let root = empty_folder("explain");
    let project = Path::new(env!("CARGO_MANIFEST_DIR"));
    let programs = Path::new(env!("CARGO_BIN_EXE_understudy")).parent().expect("a folder");
    let path = format!("{}:{}", programs.display(), std::env::var("PATH").unwrap_or_default());
    let waiting: Mutex<Vec<Page>> = Mutex::new(pages().collect());
    let wrong: Mutex<Vec<String>> = Mutex::default();
    let work = || {
        loop {
            let Some(page) = waiting.lock().expect("whole").pop() else {
                break;
            };
            let example = Example::of(page.text);
            let code_in_rust = example.rust.iter().any(|rust| rust.contains(page.code));
            if example.commands.is_empty() {
                if !code_in_rust && !page.text.contains("Not shown here: ") {
                    let line = format!("{} has neither an example nor a reason", page.code);
                    wrong.lock().expect("whole").push(line);
                }
                continue;
            }
            let folder = root.join(page.code);
            fs::create_dir(&folder).expect("a folder");
            symlink(project.join("examples"), folder.join("examples")).expect("a link");
            let said = answer_of(&page, &folder, &path);
            let found = codes(&said);
            // What else comes of it stands on the page too.
            let others = found.iter().filter(|code| *code != page.code);
            let unmentioned: Vec<_> =
                others.filter(|code| !page.text.contains(code.as_str())).collect();
            if !found.contains(page.code) || !unmentioned.is_empty() {
                let cut: String = said.chars().take(600).collect();
                let line = format!("{} answers {found:?}:\n{cut}", page.code);
                wrong.lock().expect("whole").push(line);
            }
        }
    };
    thread::scope(|scope| {
        scope.spawn(work);
        scope.spawn(work);
    });
    let wrong = wrong.into_inner().expect("whole");
    assert!(wrong.is_empty(), "{} pages:\n{}", wrong.len(), wrong[..wrong.len().min(5)].join("\n"));
}
