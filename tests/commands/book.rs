//! The book: its links lead somewhere, its summary has every page, and the commands of its tutorials run.

use std::collections::BTreeSet;
use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Component, Path, PathBuf};
use std::process::Command;

use crate::empty_folder;

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
    parts
        .filter_map(|part| Some(part.split_once(')')?.0.to_owned()))
        .collect()
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
    let mut pages = vec![root().join("README.md"), root().join("ARCHITECTURE.md")];
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

/// Writes the named blocks of a page and runs its `sh` blocks, in their order.
fn walk_through(page: &Path) {
    let text = fs::read_to_string(page).expect("a page");
    let name = page.file_stem().expect("a name").to_string_lossy();
    let folder = empty_folder(&format!("book_{name}"));
    symlink(root().join("examples"), folder.join("examples")).expect("a link");
    let programs = Path::new(env!("CARGO_BIN_EXE_understudy"))
        .parent()
        .expect("a folder");
    let path = std::env::var("PATH").unwrap_or_default();
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
        if let Some((_, file)) = words.split_once(' ') {
            fs::write(folder.join(file), body).expect("written");
        } else if words == "sh" {
            let output = Command::new("timeout")
                .args(["300", "sh", "-e", "-c", &body])
                .current_dir(&folder)
                .env("PATH", format!("{}:{path}", programs.display()))
                .output()
                .expect("a shell");
            let said: String = String::from_utf8_lossy(&output.stderr)
                .chars()
                .take(1000)
                .collect();
            assert!(
                output.status.success(),
                "{}:\n{body}\n{said}",
                page.display()
            );
        }
    }
}

#[test]
fn what_tutorials_and_guides_say_works() {
    let mut pages = Vec::new();
    for folder in ["docs/tutorials", "docs/how-to", "docs/reference"] {
        pages_below(&root().join(folder), &mut pages);
    }
    assert!(pages.len() > 4, "{pages:?}");
    for page in pages {
        walk_through(&page);
    }
}
