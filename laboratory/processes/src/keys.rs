//! Keys for one run: made when it starts, and gone when it ends.

use std::path::PathBuf;
use std::time::SystemTime;

use understudy_cluster::{Cluster, Security};
use understudy_keys::{Authority, Date, KeysError, People};

/// A run is over by then.
const DAYS: u32 = 30;

/// The folder of the keys of a run; nothing where the cluster wants none.
#[derive(Debug)]
pub(super) struct RunKeys {
    authority: Option<PathBuf>,
}

impl RunKeys {
    /// Makes them in `folder`.
    #[allow(clippy::disallowed_methods, reason = "certificates hold from one date to another")]
    pub(super) fn make(cluster: &Cluster, folder: PathBuf) -> Result<Self, Vec<KeysError>> {
        if cluster.security() == Security::Off {
            return Ok(Self { authority: None });
        }
        let now = Date::of(SystemTime::now());
        let members = cluster.members();
        let names = members.filter_map(|member| cluster.member_name(member));
        let names: Vec<String> = names.map(str::to_owned).collect();
        let made = Self { authority: Some(folder) };
        if let Some(folder) = &made.authority {
            let mut authority =
                Authority::init(folder, cluster, now).map_err(|error| vec![error])?;
            authority.issue(cluster, &names, People::default(), DAYS, now)?;
        }
        Ok(made)
    }

    /// What the process of a member is told of its keys.
    pub(super) fn arguments(&self, name: &str) -> Vec<PathBuf> {
        let folder = self.authority.as_ref();
        let folder = folder.map(|folder| folder.join("members").join(name));
        folder.map(|folder| vec![PathBuf::from("--keys"), folder]).unwrap_or_default()
    }
}

impl Drop for RunKeys {
    fn drop(&mut self) {
        if let Some(folder) = &self.authority
            && let Err(error) = std::fs::remove_dir_all(folder)
        {
            tracing::warn!(folder = %folder.display(), %error, "the keys of the run are left behind");
        }
    }
}
