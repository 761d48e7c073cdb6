//! The structure of the workspace is what `ARCHITECTURE.md` says: a crate imports only from floors below its own, the pure floors know no
//! clock, thread, socket or terminal, and a library with one home is named nowhere else.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

const ARCHITECTURE: &str = include_str!("../ARCHITECTURE.md");

/// The first floor that may know the outside.
const FIRST_IMPURE_FLOOR: usize = 5;

/// What no source of a pure floor names. Addresses are names, and names are pure; sockets are not.
const IMPURE: [&str; 14] = [
    "TcpStream",
    "TcpListener",
    "UdpSocket",
    "ToSocketAddrs",
    "std::thread",
    "std::fs",
    "std::process",
    "Instant::now",
    "SystemTime",
    "rand::rng",
    "println!",
    "eprintln!",
    "tokio::",
    "zenoh::",
];

/// The cells of each row of the table below a heading of `ARCHITECTURE.md`.
fn table(heading: &str) -> Vec<Vec<&'static str>> {
    let (_, section) = ARCHITECTURE.split_once(&format!("\n## {heading}\n")).expect("the heading");
    let rows = section
        .lines()
        .skip_while(|line| !line.starts_with('|'))
        .take_while(|line| line.starts_with('|'));
    let cells = |row: &'static str| row.trim_matches('|').split('|').map(str::trim).collect();
    rows.skip(2).map(cells).collect()
}

/// A folder as it is written in a table: `` `protocol/wire/` ``.
fn folder(cell: &str) -> &str {
    cell.trim_matches('`').trim_end_matches('/')
}

/// The floor of each folder.
fn floors() -> BTreeMap<&'static str, usize> {
    let floor = |row: &Vec<&'static str>| {
        let number = row[0].parse().expect("a number of a floor");
        let folders: Vec<&str> = row[1].split(", ").map(folder).collect();
        folders.into_iter().map(move |folder| (folder, number))
    };
    table("Floors").iter().flat_map(floor).collect()
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn metadata() -> Value {
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--no-deps", "--offline", "--format-version", "1"])
        .current_dir(root())
        .output()
        .expect("cargo runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("cargo prints JSON")
}

fn text<'a>(value: &'a Value, key: &str) -> &'a str {
    value[key].as_str().expect("a string in cargo's metadata")
}

/// The folder of a package below the root; that of the root package is that of its program, `cli`.
fn folder_of(package: &Value) -> String {
    let manifest = Path::new(text(package, "manifest_path"));
    let folder = manifest.parent().expect("a folder");
    let below = folder.strip_prefix(root()).expect("below the root");
    match below.to_str().expect("text") {
        "" => "cli".to_owned(),
        other => other.to_owned(),
    }
}

#[test]
fn no_dependency_points_up() {
    let floors = floors();
    let metadata = metadata();
    let packages = metadata["packages"].as_array().expect("packages");
    let floor_of = |package: &Value| {
        let folder = folder_of(package);
        let floor = floors.get(folder.as_str());
        *floor.unwrap_or_else(|| panic!("{folder} has no floor in ARCHITECTURE.md"))
    };
    let by_name: BTreeMap<&str, usize> =
        packages.iter().map(|package| (text(package, "name"), floor_of(package))).collect();
    for package in packages {
        let name = text(package, "name");
        let floor = by_name[name];
        for dependency in package["dependencies"].as_array().expect("dependencies") {
            let other = text(dependency, "name");
            // Tests may look down from above: they prove one crate with the help of another.
            let only_for_tests = dependency["kind"] == "dev";
            if let Some(&below) = by_name.get(other)
                && !only_for_tests
            {
                assert!(
                    below < floor,
                    "{name} on floor {floor} imports {other} from floor {below}"
                );
            }
        }
    }
    for folder in floors.keys() {
        assert!(root().join(folder).is_dir(), "{folder} does not exist");
    }
}

#[test]
fn pure_floors_know_no_outside() {
    let mut checked = 0;
    for (folder, floor) in floors() {
        if floor < FIRST_IMPURE_FLOOR {
            checked += lines_of_code(&root().join(folder).join("src"), &mut |path, line| {
                let found = IMPURE.iter().find(|word| line.contains(*word));
                assert_eq!(found, None, "{}: {line}", path.display());
            });
        }
    }
    assert!(checked > 10_000, "{checked} lines of code were checked");
}

#[test]
fn a_library_with_one_home_is_named_nowhere_else() {
    let homes: Vec<(&str, PathBuf)> = table("Libraries with one home")
        .iter()
        .map(|row| (row[0].trim_matches('`'), root().join(folder(row[1]))))
        .collect();
    let mut used = vec![false; homes.len()];
    for top in floors().keys() {
        let sources = match *top {
            "cli" | "tests" => root().join(top),
            _ => root().join(top).join("src"),
        };
        lines_of_code(&sources, &mut |path, line| {
            for ((name, home), used) in homes.iter().zip(&mut used) {
                if line.contains(name) {
                    assert!(
                        path.starts_with(home) || path.ends_with("tests/floors.rs"),
                        "{} names `{name}`, whose home is {}",
                        path.display(),
                        home.display()
                    );
                    *used = true;
                }
            }
        });
    }
    for ((name, _), used) in homes.iter().zip(used) {
        assert!(used, "no source names `{name}`");
    }
}

#[test]
fn every_path_that_is_named_exists() {
    let texts = [ARCHITECTURE, include_str!("../CONTRIBUTING.md")];
    let tops: Vec<&str> = floors()
        .keys()
        .filter_map(|folder| folder.split('/').next())
        .chain(["docs", "examples", "deployment"])
        .collect();
    let mut named = 0;
    for path in texts.iter().flat_map(|text| text.split('`').skip(1).step_by(2)) {
        let is_a_path = path.split_once('/').is_some_and(|(top, rest)| {
            tops.contains(&top) && !rest.contains(['{', '*', ' ', '?']) && !rest.contains("NAME")
        });
        if is_a_path {
            assert!(root().join(path).exists(), "`{path}` does not exist");
            named += 1;
        }
    }
    assert!(named > 50, "{named} paths are named");
}

/// Shows each line of code below a folder; answers with their number. Comments and tests are not code of the product.
fn lines_of_code(folder: &Path, show: &mut dyn FnMut(&Path, &str)) -> usize {
    let mut shown = 0;
    for entry in std::fs::read_dir(folder).expect("a readable folder") {
        let path = entry.expect("a readable entry").path();
        if path.is_dir() {
            shown += lines_of_code(&path, show);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let source = std::fs::read_to_string(&path).expect("a readable source");
            let code = source.split("#[cfg(test)]").next().unwrap_or_default();
            let lines = code.lines().filter(|line| !line.trim_start().starts_with("//"));
            for line in lines {
                show(&path, line);
                shown += 1;
            }
        }
    }
    shown
}
