//! `understudy resources`: resource requirements of programs.

use std::ffi::OsStr;
use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use serde_json::{Value, json};
use understudy_allocation::{Resources, instructions};
use understudy_ladder::{Program, from_circuit};
use understudy_text::duration::parse_positive;

use crate::answer::Answer;
use crate::deployment::allocate::programs::Programs;

/// Calculate the controller resources that programs require
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy resources examples/press-cell/cluster.toml
  understudy resources examples/press-cell/press.ladder --instructions

For several programs, and for a cluster, the generated understudy is included. Method of calculation: docs/how-to/allocation.md.")]
pub(crate) struct Arguments {
    /// Ladder programs or cluster files
    #[arg(value_name = "PROGRAM", required = true)]
    programs: Vec<PathBuf>,
    /// Print the Instruction List of each program
    #[arg(long)]
    instructions: bool,
    /// Scan period, without a cluster file. Default: that of the files, else 10ms
    #[arg(long, value_name = "TIME", value_parser = parse_positive)]
    period: Option<Duration>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Answer> {
    let programs = Programs::read(&arguments.programs, arguments.period)?;
    let answer = counted(&programs, arguments.instructions);
    let mut next: Vec<&dyn AsRef<OsStr>> = vec![&"allocate"];
    next.extend(arguments.programs.iter().map(|it| it as &dyn AsRef<OsStr>));
    Ok(answer.and_next(&next))
}

fn counted(programs: &Programs, with_instructions: bool) -> Answer {
    let mut counted: Vec<(String, Program)> = Vec::new();
    for group in &programs.groups {
        for member in &group.members {
            counted.push((group.name(&member.name), member.ladder.clone()));
        }
        if let Some(parity) = &group.parity {
            let understudy = from_circuit(parity.circuit());
            counted.push((group.name("understudy"), understudy));
        }
    }
    let mut text = table(&counted);
    let mut result = Vec::new();
    for (name, program) in &counted {
        let found = Resources::of(program);
        let mut value = json!(found);
        value["name"] = json!(name);
        value["elements"] = json!(found.elements());
        if with_instructions {
            let lines = instructions(program).into_iter();
            let lines: Vec<String> = lines.map(|line| line.to_string()).collect();
            text.push_str(&format!("\n{name}\n{}\n", lines.join("\n")));
            value["list"] = json!(lines);
        }
        result.push(value);
    }
    let result = json!({ "programs": Value::Array(result) });
    Answer::done(text, result).with_used(programs.reports.clone())
}

/// Table of counts with one column per program.
fn table(counted: &[(String, Program)]) -> String {
    let resources: Vec<Resources> =
        counted.iter().map(|(_, program)| Resources::of(program)).collect();
    let names = counted.iter().map(|(name, _)| name.as_str());
    let found: Vec<_> = names.zip(Resources::table(&resources)).collect();
    let Some((_, rows)) = found.first() else {
        return String::new();
    };
    let width = rows.iter().map(|(what, _)| what.len()).max().unwrap_or(0);
    let mut text = " ".repeat(width);
    for (name, _) in &found {
        text.push_str(&format!("  {name:>10}"));
    }
    text.push('\n');
    for (place, (what, _)) in rows.iter().enumerate() {
        text.push_str(&format!("{what:<width$}"));
        for (name, rows) in &found {
            let column = name.chars().count().max(10);
            text.push_str(&format!("  {:>column$}", rows[place].1));
        }
        text.push('\n');
    }
    text
}
