//! What is newest, as server-sent events.
//!
//! | event | when | data |
//! |---|---|---|
//! | `state` | something is new | the state, as `/api/state` answers it |
//! | `pulse` | nothing is new | how old the newest record is, in milliseconds |
//! | `reading` | the journal is still being read, or again | how much of it was read, in percent |
//!
//! One of them comes at least every [`PULSE`], so that a viewer knows that what it shows is the present.
//! A viewer that does not keep up is given the newest state when it can take one; what came in between it never sees.

use std::convert::Infallible;
use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::extract::State;
use axum::response::sse::{Event, Sse};
use futures_util::Stream;
use futures_util::stream::unfold;
use tokio::sync::{OwnedSemaphorePermit, watch};
use tokio::time::timeout;

use super::Answered;
use crate::app::{App, MAXIMUM_VIEWERS};
use crate::error::Problem;
use crate::follower::Newest;

/// Between two events to a viewer, at most. The page takes what it shows for the past after 2 s without one.
const PULSE: Duration = Duration::from_millis(500);

struct Viewer {
    newest: watch::Receiver<Newest>,
    shown: Option<Arc<str>>,
    _place: OwnedSemaphorePermit,
}

impl Viewer {
    /// The next event; nothing where the server ends.
    async fn next(&mut self) -> Option<Event> {
        if let Ok(changed) = timeout(PULSE, self.newest.changed()).await {
            changed.ok()?;
        }
        let Newest { state, progress } = self.newest.borrow_and_update().clone();
        let now = Instant::now();
        if let Err(reading) = progress.current(now) {
            self.shown = None;
            let percent = reading.percent.to_string();
            return Some(Event::default().event("reading").data(percent));
        }
        let is_shown = |shown: &Arc<str>| Arc::ptr_eq(shown, &state);
        if self.shown.as_ref().is_some_and(is_shown) {
            let age = progress.age(now).unwrap_or_default().as_millis();
            return Some(Event::default().event("pulse").data(age.to_string()));
        }
        self.shown = Some(Arc::clone(&state));
        Some(Event::default().event("state").data(state))
    }
}

pub(super) async fn live(
    State(app): State<Arc<App>>,
) -> Answered<Sse<impl Stream<Item = Result<Event, Infallible>>>> {
    let place = Arc::clone(&app.viewers).try_acquire_owned().map_err(|_| {
        Problem::too_many(format!(
            "the limit of {MAXIMUM_VIEWERS} viewers is reached: close another page"
        ))
    })?;
    let mut newest = app.newest.clone();
    // The first one is shown at once.
    newest.mark_changed();
    let viewer = Viewer { newest, shown: None, _place: place };
    let events = unfold(viewer, |mut viewer| async move {
        let event = viewer.next().await?;
        Some((Ok(event), viewer))
    });
    Ok(Sse::new(events))
}
