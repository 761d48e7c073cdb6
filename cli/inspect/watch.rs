//! `understudy watch`: the web page of a run, also served by `lab` and `demo`.

use std::net::{Ipv4Addr, SocketAddr};
use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;
use understudy_cluster::Cluster;
use understudy_journal::{Commander, Commands, commands};
use understudy_scenarios::{MAXIMUM_CYCLES, Scenario};
use understudy_view::{FollowedPlant, Run, find_running};
use understudy_watch::{
    Certificate, Commanding, Logins, Place, Served, Settings, WatchError, serve, serve_plant,
};

use crate::answer::{Answer, Status};
use crate::console::Console;
use crate::files;
use crate::inspect::attach::{AttachArguments, who_runs_already};
use crate::inspect::plant;
use crate::overrides::parse_address;
use crate::run::lab::{RunArguments, judged};
use crate::run::wakefulness;

/// Default address of the page.
pub(crate) const ADDRESS: SocketAddr =
    SocketAddr::new(std::net::IpAddr::V4(Ipv4Addr::LOCALHOST), 7480);

/// Show a run in a browser, live or finished
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy watch examples/press-cell/cluster.toml --allow-commands
  understudy watch runs/latest
  understudy watch runs/latest --address 0.0.0.0:7480 --logins logins.txt
  understudy watch cell/cluster.toml --keys keys/members/engineer
  understudy watch plant.toml --keys keys

If a laboratory of the cluster is already running below --out, the page shows that run. The page is read-only by default;
--allow-commands enables commands. For a plant file the page shows the remaining redundancy of all groups and where each spare is; --keys is
then a folder with a folder of an operator's keys for each group (docs/how-to/spares.md). At an address that other machines can reach, the page is served over TLS to the users of the --logins
file (docs/reference/watch.md).")]
pub(crate) struct Arguments {
    /// Cluster file to run or attach to, directory of a run, or plant file
    #[arg(value_name = "CLUSTER.toml|RUN|PLANT.toml")]
    target: PathBuf,
    /// Address of the page
    #[arg(long, visible_alias = "listen", value_name = "ADDRESS", default_value_t = ADDRESS, value_parser = parse_address)]
    address: SocketAddr,
    /// Attach to a running laboratory; start none
    #[arg(long)]
    attach: bool,
    /// Start a laboratory even if the cluster is already running
    #[arg(long, conflicts_with_all = ["attach", "keys"])]
    start: bool,
    #[command(flatten)]
    elsewhere: AttachArguments,
    #[command(flatten)]
    page: PageArguments,
    #[command(flatten)]
    run: RunArguments,
}

/// Settings of the page other than its address.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "Page")]
pub(crate) struct PageArguments {
    /// Allow the page to kill, stop, cut and force; every command is recorded in the journal
    #[arg(long)]
    allow_commands: bool,
    /// File of users, one line `viewer|operator|engineer NAME TOKEN` each; created with one engineer if missing
    #[arg(long, value_name = "FILE")]
    logins: Option<PathBuf>,
    /// Certificate chain of the page (PEM); default: self-signed
    #[arg(long, value_name = "FILE", requires = "private_key")]
    certificate: Option<PathBuf>,
    /// Private key of the certificate (PEM)
    #[arg(long, value_name = "FILE", requires = "certificate")]
    private_key: Option<PathBuf>,
    /// Additional host name of the page
    #[arg(long, value_name = "NAME")]
    known_as: Vec<String>,
}

/// The page of a laboratory, for `lab` and `demo`.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "Page")]
pub(crate) struct BesideArguments {
    /// Show the run in a browser while it is running
    #[arg(long, value_name = "ADDRESS", num_args = 0..=1, default_missing_value = "127.0.0.1:7480", value_parser = parse_address)]
    watch: Option<SocketAddr>,
    #[command(flatten)]
    page: PageArguments,
}

impl BesideArguments {
    pub(crate) fn page(&self) -> Option<Page> {
        Some(Page { address: self.watch?, arguments: self.page.clone(), stays: false })
    }
}

/// A page to serve.
#[derive(Debug, Clone)]
pub(crate) struct Page {
    address: SocketAddr,
    arguments: PageArguments,
    stays: bool,
}

impl Page {
    /// The page of a cluster that keeps running after its scenario and then accepts commands.
    pub(crate) fn staying(self) -> Self {
        Self { stays: true, ..self }
    }

    pub(crate) fn stays(&self) -> bool {
        self.stays
    }

    pub(crate) fn may_command(&self) -> bool {
        self.arguments.allow_commands
    }

    /// Serves the page of the laboratory that writes `run` and forwards permitted commands to it.
    pub(crate) fn beside(
        &self,
        run: &Path,
        console: &mut Console,
    ) -> Result<(Served, Commands), Answer> {
        let (commander, commands) = commands();
        let after_scenario = self.stays && !self.may_command();
        let commanding = Commanding { after_scenario, ..self.commanding(commander, Vec::new()) };
        let served = self.serve(run, commanding, console)?;
        Ok((served, commands))
    }

    fn commanding(
        &self,
        commander: Commander,
        impossible: Vec<(&'static str, String)>,
    ) -> Commanding {
        let takes = self.may_command() || self.stays;
        let forbidden = (!takes).then_some("the page was started without --allow-commands");
        let forbidden = forbidden.map(str::to_owned);
        Commanding { commander, forbidden, after_scenario: false, impossible, person: None }
    }

    fn serve(
        &self,
        run: &Path,
        commanding: Commanding,
        console: &mut Console,
    ) -> Result<Served, Answer> {
        let served = self
            .place()
            .and_then(|place| serve(Settings { run: run.to_owned(), place, commanding }));
        let served = served.map_err(|error| failed(&error))?;
        note_place(&served, "page of the run", console);
        Ok(served)
    }

    fn place(&self) -> Result<Place, WatchError> {
        let certificate = self.arguments.certificate.clone();
        let key = self.arguments.private_key.clone();
        Ok(Place {
            address: self.address,
            logins: self.arguments.logins.as_deref().map(Logins::of_file).transpose()?,
            certificate: certificate.zip(key).map(|(chain, key)| Certificate { chain, key }),
            names: self.arguments.known_as.clone(),
        })
    }
}

fn note_place(served: &Served, page: &str, console: &mut Console) {
    console.note(&format!("{page}: {}", served.url()));
    if let Some(fingerprint) = served.fingerprint() {
        console.note(&format!("SHA-256 of the certificate: {fingerprint}"));
    }
}

fn failed(error: &WatchError) -> Answer {
    let status = match error {
        WatchError::Certificate(_) | WatchError::Logins { .. } | WatchError::NoLogins(_) => {
            Status::BadInput
        }
        WatchError::Listen { .. } | WatchError::System { .. } => Status::Failed,
    };
    Answer::failed(status, error.code(), error)
}

#[derive(Serialize)]
struct Watched {
    /// The directory of the run.
    run: String,
}

pub(crate) fn run(arguments: &Arguments, console: &mut Console) -> Result<Answer, Answer> {
    let page = Page { address: arguments.address, arguments: arguments.page.clone(), stays: false };
    if plant::is_plant(&arguments.target) {
        watch_plant(arguments, &page, console)
    } else if arguments.target.is_dir() {
        watch_run(&arguments.target, &page, console)
    } else {
        watch_cluster(arguments, &page, console)
    }
}

/// Shows all groups of a plant file.
fn watch_plant(
    arguments: &Arguments,
    page: &Page,
    console: &mut Console,
) -> Result<Answer, Answer> {
    if page.may_command() || arguments.start {
        let message = "the page of a plant is read-only and starts nothing: use --allow-commands and --start with the cluster file of a group";
        return Err(Answer::failed(Status::BadInput, "U0600", message));
    }
    let (target, run) = (&arguments.target, &arguments.run);
    let plant = plant::open(target, &run.out, &arguments.elsewhere, run.journal_limit, console)?;
    let served = page.place().and_then(|place| {
        let (runs, groups) = (plant.runs.clone(), FollowedPlant::new(plant.plant.plant().clone()));
        serve_plant(groups, runs, place)
    });
    let served = served.map_err(|error| failed(&error))?;
    note_place(&served, "page of the plant", console);
    served.until_asked_to_end().map_err(|error| failed(&error))?;
    let target = target.display().to_string();
    Ok(Answer::done(format!("watched: {target}\n"), Watched { run: target }))
}

/// Shows a cluster: on other machines, in a running laboratory, or in a new one.
fn watch_cluster(
    arguments: &Arguments,
    page: &Page,
    console: &mut Console,
) -> Result<Answer, Answer> {
    let (target, run) = (&arguments.target, &arguments.run);
    let (cluster, reports) = files::cluster(target, run.overrides.overrides())?;
    if arguments.elsewhere.is_wanted() {
        let answer = watch_elsewhere(arguments, &cluster, page, console)?;
        return Ok(answer.with_used(reports));
    }
    let running = (!arguments.start).then(|| find_running(&run.out, &cluster));
    if let Some(running) = running.flatten() {
        let path = running.path().to_owned();
        console.note(&format!("already running, showing {}", path.display()));
        return Ok(watch_run(&path, page, console)?.with_used(reports));
    }
    if arguments.attach {
        let out = run.out.display();
        let message = format!(
            "no laboratory of `{}` runs below {out}; remote members require the keys of an operator (--keys DIR)",
            cluster.name()
        );
        return Err(Answer::failed(Status::BadInput, "U0614", message));
    }
    if let Some(who) = who_runs_already(&cluster).filter(|_| !arguments.start) {
        let message = format!(
            "the cluster is already running: {who} accepts connections; attach to it with the keys of an operator (--keys DIR)"
        );
        return Err(Answer::failed(Status::BadInput, "U0615", message));
    }
    Ok(run_and_watch(&cluster, arguments, page, console)?.with_used(reports))
}

fn watch_elsewhere(
    arguments: &Arguments,
    cluster: &Cluster,
    page: &Page,
    console: &mut Console,
) -> Result<Answer, Answer> {
    let (target, run) = (&arguments.target, &arguments.run);
    let (directory, attached, person) =
        arguments.elsewhere.attach(target, cluster, &run.out, run.journal_limit, console)?;
    let commanding = Commanding {
        person: Some(person),
        ..page.commanding(attached.commander(), understudy_attach::impossible())
    };
    serve_until_asked_to_end(directory.path(), page, commanding, console)
}

fn watch_run(target: &Path, page: &Page, console: &mut Console) -> Result<Answer, Answer> {
    // Errors are reported here, before a page is served.
    let run = Run::open(target)?;
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
) -> Result<Answer, Answer> {
    let served = page.serve(run, commanding, console)?;
    let ended = served.until_asked_to_end();
    ended.map_err(|error| failed(&error))?;
    Ok(watched(run))
}

fn watched(run: &Path) -> Answer {
    let name = run.display().to_string();
    let text = format!("watched: {name}\n");
    Answer::done(text, Watched { run: name }).and_next(&[&"journal", &run])
}

/// Runs the laboratory of a cluster until it is interrupted.
fn run_and_watch(
    cluster: &Cluster,
    arguments: &Arguments,
    page: &Page,
    console: &mut Console,
) -> Result<Answer, Answer> {
    let (target, arguments) = (&arguments.target, &arguments.run);
    let scenario = Scenario {
        title: cluster.name().to_owned(),
        cycles: MAXIMUM_CYCLES,
        ..Scenario::default()
    };
    let scenario = scenario.shortened(arguments.cycles);
    wakefulness::warn(cluster, console);
    let directory = files::run_directory(&arguments.out)?;
    let file = target.clone();
    let page = Some(page);
    let (_, run) = judged(cluster, &scenario, file, arguments, &directory, page, console)?;
    let answer = watched(directory.path());
    Ok(match run.failure {
        Some(failure) => answer.and_failure(Status::Failed, failure.code(), &failure),
        None => answer,
    })
}
