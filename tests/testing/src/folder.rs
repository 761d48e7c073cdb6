//! Folders of tests.

use std::fs;
use std::ops::Deref;
use std::path::{Path, PathBuf};

/// An empty folder for a test, which is removed with its content at the end.
#[derive(Debug)]
pub struct Folder(PathBuf);

impl Folder {
    /// A folder with a name that no other test uses.
    ///
    /// # Panics
    /// The folder cannot be made.
    pub fn new(name: &str) -> Self {
        let name = format!("understudy-{name}-{}", std::process::id());
        let folder = std::env::temp_dir().join(name);
        // An earlier test that was killed leaves its folder.
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).expect("a folder");
        Self(folder)
    }
}

impl Deref for Folder {
    type Target = Path;

    fn deref(&self) -> &Path {
        &self.0
    }
}

impl AsRef<Path> for Folder {
    fn as_ref(&self) -> &Path {
        self
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}
