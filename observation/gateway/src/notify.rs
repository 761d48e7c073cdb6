//! Alarms passed on: the command of `[notify]` is run for each alarm that is raised, acknowledged or over.
//!
//! ```text
//!   journal ──► Followed: alarms ──► Changes ──► queue (500 at most) ──► one command at a time, killed at its timeout
//! ```
//!
//! Invariant: the members and the journal wait for nothing of this. One command runs at a time, so that they come in the order of the changes;
//! a notification that was not delivered is reported, and counted in the next one.

mod changes;
mod command;

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use understudy_cluster::Notify;

use crate::error::GatewayError;
use crate::feed::Feed;
use crate::followed::Followed;
use crate::{asked_to_end, runtime};

pub use changes::{Change, Notification};
pub use command::NotifyError;

use changes::Changes;

/// Time between two looks at the alarms.
const LOOK: Duration = Duration::from_millis(100);

/// Notifications that wait for the command, at most; a further one is reported and not delivered.
const MOST_WAITING: usize = 500;

/// The number of notifications.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Notified {
    /// Those whose command ended with status 0.
    pub delivered: u64,
    /// The others.
    pub undelivered: u64,
}

/// Runs the command of the cluster file for the alarms of `run`, until the run has ended and no notification waits, or until SIGINT or SIGTERM.
/// `said` gets each error.
///
/// # Errors
/// The cluster file has no `[notify]`.
pub fn notify(
    run: &Followed,
    said: &mut dyn FnMut(&NotifyError),
) -> Result<Notified, GatewayError> {
    let cluster = run.cluster();
    let command = cluster.notify().cloned();
    let command =
        command.ok_or_else(|| GatewayError::NoNotify { cluster: cluster.name().into() })?;
    runtime()?.block_on(async {
        let end = asked_to_end();
        tokio::pin!(end);
        let mut notified = Notified::default();
        tokio::select! {
            () = pass_on(run, &command, &mut notified, said) => {}
            // A command that runs is killed.
            () = &mut end => {}
        }
        Ok(notified)
    })
}

async fn pass_on(
    run: &Followed,
    command: &Notify,
    notified: &mut Notified,
    said: &mut dyn FnMut(&NotifyError),
) {
    let mut changes = Changes::new(run.cluster().name());
    let mut waiting: VecDeque<Notification> = VecDeque::new();
    // Since the last one that was delivered.
    let mut undelivered = 0;
    let mut failed = |error: &NotifyError, undelivered: &mut u64, notified: &mut Notified| {
        *undelivered += 1;
        notified.undelivered += 1;
        said(error);
    };
    loop {
        let mut is_over = false;
        if let Some(present) = run.observation().ok().filter(|now| now.past_percent.is_none()) {
            for change in changes.since(&present.alarms, &present.snapshot.process_alarms) {
                if waiting.len() < MOST_WAITING {
                    waiting.push_back(change);
                } else {
                    let error = NotifyError::Full { alarm: change.alarm.name };
                    failed(&error, &mut undelivered, notified);
                }
            }
            is_over = present.feed(Instant::now()) == Feed::Ended;
        }
        let Some(mut next) = waiting.pop_front() else {
            if is_over {
                return;
            }
            tokio::time::sleep(LOOK).await;
            continue;
        };
        next.undelivered = undelivered;
        match command::run(command, &next).await {
            Ok(()) => {
                undelivered = 0;
                notified.delivered += 1;
            }
            Err(error) => failed(&error, &mut undelivered, notified),
        }
    }
}
