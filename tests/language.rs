//! The language of everything that people read: no banned phrase is added.
//!
//! `docs/reference/banned-phrases.txt` lists the phrases with their replacements. `tests/language/baseline.txt` has the number of hits
//! that each file had when the list was made; a file that it does not name has none. A number may fall and must not rise. After a file has
//! been improved, `UNDERSTUDY_LANGUAGE=update cargo test --test language` lowers its number; it never raises one.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::{env, fs};

const LIST: &str = include_str!("../docs/reference/banned-phrases.txt");
const BASELINE: &str = "tests/language/baseline.txt";
const UPDATE: &str = "UNDERSTUDY_LANGUAGE";

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// A part of a phrase: the beginning of a word, and whether any letters may follow.
struct Part {
    start: Vec<char>,
    open: bool,
}

struct Phrase {
    text: &'static str,
    parts: Vec<Part>,
    /// Empty for a text that is allowed.
    replacement: &'static str,
}

impl Phrase {
    fn new(text: &'static str, replacement: &'static str) -> Self {
        let part = |word: &str| Part {
            start: word.trim_end_matches('*').chars().collect(),
            open: word.ends_with('*'),
        };
        Self { text, parts: text.split_whitespace().map(part).collect(), replacement }
    }

    /// Where the phrase ends that begins at `start` of the text in small letters.
    fn end(&self, text: &[char], start: usize) -> Option<usize> {
        let mut at = start;
        for (index, part) in self.parts.iter().enumerate() {
            if index > 0 {
                let blank = text[at..].iter().take_while(|letter| letter.is_whitespace());
                match blank.count() {
                    0 => return None,
                    count => at += count,
                }
            }
            if !text[at..].starts_with(&part.start) {
                return None;
            }
            at += part.start.len();
            let rest = text[at..].iter().take_while(|letter| is_letter(**letter));
            let rest = rest.count();
            if rest > 0 && !part.open {
                return None;
            }
            at += rest;
        }
        Some(at)
    }
}

fn is_letter(letter: char) -> bool {
    letter.is_alphanumeric() || letter == '_'
}

/// The banned phrases, and the texts in which one is allowed.
fn phrases() -> (Vec<Phrase>, Vec<Phrase>) {
    let lines = LIST.lines().map(str::trim);
    let lines = lines.filter(|line| !line.is_empty() && !line.starts_with('#'));
    let (mut banned, mut allowed) = (Vec::new(), Vec::new());
    for line in lines {
        if let Some(text) = line.strip_prefix('!') {
            allowed.push(Phrase::new(text.trim(), ""));
        } else {
            let (text, replacement) = line.split_once(" -> ").expect("phrase -> replacement");
            banned.push(Phrase::new(text.trim(), replacement.trim()));
        }
    }
    (banned, allowed)
}

/// Each hit: its line, counted from 1, and the phrase.
fn hits<'a>(text: &str, banned: &'a [Phrase], allowed: &[Phrase]) -> Vec<(usize, &'a Phrase)> {
    let letters: Vec<char> =
        text.chars().map(|letter| letter.to_lowercase().next().unwrap_or(letter)).collect();
    let mut found = Vec::new();
    let mut line = 1;
    let mut allowed_until = 0;
    for at in 0..letters.len() {
        if letters[at] == '\n' {
            line += 1;
        }
        if !is_letter(letters[at]) || (at > 0 && is_letter(letters[at - 1])) {
            continue;
        }
        // The name of an option is not prose.
        if letters[..at].ends_with(&['-', '-']) {
            continue;
        }
        let ends = allowed.iter().filter_map(|phrase| phrase.end(&letters, at));
        allowed_until = ends.chain([allowed_until]).max().unwrap_or_default();
        if at < allowed_until {
            continue;
        }
        let here = banned.iter().filter(|phrase| phrase.end(&letters, at).is_some());
        // Of two phrases that begin at one place, the longer one.
        found.extend(here.max_by_key(|phrase| phrase.text.len()).map(|phrase| (line, phrase)));
    }
    found
}

/// Markdown without its code, line by line.
fn prose_of_markdown(text: &str) -> String {
    let mut inside = false;
    let mut prose = String::new();
    for line in text.lines() {
        let fence = line.trim_start().starts_with("```");
        inside ^= fence;
        if !inside && !fence {
            // What is between backticks is code; a code that continues on the next line is left in.
            let parts: Vec<&str> = line.split('`').collect();
            let is_open = parts.len().is_multiple_of(2);
            for (index, part) in parts.iter().enumerate() {
                let is_code = index % 2 == 1 && !(is_open && index + 1 == parts.len());
                prose.push_str(if is_code { "`" } else { part });
            }
        }
        prose.push('\n');
    }
    prose
}

/// The comments of files in TOML, YAML, shell and the like, and all else that they say: their text.
fn prose_of_text(text: &str) -> String {
    text.replace('#', " ")
}

/// The doc comments and the strings of Rust, or all comments and the strings of JavaScript, each in its line.
fn prose_of_code(text: &str, is_rust: bool) -> String {
    let letters: Vec<char> = text.chars().collect();
    let mut prose = String::new();
    let mut at = 0;
    while at < letters.len() {
        let rest = &letters[at..];
        let line_end = || at + rest.iter().take_while(|letter| **letter != '\n').count();
        if rest.starts_with(&['/', '/']) {
            let end = line_end();
            let is_doc = matches!(rest.get(2), Some('/' | '!'));
            if is_doc || !is_rust {
                let comment: String = letters[at..end].iter().collect();
                let comment = comment.trim_start_matches(['/', '!']);
                prose.push_str(&prose_of_markdown(comment));
                prose.pop();
            }
            at = end;
        } else if let Some(end) = end_of_string(rest, is_rust) {
            prose.extend(&letters[at..at + end]);
            prose.push(' ');
            at += end;
        } else {
            if letters[at] == '\n' {
                prose.push('\n');
            }
            at += 1;
        }
    }
    prose
}

/// The length of the string that begins here.
fn end_of_string(rest: &[char], is_rust: bool) -> Option<usize> {
    let quote = *rest.first()?;
    if is_rust && quote == 'r' {
        let hashes = rest[1..].iter().take_while(|letter| **letter == '#').count();
        if rest.get(1 + hashes) != Some(&'"') {
            return None;
        }
        let mut end = vec!['"'];
        end.extend(std::iter::repeat_n('#', hashes));
        let body = 2 + hashes;
        let close = rest[body..].windows(end.len()).position(|window| window == end)?;
        return Some(body + close + end.len());
    }
    if is_rust && quote == '\'' {
        // A character, or else a lifetime.
        let length = if rest.get(1) == Some(&'\\') { 4 } else { 3 };
        return (rest.get(length - 1) == Some(&'\'')).then_some(length);
    }
    if quote != '"' && (is_rust || !matches!(quote, '\'' | '`')) {
        return None;
    }
    let mut escaped = false;
    for (index, letter) in rest.iter().enumerate().skip(1) {
        match letter {
            _ if escaped => escaped = false,
            '\\' => escaped = true,
            letter if *letter == quote => return Some(index + 1),
            _ => {}
        }
    }
    None
}

fn prose(path: &Path, text: &str) -> Option<String> {
    let name = path.file_name()?.to_str()?;
    Some(match name.rsplit('.').next()? {
        "md" => prose_of_markdown(text),
        "rs" => prose_of_code(text, true),
        "js" => prose_of_code(text, false),
        "toml" | "ladder" | "st" | "py" | "sh" | "yaml" | "json5" | "json" | "html" | "service"
        | "logrotate" | "properties" | "control" => prose_of_text(text),
        _ => return None,
    })
}

fn files_below(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a readable folder") {
        let path = entry.expect("a readable entry").path();
        if path.is_dir() && !path.ends_with("vendor") {
            files_below(&path, found);
        } else if path.is_file() {
            found.push(path);
        }
    }
}

/// Everything that people read, by its path in the project.
fn examined() -> BTreeMap<String, String> {
    let mut files = Vec::new();
    for page in ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "CHANGELOG.md"] {
        files.push(root().join(page));
    }
    let folders = ["docs", "examples", "deployment", "clients", "cli", "observation/watch/assets"];
    for folder in folders {
        files_below(&root().join(folder), &mut files);
    }
    let text = |path: PathBuf| {
        let text = fs::read_to_string(&path).ok()?;
        let name = path.strip_prefix(root()).ok()?.to_str()?.to_owned();
        Some((name, prose(&path, &text)?))
    };
    files.into_iter().filter_map(text).collect()
}

fn baseline() -> BTreeMap<String, usize> {
    let text = fs::read_to_string(root().join(BASELINE)).unwrap_or_default();
    let line = |line: &str| {
        let (count, path) = line.trim().split_once(' ')?;
        Some((path.to_owned(), count.parse().ok()?))
    };
    text.lines().filter_map(line).collect()
}

#[test]
fn no_banned_phrase_is_added() {
    let (banned, allowed) = phrases();
    let known = baseline();
    let update = env::var(UPDATE).is_ok_and(|value| value == "update");
    let (mut counts, mut risen, mut fallen) = (BTreeMap::new(), String::new(), String::new());
    for (path, text) in examined() {
        let found = hits(&text, &banned, &allowed);
        let before = known.get(&path).copied().unwrap_or_default();
        if found.len() > before {
            let _ = writeln!(risen, "{path}: {} hits, {before} known", found.len());
            for (line, phrase) in &found {
                let _ =
                    writeln!(risen, "  {path}:{line}: `{}`: {}", phrase.text, phrase.replacement);
            }
        } else if found.len() < before {
            let _ = writeln!(fallen, "{path}: {} hits, {before} known", found.len());
        }
        // A number falls, or is new for a list that has no baseline yet.
        let count = if known.is_empty() { found.len() } else { found.len().min(before) };
        if count > 0 {
            counts.insert(path, count);
        }
    }
    if update {
        let text: String = counts.iter().map(|(path, count)| format!("{count} {path}\n")).collect();
        fs::create_dir_all(root().join("tests/language")).expect("a folder");
        fs::write(root().join(BASELINE), text).expect("written");
        fallen.clear();
        if known.is_empty() {
            risen.clear();
        }
    }
    assert!(risen.is_empty(), "banned phrases; use the replacement:\n{risen}");
    assert!(
        fallen.is_empty(),
        "fewer banned phrases than {BASELINE} says; `{UPDATE}=update cargo test --test language` lowers it:\n{fallen}"
    );
}

#[test]
fn phrases_are_found_as_the_list_says() {
    #[track_caller]
    fn check(prose: &str, expected: &[(usize, &str)]) {
        let (banned, allowed) = phrases();
        let found = hits(prose, &banned, &allowed);
        let found: Vec<_> = found.iter().map(|(line, phrase)| (*line, phrase.text)).collect();
        assert_eq!(found, expected, "{prose}");
    }
    check("A member is synchronised.", &[]);
    check("Nobody\nis in\nstep.", &[(1, "nobody"), (2, "in step")]);
    check("mishaps; in steps; a third party; the party", &[(1, "mishap*"), (1, "party")]);
    check(&prose_of_markdown("a `party` and\n```\nparty\n```\nparties"), &[(5, "parties")]);
    let rust = "/// Nobody.\n// nobody\nlet party = \"no party\"; let c = '\"'; let raw = r#\"a \"party\"\"#;";
    check(&prose_of_code(rust, true), &[(1, "nobody"), (3, "party"), (3, "party")]);
    check(
        &prose_of_code("const party = 'nobody'; // party", false),
        &[(1, "nobody"), (1, "party")],
    );
}
