//! The page of a plant: its groups and spares, read when a viewer asks.
//!
//! | path | answer |
//! |---|---|
//! | `/` | the page |
//! | `/api/plant` | the overview as JSON |
//! | `/group/NAME/` | the page of the run of a group, with all of its paths |

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use axum::extract::{Path, Request, State};
use axum::http::Uri;
use axum::response::{IntoResponse, Redirect, Response};
use axum::routing::{any, get};
use axum::{Json, Router};
use tower::ServiceExt;
use understudy_view::{FollowedPlant, PlantOverview};

use crate::api::Guarded;
use crate::app::Commanding;
use crate::assets::asset;
use crate::error::Problem;
use crate::guard::Gate;
use crate::server::RunPage;

struct PlantPage {
    plant: Mutex<FollowedPlant>,
    runs: PathBuf,
    gate: Arc<Gate>,
    /// Pages of groups that a viewer has opened, by the name of the group.
    groups: Mutex<HashMap<String, GroupPage>>,
}

/// The page of a group, of the run that a process records now.
struct GroupPage {
    run: PathBuf,
    page: RunPage,
}

impl Drop for GroupPage {
    fn drop(&mut self) {
        // Its follower looks at this between two looks at the journal.
        self.page.ending.send_replace(true);
    }
}

pub(crate) fn router(plant: FollowedPlant, runs: PathBuf, gate: Arc<Gate>) -> Router {
    let (plant, groups) = (Mutex::new(plant), Mutex::default());
    let page = PlantPage { plant, runs, gate: Arc::clone(&gate), groups };
    Router::new()
        .route("/api/plant", get(overview))
        .route("/group/{name}", get(with_slash))
        .route("/group/{name}/", any(group))
        .route("/group/{name}/{*path}", any(group))
        .fallback(page_of_plant)
        .with_state(Arc::new(page))
        .guarded(&gate)
}

async fn page_of_plant(uri: Uri) -> Response {
    match uri.path() {
        "/" => asset("plant.html"),
        path => asset(path.trim_start_matches('/')),
    }
}

/// Reads what is new in the journals of the groups.
async fn overview(State(page): State<Arc<PlantPage>>) -> Result<Json<PlantOverview>, Problem> {
    let read = tokio::task::spawn_blocking(move || {
        let mut plant = page.plant.lock().unwrap_or_else(PoisonError::into_inner);
        plant.look(&page.runs, Instant::now())
    });
    // It ends without an answer only where the server ends.
    read.await.map(Json).map_err(|error| Problem::reading(error.to_string()))
}

/// The paths of the page of a group are relative to its folder.
async fn with_slash(Path(name): Path<String>) -> Redirect {
    Redirect::permanent(&format!("/group/{name}/"))
}

/// Answers as the page of the run that a process records of a group.
async fn group(State(page): State<Arc<PlantPage>>, request: Request) -> Response {
    let (mut parts, body) = request.into_parts();
    // The page of the group has no path with the parts of this one.
    parts.extensions.clear();
    let path = parts.uri.path_and_query().map_or("/", |path| path.as_str()).to_owned();
    let rest = path.strip_prefix("/group/").unwrap_or_default();
    let (name, rest) = rest.split_once('/').unwrap_or((rest, ""));
    let pages = match page.pages_of(name) {
        Ok(pages) => pages,
        Err(problem) => return problem.into_response(),
    };
    match Uri::try_from(format!("/{rest}")) {
        Ok(uri) => parts.uri = uri,
        Err(error) => return Problem::bad(error.to_string()).into_response(),
    }
    pages.oneshot(Request::from_parts(parts, body)).await.into_response()
}

impl PlantPage {
    /// The pages of a group: of the run that is recorded now, or of the one that was opened before.
    fn pages_of(&self, name: &str) -> Result<Router, Problem> {
        let run = {
            let plant = self.plant.lock().unwrap_or_else(PoisonError::into_inner);
            let group = plant.plant().groups.iter().position(|group| group.name == name);
            let group = group
                .ok_or_else(|| Problem::unknown(format!("the plant has no group `{name:.60}`")))?;
            plant.run_of(group).map(|run| (run.path().to_owned(), run.commander()))
        };
        let mut groups = self.groups.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((run, commander)) = run
            && groups.get(name).is_none_or(|opened| opened.run != run)
        {
            let commanding = Commanding {
                commander,
                forbidden: Some("the page of a plant is read-only".to_owned()),
                impossible: Vec::new(),
                after_scenario: false,
                person: None,
            };
            let page = RunPage::start(run.clone(), commanding, Arc::clone(&self.gate));
            let page = page.map_err(|error| Problem::reading(error.to_string()))?;
            groups.insert(name.to_owned(), GroupPage { run, page });
        }
        let opened = groups.get(name).map(|opened| opened.page.pages.clone());
        opened.ok_or_else(|| Problem::unknown(format!("no process records the run of {name}")))
    }
}
