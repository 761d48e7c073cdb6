//! What is newest, as server-sent events.
//!
//! A viewer that does not keep up is given the newest state when it can take one; what came in between it never sees.

use std::convert::Infallible;
use std::sync::Arc;
use std::time::Duration;

use axum::extract::State;
use axum::response::sse::{Event, KeepAlive, Sse};
use futures_util::Stream;
use futures_util::stream::unfold;
use tokio::sync::{OwnedSemaphorePermit, watch};

use super::Answered;
use crate::app::{App, MAXIMUM_VIEWERS};
use crate::error::Problem;

/// Between two words to a viewer while nothing is new, so that both sides know that the other is there.
const KEEP_ALIVE: Duration = Duration::from_secs(5);

struct Viewer {
    newest: watch::Receiver<Arc<str>>,
    _place: OwnedSemaphorePermit,
}

pub(super) async fn live(
    State(app): State<Arc<App>>,
) -> Answered<Sse<impl Stream<Item = Result<Event, Infallible>>>> {
    let place = Arc::clone(&app.viewers).try_acquire_owned().map_err(|_| {
        Problem::too_many(format!(
            "{MAXIMUM_VIEWERS} viewers are there already: close another page"
        ))
    })?;
    let mut newest = app.newest.clone();
    // The first one is shown at once.
    newest.mark_changed();
    let viewer = Viewer {
        newest,
        _place: place,
    };
    let states = unfold(viewer, |mut viewer| async move {
        viewer.newest.changed().await.ok()?;
        let state = Arc::clone(&viewer.newest.borrow_and_update());
        Some((Ok(Event::default().event("state").data(state)), viewer))
    });
    Ok(Sse::new(states).keep_alive(KeepAlive::new().interval(KEEP_ALIVE)))
}
