//! The thread that reads the journal while it is written, and publishes what is newest.

use std::path::Path;
use std::sync::{Arc, PoisonError, RwLock};
use std::time::{Duration, Instant};

use tokio::sync::watch;
use understudy_view::{Progress, Run};

use crate::model::{Known, Model};
use crate::shown::{NOTHING, newest_state};

/// Time between two polls of a journal that has nothing new.
const LOOK: Duration = Duration::from_millis(40);

/// The newest state, written once for all viewers, and the progress of its reader.
#[derive(Debug, Clone)]
pub(crate) struct Newest {
    /// The state as JSON.
    pub(crate) state: Arc<str>,
    pub(crate) progress: Progress,
}

impl Default for Newest {
    fn default() -> Self {
        Self { state: Arc::from(NOTHING), progress: Progress::default() }
    }
}

/// Time between two messages to the viewers.
const SAY: Duration = Duration::from_millis(200);

/// Time between two checks for a run that has not started.
const WAIT: Duration = Duration::from_millis(200);

pub(crate) fn follow(
    path: &Path,
    model: &RwLock<Model>,
    newest: &watch::Sender<Newest>,
    ends: &watch::Receiver<bool>,
) {
    let (run, mut following) = loop {
        if *ends.borrow() {
            return;
        }
        match Run::open(path) {
            // The cluster is written before the journal begins.
            Ok(_) if !has_journal(path) => {}
            Ok(run) => {
                let following = lock(model, |model| model.begin(&run));
                break (run, following);
            }
            Err(error) => lock(model, |model| model.waits_for = error.words()),
        }
        std::thread::sleep(WAIT);
    };
    let mut said = Instant::now() - SAY;
    let mut unsaid = true;
    let mut ended = false;
    while !*ends.borrow() {
        // Records are read before the model is locked, so that no request waits for a disk.
        let mut found = Vec::new();
        let taken = following.poll(&mut |record| found.push(record));
        lock(model, |model| found.into_iter().for_each(|found| model.note(found)));
        unsaid |= taken > 0;
        let reads_past = following.past_percent();
        if reads_past.is_some() {
            let whole = following.read_past();
            let percent = following.past_percent();
            unsaid |= reads_past != percent;
            lock(model, |model| model.past_is_read(whole, percent));
        }
        // A simulated run has no last record; it has results when it is over.
        if taken == 0 && !ended && run.is_finished() {
            ended = true;
            unsaid = true;
            lock(model, |model| model.end(run.has_results()));
        }
        let progress = lock(model, |model| {
            let has_ended = model.known().is_some_and(Known::has_ended);
            model.progress = following.progress().of_ended(has_ended);
            model.progress
        });
        let now = Instant::now();
        let was_current = newest.borrow().progress.current(now).is_ok();
        let is_due = said.elapsed() >= SAY || !was_current;
        if unsaid && is_due && progress.current(now).is_ok() {
            let state = newest_state(&model.read().unwrap_or_else(PoisonError::into_inner));
            newest.send_replace(Newest { state: Arc::from(state), progress });
            said = now;
            unsaid = false;
        } else {
            // Viewers poll the progress.
            newest.send_if_modified(|newest| {
                newest.progress = progress;
                false
            });
        }
        if taken == 0 && reads_past.is_none() {
            std::thread::sleep(LOOK);
        }
    }
}

/// Whether a segment of the journal is there.
fn has_journal(run: &Path) -> bool {
    let files = std::fs::read_dir(run).into_iter().flatten().flatten();
    let mut names = files.map(|file| file.file_name().to_string_lossy().into_owned());
    names.any(|name| name.starts_with("journal") && name.ends_with(".jsonl"))
}

fn lock<T>(model: &RwLock<Model>, work: impl FnOnce(&mut Model) -> T) -> T {
    work(&mut model.write().unwrap_or_else(PoisonError::into_inner))
}
