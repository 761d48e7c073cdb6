//! Plant files, with the cluster files that they name.

use std::path::Path;

use understudy_cluster::{LoadedPlant, Overrides, PlantFile, read_plant_file};
use understudy_text::{Report, Severity};

use crate::answer::Answer;
use crate::files;
use crate::kind::Kind;

/// Reads a plant file and the cluster files that it names, relative to its folder.
pub(crate) fn read(path: &Path, text: &str) -> LoadedPlant {
    let folder = path.parent().unwrap_or(Path::new("")).to_owned();
    read_plant_file(&path.display().to_string(), text, &mut |name| {
        let file = folder.join(name);
        let text = files::named(&folder, name)?;
        let loaded = files::read_cluster(&file, &text, Overrides::default());
        let errors = loaded.reports.iter().flat_map(|report| &report.diagnostics);
        let errors = errors.filter(|found| found.severity == Severity::Error).count();
        loaded.cluster.ok_or_else(|| format!("{}: {errors} errors", file.display()))
    })
}

/// A valid plant file, with its warnings.
pub(crate) fn valid(path: &Path) -> Result<(PlantFile, Vec<Report>), Answer> {
    let text = files::text_of(Kind::Plant, path)?;
    let LoadedPlant { plant, report } = read(path, &text);
    match plant {
        Some(plant) => Ok((plant, vec![report])),
        None => Err(Answer::bad_files(vec![report])),
    }
}
