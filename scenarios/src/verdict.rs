//! Verdict on a run.

use crate::summary::{Summary, World};

impl Summary {
    /// The verdict in one line.
    pub fn verdict(&self) -> String {
        let (run, asked) = (self.cycles_run, self.cycles_asked);
        match (&self.inconclusive, self.passed, self.interrupted) {
            (_, true, _) => format!("passed: all expectations were met{}", self.not_functional()),
            (Some(why), false, _) => format!("INCONCLUSIVE: {why}; neither passed nor failed"),
            (None, false, true) => format!("interrupted after {run} of {asked} cycles"),
            (None, false, false) if run < asked => {
                let why = self.ended_early.as_ref().map_or_else(String::new, |why| {
                    format!("; then no remote I/O passed a deadline: {why}")
                });
                format!("FAILED: only {run} of {asked} cycles were completed{why}")
            }
            (None, false, false) => "FAILED".to_owned(),
        }
    }

    /// Names the plants that were not functional, of which nothing was expected.
    fn not_functional(&self) -> String {
        let plants = self.plants.iter().filter(|plant| !plant.functional);
        let names: Vec<&str> = plants.map(|plant| plant.name.as_str()).collect();
        match names.as_slice() {
            [] => String::new(),
            names => format!("; not functional: {}", names.join(", ")),
        }
    }

    /// Whether processes were late: cycles had no provable outputs, and no applied output was wrong.
    pub fn was_late(&self) -> bool {
        let counts = || self.remote_ios.iter().map(|remote_io| &remote_io.counts);
        let lacking = counts().map(|counts| counts.held + counts.fail_safe + counts.missed);
        self.circumstances.world == World::Laboratory
            && !self.passed
            && !self.interrupted
            && counts().all(|counts| counts.wrong == 0)
            && lacking.sum::<u64>() > 0
    }
}
