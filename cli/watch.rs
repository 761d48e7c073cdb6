//! `understudy watch`: the live view of a run, and the page beside a laboratory.

use std::net::{Ipv4Addr, SocketAddr};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use clap::Args;
use serde::Serialize;
use understudy_scenarios::{
    Commands, LaboratoryError, MAXIMUM_CYCLES, RunDirectory, Scenario, commands,
};
use understudy_view::Run;
use understudy_watch::{Certificate, Commanding, Logins, Served, Settings, WatchError, serve};

use crate::answer::{Answer, Status};
use crate::console::Console;
use crate::files;
use crate::lab::{RunArguments, judged};

/// Where the page is served where nobody says otherwise.
pub(crate) const ADDRESS: SocketAddr =
    SocketAddr::new(std::net::IpAddr::V4(Ipv4Addr::LOCALHOST), 7480);

/// See a run in a browser: who works, what is driven and why, what could fail now
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy watch examples/press-cell/cluster.toml --allow-commands     run it until Ctrl-C, and command it
  understudy watch runs/latest                                           a run that is finished, or is being written
  understudy watch runs/latest --address 0.0.0.0:7480 --logins logins.txt

The page looks only, unless it is told --allow-commands. Where other machines can reach its address, it is served over TLS, and only to
those that the file of --logins names (docs/watch.md).")]
pub(crate) struct Arguments {
    /// A cluster file, whose laboratory is run; or the directory of a run
    #[arg(value_name = "CLUSTER.toml|RUN")]
    target: PathBuf,
    /// Where the page is served
    #[arg(long, value_name = "ADDRESS", default_value_t = ADDRESS)]
    address: SocketAddr,
    #[command(flatten)]
    page: PageArguments,
    #[command(flatten)]
    run: RunArguments,
}

/// What a page is told besides its address.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "Page")]
pub(crate) struct PageArguments {
    /// Let the page kill, stop, cut and force; every command is in the journal
    #[arg(long)]
    allow_commands: bool,
    /// Who may log in, one `viewer|operator NAME TOKEN` a line; made with one operator where there is none
    #[arg(long, value_name = "FILE")]
    logins: Option<PathBuf>,
    /// The certificate chain of the page, in PEM; without one it makes its own
    #[arg(long, value_name = "FILE", requires = "private_key")]
    certificate: Option<PathBuf>,
    /// The key of the certificate, in PEM
    #[arg(long, value_name = "FILE", requires = "certificate")]
    private_key: Option<PathBuf>,
    /// A name under which browsers reach the page, besides its addresses
    #[arg(long, value_name = "NAME")]
    known_as: Vec<String>,
}

/// The page beside a laboratory, from the command line of `lab` and `demo`.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "Page")]
pub(crate) struct BesideArguments {
    /// Show the run in a browser while it lasts
    #[arg(long, value_name = "ADDRESS", num_args = 0..=1, default_missing_value = "127.0.0.1:7480")]
    watch: Option<SocketAddr>,
    #[command(flatten)]
    page: PageArguments,
}

impl BesideArguments {
    pub(crate) fn page(&self) -> Option<Page> {
        Some(Page {
            address: self.watch?,
            arguments: self.page.clone(),
        })
    }
}

/// A page that is to be served.
#[derive(Debug, Clone)]
pub(crate) struct Page {
    address: SocketAddr,
    arguments: PageArguments,
}

impl Page {
    pub(crate) fn may_command(&self) -> bool {
        self.arguments.allow_commands
    }

    /// Serves it beside the laboratory that writes `run`, which takes its commands where it may give any.
    pub(crate) fn beside(
        &self,
        run: &Path,
        console: &mut Console,
    ) -> Result<(Served, Option<Commands>), Answer> {
        let (commanding, commands) = if self.may_command() {
            let (commander, commands) = commands();
            (Commanding::Allowed(commander), Some(commands))
        } else {
            let why = "the page was not told --allow-commands";
            (Commanding::Forbidden(why), None)
        };
        let served = self.serve(run, commanding, console)?;
        Ok((served, commands))
    }

    fn serve(
        &self,
        run: &Path,
        commanding: Commanding,
        console: &mut Console,
    ) -> Result<Served, Answer> {
        let logins = self.arguments.logins.as_deref().map(Logins::of_file);
        let certificate = self.arguments.certificate.clone();
        let key = self.arguments.private_key.clone();
        let served = logins.transpose().and_then(|logins| {
            serve(Settings {
                run: run.to_owned(),
                address: self.address,
                commanding,
                logins,
                certificate: certificate
                    .zip(key)
                    .map(|(chain, key)| Certificate { chain, key }),
                names: self.arguments.known_as.clone(),
            })
        });
        let served = served.map_err(|error| failed(&error))?;
        console.note(&format!("the run can be seen at {}", served.url()));
        if let Some(fingerprint) = served.fingerprint() {
            console.note(&format!("SHA-256 of its certificate: {fingerprint}"));
        }
        Ok(served)
    }
}

fn failed(error: &WatchError) -> Answer {
    Answer::failed(Status::Failed, error.code(), error.to_string())
}

#[derive(Serialize)]
struct Watched {
    /// The directory of the run.
    run: String,
}

pub(crate) fn run(arguments: &Arguments, console: &mut Console) -> Answer {
    let page = Page {
        address: arguments.address,
        arguments: arguments.page.clone(),
    };
    if arguments.target.is_dir() {
        watch_run(&arguments.target, &page, console)
    } else {
        run_and_watch(&arguments.target, &page, &arguments.run, console)
    }
}

fn watch_run(target: &Path, page: &Page, console: &mut Console) -> Answer {
    // What is wrong with it is said here, and not on a page that nobody sees.
    let run = match Run::open(target) {
        Ok(run) => run.path().to_owned(),
        Err(error) => return Answer::failed(Status::BadInput, error.code(), error.to_string()),
    };
    let why = "this page only follows the run: command it on the page of the process that runs it";
    let served = match page.serve(&run, Commanding::Forbidden(why), console) {
        Ok(served) => served,
        Err(answer) => return answer,
    };
    match served.until_asked_to_end() {
        Ok(()) => watched(&run),
        Err(error) => failed(&error),
    }
}

fn watched(run: &Path) -> Answer {
    let run = run.display().to_string();
    Answer::done(format!("watched: {run}\n"), Watched { run })
}

/// Runs the laboratory of a cluster until it is asked to end.
fn run_and_watch(
    target: &Path,
    page: &Page,
    arguments: &RunArguments,
    console: &mut Console,
) -> Answer {
    let (cluster, reports) = match files::cluster(target, arguments.overrides.overrides()) {
        Ok(read) => read,
        Err(answer) => return answer,
    };
    let scenario = Scenario {
        title: cluster.name().to_owned(),
        cycles: MAXIMUM_CYCLES,
        ..Scenario::default()
    };
    let scenario = scenario.shortened(arguments.cycles);
    let directory = match RunDirectory::create(&arguments.out, SystemTime::now()) {
        Ok(directory) => directory,
        Err(error) => return Answer::failed(Status::Failed, "U0602", error.to_string()),
    };
    let file = target.to_owned();
    let page = Some(page);
    match judged(
        &cluster, &scenario, file, arguments, &directory, page, console,
    ) {
        Err(answer) => answer.with_reports(reports),
        Ok((_, run)) => {
            let answer = watched(directory.path()).with_reports(reports);
            match run.failure {
                Some(failure) => answer.and_failure(
                    Status::Failed,
                    LaboratoryError::code(&failure),
                    failure.to_string(),
                ),
                None => answer,
            }
        }
    }
}
