//! `understudy demo`: the experiment of section V.B on real processes.

use std::path::PathBuf;
use std::time::SystemTime;

use clap::Args;
use understudy_cluster::{Cluster, press_cell};
use understudy_scenarios::{Members, RunDirectory, Scenario, Summary, TABLE_TWO, read};

use crate::answer::{Answer, Status};
use crate::console::Console;
use crate::files;
use crate::inspect::watch::{BesideArguments, Page};
use crate::run::lab::{Judged, RunArguments, in_laboratory, judged};
use crate::run::wakefulness;

/// Run the robot and the press of the paper on real processes, and kill each station once
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy demo
  understudy demo --period 10ms
  understudy demo --link zenoh
  understudy demo --watch

Without --period it measures for a second how late this host wakes it, and takes the shortest of 10, 20, 50 and 100 ms that the host keeps.
Station 1 is killed at cycle 200 and started again at 327, station 2 at 400 and 527, station 3 at 600 and 727 (Table II).
With --watch the cluster stays up when the scenario is over: kill a station yourself on the page. Ctrl-C ends it.
Exit status 0 when every plant stayed functional and nothing wrong was applied; 3 where the host woke the members too late to tell.")]
pub(crate) struct Arguments {
    #[command(flatten)]
    run: RunArguments,
    #[command(flatten)]
    beside: BesideArguments,
}

pub(crate) fn run(arguments: &Arguments, console: &mut Console) -> Answer {
    let run = wakefulness::with_period(&arguments.run, console);
    let cell = match PressCell::write(&run) {
        Ok(cell) => cell,
        Err(answer) => return answer,
    };
    let members = Members::of(&cell.cluster);
    let found = read("table-two.toml", TABLE_TWO, Some(&members));
    let Some(scenario) = found.scenario else {
        return Answer::bad_files(vec![found.report]);
    };
    let page = arguments.beside.page().map(Page::staying);
    let answer = cell.run(&scenario, &run, page.as_ref(), console);
    answer.and_next(&[&"init", &"cell"])
}

/// The cluster of section V, written into the directory of its run.
pub(crate) struct PressCell {
    pub(crate) cluster: Cluster,
    directory: RunDirectory,
    file: PathBuf,
}

impl PressCell {
    pub(crate) fn write(arguments: &RunArguments) -> Result<Self, Answer> {
        let directory = RunDirectory::create(&arguments.out, SystemTime::now())
            .map_err(|error| Answer::failed(Status::Failed, "U0602", error.to_string()))?;
        let folder = directory.file("cluster");
        files::write_template(&folder, press_cell())?;
        let file = folder.join("cluster.toml");
        let (cluster, _) = files::cluster(&file, arguments.overrides.overrides())?;
        Ok(Self {
            cluster,
            directory,
            file,
        })
    }

    /// Where its run is kept.
    pub(crate) fn path(&self) -> &std::path::Path {
        self.directory.path()
    }

    /// As [`Self::run`], with what came of it in place of an answer.
    pub(crate) fn judged(
        &self,
        scenario: &Scenario,
        arguments: &RunArguments,
        console: &mut Console,
    ) -> Result<(Summary, Judged), Answer> {
        let file = self.file.clone();
        judged(
            &self.cluster,
            scenario,
            file,
            arguments,
            &self.directory,
            None,
            console,
        )
    }

    pub(crate) fn run(
        &self,
        scenario: &Scenario,
        arguments: &RunArguments,
        page: Option<&Page>,
        console: &mut Console,
    ) -> Answer {
        let scenario = scenario.clone().shortened(arguments.cycles);
        let file = self.file.clone();
        in_laboratory(
            &self.cluster,
            &scenario,
            file,
            arguments,
            &self.directory,
            page,
            console,
        )
    }
}
