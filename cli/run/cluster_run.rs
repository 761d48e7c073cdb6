//! A cluster that runs in the laboratory, with the directory of its run.

use std::path::{Path, PathBuf};

use understudy_cluster::{Cluster, press_cell};
use understudy_journal::RunDirectory;
use understudy_scenarios::{Scenario, Summary};

use crate::answer::Answer;
use crate::console::Console;
use crate::files;
use crate::inspect::watch::Page;
use crate::run::lab::{Judged, RunArguments, in_laboratory, judged};

/// A cluster with the directory of its run.
pub struct ClusterRun {
    /// The cluster with its overrides.
    pub cluster: Cluster,
    directory: RunDirectory,
    file: PathBuf,
}

impl ClusterRun {
    /// The press cell of section V, with its files in the directory of the run.
    ///
    /// # Errors
    /// U0602 if they cannot be written.
    pub fn press_cell(arguments: &RunArguments) -> Result<Self, Answer> {
        let directory = files::run_directory(&arguments.out)?;
        let folder = directory.file("cluster");
        files::write_template(&folder, press_cell())?;
        let file = folder.join("cluster.toml");
        let (cluster, _) = files::cluster(&file, arguments.overrides.overrides())?;
        Ok(Self { cluster, directory, file })
    }

    /// The cluster of a file.
    ///
    /// # Errors
    /// The file has errors, or there can be no directory.
    pub fn of_file(file: PathBuf, arguments: &RunArguments) -> Result<Self, Answer> {
        let (cluster, _) = files::cluster(&file, arguments.overrides.overrides())?;
        let directory = files::run_directory(&arguments.out)?;
        Ok(Self { cluster, directory, file })
    }

    /// Directory of the run.
    pub fn path(&self) -> &Path {
        self.directory.path()
    }

    /// Runs a scenario in the laboratory, and writes the results.
    ///
    /// # Errors
    /// If the processes cannot be started.
    pub fn judged(
        &self,
        scenario: &Scenario,
        arguments: &RunArguments,
        console: &mut Console,
    ) -> Result<(Summary, Judged), Answer> {
        let file = self.file.clone();
        judged(&self.cluster, scenario, file, arguments, &self.directory, None, console)
    }

    /// Runs a scenario in the laboratory, writes the results and returns the answer.
    pub(crate) fn run(
        &self,
        scenario: &Scenario,
        arguments: &RunArguments,
        page: Option<&Page>,
        console: &mut Console,
    ) -> Result<Answer, Answer> {
        let scenario = scenario.clone().shortened(arguments.cycles);
        let file = self.file.clone();
        in_laboratory(&self.cluster, &scenario, file, arguments, &self.directory, page, console)
    }
}
