//! A crate imports only from floors below its own, and the pure floors know no clock, thread, socket or terminal.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

/// As in `ARCHITECTURE.md`.
const FLOORS: &[&[&str]] = &[
    &[
        "understudy-diagnostic",
        "understudy-logic",
        "understudy-wire",
    ],
    &[
        "understudy-form",
        "understudy-ladder",
        "understudy-parity",
        "understudy-reliability",
        "understudy-seal",
    ],
    &[
        "understudy-allocation",
        "understudy-interchange",
        "understudy-node",
        "understudy-plant",
        "understudy-remote-io",
        "understudy-supervisor",
    ],
    &[
        "understudy-cluster",
        "understudy-reconfiguration",
        "understudy-verification",
    ],
    &[
        "understudy-bus",
        "understudy-field",
        "understudy-keys",
        "understudy-network",
        "understudy-simulator",
        "understudy-testing",
    ],
    &[
        "understudy-baselines",
        "understudy-model-checking",
        "understudy-scenarios",
    ],
    &["understudy-attach", "understudy-view"],
    &["understudy-gateway", "understudy-watch"],
    &["understudy", "understudy-fuzz", "understudy-opcua-gateway"],
];

/// The first floor that may know the outside.
const FIRST_IMPURE_FLOOR: usize = 4;

fn metadata() -> Value {
    let output = Command::new(env!("CARGO"))
        .args([
            "metadata",
            "--no-deps",
            "--offline",
            "--format-version",
            "1",
        ])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("cargo runs");
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    serde_json::from_slice(&output.stdout).expect("cargo prints JSON")
}

fn text<'a>(value: &'a Value, key: &str) -> &'a str {
    value[key].as_str().expect("a string in cargo's metadata")
}

fn floor_of() -> BTreeMap<&'static str, usize> {
    let floors = FLOORS.iter().enumerate();
    floors
        .flat_map(|(floor, crates)| crates.iter().map(move |name| (*name, floor)))
        .collect()
}

#[test]
fn no_dependency_points_up() {
    let floor_of = floor_of();
    let metadata = metadata();
    let packages = metadata["packages"].as_array().expect("packages");
    assert_eq!(packages.len(), floor_of.len(), "every crate has a floor");
    for package in packages {
        let name = text(package, "name");
        let floor = floor_of[name];
        for dependency in package["dependencies"].as_array().expect("dependencies") {
            let other = text(dependency, "name");
            // Tests may look down from above: they prove one crate with the help of another.
            let only_for_tests = dependency["kind"] == "dev";
            if let Some(&below) = floor_of.get(other)
                && !only_for_tests
            {
                assert!(
                    below < floor,
                    "{name} on floor {floor} imports {other} from floor {below}"
                );
            }
        }
    }
}

#[test]
fn pure_floors_know_no_outside() {
    // Addresses are names, and names are pure; sockets are not.
    let forbidden = [
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
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let metadata = metadata();
    for name in FLOORS[..FIRST_IMPURE_FLOOR]
        .iter()
        .flat_map(|crates| crates.iter())
    {
        let package = metadata["packages"]
            .as_array()
            .expect("packages")
            .iter()
            .find(|package| package["name"] == *name)
            .expect("the crate is in the workspace");
        let manifest = Path::new(text(package, "manifest_path"));
        let sources = manifest.parent().expect("a folder").join("src");
        assert!(sources.starts_with(root));
        check_folder(&sources, &forbidden);
    }
}

fn check_folder(folder: &Path, forbidden: &[&str]) {
    for entry in std::fs::read_dir(folder).expect("a readable folder") {
        let path = entry.expect("a readable entry").path();
        if path.is_dir() {
            check_folder(&path, forbidden);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let source = std::fs::read_to_string(&path).expect("a readable source");
            // What stands in comments and in tests is not what the floor does.
            let code = source.split("#[cfg(test)]").next().unwrap_or_default();
            let lines = code
                .lines()
                .filter(|line| !line.trim_start().starts_with("//"));
            for line in lines {
                let found = forbidden.iter().find(|word| line.contains(*word));
                assert_eq!(found, None, "{}: {line}", path.display());
            }
        }
    }
}
