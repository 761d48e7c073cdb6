//! The `understudy-opcua` command: parses, calls one function, prints, exits.

use std::io::Write as _;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, CommandFactory, Parser, Subcommand};
use clap_complete::Shell;
use serde_json::json;
use understudy_bus::{LogFilter, LogFormat, LogSettings};
use understudy_opcua_gateway::{Login, OpcuaError, Settings, Variable, serve, variables};
use understudy_text::visible;
use understudy_view::Run;

/// Show a run as an OPC UA server.
#[derive(Debug, Parser)]
#[command(
    name = "understudy-opcua",
    version,
    after_help = "\
Example:
  understudy-opcua serve runs/latest
  understudy-opcua nodes runs/latest
  understudy-opcua serve runs/latest --listen 192.0.2.7:4840 --certificates opcua
  understudy-opcua serve runs/latest --certificates opcua --logins logins

It reads the journal of the run, finished or not, as `understudy gateway` does
(docs/how-to/monitoring.md). Exit status: 0 when all is well, 1 when it cannot serve, 2 when an
input is wrong and nothing was started."
)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
    /// Log on standard error, such as debug or understudy=trace; default: RUST_LOG
    #[arg(long, global = true, value_name = "FILTER")]
    log: Option<LogFilter>,
    /// Format of the log: text or json
    #[arg(long, global = true, value_name = "FORMAT")]
    log_format: Option<LogFormat>,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Serve a run until SIGINT or SIGTERM
    Serve(ServeArguments),
    /// Print every variable with its identifier, its type and its meaning
    Nodes {
        #[command(flatten)]
        run: RunArgument,
        /// As JSON
        #[arg(long)]
        json: bool,
    },
    /// Print a script that completes commands in a shell
    Completions {
        /// For which shell
        #[arg(value_enum)]
        shell: Shell,
    },
    /// Print the manual page
    Man,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy-opcua serve runs/latest
  understudy-opcua serve runs/latest --listen 192.0.2.7:4840 --certificates opcua

Without --certificates there is no security, and only this machine is served. With it the
policies are Basic256Sha256 and Aes256_Sha256_RsaPss. A client that is not trusted yet is
refused, and lies in FOLDER/rejected for you to move to FOLDER/trusted. A login with the role
operator or engineer writes operator inputs; without logins nothing can be written.")]
struct ServeArguments {
    #[command(flatten)]
    run: RunArgument,
    /// Where it listens; port 0 for any that is free
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1:4840")]
    listen: SocketAddr,
    /// Name of this machine in URLs and in the certificate; by default its address
    #[arg(long, value_name = "NAME")]
    host: Option<String>,
    /// A folder for the certificate of the server, made where there is none, and for those of clients
    #[arg(long, value_name = "FOLDER")]
    certificates: Option<PathBuf>,
    /// File with a line `ROLE NAME PASSWORD` for each login, readable by its owner only; roles: viewer, operator, engineer
    #[arg(long, value_name = "FILE", requires = "certificates", conflicts_with = "user")]
    logins: Option<PathBuf>,
    /// User name of a viewer; without it and --logins no login is needed
    #[arg(long, value_name = "NAME", requires = "password_file", requires = "certificates")]
    user: Option<String>,
    /// File whose first line is the password, readable by its owner only
    #[arg(long, value_name = "FILE", requires = "user")]
    password_file: Option<PathBuf>,
}

#[derive(Debug, Args)]
struct RunArgument {
    /// The directory of a run
    #[arg(value_name = "RUN", default_value = "runs/latest")]
    run: PathBuf,
}

fn main() -> ExitCode {
    let Arguments { command, log, log_format } = Arguments::parse();
    let log = LogSettings { filter: log, format: log_format }.start();
    let status = answered(command);
    if let Some(log) = log {
        log.finish();
    }
    status
}

fn answered(command: Command) -> ExitCode {
    let done = match command {
        Command::Serve(arguments) => serve_run(&arguments),
        Command::Nodes { run, json } => nodes(&run, json),
        Command::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(
                shell,
                &mut Arguments::command(),
                "understudy-opcua",
                &mut script,
            );
            print(&script);
            Ok(())
        }
        Command::Man => {
            let mut page = Vec::new();
            // It is written to memory.
            let _ = clap_mangen::Man::new(Arguments::command()).render(&mut page);
            print(&page);
            Ok(())
        }
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            let message = error.to_string();
            // Some messages begin with their code.
            let prefix = format!("{}: ", error.code());
            let message = message.strip_prefix(&prefix).unwrap_or(&message);
            say(&format!("error[{}]: {message}", error.code()));
            ExitCode::from(if error.is_bad_input() { 2 } else { 1 })
        }
    }
}

fn serve_run(arguments: &ServeArguments) -> Result<(), OpcuaError> {
    let run = Run::open(&arguments.run.run)?;
    let logins = match (&arguments.logins, &arguments.user, &arguments.password_file) {
        (Some(file), ..) => Login::read_all(file)?,
        (_, Some(user), Some(file)) => vec![Login::read(user, file)?],
        _ => Vec::new(),
    };
    let settings = Settings {
        address: arguments.listen,
        host: arguments.host.clone(),
        certificates: arguments.certificates.clone(),
        logins,
    };
    serve(&run, &settings, |address| {
        say(&format!("listening on {address}"));
    })
}

fn nodes(run: &RunArgument, json: bool) -> Result<(), OpcuaError> {
    let run = Run::open(&run.run)?;
    let cluster = run.cluster();
    let variables = variables(cluster);
    let text = if json {
        let list: Vec<_> = variables.iter().map(document).collect();
        let namespace = format!("urn:understudy:{}", cluster.name());
        format!("{:#}\n", json!({ "namespace": namespace, "variables": list }))
    } else {
        table(&variables)
    };
    print(text.as_bytes());
    Ok(())
}

fn document(variable: &Variable) -> serde_json::Value {
    json!({
        "identifier": variable.path(),
        "type": variable.kind().word(),
        "meaning": variable.meaning(),
        "writable": variable.is_writable(),
    })
}

fn table(variables: &[Variable]) -> String {
    let width =
        variables.iter().map(|variable| variable.path().chars().count()).max().unwrap_or_default();
    variables
        .iter()
        .map(|variable| {
            format!(
                "{:width$}  {:8}  {}\n",
                variable.path(),
                variable.kind().word(),
                variable.meaning()
            )
        })
        .collect()
}

/// The reader of the output may have ended.
fn print(bytes: &[u8]) {
    let _ = std::io::stdout().write_all(bytes);
}

fn say(text: &str) {
    let _ = writeln!(std::io::stderr(), "{}", visible(text));
}
