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
use crate::guard::guard;

pub(crate) use facts::not_remembered;

/// Bytes of a command.
const BODY_BYTES: usize = 4096;

pub(crate) fn router(app: Arc<App>) -> Router {
    Router::new()
        .route("/api/run", get(facts::run))
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
        .route("/api/login", post(session::log_in))
        .route("/api/logout", post(session::log_out))
        .method_not_allowed_fallback(wrong_method)
        .fallback(page)
        .layer(DefaultBodyLimit::max(BODY_BYTES))
        .layer(from_fn_with_state(Arc::clone(&app), guard))
        .with_state(app)
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
