//! The groups of a plant, each followed in a run.

use std::path::Path;
use std::time::{Duration, Instant};

use understudy_cluster::PlantFile;

use super::{GroupView, PlantOverview};
use crate::following::Following;
use crate::model::{Bounds, Model};
use crate::run::{Run, find_running};

/// The overview shows the present; the past is for the view of a group.
const BOUNDS: Bounds = Bounds { cycles: 64, events: 1000, changes: 64, timings: 16 };

/// A group of which no new cycle is known for this time is not observed.
const STALE: Duration = Duration::from_secs(3);

/// Time between two searches for the run of a group.
const SEARCH_EVERY: Duration = Duration::from_secs(2);

/// A plant whose groups are followed: for each the run that a process writes below a directory of runs.
#[derive(Debug)]
pub struct FollowedPlant {
    plant: PlantFile,
    groups: Vec<Option<FollowedGroup>>,
    searched: Vec<Option<Instant>>,
}

#[derive(Debug)]
struct FollowedGroup {
    run: Run,
    model: Model,
    following: Following,
    advance: Advance,
}

/// Whether the newest cycle of a group is the present. Records alone do not tell: the first ones after an outage are of members that start, and
/// the newest cycle is still that of before.
#[derive(Debug, Default)]
struct Advance {
    newest: Option<i64>,
    /// When the newest cycle was another one at the last look.
    at: Option<Instant>,
}

impl Advance {
    /// Takes the newest cycle at `now`; how long ago it changed. What is found first may be as old as the journal.
    fn look(&mut self, newest: Option<i64>, age: Duration, now: Instant) -> Duration {
        let at = match self.at {
            Some(at) if newest == self.newest => at,
            Some(_) => now,
            None => now.checked_sub(age).unwrap_or(now),
        };
        (self.newest, self.at) = (newest, Some(at));
        now.saturating_duration_since(at)
    }
}

impl FollowedPlant {
    /// Follows a plant, of which no run is known yet.
    pub fn new(plant: PlantFile) -> Self {
        let groups = plant.groups.len();
        let (followed, searched) = ((0..groups).map(|_| None).collect(), vec![None; groups]);
        Self { plant, groups: followed, searched }
    }

    /// The plant file.
    pub fn plant(&self) -> &PlantFile {
        &self.plant
    }

    /// The run of a group, where one was found.
    pub fn run_of(&self, group: usize) -> Option<&Run> {
        Some(&self.groups.get(group)?.as_ref()?.run)
    }

    /// Follows a group in this run.
    pub fn follow(&mut self, group: usize, run: Run) {
        let (model, following) = Following::of(&run, BOUNDS);
        if let Some(place) = self.groups.get_mut(group) {
            *place = Some(FollowedGroup { run, model, following, advance: Advance::default() });
        }
    }

    /// Reads what is new; runs of groups without one are searched below `runs`.
    pub fn look(&mut self, runs: &Path, now: Instant) -> PlantOverview {
        let mut views = Vec::new();
        for group in 0..self.groups.len() {
            let is_over = |of: &FollowedGroup| !of.run.is_written();
            if self.groups[group].as_ref().is_none_or(is_over) {
                self.search(group, runs, now);
            }
            views.push(match &mut self.groups[group] {
                Some(followed) => followed.view(now),
                None => GroupView::Unknown("no process records its run".to_owned()),
            });
        }
        PlantOverview::new(&self.plant, &views)
    }

    fn search(&mut self, group: usize, runs: &Path, now: Instant) {
        let is_due = |at: Instant| now.saturating_duration_since(at) >= SEARCH_EVERY;
        if !self.searched[group].is_none_or(is_due) {
            return;
        }
        self.searched[group] = Some(now);
        if let Some(run) = find_running(runs, &self.plant.groups[group].cluster) {
            self.follow(group, run);
        }
    }
}

impl FollowedGroup {
    fn view(&mut self, now: Instant) -> GroupView {
        let Self { run, model, following, advance } = self;
        while following.poll(&mut |found| model.take_found(found)) > 0 {
            // A journal that grows faster than it is read is not followed to its end.
            if following.progress().is_at_end() {
                break;
            }
        }
        if !run.is_written() {
            return GroupView::Unknown("the process that recorded its run has ended".to_owned());
        }
        let progress = following.progress();
        if let Err(reading) = progress.current(now) {
            return GroupView::Unknown(reading.to_string());
        }
        let Some(age) = progress.age(now) else {
            return GroupView::Unknown("no record yet".to_owned());
        };
        let newest = model.newest();
        let since = advance.look(newest, age, now);
        let lacks = |what: &str, since: Duration| {
            GroupView::Unknown(format!("no {what} for {} s", since.as_secs()))
        };
        if age > STALE {
            return lacks("record", age);
        }
        let Some(newest) = newest else {
            return GroupView::Unknown("no deadline was reported yet".to_owned());
        };
        if since > STALE {
            return lacks("cycle", since);
        }
        if model.program_ids().all(|program| model.deadline(program, newest).is_none()) {
            return GroupView::Unknown("no remote I/O reports its deadlines".to_owned());
        }
        GroupView::Present(Box::new(model.snapshot()))
    }
}

#[cfg(test)]
#[allow(clippy::disallowed_methods, reason = "any time to begin with")]
mod tests {
    use super::*;

    #[test]
    fn records_of_members_that_start_make_an_old_cycle_no_younger() {
        let start = Instant::now();
        let mut advance = Advance::default();
        let mut since = |newest, age, after| {
            let [age, now] = [age, after].map(Duration::from_millis);
            advance.look(newest, age, start + now).as_millis()
        };
        assert_eq!(since(Some(100), 40, 100), 40, "as old as the journal");
        assert_eq!(since(Some(200), 10, 1_000), 0);
        assert_eq!(since(Some(200), 3_000, 4_000), 3_000);
        // The first record after an outage: the newest cycle is that of before.
        assert_eq!(since(Some(200), 0, 4_010), 3_010);
        assert_eq!(since(Some(950), 0, 4_300), 0);
        let mut late = Advance::default();
        let now = start + Duration::from_secs(9);
        assert_eq!(late.look(Some(1), Duration::from_secs(5), now), Duration::from_secs(5));
    }
}
