//! Every manifest that the documentation shows or that comes with the project is read by a parser of its format.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use understudy_testing::skip;

/// Reads pages and manifests; prints what a parser refuses, then how many texts it has read of each format.
const PARSE: &str = r#"
import configparser, json, re, sys, tomllib, yaml
def unit(text):
    reader = configparser.ConfigParser(strict=False, interpolation=None)
    reader.optionxform = str
    reader.read_string(text)
    assert {"Unit", "Service"} <= set(reader.sections()), reader.sections()
parsers = {
    "json": json.loads,
    "toml": tomllib.loads,
    "yaml": lambda text: list(yaml.safe_load_all(text)),
    "service": unit,
}
counts = dict.fromkeys(parsers, 0)
def see(path, line, kind, text):
    kind = "yaml" if kind == "yml" else kind
    counts[kind] += 1
    try:
        parsers[kind](text)
    except Exception as error:
        print(f"{path}:{line}: {kind}: {error}")
for path in sys.argv[1:]:
    page = open(path, encoding="utf-8").read()
    if not path.endswith(".md"):
        see(path, 1, path.rsplit(".", 1)[1], page)
        continue
    for block in re.finditer(r"^```(json|toml|ya?ml)\b([^\n]*)\n(.*?)^```", page, re.S | re.M):
        see(path, page.count("\n", 0, block.start()) + 1, block[1], block[3])
    # A manifest that is only indented has no parser.
    for line in re.finditer(r"^ {4}apiVersion:", page, re.M):
        print(f"{path}:{page.count(chr(10), 0, line.start()) + 1}: a manifest outside a block ```yaml")
print("texts", *counts.values())
"#;

const ENDINGS: [&str; 6] = ["md", "json", "toml", "yaml", "yml", "service"];

fn texts(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            texts(&path, found);
        } else if path.extension().is_some_and(|end| ENDINGS.iter().any(|known| end == *known)) {
            found.push(path);
        }
    }
}

#[test]
fn each_manifest_is_read_by_a_parser_of_its_format() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut found = vec![root.join("README.md")];
    texts(&root.join("docs"), &mut found);
    texts(&root.join("deployment"), &mut found);
    // Pages of error codes show faulty files on purpose; a test of their own reads them.
    found.retain(|path| !path.starts_with(root.join("docs/errors")));
    found.sort();
    let available = Command::new("python3").args(["-c", "import tomllib, yaml"]).output();
    if !available.is_ok_and(|output| output.status.success()) {
        skip("python3 with tomllib and yaml is not installed");
        return;
    }
    let output = Command::new("python3").args(["-c", PARSE]).args(&found).output();
    let output = output.expect("python3 runs");
    let (text, errors) =
        (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{errors}");
    let (wrong, counts) = text.trim_end().rsplit_once('\n').unwrap_or(("", text.trim_end()));
    assert_eq!(wrong, "", "texts that their parsers refuse");
    let counts = counts.strip_prefix("texts ").expect("the counts");
    let counts: Vec<usize> =
        counts.split(' ').map(|count| count.parse().expect("a number")).collect();
    assert!(counts.iter().all(|count| *count > 0), "json, toml, yaml, service: {counts:?}");
}
