//! The book: its links lead somewhere, its summary has every page, and the commands of its tutorials run.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Component, Path, PathBuf};
use std::process::{Command, Output};

use crate::{empty_folder, understudy};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// All Markdown files below `folder`.
fn pages_below(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a readable folder") {
        let path = entry.expect("a readable entry").path();
        if path.is_dir() {
            pages_below(&path, found);
        } else if path.extension().is_some_and(|ending| ending == "md") {
            found.push(path);
        }
    }
}

/// The pages in the folder of the project itself.
fn top_pages() -> Vec<PathBuf> {
    let names = ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "CHANGELOG.md"];
    names.iter().map(|name| root().join(name)).collect()
}

/// The text without its blocks of code, in which brackets are no links.
fn prose(text: &str) -> String {
    let mut inside = false;
    let mut kept = String::new();
    for line in text.lines() {
        if line.trim_start().starts_with("```") {
            inside = !inside;
        } else if !inside {
            kept.push_str(line);
            kept.push('\n');
        }
    }
    kept
}

/// What stands in `](...)`.
fn links(text: &str) -> Vec<String> {
    let prose = prose(text);
    let parts = prose.split("](").skip(1);
    parts.filter_map(|part| Some(part.split_once(')')?.0.to_owned())).collect()
}

/// As GitHub and mdBook name the place of a heading.
fn anchors(text: &str) -> BTreeSet<String> {
    let prose = prose(text);
    let headings = prose.lines().filter(|line| line.starts_with('#'));
    headings
        .map(|heading| {
            let words = heading.trim_start_matches('#').trim().to_lowercase();
            let kept = words
                .chars()
                .filter(|character| character.is_alphanumeric() || " -_".contains(*character));
            kept.collect::<String>().replace(' ', "-")
        })
        .collect()
}

/// `a/b/../c` as `a/c`.
fn plain(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir => {
                plain.pop();
            }
            Component::CurDir => {}
            _ => plain.push(part),
        }
    }
    plain
}

#[test]
fn every_link_leads_somewhere() {
    let mut pages = top_pages();
    for folder in ["docs", "examples", "deployment", "clients"] {
        if root().join(folder).exists() {
            pages_below(&root().join(folder), &mut pages);
        }
    }
    let mut dead = Vec::new();
    for page in &pages {
        let text = fs::read_to_string(page).expect("a page");
        for link in links(&text) {
            if link.starts_with("http://") || link.starts_with("https://") {
                continue;
            }
            let (file, place) = link.split_once('#').unwrap_or((&link, ""));
            let target = match file {
                "" => page.clone(),
                _ => plain(&page.parent().expect("a folder").join(file)),
            };
            let there = target.exists() && target.starts_with(root());
            let place_is_there = place.is_empty()
                || fs::read_to_string(&target).is_ok_and(|text| anchors(&text).contains(place));
            if !there || !place_is_there {
                dead.push(format!("{}: {link}", page.display()));
            }
        }
    }
    assert!(pages.len() > 30 && dead.is_empty(), "{dead:#?}");
}

#[test]
fn the_summary_has_every_page_once() {
    let docs = root().join("docs");
    let summary = fs::read_to_string(docs.join("SUMMARY.md")).expect("a summary");
    let mut listed = links(&summary);
    let mut pages = Vec::new();
    pages_below(&docs, &mut pages);
    let mut there: Vec<String> = pages
        .iter()
        .filter_map(|page| Some(page.strip_prefix(&docs).ok()?.display().to_string()))
        .filter(|page| page != "SUMMARY.md")
        .collect();
    listed.sort();
    there.sort();
    assert_eq!(listed, there, "docs/SUMMARY.md and the pages in docs");
}

/// The blocks of a page: what stands behind the fence, and the lines.
fn blocks(text: &str) -> Vec<(String, String)> {
    let mut lines = text.lines();
    let mut blocks = Vec::new();
    while let Some(line) = lines.next() {
        if let Some(words) = line.strip_prefix("```") {
            let body = lines.by_ref().take_while(|line| *line != "```");
            blocks.push((words.to_owned(), body.flat_map(|line| [line, "\n"]).collect()));
        }
    }
    blocks
}

/// The commands of a block, for the binary that was built. Real processes have tests of their own.
fn commands(body: &str) -> String {
    let body = body.replace("cargo run --release -- ", "understudy ");
    let apart = ["understudy demo", "understudy lab ", "understudy watch ", "cargo "];
    let kept = body.lines().filter(|line| !apart.iter().any(|command| line.starts_with(command)));
    kept.flat_map(|line| [line, "\n"]).collect()
}

/// An empty folder with the examples and the scenarios in it.
pub(crate) fn folder_of_examples(name: &str) -> PathBuf {
    let folder = empty_folder(name);
    for shared in ["examples", "scenarios"] {
        symlink(root().join(shared), folder.join(shared)).expect("a link");
    }
    folder
}

/// Runs a text of commands as a person types it, with the binary that was built.
pub(crate) fn shell(folder: &Path, commands: &str) -> Output {
    let programs = Path::new(env!("CARGO_BIN_EXE_understudy")).parent().expect("a folder");
    let path = std::env::var("PATH").unwrap_or_default();
    Command::new("timeout")
        .args(["900", "sh", "-e", "-c", commands])
        .current_dir(folder)
        .env("PATH", format!("{}:{path}", programs.display()))
        .env_remove("COLUMNS")
        .output()
        .expect("a shell")
}

/// Writes the named blocks of a page and runs its `sh` blocks, in their order; says in which folder. Blocks of a `console` take another
/// machine, a reader or minutes, or end with another status.
fn walk_through(page: &Path) -> PathBuf {
    let text = fs::read_to_string(page).expect("a page");
    let name = page.strip_prefix(root()).expect("a page of the project");
    let name = name.display().to_string().replace('/', "_");
    let folder = folder_of_examples(&format!("book_{name}"));
    let blocks = blocks(&text);
    for (words, body) in &blocks {
        if let Some((_, file)) = words.split_once(' ') {
            let file = folder.join(file);
            fs::create_dir_all(file.parent().expect("a folder")).expect("made");
            fs::write(file, body).expect("written");
        }
    }
    for (_, body) in blocks.iter().filter(|(words, _)| words == "sh") {
        let output = shell(&folder, &commands(body));
        let said: String = String::from_utf8_lossy(&output.stderr).chars().take(1000).collect();
        assert!(output.status.success(), "{}:\n{body}\n{said}", page.display());
    }
    folder
}

#[test]
fn what_the_pages_say_works() {
    let mut pages = vec![root().join("README.md")];
    pages_below(&root().join("docs"), &mut pages);
    pages_below(&root().join("examples"), &mut pages);
    // The pages of the codes are run with what each of them has to answer, and the gallery with its pictures.
    pages.retain(|page| {
        !page.starts_with(root().join("docs/errors"))
            && !page.ends_with("docs/reference/examples.md")
    });
    assert!(pages.len() > 45, "{pages:?}");
    for page in pages {
        walk_through(&page);
    }
}

#[test]
fn the_gallery_shows_what_its_commands_draw() {
    let page = root().join("docs/reference/examples.md");
    let folder = walk_through(&page);
    let mut other = Vec::new();
    for link in links(&fs::read_to_string(&page).expect("a page")) {
        let Some(name) = link.strip_prefix("../pictures/examples/") else {
            continue;
        };
        let shown = root().join("docs/pictures/examples").join(name);
        let made = folder.join(name);
        if fs::read(&made).ok() != fs::read(&shown).ok() {
            other.push(format!("cp {} {}", made.display(), shown.display()));
        }
    }
    assert!(other.is_empty(), "pictures are others now; renew them:\n{}", other.join("\n"));
}

/// Commands of this program as a page has them: in blocks of a shell, in indented lines, and between backticks.
fn published(text: &str) -> Vec<String> {
    let text = text.replace("\\\n", " ");
    let shells = blocks(&text).into_iter().filter(|(words, _)| words == "sh" || words == "console");
    let prose = prose(&text);
    let indented = prose.lines().filter_map(|line| line.strip_prefix("    "));
    let between = prose.split('`').skip(1).step_by(2);
    let written: Vec<String> = shells.map(|(_, body)| body).collect();
    let written = written.iter().flat_map(|body| body.lines());
    let all = written.chain(indented).chain(between).map(str::trim_start);
    let ours = all.map(|line| line.replace("cargo run --release -- ", "understudy "));
    let ours = ours.flat_map(|line| line.split(" && ").map(str::to_owned).collect::<Vec<_>>());
    ours.filter(|command| command.starts_with("understudy ") && !command.contains('\n')).collect()
}

#[test]
fn every_command_and_option_that_is_named_exists() {
    let mut pages = top_pages();
    for folder in ["docs", "examples", "deployment", "clients"] {
        pages_below(&root().join(folder), &mut pages);
    }
    let mut helps: BTreeMap<Vec<String>, Option<String>> = BTreeMap::new();
    let mut wrong = Vec::new();
    for page in &pages {
        let text = fs::read_to_string(page).expect("a page");
        for command in published(&text) {
            let command = command.split(" #").next().unwrap_or_default();
            let words: Vec<&str> = command.split_whitespace().skip(1).collect();
            let is_name = |word: &&&str| {
                let mut letters = word.chars();
                letters.all(|letter| letter.is_ascii_lowercase() || letter == '-')
            };
            let path = words.iter().take(2).take_while(is_name);
            let mut path: Vec<String> = path.map(ToString::to_string).collect();
            // The second word of a command may be its operand.
            let help = loop {
                let arguments = path.iter().map(String::as_str).chain(["--help"]);
                let arguments: Vec<&str> = arguments.collect();
                let help = helps.entry(path.clone()).or_insert_with(|| {
                    let answer = understudy(&arguments);
                    (answer.status == 0).then_some(answer.output)
                });
                if help.is_some() || path.len() < 2 {
                    break help.clone();
                }
                path.pop();
            };
            let options = words.iter().filter_map(|word| {
                let name = word.trim_matches(|letter| "()[],.;".contains(letter));
                let name = name.split('=').next()?;
                name.starts_with("--").then_some(name)
            });
            let unknown: Vec<&str> = match &help {
                None => vec!["the command"],
                Some(help) => {
                    let known =
                        |option: &&str| help.split([' ', '\n', ',']).any(|word| word == *option);
                    options.filter(|option| *option != "--" && !known(option)).collect()
                }
            };
            if !unknown.is_empty() {
                wrong.push(format!("{}: {command}: {}", page.display(), unknown.join(" ")));
            }
        }
    }
    assert!(helps.len() > 30 && wrong.is_empty(), "{wrong:#?}");
}

/// The page on deployment copies one binary of a release, and installs it once.
#[test]
fn a_release_is_copied_and_installed_once() {
    let page = fs::read_to_string(root().join("docs/how-to/deployment.md")).expect("a page");
    let copy = page.lines().find(|line| line.starts_with("scp "));
    let pattern = copy.and_then(|line| line.split(' ').nth(1));
    let pattern = pattern.expect("a command that copies the binary");
    let folder = empty_folder("release_names");
    fs::create_dir(folder.join("release")).expect("a folder");
    // As deployment/release.sh names them.
    for binary in ["understudy", "understudy-runtime", "understudy-opcua"] {
        for target in ["x86_64", "aarch64"] {
            for ending in ["", ".cdx.json"] {
                let name = format!("{binary}-0.1.0-{target}-unknown-linux-musl{ending}");
                fs::write(folder.join("release").join(name), "").expect("written");
            }
        }
    }
    let shell = Command::new("sh")
        .args(["-c", &format!("printf '%s\\n' {pattern}")])
        .current_dir(&folder)
        .output()
        .expect("a shell");
    let matched = String::from_utf8(shell.stdout).expect("text");
    assert_eq!(matched, "release/understudy-runtime-0.1.0-aarch64-unknown-linux-musl\n");
    let installs = page.lines().filter(|line| line.contains("/usr/local/bin")).count();
    assert_eq!(installs, 1, "the binary is installed by one command");
}
