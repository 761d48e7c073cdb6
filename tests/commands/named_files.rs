//! What a file names is read below its own folder only.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::{Answer, empty_folder, understudy};

fn understudy_allowing(folder: &Path, arguments: &[&str]) -> Answer {
    let output = Command::new(env!("CARGO_BIN_EXE_understudy"))
        .args(arguments)
        .env("UNDERSTUDY_ALLOW_FILES", folder)
        .output()
        .expect("the binary is built");
    Answer {
        status: output.status.code().expect("an exit status"),
        output: String::from_utf8(output.stdout).expect("text"),
        errors: String::from_utf8(output.stderr).expect("text"),
    }
}

/// One file of each kind that names files; each names a file of the folder beside its own, of which no line may be shown.
#[test]
fn a_file_from_a_stranger_shows_no_other_file() {
    let root = empty_folder("named_files");
    let (strange, private) = (root.join("strange"), root.join("private"));
    for folder in [&strange, &private] {
        fs::create_dir_all(folder).expect("a folder");
    }
    fs::write(private.join("secret"), "the password is swordfish\n").expect("written");
    std::os::unix::fs::symlink(private.join("secret"), strange.join("link")).expect("a link");
    let absolute = private.join("secret").display().to_string();
    let files = |name: &str| {
        [
            (
                "cluster.toml",
                format!(
                    "[cluster]\nname = \"cell\"\n[[controller]]\nname = \"tank\"\nladder = \"{name}\"\n"
                ),
                &["check", "simulate"][..],
                "U0211",
            ),
            (
                "model.toml",
                format!("[events]\n[[plant]]\nfile = \"{name}\"\n[[plant]]\nnet = \"{name}\"\n"),
                &["check", "synth"][..],
                "U0829",
            ),
            (
                "project.toml",
                format!("[project]\nladder = \"{name}\"\nplant = \"{name}\"\n"),
                &["check", "reconfigure"][..],
                "U1208",
            ),
        ]
    };
    for name in ["../private/secret", "link", absolute.as_str()] {
        for (file, text, commands, code) in files(name) {
            let path = strange.join(file);
            fs::write(&path, text).expect("written");
            let path = path.to_str().expect("text");
            for command in commands {
                let answer = understudy(&[command, path]);
                assert_eq!(answer.status, 2, "{command} {file}: {}", answer.output);
                let said = answer.output + &answer.errors;
                assert!(said.contains(code), "{command} {file} with {name}: {said}");
                assert!(said.contains("outside the folder"), "{command}: {said}");
                assert!(!said.contains("swordfish"), "{command} {file}: {said}");
                let allowed = understudy_allowing(&private, &[command, path]);
                assert!(!allowed.errors.contains("outside the folder"));
                assert!((allowed.output + &allowed.errors).contains("swordfish"));
            }
        }
    }
}

/// The press is an example of its own, and a part of two others, which are copied as they are.
#[test]
fn examples_have_the_same_press() {
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    let press = |folder: &str| {
        fs::read_to_string(examples.join(folder).join("press.ladder")).expect("a ladder")
    };
    for folder in ["filling-line", "modbus-cell"] {
        assert!(press(folder) == press("press-cell"), "{folder}");
    }
}
