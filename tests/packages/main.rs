//! What `deployment/release.sh` made, installed in bare systems that the tests make: each package runs the demo there.
//!
//! `UNDERSTUDY_RELEASE` names the folder of the release. The systems have no network, and are removed after the test.

#![allow(
    clippy::disallowed_methods,
    reason = "what is waited for has a deadline on the real clock"
)]

mod image;
mod root;
#[allow(dead_code, reason = "each test uses its part")]
#[path = "../shared/mod.rs"]
mod shared;

use std::env::{consts::ARCH, var_os};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use understudy_testing::skip;

use root::{Root, User};
use shared::{empty_folder, one_at_a_time};

const VERSION: &str = env!("CARGO_PKG_VERSION");
/// The suite of the systems: the oldest Debian that is supported.
const SUITE: &str = "bookworm";

fn skipped<T>(reason: &str) -> Option<T> {
    skip(reason);
    None
}

/// A file of the release.
fn released(name: &str) -> Option<PathBuf> {
    let Some(folder) = var_os("UNDERSTUDY_RELEASE") else {
        return skipped("UNDERSTUDY_RELEASE names no folder that deployment/release.sh made");
    };
    let file = Path::new(&folder).join(name);
    assert!(file.is_file(), "the release has no {}", file.display());
    Some(file)
}

/// The name of Debian for this machine's architecture, and that of Go.
fn architecture() -> &'static str {
    match ARCH {
        "x86_64" => "amd64",
        "aarch64" => "arm64",
        other => other,
    }
}

#[test]
fn every_file_of_a_release_has_its_sum() {
    let Some(sums) = released("SHA256SUMS") else {
        return;
    };
    let folder = sums.parent().expect("it is in a folder");
    let status = Command::new("sha256sum")
        .args(["--check", "--quiet", "--strict", "SHA256SUMS"])
        .current_dir(folder)
        .status();
    assert!(status.expect("coreutils").success());
    let text = fs::read_to_string(&sums).expect("text");
    let listed: Vec<&str> = text.lines().filter_map(|line| line.split("  ").nth(1)).collect();
    for entry in fs::read_dir(folder).expect("a folder") {
        let name = entry.expect("an entry").file_name();
        let name = name.to_str().expect("text");
        assert!(name == "SHA256SUMS" || listed.contains(&name), "{name} has no sum");
    }
}

#[test]
fn the_static_binary_runs_the_demo() {
    let _one = one_at_a_time();
    let Some(binary) = released(&format!("understudy-{VERSION}-{ARCH}-unknown-linux-musl")) else {
        return;
    };
    let Some(root) = Root::debian("binary", &[]) else {
        return;
    };
    root.copy(&binary, "usr/local/bin/understudy");
    root.demo(&User::ordinary(), "/tmp", &["understudy", "demo"]);
}

#[test]
fn the_wheel_installs_and_runs_the_demo() {
    let _one = one_at_a_time();
    let platforms = format!("manylinux_2_17_{ARCH}.manylinux2014_{ARCH}.musllinux_1_1_{ARCH}");
    let name = format!("understudy-{VERSION}-py3-none-{platforms}.whl");
    let Some(wheel) = released(&name) else {
        return;
    };
    let Some(root) = Root::debian("wheel", &["python3-venv"]) else {
        return;
    };
    root.copy(&wheel, &format!("tmp/{name}"));
    root.run(&["python3", "-m", "venv", "/opt/understudy"]);
    let pip = "/opt/understudy/bin/pip";
    // Without an index: it needs no other package.
    root.run(&[pip, "install", "--no-index", &format!("/tmp/{name}")]);
    root.run(&[pip, "check"]);
    let opcua = root.run(&["/opt/understudy/bin/understudy-opcua", "--version"]);
    assert_eq!(opcua.trim(), format!("understudy-opcua {VERSION}"));
    root.demo(&User::ordinary(), "/tmp", &["/opt/understudy/bin/understudy", "demo"]);
    root.run(&[pip, "uninstall", "--yes", "understudy"]);
    assert!(!root.path("opt/understudy/bin/understudy").exists());
}

#[test]
fn the_debian_package_installs_runs_the_demo_and_goes() {
    let _one = one_at_a_time();
    let name = format!("understudy_{VERSION}_{}.deb", architecture());
    let Some(package) = released(&name) else {
        return;
    };
    let Some(root) = Root::debian("debian-package", &[]) else {
        return;
    };
    root.copy(&package, &format!("tmp/{name}"));
    root.run(&["dpkg", "--install", &format!("/tmp/{name}")]);
    // A second installation, as in an upgrade, changes nothing.
    root.run(&["dpkg", "--install", &format!("/tmp/{name}")]);

    let user = root.run(&["getent", "passwd", "understudy"]);
    let fields: Vec<&str> = user.trim().split(':').collect();
    assert_eq!(fields[6], "/usr/sbin/nologin", "{user}");
    for kind in ["node", "remote-io", "plant"] {
        let path = root.path(&format!("usr/lib/systemd/system/understudy-{kind}@.service"));
        let unit = fs::read_to_string(path).expect("the unit is installed");
        let called = unit.lines().find_map(|line| line.strip_prefix("ExecStart=/"));
        let binary = called.and_then(|called| called.split(' ').next());
        assert!(root.path(binary.expect("a command")).is_file(), "{unit}");
        assert!(unit.contains("\nLimitNOFILE="), "{unit}");
    }
    for (folder, mode) in [
        ("/etc/understudy", "755 root"),
        ("/var/lib/understudy/keys", "700 understudy"),
        ("/var/log/understudy", "700 understudy"),
    ] {
        assert_eq!(root.run(&["stat", "--format=%a %U", folder]).trim(), mode, "{folder}");
    }
    let understudy = User(fields[2].to_owned(), fields[3].to_owned());
    root.demo(&understudy, "/var/log/understudy", &["understudy", "demo"]);

    fs::write(root.path("var/lib/understudy/keys/robot"), "a key").expect("written");
    root.run(&["dpkg", "--purge", "understudy"]);
    assert!(!root.path("usr/bin/understudy").exists());
    assert!(!root.path("var/log/understudy").exists());
    assert!(root.path("var/lib/understudy/keys/robot").exists(), "keys stay");
}

#[test]
fn the_container_image_runs_the_demo() {
    let _one = one_at_a_time();
    let Some(file) = released(&format!("understudy-{VERSION}-{ARCH}.oci.tar")) else {
        return;
    };
    let Some(root) = Root::empty("image") else {
        return;
    };
    let layout = empty_folder("image-layout");
    let image = image::unpack(&file, &layout, root.path(""));
    assert_eq!(image.architecture, architecture());
    // It has its own binaries and nothing else that could run.
    let commands = fs::read_dir(root.path("usr/bin")).expect("a folder");
    assert_eq!(commands.count(), 3);
    let command: Vec<&str> = image.command.iter().map(String::as_str).collect();
    root.demo(&image.user, &image.folder, &command);
    fs::remove_dir_all(layout).expect("it is ours");
}
