//! Reading the files that a command is given.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use understudy_cluster::{Cluster, Loaded, Overrides, TemplateFile};
use understudy_diagnostic::spelling::nearest;
use understudy_diagnostic::{Report, decode};
use understudy_scenarios::{Parties, Scenario, named_file, read as read_scenario};

use crate::answer::{Answer, Status};
use crate::kind::{self, Kind};

/// The text of a file; a failure names it and says why not.
pub(crate) fn text(path: &Path) -> Result<String, Answer> {
    let failed = |code, message| Answer::failed(Status::BadInput, code, message);
    let bytes = fs::read(path).map_err(|error| failed("U0601", unreadable(path, &error)))?;
    decode(bytes).map_err(|error| {
        let message = format!("{} is not a text file: {error}", path.display());
        failed("U0618", message)
    })
}

/// The text of a file that has to be of one kind.
pub(crate) fn text_of(wanted: Kind, path: &Path) -> Result<String, Answer> {
    let text = text(path)?;
    kind::expect(wanted, path, &text)?;
    Ok(text)
}

/// Files that folders of the project begin with.
const FIRST_FILES: [&str; 3] = ["cluster.toml", "model.toml", "reconfiguration.toml"];

/// Why a file cannot be read, and which one was probably meant.
pub(crate) fn unreadable(path: &Path, error: &io::Error) -> String {
    let (reason, meant) = if path.is_dir() {
        let first = FIRST_FILES.iter().map(|name| path.join(name));
        (
            "it is a folder".to_owned(),
            first.into_iter().find(|file| file.exists()),
        )
    } else if error.kind() == io::ErrorKind::NotFound {
        (error.to_string(), nearest_file(path))
    } else {
        (error.to_string(), None)
    };
    let meant = meant.map(|file| format!("; did you mean {}?", file.display()));
    format!(
        "{} cannot be read: {reason}{}",
        path.display(),
        meant.unwrap_or_default()
    )
}

/// The file beside it whose name is nearest.
fn nearest_file(path: &Path) -> Option<PathBuf> {
    let folder = path.parent()?;
    let place = if folder == Path::new("") {
        Path::new(".")
    } else {
        folder
    };
    let entries = fs::read_dir(place).ok()?.filter_map(Result::ok);
    let names: Vec<String> = entries
        .filter_map(|entry| entry.file_name().into_string().ok())
        .collect();
    let name = path.file_name()?.to_str()?;
    let nearest = nearest(
        name,
        names
            .iter()
            .map(String::as_str)
            .filter(|known| *known != name),
    )?;
    Some(folder.join(nearest))
}

/// Writes a file; a failure names it and says why not.
pub(crate) fn write(path: &Path, text: &str) -> Result<(), Answer> {
    fs::write(path, text).map_err(|error| {
        let message = format!("{} cannot be written: {error}", path.display());
        Answer::failed(Status::Failed, "U0602", message)
    })
}

/// Writes a file anew: whole, or not at all.
pub(crate) fn replace(path: &Path, text: &str) -> Result<(), Answer> {
    let mut staged = path.as_os_str().to_owned();
    staged.push(".new");
    let staged = PathBuf::from(staged);
    write(&staged, text)?;
    fs::rename(&staged, path).map_err(|error| {
        let _ = fs::remove_file(&staged);
        let message = format!("{} cannot be written: {error}", path.display());
        Answer::failed(Status::Failed, "U0602", message)
    })
}

/// Reads a cluster file and the ladders that it names, which stand beside it.
pub(crate) fn read_cluster(path: &Path, text: &str, overrides: Overrides) -> Loaded {
    let folder = path.parent().unwrap_or(Path::new("")).to_owned();
    let mut loaded =
        understudy_cluster::read_with(&path.display().to_string(), text, overrides, &mut |name| {
            named_file(&folder, name)
        });
    // Ladders are shown as a person would open them from here.
    for report in loaded.reports.iter_mut().skip(1) {
        report.name = folder.join(&report.name).display().to_string();
    }
    loaded
}

/// A cluster without errors, and the files that it came from with their warnings.
pub(crate) fn cluster(path: &Path, overrides: Overrides) -> Result<(Cluster, Vec<Report>), Answer> {
    let text = text_of(Kind::Cluster, path)?;
    let Loaded { cluster, reports } = read_cluster(path, &text, overrides);
    match cluster {
        Some(cluster) => Ok((cluster, reports)),
        None => Err(Answer::bad_files(reports)),
    }
}

/// A scenario for a cluster, without errors.
pub(crate) fn scenario(path: &Path, cluster: &Cluster) -> Result<Scenario, Answer> {
    let text = text_of(Kind::Scenario, path)?;
    let found = read_scenario(
        &path.display().to_string(),
        &text,
        Some(&Parties::of(cluster)),
    );
    found
        .scenario
        .ok_or_else(|| Answer::bad_files(vec![found.report]))
}

/// Writes files of a template into a folder that has none of them.
pub(crate) fn write_template(
    folder: &Path,
    files: &[TemplateFile],
) -> Result<Vec<PathBuf>, Answer> {
    let failed = |path: &Path, error: std::io::Error| {
        let message = format!("{} cannot be written: {error}", path.display());
        Answer::failed(Status::Failed, "U0602", message)
    };
    let paths: Vec<PathBuf> = files.iter().map(|file| folder.join(file.name)).collect();
    if let Some(path) = paths.iter().find(|path| path.exists()) {
        let message = format!(
            "{} exists already, and nothing is overwritten",
            path.display()
        );
        return Err(Answer::failed(Status::BadInput, "U0603", message));
    }
    fs::create_dir_all(folder).map_err(|error| failed(folder, error))?;
    for (file, path) in files.iter().zip(&paths) {
        write(path, file.text)?;
    }
    Ok(paths)
}
