//! The page of a plant: its groups and spares, read when a viewer asks.
//!
//! | path | answer |
//! |---|---|
//! | `/` | the page |
//! | `/api/plant` | the overview as JSON |

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use axum::extract::State;
use axum::http::Uri;
use axum::response::Response;
use axum::routing::get;
use axum::{Json, Router};
use understudy_view::{FollowedPlant, PlantOverview};

use crate::api::Guarded;
use crate::assets::asset;
use crate::error::Problem;
use crate::guard::Gate;

struct PlantPage {
    plant: Mutex<FollowedPlant>,
    runs: PathBuf,
}

pub(crate) fn router(plant: FollowedPlant, runs: PathBuf, gate: Arc<Gate>) -> Router {
    Router::new()
        .route("/api/plant", get(overview))
        .fallback(page)
        .with_state(Arc::new(PlantPage { plant: Mutex::new(plant), runs }))
        .guarded(&gate)
}

async fn page(uri: Uri) -> Response {
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
