//! An OCI layout, unpacked as a container engine does: every blob by its digest.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use super::root::User;

/// What the image is run as.
pub(crate) struct Image {
    pub(crate) architecture: String,
    pub(crate) user: User,
    pub(crate) folder: String,
    /// Its entry point with its default arguments.
    pub(crate) command: Vec<String>,
}

/// Unpacks the tar file into `layout`, and the layers of its image into `root`.
pub(crate) fn unpack(file: &Path, layout: &Path, root: PathBuf) -> Image {
    extract(file, layout);
    let index = json(&layout.join("index.json"));
    let manifest = json(&blob(layout, &index["manifests"][0]));
    let configuration = json(&blob(layout, &manifest["config"]));
    for layer in manifest["layers"].as_array().expect("a list") {
        extract(&blob(layout, layer), &root);
    }
    let settings = &configuration["config"];
    let (user, group) = word(&settings["User"]).split_once(':').expect("both");
    let words =
        [&settings["Entrypoint"], &settings["Cmd"]].map(|words| words.as_array().expect("a list"));
    Image {
        architecture: word(&configuration["architecture"]).to_owned(),
        user: User(user.to_owned(), group.to_owned()),
        folder: word(&settings["WorkingDir"]).to_owned(),
        command: words.into_iter().flatten().map(|part| word(part).to_owned()).collect(),
    }
}

fn word(value: &Value) -> &str {
    value.as_str().expect("text")
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).expect("it is in the image")).expect("JSON")
}

/// The file that a descriptor names, whose size and digest are as the descriptor says.
fn blob(layout: &Path, descriptor: &Value) -> PathBuf {
    let digest = word(&descriptor["digest"]).strip_prefix("sha256:").expect("SHA-256");
    let path = layout.join("blobs/sha256").join(digest);
    let summed = Command::new("sha256sum").arg(&path).output().expect("coreutils");
    assert!(summed.stdout.starts_with(digest.as_bytes()), "{}", path.display());
    let size = fs::metadata(&path).expect("it is there").len();
    assert_eq!(descriptor["size"], size, "{}", path.display());
    path
}

fn extract(archive: &Path, folder: &Path) {
    let status = Command::new("tar")
        .args(["--extract", "--numeric-owner", "--same-permissions", "--file"])
        .arg(archive)
        .arg("--directory")
        .arg(folder)
        .status();
    assert!(status.expect("tar").success(), "{}", archive.display());
}
