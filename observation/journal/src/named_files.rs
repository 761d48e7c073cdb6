//! Files that other files name: a cluster its ladders, a model its nets and automata, a project its ladders.
//!
//! A file may come from a stranger. So what it names is read only below its own folder, or below one that the caller allows in the
//! environment; links are followed first. Where a name leads elsewhere, nothing there is opened, and no message shows a line of it.

use std::env;
use std::fs;
use std::io;
use std::path::{Component, Path, PathBuf, absolute};

use understudy_text::decode;

/// Environment variable with more folders that named files may lie in, separated as in `PATH`.
pub const ALLOWED_FOLDERS: &str = "UNDERSTUDY_ALLOW_FILES";

/// The text of the file that a file in `folder` calls `name`; or why it cannot be had.
///
/// # Errors
/// A file outside the folders that are allowed, or one that cannot be read.
pub fn named_file(folder: &Path, name: &str) -> Result<String, String> {
    decode(named_bytes(folder, name)?).map_err(|error| error.to_string())
}

/// As [`named_file`], the bytes as they are.
pub(crate) fn named_bytes(folder: &Path, name: &str) -> Result<Vec<u8>, String> {
    let more = env::var_os(ALLOWED_FOLDERS).unwrap_or_default();
    let more: Vec<PathBuf> =
        env::split_paths(&more).filter(|folder| !folder.as_os_str().is_empty()).collect();
    read_below(folder, &more, name)
}

fn read_below(folder: &Path, more: &[PathBuf], name: &str) -> Result<Vec<u8>, String> {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let path = folder.join(name);
    let places = || std::iter::once(folder).chain(more.iter().map(PathBuf::as_path));
    let below = |path: &Path, resolve: fn(&Path) -> io::Result<PathBuf>| {
        places().any(|place| resolve(place).is_ok_and(|place| path.starts_with(place)))
    };
    let said = |error: io::Error| error.to_string();
    let refused = || {
        Err(format!(
            "it is outside the folder of the file that names it; move it below that folder, or allow its own folder: {ALLOWED_FOLDERS}=FOLDER"
        ))
    };
    // By its name first, so that nobody learns what exists elsewhere.
    if !below(&written(&path).map_err(said)?, written) {
        return refused();
    }
    let real = fs::canonicalize(&path).map_err(said)?;
    if !below(&real, |place| fs::canonicalize(place)) {
        return refused();
    }
    fs::read(real).map_err(said)
}

/// A path from the root without `.` and `..`, as it is written.
fn written(path: &Path) -> io::Result<PathBuf> {
    let mut plain = PathBuf::new();
    for part in absolute(path)?.components() {
        match part {
            Component::ParentDir => {
                plain.pop();
            }
            Component::CurDir => {}
            part => plain.push(part),
        }
    }
    Ok(plain)
}

#[cfg(test)]
mod tests {
    use understudy_testing::Folder;

    use super::*;

    #[test]
    fn names_lead_below_the_folder_or_nowhere() {
        let root = Folder::new("named-files");
        let cell = root.join("cell");
        fs::create_dir_all(cell.join("ladders")).expect("a folder");
        fs::create_dir_all(root.join("cell-two")).expect("a folder");
        for file in ["cell/own", "cell/ladders/deep", "cell-two/other", "secret"] {
            fs::write(root.join(file), file).expect("written");
        }
        std::os::unix::fs::symlink(root.join("secret"), cell.join("link")).expect("a link");
        std::os::unix::fs::symlink("own", cell.join("inner")).expect("a link");
        let read = |name: &str| read_below(&cell, &[], name);
        let bytes = |text: &str| Ok(text.as_bytes().to_vec());
        for (name, text) in [
            ("own", "cell/own"),
            ("ladders/deep", "cell/ladders/deep"),
            ("ladders/../own", "cell/own"),
            ("../cell/own", "cell/own"),
            ("inner", "cell/own"),
        ] {
            assert_eq!(read(name), bytes(text), "{name}");
        }
        let secret = root.join("secret").display().to_string();
        for name in
            ["../secret", "../gone", "../cell-two/other", "link", secret.as_str(), "/etc/passwd"]
        {
            let error = read(name).expect_err(name);
            assert!(error.contains("outside the folder"), "{name}: {error}");
        }
        assert!(read("gone").expect_err("no file").contains("No such file"));
        let allowed = [root.join("cell-two")];
        let other = read_below(&cell, &allowed, "../cell-two/other");
        assert_eq!(other, bytes("cell-two/other"));
        assert!(read_below(&cell, &allowed, "../secret").is_err());
    }
}
