//! `understudy catalogue`: commercially available controllers with sourced figures.

use std::fmt::Write as _;
use std::fs::File;
use std::io::Read as _;
use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use serde_json::{Value, json};
use understudy_allocation::{
    Added, AdditionError, AllocationError, Catalogue, Controller, Family, Figure, Kind, Mode,
    Quantity, Requirement, RequirementError, Statement, file, search,
};
use understudy_text::Report;

use crate::answer::{Answer, Status};
use crate::deployment::allocate::message;
use crate::files;

/// List, add, import and export commercially available controllers
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy catalogue list --family S7-1200
  understudy catalogue list --vendor Z-World --require \"data_memory>=256KiB\"
  understudy catalogue show \"CPU 1214C\"
  understudy catalogue add --catalogue ours.csv --vendor Works --model A1 --family A --kind plc --source \"data sheet of 2026\" digital_inputs=8
  understudy catalogue import prices.csv --catalogue ours.csv --update
  understudy catalogue export --output controllers.csv

The default is the built-in catalogue, which is read-only. --catalogue names a file in a format of docs/reference/catalogue.md; `add` and `import`
create it with the contents of the built-in catalogue if it is missing. A missing figure is unknown, never 0.")]
pub(crate) struct Arguments {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    /// List controllers
    #[command(
        after_help = "Example:\n  understudy catalogue list --family S7-1200\n  understudy catalogue list --vendor Z-World --require \"data_memory>=256KiB\""
    )]
    List {
        /// Show only this vendor
        #[arg(long, value_name = "NAME")]
        vendor: Option<String>,
        /// Show only this family
        #[arg(long, value_name = "NAME")]
        family: Option<String>,
        /// Show only controllers with this property, such as data_memory>=256KiB or kind=plc; repeatable
        #[arg(long, value_name = "WHAT")]
        require: Vec<String>,
        #[command(flatten)]
        file: FileArgument,
    },
    /// Show all figures of a controller with their sources, and the unknown figures
    #[command(after_help = "Example:\n  understudy catalogue show \"CPU 1214C\"")]
    Show {
        /// Model, or vendor and model
        #[arg(value_name = "MODEL")]
        model: String,
        #[command(flatten)]
        file: FileArgument,
    },
    /// Add a controller
    #[command(
        after_help = "Example:\n  understudy catalogue add --catalogue ours.csv --vendor Works --model A1 --family A --source \"data sheet of 2026\" digital_inputs=8"
    )]
    Add {
        #[command(flatten)]
        entry: Box<Entry>,
        #[command(flatten)]
        file: WrittenFile,
    },
    /// Remove a controller
    #[command(
        after_help = "Example:\n  understudy catalogue add --catalogue ours.csv --vendor Works --model A1 --family A --source \"data sheet of 2026\" digital_inputs=8\n  understudy catalogue remove \"Works A1\" --catalogue ours.csv"
    )]
    Remove {
        /// Model, or vendor and model
        #[arg(value_name = "MODEL")]
        model: String,
        /// Catalogue file
        #[arg(long, value_name = "FILE")]
        catalogue: PathBuf,
    },
    /// Import the controllers of a file
    #[command(
        after_help = "Example:\n  understudy catalogue import prices.csv --catalogue ours.csv --update"
    )]
    Import {
        /// Input file (formats: docs/reference/catalogue.md)
        #[arg(value_name = "FILE.csv")]
        from: PathBuf,
        /// Update the figures of existing controllers
        #[arg(long)]
        update: bool,
        /// Create a new catalogue without the built-in controllers
        #[arg(long)]
        empty: bool,
        #[command(flatten)]
        file: WrittenFile,
    },
    /// Export all figures with their sources, one line each
    #[command(after_help = "Example:\n  understudy catalogue export --output controllers.csv")]
    Export {
        /// Output file; default: standard output
        #[arg(long, short, value_name = "FILE.csv")]
        output: Option<PathBuf>,
        #[command(flatten)]
        file: FileArgument,
    },
}

#[derive(Debug, Args)]
struct FileArgument {
    /// Catalogue file; default: the built-in catalogue
    #[arg(long, value_name = "FILE")]
    catalogue: Option<PathBuf>,
}

#[derive(Debug, Args)]
struct WrittenFile {
    /// Catalogue file; created if missing
    #[arg(long, value_name = "FILE")]
    catalogue: PathBuf,
}

#[derive(Debug, Args)]
struct Entry {
    /// Vendor
    #[arg(long, value_name = "NAME")]
    vendor: String,
    /// Model
    #[arg(long, value_name = "NAME")]
    model: String,
    /// Family of models with the same program storage; of a module: the family that it extends
    #[arg(long, value_name = "NAME")]
    family: String,
    /// Kind: `plc`, `embedded` or `module`
    #[arg(long, value_name = "KIND", default_value = "plc", value_parser = kind)]
    kind: Kind,
    /// Source of the figures: a URL, a document, a quotation
    #[arg(long, value_name = "TEXT")]
    source: String,
    /// Note on the figures
    #[arg(long, value_name = "TEXT", default_value = "")]
    notes: String,
    /// Figures, such as digital_inputs=8 or comm_ports="1x Ethernet"
    #[arg(value_name = "FIGURE=VALUE")]
    figures: Vec<String>,
    /// Update the figures of an existing controller
    #[arg(long)]
    update: bool,
}

fn kind(text: &str) -> Result<Kind, String> {
    Kind::of(text).ok_or_else(|| format!("expected {}", Kind::WORDS))
}

pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Answer> {
    match &arguments.what {
        What::List { vendor, family, require, file } => {
            list(file, vendor.as_deref(), family.as_deref(), require)
        }
        What::Show { model, file } => show(file, model),
        What::Add { entry, file } => add(file, entry),
        What::Remove { model, catalogue } => remove(catalogue, model),
        What::Import { from, update, empty, file } => import(file, from, *update, *empty),
        What::Export { output, file } => export(file, output.as_deref()),
    }
}

fn refused(errors: &[AdditionError]) -> Answer {
    errors.iter().fold(Answer::done("", Value::Null), |answer, error| {
        answer.and_failure(Status::BadInput, error.code(), message(error))
    })
}

/// Catalogue at `path`, or the built-in one, with its name.
pub(crate) fn read(path: Option<&Path>) -> Result<(Catalogue, String), Answer> {
    let (catalogue, name) = match path {
        Some(path) => {
            let catalogue = read_file(path)?.0;
            let faults = catalogue.module_faults();
            if !faults.is_empty() {
                let faults: Vec<AdditionError> = faults.into_iter().map(Into::into).collect();
                return Err(refused(&faults));
            }
            (catalogue, path.display().to_string())
        }
        None => {
            let catalogue = Catalogue::built_in().map_err(Answer::bad_files)?;
            let name = "the built-in catalogue".to_owned();
            (catalogue, name)
        }
    };
    let about = format!("{name} ({} controllers)", catalogue.len());
    Ok((catalogue, about))
}

/// Entries of a catalogue file, with remarks.
fn read_file(path: &Path) -> Result<(Catalogue, Report), Answer> {
    if begins_as_sqlite(path) {
        let message = format!(
            "{} is a SQLite catalogue of an earlier version; write it as a file with that version: \
             understudy catalogue export --catalogue {0} --output FILE.csv",
            path.display()
        );
        return Err(Answer::failed(Status::BadInput, "U1121", message));
    }
    let loaded = file::read(&path.display().to_string(), &files::text(path)?);
    match loaded.catalogue {
        Some(catalogue) => Ok((catalogue, loaded.report)),
        None => Err(Answer::bad_files(vec![loaded.report])),
    }
}

fn begins_as_sqlite(path: &Path) -> bool {
    let mut first = [0; 16];
    let read = File::open(path).and_then(|mut file| file.read_exact(&mut first));
    read.is_ok() && first == *b"SQLite format 3\0"
}

fn list(
    file: &FileArgument,
    vendor: Option<&str>,
    family: Option<&str>,
    require: &[String],
) -> Result<Answer, Answer> {
    let (catalogue, about) = read(file.catalogue.as_deref())?;
    let mut wrong = Vec::new();
    let mut requirements = Vec::new();
    for text in require {
        match Requirement::parse(text) {
            Ok(requirement) => requirements.push(requirement),
            Err(error) => wrong.push(error),
        }
    }
    let bad = |errors: &[RequirementError]| {
        errors.iter().fold(Answer::done("", Value::Null), |answer, error| {
            answer.and_failure(Status::BadInput, "U1130", message(error))
        })
    };
    if !wrong.is_empty() {
        return Err(bad(&wrong));
    }
    for (name, asked) in [("vendor", vendor), ("family", family)] {
        let text = asked.map(|asked| format!("{name}={asked}"));
        let requirement = text.map(|text| Requirement::parse(&text)).transpose();
        requirements.extend(requirement.map_err(|error| bad(&[error]))?);
    }
    let searched = search(&catalogue, &requirements).map_err(|errors| bad(&errors))?;
    let found = searched.controllers;
    let mut text = format!(
        "{:<44}{:<22}{:>5}{:>5}{:>12}{:>12}{:>8}\n",
        "controller", "family", "in", "out", "program B", "data B", "bit ns"
    );
    for known in &found {
        let number = |quantity| {
            let number = known.number(quantity);
            number.map_or_else(|| "?".to_owned(), |number| number.to_string())
        };
        let _ = writeln!(
            text,
            "{:<44}{:<22}{:>5}{:>5}{:>12}{:>12}{:>8}",
            known.to_string(),
            known.family,
            number(Quantity::DigitalInputs),
            number(Quantity::DigitalOutputs),
            number(Quantity::ProgramMemoryBytes),
            number(Quantity::DataMemoryBytes),
            number(Quantity::BoolInstructionNs),
        );
    }
    let _ = writeln!(text, "{} of {about}; ?: unknown", found.len());
    for lacking in searched.unknown.iter().take(MOST_UNKNOWN) {
        let messages = lacking.messages.join(", ");
        let _ = writeln!(text, "undecided: {}: {messages}", lacking.controller);
    }
    if searched.unknown.len() > MOST_UNKNOWN {
        let more = searched.unknown.len() - MOST_UNKNOWN;
        let _ = writeln!(text, "undecided: {more} more (--json has all)");
    }
    Ok(Answer::done(text, json!({ "controllers": found, "undecided": searched.unknown })))
}

/// Controllers with a missing figure that a list names.
const MOST_UNKNOWN: usize = 5;

fn remove(path: &Path, name: &str) -> Result<Answer, Answer> {
    let (mut catalogue, report) = read_file(path)?;
    let named: Vec<(String, String)> = catalogue
        .named(name)
        .into_iter()
        .map(|found| (found.vendor.clone(), found.model.clone()))
        .collect();
    let [(vendor, model)] = &named[..] else {
        let error = if named.is_empty() {
            AllocationError::NoModel { name: name.to_owned(), like: catalogue.like(name) }
        } else {
            let vendors = named.into_iter().map(|(vendor, _)| vendor).collect();
            AllocationError::Ambiguous { name: name.to_owned(), vendors }
        };
        return Err(Answer::failed(Status::BadInput, error.code(), error));
    };
    let removed = catalogue
        .remove(vendor, model)
        .map_err(|error| Answer::failed(Status::BadInput, "U1144", message(&error)))?;
    files::replace(path, &file::write(&catalogue))?;
    let text = format!("{}: {vendor} {model} removed", path.display());
    let result = json!({ "catalogue": path.display().to_string(), "removed": removed });
    Ok(Answer::done(text, result).with_reports(vec![report]))
}

fn show(file: &FileArgument, name: &str) -> Result<Answer, Answer> {
    let (catalogue, _) = read(file.catalogue.as_deref())?;
    let found = catalogue.named(name);
    if found.is_empty() {
        let like = catalogue.like(name);
        let hint =
            if like.is_empty() { String::new() } else { format!("; similar: {}", like.join(", ")) };
        let message = format!("the catalogue has no `{name}`{hint}");
        return Err(Answer::failed(Status::BadInput, "U1131", message));
    }
    let mut text = String::new();
    let mut result = Vec::new();
    for controller in found {
        push_shown(&mut text, controller);
        let family = catalogue.families.get(&controller.family);
        if let Some(family) = family {
            push_family(&mut text, &controller.family, family);
        }
        let unknown = controller.unknown();
        result.push(json!({ "controller": controller, "unknown": unknown, "family": family }));
    }
    Ok(Answer::done(text, json!({ "controllers": result })))
}

fn push_shown(text: &mut String, controller: &Controller) {
    let _ = writeln!(text, "{controller}, {}, {}", controller.family, controller.kind.name());
    for (quantity, figure) in &controller.numbers {
        let _ = writeln!(text, "  {quantity}: {}", quantity.text(figure.value));
        let _ = writeln!(text, "      {}", figure.source);
    }
    for (statement, figure) in &controller.texts {
        let _ = writeln!(text, "  {statement}: {}", figure.value);
        let _ = writeln!(text, "      {}", figure.source);
    }
    if !controller.notes.is_empty() {
        let _ = writeln!(text, "  note: {}", controller.notes);
    }
    let _ = writeln!(text, "  unknown: {}", controller.unknown().join(", "));
}

fn push_family(text: &mut String, name: &str, family: &Family) {
    let _ = writeln!(text, "family {name}");
    for (quantity, figure) in &family.numbers {
        let _ = writeln!(text, "  {quantity}: {}", figure.value);
        let _ = writeln!(text, "      {}", figure.source);
    }
    if !family.notes.is_empty() {
        let _ = writeln!(text, "  note: {}", family.notes);
    }
}

/// The entry as a file of one line, which is checked like any file.
fn add(file: &WrittenFile, entry: &Entry) -> Result<Answer, Answer> {
    let mut wrong = Answer::done("", Value::Null);
    let mut bad = |message: String| {
        let answer = std::mem::replace(&mut wrong, Answer::done("", Value::Null));
        wrong = answer.and_failure(Status::BadInput, "U1107", message);
    };
    let mut controller = Controller::new(&entry.vendor, &entry.model, &entry.family, entry.kind);
    controller.notes.clone_from(&entry.notes);
    for text in &entry.figures {
        let (name, value) = text.split_once('=').unwrap_or((text, ""));
        let (name, value) = (name.trim(), value.trim());
        let source = entry.source.clone();
        let number = Quantity::ALL.into_iter().find(|known| known.name() == name);
        let words = Statement::ALL.into_iter().find(|known| known.name() == name);
        if let Some(quantity) = number {
            match quantity.parse(value) {
                Some(value) => {
                    controller.numbers.insert(quantity, Figure { value, source });
                }
                None => bad(format!("`{value}` is not a valid {quantity}")),
            }
        } else if let (Some(statement), false) = (words, value.is_empty()) {
            let value = value.to_owned();
            controller.texts.insert(statement, Figure { value, source });
        } else {
            let known: Vec<&str> = Quantity::ALL
                .map(Quantity::name)
                .into_iter()
                .chain(Statement::ALL.map(Statement::name))
                .collect();
            bad(format!("`{text}` is not a figure; known figures: {}", known.join(", ")));
        }
    }
    if !wrong.failures.is_empty() {
        return Err(wrong);
    }
    let mut part = Catalogue::default();
    part.put(controller);
    // Entries are checked like files.
    let loaded = file::read("the entry", &file::write(&part));
    let Some(part) = loaded.catalogue else {
        return Err(Answer::bad_files(vec![loaded.report]));
    };
    put(file, &part, entry.update, false)
}

fn import(file: &WrittenFile, from: &Path, update: bool, empty: bool) -> Result<Answer, Answer> {
    let (part, report) = read_file(from)?;
    let answer = put(file, &part, update, empty)?;
    Ok(answer.with_reports(vec![report]))
}

fn put(file: &WrittenFile, part: &Catalogue, update: bool, empty: bool) -> Result<Answer, Answer> {
    let path = &file.catalogue;
    let mut catalogue = if path.exists() {
        read_file(path)?.0
    } else if empty {
        Catalogue::default()
    } else {
        Catalogue::built_in().map_err(Answer::bad_files)?
    };
    let mode = if update { Mode::Update } else { Mode::New };
    let added = catalogue.add(part, mode);
    let added = added.map_err(|errors| refused(&errors))?;
    files::replace(path, &file::write(&catalogue))?;
    let Added { models, modules, updated, family_figures, changed } = &added;
    let mut text = format!(
        "{}: {models} added, {updated} updated, {family_figures} figures of families\n",
        path.display()
    );
    if *modules > 0 {
        let _ = writeln!(text, "  modules added: {modules}");
    }
    for figure in changed {
        let _ = writeln!(text, "  changed: {figure}");
    }
    let result = json!({
        "catalogue": path.display().to_string(),
        "added": models,
        "modules": modules,
        "updated": updated,
        "family_figures": family_figures,
        "changed": changed,
    });
    Ok(Answer::done(text, result))
}

fn export(file: &FileArgument, output: Option<&Path>) -> Result<Answer, Answer> {
    let (catalogue, _) = read(file.catalogue.as_deref())?;
    let text = file::write(&catalogue);
    match output {
        None => Ok(Answer::done(text.clone(), json!({ "text": text }))),
        Some(path) => {
            files::write(path, &text)?;
            let name = path.display().to_string();
            let said = format!("{} controllers written to {name}", catalogue.len());
            Ok(Answer::done(said, json!({ "file": name })))
        }
    }
}
