//! `understudy spare`: a machine without a role that serves several groups.

use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use clap::Args;
use serde_json::json;
use understudy_attach::AttachError;
use understudy_bus::{interruption, zenoh_runtime_of_follower};
use understudy_cluster::{PlantFile, PlantGroup, PlantSpare, Security, Serves};
use understudy_keys::{Date, KeysError, MemberKeys, OperatorKeys};
use understudy_member::{restart_for_zenoh, tls_keys};
use understudy_spare::{Duty, SpareSettings};
use understudy_wire::Member;

use crate::answer::{Answer, Status};
use crate::console::Console;
use crate::files;
use crate::member::peers;
use crate::plants;

/// Run a spare, which joins the group with the least remaining redundancy
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy spare plant.toml --name spare-1 --keys keys

The folder of --keys has a folder for each group, with the keys of the slot and those of a viewer with the name of the spare:
keys/line-1/spare and keys/line-1/spare-1. The spare follows the reports of up to three remote I/Os of each group. When a station has been
flagged for `spare_after` cycles, the spare runs the station of its slot until the group is complete without it (docs/how-to/spares.md).
SIGINT and SIGTERM end the spare and its station.")]
pub(crate) struct Arguments {
    /// Plant file
    #[arg(value_name = "PLANT.toml")]
    plant: PathBuf,
    /// Name of the spare in the plant file
    #[arg(long, value_name = "NAME")]
    name: String,
    /// Folder with a folder of keys for each group
    #[arg(long, value_name = "DIR")]
    keys: PathBuf,
    /// Folder of the journals of its stations, one file for each group. Default: no journal
    #[arg(long, value_name = "DIR")]
    journals: Option<PathBuf>,
    /// Folder for what its stations keep for the time after a power failure
    #[arg(long, value_name = "DIR")]
    retain: Option<PathBuf>,
    /// End with the process that started it
    #[arg(long)]
    ends_with_parent: bool,
    /// Do not request real-time scheduling and locked memory
    #[arg(long)]
    no_real_time: bool,
}

pub(crate) fn run(arguments: &Arguments, console: &mut Console) -> Result<Answer, Answer> {
    restart_for_zenoh(zenoh_runtime_of_follower());
    if arguments.ends_with_parent {
        understudy_bus::end_with_parent()
            .map_err(|error| Answer::failed(Status::Failed, error.code(), error))?;
    }
    let (plant, _) = plants::valid(&arguments.plant)?;
    let Some(spare) = plant.spares.iter().find(|spare| spare.name == arguments.name) else {
        let known: Vec<&str> = plant.spares.iter().map(|spare| spare.name.as_str()).collect();
        let message =
            format!("there is no spare `{}`; the spares are {}", arguments.name, known.join(", "));
        return Err(Answer::failed(Status::BadInput, "U0605", message));
    };
    if let Some(journals) = &arguments.journals {
        files::make_folder(journals)?;
    }
    let _claimed = claim(&arguments.keys)?;
    let (mut duties, mut wrong) = (Vec::new(), Answer::bad_files(Vec::new()));
    for serves in &spare.serves {
        match arguments.duty(&plant, spare, serves) {
            Ok(duty) => duties.push(duty),
            Err(answer) => wrong.failures.extend(answer.failures),
        }
    }
    if !wrong.failures.is_empty() {
        return Err(wrong);
    }
    let settings = SpareSettings {
        duties,
        spare: spare.clone(),
        program: std::env::current_exe().map_err(|error| {
            let message = format!("cannot find the executable of this program: {error}");
            Answer::failed(Status::Failed, "U0604", message)
        })?,
        real_time: !arguments.no_real_time,
    };
    let failed =
        |error: understudy_bus::BusError| Answer::failed(Status::Failed, error.code(), &error);
    let ends = interruption().map_err(failed)?;
    let mut say = |report: &understudy_spare::Report| console.note(&report.to_string());
    let woke = understudy_spare::run(&settings, &ends, &mut say).map_err(failed)?;
    let name = &spare.name;
    Ok(Answer::done(format!("{name}: woke {woke} times"), json!({ "spare": name, "woke": woke })))
}

/// Takes the folder of keys for this process, as long as the answer lives: a machine runs one spare at a time.
fn claim(keys: &Path) -> Result<Option<File>, Answer> {
    // A folder that is not there is reported for each group.
    let Ok(folder) = File::open(keys) else {
        return Ok(None);
    };
    match folder.try_lock() {
        Err(TryLockError::WouldBlock) => {
            let keys = keys.display();
            let message = format!("another process of a spare uses the keys in {keys}");
            Err(Answer::failed(Status::BadInput, "U0627", message))
        }
        // Where the file system has no locks, no process is refused.
        Ok(()) | Err(TryLockError::Error(_)) => Ok(Some(folder)),
    }
}

impl Arguments {
    fn duty(&self, plant: &PlantFile, spare: &PlantSpare, serves: &Serves) -> Result<Duty, Answer> {
        let PlantGroup { name, file, cluster, .. } = &plant.groups[serves.group];
        if cluster.security() == Security::Off {
            let error = AttachError::NoKeys;
            return Err(Answer::failed(Status::BadInput, error.code(), error));
        }
        let folder = self.keys.join(name);
        let (viewer, slot_keys) = (folder.join(&spare.name), folder.join(&serves.name));
        let today = Date::of(SystemTime::now());
        // A spare that cannot run its station must not be taken for one that waits.
        let slot = MemberKeys::load(&slot_keys, cluster, Member::Station(serves.station), today);
        let mut errors = slot.err().unwrap_or_default();
        let keys = OperatorKeys::load(&viewer, cluster, today).and_then(|keys| {
            // Members take its reports under the name of its certificate only.
            let others = |keys: OperatorKeys| KeysError::Others {
                folder: viewer.clone(),
                found: keys.name,
                wanted: spare.name.clone(),
            };
            if keys.name == spare.name { Ok(keys) } else { Err(vec![others(keys)]) }
        });
        let keys = keys.map_err(|wrong| errors.extend(wrong)).ok().filter(|_| errors.is_empty());
        let Some(keys) = keys else {
            return Err(super::keys::failed(&errors));
        };
        Ok(Duty {
            group: name.clone(),
            cluster: cluster.clone(),
            cluster_file: self.plant.parent().unwrap_or(Path::new("")).join(file),
            slot: serves.station,
            slot_name: serves.name.clone(),
            fits: serves.fits,
            slot_keys,
            viewer_keys: tls_keys(&keys.tls),
            peers: peers(cluster, None)?,
            journal: self.journals.as_ref().map(|folder| folder.join(format!("{name}.jsonl"))),
            retain: self.retain.clone(),
        })
    }
}
