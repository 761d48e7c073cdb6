//! `understudy watch`: the live view of a run, and the page beside a laboratory.

use std::net::{Ipv4Addr, SocketAddr};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use clap::Args;
use serde::Serialize;
use understudy_cluster::Cluster;
use understudy_journal::{Commander, Commands, RunDirectory, commands};
use understudy_processes::LaboratoryError;
use understudy_scenarios::{MAXIMUM_CYCLES, Scenario};
use understudy_view::{Run, find_running};
use understudy_watch::{Certificate, Commanding, Logins, Served, Settings, WatchError, serve};

use crate::answer::{Answer, Status};
use crate::attach::{AttachArguments, who_runs_already};
use crate::console::Console;
use crate::files;
use crate::lab::{RunArguments, judged};
use crate::overrides::parse_address;
use crate::wakefulness;

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
  understudy watch cell/cluster.toml --keys keys/members/operator        what runs on other machines

A cluster file whose laboratory runs already below --out is looked at, and no other one is started. The page looks only, unless it is told --allow-commands. Where other machines can reach its address, it is served over TLS, and only to
those that the file of --logins names (docs/watch.md).")]
pub(crate) struct Arguments {
    /// A cluster file, whose laboratory is run or looked at; or the directory of a run
    #[arg(value_name = "CLUSTER.toml|RUN")]
    target: PathBuf,
    /// Where the page is served
    #[arg(long, value_name = "ADDRESS", default_value_t = ADDRESS, value_parser = parse_address)]
    address: SocketAddr,
    /// Only look at what runs already, and start nothing
    #[arg(long)]
    attach: bool,
    /// Start a laboratory, also where one of this cluster runs already
    #[arg(long, conflicts_with_all = ["attach", "keys"])]
    start: bool,
    #[command(flatten)]
    elsewhere: AttachArguments,
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
    #[arg(long, value_name = "ADDRESS", num_args = 0..=1, default_missing_value = "127.0.0.1:7480", value_parser = parse_address)]
    watch: Option<SocketAddr>,
    #[command(flatten)]
    page: PageArguments,
}

impl BesideArguments {
    pub(crate) fn page(&self) -> Option<Page> {
        Some(Page {
            address: self.watch?,
            arguments: self.page.clone(),
            stays: false,
        })
    }
}

/// A page that is to be served.
#[derive(Debug, Clone)]
pub(crate) struct Page {
    address: SocketAddr,
    arguments: PageArguments,
    stays: bool,
}

impl Page {
    /// The same, of a cluster that stays up when its scenario is over, and then takes commands.
    pub(crate) fn staying(self) -> Self {
        Self {
            stays: true,
            ..self
        }
    }

    pub(crate) fn stays(&self) -> bool {
        self.stays
    }

    pub(crate) fn may_command(&self) -> bool {
        self.arguments.allow_commands
    }

    /// Serves it beside the laboratory that writes `run`, which takes its commands where it may give any.
    pub(crate) fn beside(
        &self,
        run: &Path,
        console: &mut Console,
    ) -> Result<(Served, Commands), Answer> {
        let (commander, commands) = commands();
        let served = self.serve(run, self.commanding(commander, Vec::new()), console)?;
        Ok((served, commands))
    }

    fn commanding(
        &self,
        commander: Commander,
        impossible: Vec<(&'static str, String)>,
    ) -> Commanding {
        let takes = self.may_command() || self.stays;
        let forbidden = (!takes).then_some("the page was not told --allow-commands");
        Commanding {
            commander,
            forbidden: forbidden.map(str::to_owned),
            impossible,
        }
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
    let status = match error {
        WatchError::Certificate(_) | WatchError::Logins { .. } | WatchError::NoLogins(_) => {
            Status::BadInput
        }
        WatchError::Listen { .. } | WatchError::System { .. } => Status::Failed,
    };
    Answer::failed(status, error.code(), error.to_string())
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
        stays: false,
    };
    if arguments.target.is_dir() {
        watch_run(&arguments.target, &page, console)
    } else {
        watch_cluster(arguments, &page, console)
    }
}

/// The cluster of a file: elsewhere, in a laboratory that runs already, or in one that is started.
fn watch_cluster(arguments: &Arguments, page: &Page, console: &mut Console) -> Answer {
    let (target, run) = (&arguments.target, &arguments.run);
    let (cluster, reports) = match files::cluster(target, run.overrides.overrides()) {
        Ok(read) => read,
        Err(answer) => return answer,
    };
    if arguments.elsewhere.is_wanted() {
        return watch_elsewhere(arguments, &cluster, page, console).with_used(reports);
    }
    let running = (!arguments.start).then(|| find_running(&run.out, &cluster));
    if let Some(running) = running.flatten() {
        let path = running.path().to_owned();
        console.note(&format!(
            "it runs already, and is looked at: {}",
            path.display()
        ));
        return watch_run(&path, page, console).with_used(reports);
    }
    if arguments.attach {
        let out = run.out.display();
        let message = format!(
            "no laboratory of `{}` runs below {out}; members on other machines are called with the keys of an operator (--keys DIR)",
            cluster.name()
        );
        return Answer::failed(Status::BadInput, "U0614", message);
    }
    if let Some(who) = who_runs_already(&cluster).filter(|_| !arguments.start) {
        let message = format!(
            "the cluster runs already, for something takes calls at the address of {who}: look at it with the keys of an operator (--keys DIR)"
        );
        return Answer::failed(Status::BadInput, "U0615", message);
    }
    run_and_watch(&cluster, arguments, page, console).with_used(reports)
}

fn watch_elsewhere(
    arguments: &Arguments,
    cluster: &Cluster,
    page: &Page,
    console: &mut Console,
) -> Answer {
    let (target, run) = (&arguments.target, &arguments.run);
    let attached =
        arguments
            .elsewhere
            .attach(target, cluster, &run.out, run.journal_limit, console);
    let (directory, attached) = match attached {
        Ok(attached) => attached,
        Err(answer) => return answer,
    };
    let commanding = page.commanding(attached.commander(), understudy_attach::impossible());
    serve_until_asked_to_end(directory.path(), page, commanding, console)
}

fn watch_run(target: &Path, page: &Page, console: &mut Console) -> Answer {
    // What is wrong with it is said here, and not on a page that nobody sees.
    let run = match Run::open(target) {
        Ok(run) => run,
        Err(error) => return Answer::failed(Status::BadInput, error.code(), error.to_string()),
    };
    let (path, commander) = (run.path().to_owned(), run.commander());
    let mut commanding = page.commanding(commander, Vec::new());
    if !run.is_written() {
        commanding.forbidden = Some("the run is over".to_owned());
    }
    serve_until_asked_to_end(&path, page, commanding, console)
}

fn serve_until_asked_to_end(
    run: &Path,
    page: &Page,
    commanding: Commanding,
    console: &mut Console,
) -> Answer {
    let served = match page.serve(run, commanding, console) {
        Ok(served) => served,
        Err(answer) => return answer,
    };
    match served.until_asked_to_end() {
        Ok(()) => watched(run),
        Err(error) => failed(&error),
    }
}

fn watched(run: &Path) -> Answer {
    let name = run.display().to_string();
    let text = format!("watched: {name}\n");
    Answer::done(text, Watched { run: name }).and_next(&[&"journal", &run])
}

/// Runs the laboratory of a cluster until it is asked to end.
fn run_and_watch(
    cluster: &Cluster,
    arguments: &Arguments,
    page: &Page,
    console: &mut Console,
) -> Answer {
    let (target, arguments) = (&arguments.target, &arguments.run);
    let scenario = Scenario {
        title: cluster.name().to_owned(),
        cycles: MAXIMUM_CYCLES,
        ..Scenario::default()
    };
    let scenario = scenario.shortened(arguments.cycles);
    wakefulness::warn(cluster, console);
    let directory = match RunDirectory::create(&arguments.out, SystemTime::now()) {
        Ok(directory) => directory,
        Err(error) => return Answer::failed(Status::Failed, "U0602", error.to_string()),
    };
    let file = target.clone();
    let page = Some(page);
    match judged(
        cluster, &scenario, file, arguments, &directory, page, console,
    ) {
        Err(answer) => answer,
        Ok((_, run)) => {
            let answer = watched(directory.path());
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
