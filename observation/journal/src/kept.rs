//! `cluster/` in the directory of a run: the files that it was made of, so that who reads the run later knows its programs.
//!
//! `kept.json` says under which names the cluster file reads its ladders, and what the command line said in its place. The
//! files lie beside it, under names without folders.

use std::collections::BTreeMap;
use std::fs;
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};
use std::time::Duration;

use serde::{Deserialize, Serialize};
use understudy_cluster::{Cluster, Link, Overrides, Security, read_with};
use understudy_cycle::{Mode, Turns};
use understudy_text::{Report, decode};

use crate::named_files::{named_bytes, named_file};
use crate::packed_file::open_file;
use crate::run_directory::RunDirectoryError;

const FOLDER: &str = "cluster";
const CLUSTER_FILE: &str = "cluster.toml";
const KEPT_FILE: &str = "kept.json";

/// What `kept.json` holds.
#[derive(Debug, Default, Serialize, Deserialize)]
struct Kept {
    /// Of this format: 1.
    format: u32,
    /// By the name that stands in the cluster file: the file in this folder.
    ladders: BTreeMap<String, String>,
    period_ns: Option<u64>,
    link: Option<Link>,
    security: Option<Security>,
    mode: Option<Mode>,
    turns: Option<Turns>,
}

/// Why the cluster of a run is not known.
#[derive(Debug, thiserror::Error)]
pub enum KeptError {
    /// The run has no folder `cluster/`.
    #[error("U0571: {} does not say which programs it ran: it has no folder `cluster/`", run.display())]
    NotKept {
        /// The directory of the run.
        run: PathBuf,
    },
    /// A file cannot be read.
    #[error("U0572: {} cannot be read: {reason}", path.display())]
    Read {
        /// Which.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// The files have errors: somebody has changed them, or another version of this program wrote them.
    #[error("U0572: the cluster that was kept with the run has errors")]
    Files {
        /// With what was found in them.
        reports: Vec<Report>,
    },
}

/// Keeps the `cluster` that was read from `file`, and the ladders that it names, in the directory of a run.
///
/// # Errors
/// [`RunDirectoryError::Write`]. A ladder that cannot be read any more is left out; the run has read it already.
pub fn keep_cluster(run: &Path, file: &Path, cluster: &Cluster) -> Result<(), RunDirectoryError> {
    let overrides = Overrides {
        period: Some(cluster.agreement().schedule.period()),
        link: Some(cluster.link()),
        security: Some(cluster.security()),
        mode: Some(cluster.agreement().mode),
        turns: Some(cluster.agreement().schedule.turns()),
    };
    let folder = run.join(FOLDER);
    let write = |name: &str, bytes: &[u8]| {
        let path = folder.join(name);
        let written = fs::create_dir_all(&folder).and_then(|()| fs::write(&path, bytes));
        written.map_err(|source| RunDirectoryError::Write { path, source })
    };
    let failed = |source| RunDirectoryError::Write { path: file.to_owned(), source };
    let bytes = fs::read(file).map_err(failed)?;
    let text = decode(bytes.clone()).map_err(|error| failed(io::Error::other(error)))?;
    let beside = file.parent().unwrap_or(Path::new(""));
    // As they are: XML says its encoding itself.
    let mut ladders: BTreeMap<String, Vec<u8>> = BTreeMap::new();
    let _ = read_with(CLUSTER_FILE, &text, overrides, &mut |name| {
        let ladder = named_bytes(beside, name)?;
        ladders.insert(name.to_owned(), ladder.clone());
        decode(ladder).map_err(|error| error.to_string())
    });
    write(CLUSTER_FILE, &bytes)?;
    let mut kept = Kept {
        format: 1,
        ladders: BTreeMap::new(),
        period_ns: overrides
            .period
            .map(|period| u64::try_from(period.as_nanos()).unwrap_or(u64::MAX)),
        link: overrides.link,
        security: overrides.security,
        mode: overrides.mode,
        turns: overrides.turns,
    };
    for (name, ladder) in &ladders {
        let file = unique(name, &kept.ladders);
        write(&file, ladder)?;
        kept.ladders.insert(name.clone(), file);
    }
    let json = serde_json::to_string_pretty(&kept)
        .map_err(|source| RunDirectoryError::Json { path: folder.join(KEPT_FILE), source })?;
    write(KEPT_FILE, (json + "\n").as_bytes())
}

/// The cluster that was kept with a run.
///
/// # Errors
/// [`KeptError`].
pub fn kept_cluster(run: &Path) -> Result<Cluster, KeptError> {
    read_kept_cluster(run, true)
}

/// What the command line of a run said in place of the cluster file that was kept with it.
///
/// # Errors
/// [`KeptError`].
pub fn kept_overrides(run: &Path) -> Result<Overrides, KeptError> {
    let [used, written] = [read_kept_cluster(run, true)?, read_kept_cluster(run, false)?];
    fn said<T: PartialEq>(
        of: impl Fn(&Cluster) -> T,
        used: &Cluster,
        written: &Cluster,
    ) -> Option<T> {
        Some(of(used)).filter(|value| *value != of(written))
    }
    Ok(Overrides {
        period: said(|it| it.agreement().schedule.period(), &used, &written),
        link: said(Cluster::link, &used, &written),
        security: said(Cluster::security, &used, &written),
        mode: said(|it| it.agreement().mode, &used, &written),
        turns: said(|it| it.agreement().schedule.turns(), &used, &written),
    })
}

/// The cluster that was kept with a run, as the run used it or as its file has it.
fn read_kept_cluster(run: &Path, is_as_used: bool) -> Result<Cluster, KeptError> {
    let folder = run.join(FOLDER);
    let file = folder.join(CLUSTER_FILE);
    if !file.is_file() {
        let run = run.to_owned();
        return Err(KeptError::NotKept { run });
    }
    let unreadable = |path: PathBuf, reason: String| KeptError::Read { path, reason };
    let text = |path: &Path| {
        let bytes = read_file(path).map_err(|error| error.to_string())?;
        decode(bytes).map_err(|error| error.to_string())
    };
    let cluster = text(&file).map_err(|reason| unreadable(file.clone(), reason))?;
    let kept_file = folder.join(KEPT_FILE);
    let kept: Kept = match read_file(&kept_file) {
        Ok(bytes) => serde_json::from_slice(&bytes)
            .map_err(|error| unreadable(kept_file, error.to_string()))?,
        // A folder that a person has put there.
        Err(error) if error.kind() == io::ErrorKind::NotFound => Kept::default(),
        Err(error) => return Err(unreadable(kept_file, error.to_string())),
    };
    let used = Overrides {
        period: kept.period_ns.map(Duration::from_nanos),
        link: kept.link,
        security: kept.security,
        mode: kept.mode,
        turns: kept.turns,
    };
    let overrides = if is_as_used { used } else { Overrides::default() };
    let name = file.display().to_string();
    let loaded = read_with(&name, &cluster, overrides, &mut |name| {
        let file = kept.ladders.get(name).map_or(name, String::as_str);
        named_file(&folder, file)
    });
    loaded.cluster.ok_or(KeptError::Files { reports: loaded.reports })
}

/// The bytes of a regular file.
fn read_file(path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    open_file(path)?.read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// The last part of a name, which no other ladder and no file of ours has.
fn unique(name: &str, taken: &BTreeMap<String, String>) -> String {
    let last = Path::new(name)
        .file_name()
        .map_or_else(|| "ladder".to_owned(), |last| last.to_string_lossy().into_owned());
    let free = |candidate: &String| {
        ![CLUSTER_FILE, KEPT_FILE].contains(&candidate.as_str())
            && !taken.values().any(|taken| taken == candidate)
    };
    let numbered = (2..).map(|number| format!("{number}-{last}"));
    std::iter::once(last.clone()).chain(numbered).find(free).unwrap_or(last)
}

#[cfg(test)]
mod tests {
    use understudy_cluster::press_cell;
    use understudy_testing::Folder;

    use super::*;

    #[test]
    fn what_was_kept_is_the_same_cluster() {
        let folder = Folder::new("kept");
        let source = folder.join("source");
        fs::create_dir_all(source.join("ladders")).expect("a folder");
        for file in press_cell() {
            let path = if file.name.ends_with(".ladder") {
                source.join("ladders").join(file.name)
            } else {
                source.join(file.name)
            };
            let text = file
                .text
                .replace("\"robot.ladder\"", "\"ladders/robot.ladder\"")
                .replace("\"press.ladder\"", "\"ladders/../ladders/press.ladder\"");
            fs::write(path, text).expect("written");
        }
        let run = folder.join("run");
        assert!(matches!(kept_cluster(&run), Err(KeptError::NotKept { .. })));
        let overrides = Overrides {
            period: Some(Duration::from_millis(7)),
            mode: Some(Mode::Paper),
            turns: None,
            link: Some(Link::Udp),
            security: Some(Security::Off),
        };
        let file = source.join(CLUSTER_FILE);
        let text = fs::read_to_string(&file).expect("a text");
        let read = read_with("cluster.toml", &text, overrides, &mut |name| {
            fs::read_to_string(source.join(name)).map_err(|error| error.to_string())
        });
        let cluster = read.cluster.expect("it has no errors");
        keep_cluster(&run, &file, &cluster).expect("kept");
        fs::remove_dir_all(&source).expect("it goes");
        let kept = kept_cluster(&run).expect("it has no errors");
        let schedule = &kept.agreement().schedule;
        assert_eq!(schedule.period(), Duration::from_millis(7));
        assert_eq!(kept.agreement().mode, Mode::Paper);
        assert_eq!((kept.link(), kept.security()), (Link::Udp, Security::Off));
        assert_eq!(kept.agreement().configuration, cluster.agreement().configuration);
        // What the file says too was not said by the command line.
        let said = Overrides { link: None, ..overrides };
        assert_eq!(kept_overrides(&run).expect("it has no errors"), said);
        fs::write(run.join("cluster/robot.ladder"), "rung oh").expect("written");
        assert!(matches!(kept_cluster(&run), Err(KeptError::Files { .. })));
    }
}
