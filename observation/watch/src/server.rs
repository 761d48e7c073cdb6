//! Serving the page: its address, its threads, and its end.

use std::net::{SocketAddr, TcpListener as StdListener};
use std::path::PathBuf;
use std::sync::{Arc, RwLock};
use std::thread::JoinHandle;

use axum::Router;
use thread_priority::{
    NormalThreadSchedulePolicy, ThreadPriority, ThreadPriorityValue, ThreadSchedulePolicy,
    set_thread_priority_and_policy, thread_native_id,
};
use tokio::net::TcpListener;
use tokio::signal::unix::{SignalKind, signal};
use tokio::sync::{oneshot, watch};
use understudy_view::FollowedPlant;

use crate::api::router;
use crate::app::{App, Commanding};
use crate::error::WatchError;
use crate::follower::{self, Newest};
use crate::guard::Gate;
use crate::listener::Doors;
use crate::login::Logins;
use crate::model::Model;
use crate::plant;
use crate::tls::{Certificate, acceptor};

/// Few: what they do has time.
const THREADS: usize = 2;

/// Settings of the page.
#[derive(Debug)]
pub struct Settings {
    /// The directory of the run: finished, being written, or not there yet.
    pub run: PathBuf,
    /// Where the page is served, and to whom.
    pub place: Place,
    /// Whether it may command.
    pub commanding: Commanding,
}

/// A page that is being served, until this is dropped.
#[derive(Debug)]
pub struct Served {
    address: SocketAddr,
    fingerprint: Option<String>,
    stop: Option<oneshot::Sender<()>>,
    threads: Vec<JoinHandle<()>>,
    ending: watch::Sender<bool>,
}

impl Served {
    /// Where it is found.
    pub fn url(&self) -> String {
        let scheme = if self.fingerprint.is_some() { "https" } else { "http" };
        format!("{scheme}://{}/", self.address)
    }

    /// Serves until this process is asked to end, by SIGINT or SIGTERM.
    ///
    /// # Errors
    /// [`WatchError::System`] where these signals cannot be heard.
    pub fn until_asked_to_end(self) -> Result<(), WatchError> {
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build()
            .map_err(system("a runtime"))?;
        runtime
            .block_on(async {
                let mut interrupt = signal(SignalKind::interrupt())?;
                let mut terminate = signal(SignalKind::terminate())?;
                tokio::select! {
                    _ = interrupt.recv() => {}
                    _ = terminate.recv() => {}
                }
                Ok(())
            })
            .map_err(system("to hear SIGINT and SIGTERM"))
    }

    /// SHA-256 of its certificate, where it is served over TLS.
    pub fn fingerprint(&self) -> Option<&str> {
        self.fingerprint.as_deref()
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        // The follower looks at this between two looks at the journal.
        self.ending.send_replace(true);
        self.stop = None;
        for thread in self.threads.drain(..) {
            // A panic has been reported.
            let _ = thread.join();
        }
    }
}

/// Where a page is served, and to whom.
#[derive(Debug)]
pub struct Place {
    /// Its address.
    pub address: SocketAddr,
    /// Who may log in; needed where other machines can reach the address, and then the page is served over TLS.
    pub logins: Option<Logins>,
    /// Its certificate; without one it makes its own.
    pub certificate: Option<Certificate>,
    /// Names under which browsers reach it, besides its addresses.
    pub names: Vec<String>,
}

/// A place that is taken.
struct Taken {
    listener: StdListener,
    address: SocketAddr,
    tls: Option<tokio_rustls::TlsAcceptor>,
    fingerprint: Option<String>,
    gate: Gate,
}

impl Place {
    fn take(self, person: Option<String>) -> Result<Taken, WatchError> {
        let Self { address, logins, certificate, names } = self;
        if !address.ip().is_loopback() && logins.is_none() {
            return Err(WatchError::NoLogins(address));
        }
        let listen = |source| WatchError::Listen { address, source };
        let listener = StdListener::bind(address).map_err(listen)?;
        listener.set_nonblocking(true).map_err(listen)?;
        let address = listener.local_addr().map_err(listen)?;
        let tls = match &logins {
            Some(_) => Some(acceptor(certificate.as_ref(), address, &names)?),
            None => None,
        };
        let (tls, fingerprint) = tls.map_or((None, None), |(tls, print)| (Some(tls), Some(print)));
        Ok(Taken { listener, address, tls, fingerprint, gate: Gate { logins, names, person } })
    }
}

/// Serves the page of a run in threads of its own.
///
/// # Errors
/// [`WatchError`].
pub fn serve(settings: Settings) -> Result<Served, WatchError> {
    let Settings { run, place, commanding } = settings;
    let Taken { listener, address, tls, fingerprint, gate } =
        place.take(commanding.person.clone())?;
    let RunPage { pages, follower, ending } = RunPage::start(run, commanding, Arc::new(gate))?;
    let (stop, server) = start(listener, tls, pages)?;
    Ok(Served { address, fingerprint, stop: Some(stop), threads: vec![server, follower], ending })
}

/// The pages of a run, and the thread that follows its journal until it is told to end.
pub(crate) struct RunPage {
    pub(crate) pages: Router,
    pub(crate) follower: JoinHandle<()>,
    pub(crate) ending: watch::Sender<bool>,
}

impl RunPage {
    /// Starts to follow a run.
    ///
    /// # Errors
    /// [`WatchError::System`] without a thread.
    pub(crate) fn start(
        run: PathBuf,
        commanding: Commanding,
        gate: Arc<Gate>,
    ) -> Result<Self, WatchError> {
        let model = Arc::new(RwLock::new(Model::new(&run)));
        let (newest, taken) = watch::channel(Newest::default());
        let (ending, ends) = watch::channel(false);
        let (path, followed) = (run.clone(), Arc::clone(&model));
        let follower = std::thread::Builder::new()
            .name("watch-follower".to_owned())
            .spawn(move || {
                step_back();
                follower::follow(&path, &followed, &newest, &ends);
            })
            .map_err(system("a thread that follows the journal"))?;
        let pages = router(Arc::new(App::new(model, taken, commanding, gate, run)));
        Ok(Self { pages, follower, ending })
    }
}

/// Serves the page of a plant: all groups of a plant file, each as the process records it that writes its run below `runs`.
///
/// # Errors
/// [`WatchError`].
pub fn serve_plant(
    plant: FollowedPlant,
    runs: PathBuf,
    place: Place,
) -> Result<Served, WatchError> {
    let Taken { listener, address, tls, fingerprint, gate } = place.take(None)?;
    let pages = plant::router(plant, runs, Arc::new(gate));
    let (stop, server) = start(listener, tls, pages)?;
    let (ending, _) = watch::channel(false);
    Ok(Served { address, fingerprint, stop: Some(stop), threads: vec![server], ending })
}

fn start(
    listener: StdListener,
    tls: Option<tokio_rustls::TlsAcceptor>,
    pages: Router,
) -> Result<(oneshot::Sender<()>, JoinHandle<()>), WatchError> {
    let (stop, stopped) = oneshot::channel();
    let server = std::thread::Builder::new()
        .name("watch-server".to_owned())
        .spawn(move || {
            step_back();
            run_server(listener, tls, pages, stopped);
        })
        .map_err(system("a thread that serves the page"))?;
    Ok((stop, server))
}

fn system(what: &'static str) -> impl Fn(std::io::Error) -> WatchError {
    move |source| WatchError::System { what, source }
}

fn run_server(
    listener: StdListener,
    tls: Option<tokio_rustls::TlsAcceptor>,
    pages: Router,
    stopped: oneshot::Receiver<()>,
) {
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(THREADS)
        .max_blocking_threads(THREADS)
        .thread_name("watch-answer")
        .on_thread_start(step_back)
        .enable_all()
        .build();
    let runtime = match runtime {
        Ok(runtime) => runtime,
        Err(error) => {
            tracing::error!(%error, "the page is not served");
            return;
        }
    };
    runtime.block_on(async {
        let doors = TcpListener::from_std(listener).and_then(|listener| Doors::open(listener, tls));
        let doors = match doors {
            Ok(doors) => doors,
            Err(error) => {
                tracing::error!(%error, "the page is not served");
                return;
            }
        };
        tokio::select! {
            // It only ends with the runtime.
            _ = axum::serve(doors, pages) => {}
            _ = stopped => {}
        }
    });
    // Streams to viewers have no end of their own.
    runtime.shutdown_background();
}

/// Nice value 10: behind what controls a plant, but not starved by other programs of the machine.
const PRIORITY: u8 = 22;

/// Gives the threads of the page a low priority.
fn step_back() {
    let policy = ThreadSchedulePolicy::Normal(NormalThreadSchedulePolicy::Batch);
    let stepped = ThreadPriorityValue::try_from(PRIORITY).and_then(|priority| {
        let priority = ThreadPriority::Crossplatform(priority);
        set_thread_priority_and_policy(thread_native_id(), priority, policy)
            .map_err(|error| error.to_string())
    });
    if let Err(error) = stepped {
        tracing::debug!(%error, "a thread of the page keeps its priority");
    }
}
