//! Questions and commands: one path each.

mod alarms;
mod command;
mod compare;
mod events;
mod facts;
mod ladder;
mod live;
mod session;
mod signals;
mod trends;
mod why;

use std::sync::Arc;

use axum::Router;
use axum::extract::DefaultBodyLimit;
use axum::extract::rejection::{JsonRejection, PathRejection, QueryRejection};
use axum::http::Uri;
use axum::middleware::from_fn_with_state;
use axum::response::Response;
use axum::routing::{get, post};

use crate::app::App;
use crate::assets::asset;
use crate::error::Problem;
use crate::guard::{Gate, guard};

pub(crate) use facts::not_remembered;

/// Bytes of a command.
const BODY_BYTES: usize = 4096;

pub(crate) fn router(app: Arc<App>) -> Router {
    Router::new()
        .route("/api/run", get(facts::run))
        .route("/api/points/{program}", get(facts::points))
        .route("/api/live", get(live::live))
        .route("/api/state", get(facts::state))
        .route("/api/events", get(events::events))
        .route("/api/ladder/{program}", get(ladder::picture))
        .route("/api/cross-reference/{program}", get(ladder::cross_reference))
        .route("/api/why/{program}/{output}", get(why::why))
        .route("/api/signals", get(signals::signals))
        .route("/api/values", get(signals::values))
        .route("/api/trends", get(trends::trends))
        .route("/api/compare", get(compare::compare))
        .route("/api/alarms/acknowledge", post(alarms::acknowledge))
        .route("/api/alarms/shelve", post(alarms::shelve))
        .route("/api/alarms/unshelve", post(alarms::unshelve))
        .route("/api/command", post(command::command))
        .fallback(page)
        .with_state(Arc::clone(&app))
        .guarded(&app.gate)
}

/// What every page has: logins, and a guard before all of its paths.
pub(crate) trait Guarded {
    /// The same with a guard.
    fn guarded(self, gate: &Arc<Gate>) -> Self;
}

impl Guarded for Router {
    fn guarded(self, gate: &Arc<Gate>) -> Self {
        let sessions = Router::new()
            .route("/api/login", post(session::log_in))
            .route("/api/logout", post(session::log_out))
            .with_state(Arc::clone(gate));
        self.merge(sessions)
            .method_not_allowed_fallback(wrong_method)
            .layer(DefaultBodyLimit::max(BODY_BYTES))
            .layer(from_fn_with_state(Arc::clone(gate), guard))
    }
}

async fn page(uri: Uri) -> Response {
    asset(uri.path().trim_start_matches('/'))
}

async fn wrong_method(uri: Uri) -> Problem {
    Problem::wrong_method(format!("{} does not support this method", uri.path()))
}

impl From<QueryRejection> for Problem {
    fn from(rejection: QueryRejection) -> Self {
        Self::bad(rejection.body_text())
    }
}

impl From<PathRejection> for Problem {
    fn from(rejection: PathRejection) -> Self {
        Self::bad(rejection.body_text())
    }
}

impl From<JsonRejection> for Problem {
    fn from(rejection: JsonRejection) -> Self {
        Self::bad(rejection.body_text())
    }
}

/// An answer or a problem.
type Answered<T> = Result<T, Problem>;
