//! `understudy demo`: the experiment of section V.B on real processes.

use std::num::NonZeroU64;
use std::path::PathBuf;
use std::time::{Duration, SystemTime};

use clap::Args;
use understudy_cluster::{Cluster, press_cell};
use understudy_journal::{Members, RunDirectory};
use understudy_scenarios::{Scenario, Summary, TABLE_TWO, read};

use crate::answer::{Answer, Status};
use crate::console::Console;
use crate::files;
use crate::lab::{Judged, RunArguments, in_laboratory, judged};
use crate::wakefulness;
use crate::watch::{BesideArguments, Page};

/// How long a demonstration takes at most, from its origin.
const LONGEST: Duration = Duration::from_secs(25);
/// Cycles of Table II.
const TABLE_TWO_CYCLES: u32 = 1000;

/// Run the robot and the press of the paper on real processes, and kill each station once
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy demo
  understudy demo --period 10ms
  understudy demo --link zenoh
  understudy demo --watch

Without --period it measures for a second how late this host wakes it, and takes the shortest of 10, 20, 50 and 100 ms that the host keeps.
Station 1 is killed at cycle 200 and started again at 327, station 2 at 400 and 527, station 3 at 600 and 727 (Table II). At a period of
50 or 100 ms all of it comes in a half or a quarter of the cycles, so that a demonstration takes 25 s at most.
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
    let scenario = match run.cycles {
        Some(_) => scenario,
        None => scenario.compressed(divisor(&cell.cluster)),
    };
    let answer = cell.run(&scenario, &run, page.as_ref(), console);
    answer.and_next(&[&"init", &"cell"])
}

/// What keeps the experiment shorter than [`LONGEST`] on a host that keeps long periods only.
fn divisor(cluster: &Cluster) -> NonZeroU64 {
    let period = cluster.agreement().schedule.period();
    let divisor = (period * TABLE_TWO_CYCLES)
        .as_nanos()
        .div_ceil(LONGEST.as_nanos());
    u64::try_from(divisor)
        .ok()
        .and_then(NonZeroU64::new)
        .unwrap_or(NonZeroU64::MIN)
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
