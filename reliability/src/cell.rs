//! A whole cell compared with other ways to build it: stations, remote I/Os and networks, each single or redundant.

use std::fmt::Write;

use serde::Serialize;

use crate::chain::Chain;
use crate::error::ReliabilityError;
use crate::options::Options;
use crate::quantity::grouped;
use crate::system::Rule;

/// One way to build the cell.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CellRow {
    /// What is redundant.
    pub name: String,
    /// Controllers and understudies, or the controllers of pairs.
    pub stations: u32,
    /// Remote I/Os, with their twins; nothing where no time of them is given.
    pub remote_ios: Option<u32>,
    /// Networks of all groups, each with a switch; nothing where no time of them is given.
    pub networks: Option<u32>,
    /// All of these.
    pub boxes: u32,
    /// Mean time to the first failure of the cell.
    pub mttf_hours: f64,
}

/// How the programs are executed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stations {
    /// One controller for each program.
    Single,
    /// With understudies for each group.
    Understudies(u32),
    /// Two controllers for each program.
    Pairs,
}

/// The cell of `options`, and six other ways to build it with boxes of the same times. Nothing where the options have neither remote I/Os nor networks.
///
/// # Errors
/// Everything that is wrong with the options, or the first result that cannot be had.
pub fn compare_cells(options: &Options) -> Result<Vec<CellRow>, Vec<ReliabilityError>> {
    if options.remote_ios.is_none() && options.networks.is_none() {
        return Ok(Vec::new());
    }
    let asked = Stations::Understudies(options.spares);
    let mut rows = vec![row("this cell", options, asked)?];
    let one = Stations::Understudies(1);
    let single = |stations, name| row(name, &redundant(options, 1, false), stations);
    let double = |stations, name| row(name, &redundant(options, 2, true), stations);
    rows.push(single(Stations::Single, "nothing redundant")?);
    rows.push(single(Stations::Pairs, "hot-standby pairs, single I/O and network")?);
    rows.push(double(Stations::Pairs, "hot-standby pairs, redundant I/O, two networks")?);
    rows.push(single(one, "one understudy, single I/O and network")?);
    rows.push(row("one understudy, single I/O, two networks", &redundant(options, 2, false), one)?);
    rows.push(double(one, "one understudy, twins, two networks")?);
    Ok(rows)
}

/// The rows for people.
pub fn cells_text(rows: &[CellRow]) -> String {
    let mut text = format!(
        "{:<46} {:>8} {:>11} {:>8} {:>6} {:>14}\n",
        "whole cell", "stations", "remote I/Os", "networks", "boxes", "MTTF in h"
    );
    let count = |count: Option<u32>| count.map_or("-".to_owned(), |count| count.to_string());
    for row in rows {
        let _ = writeln!(
            text,
            "{:<46} {:>8} {:>11} {:>8} {:>6} {:>14}",
            row.name,
            row.stations,
            count(row.remote_ios),
            count(row.networks),
            row.boxes,
            grouped(row.mttf_hours)
        );
    }
    text
}

/// The same cell with this number of networks, and with or without a twin for each remote I/O.
fn redundant(options: &Options, networks: u32, has_twins: bool) -> Options {
    let mut changed = options.clone();
    if let Some(them) = &mut changed.remote_ios {
        them.twins = if has_twins { them.count } else { 0 };
    }
    if let Some(them) = &mut changed.networks {
        them.count = networks;
    }
    changed
}

fn row(
    name: &str,
    options: &Options,
    stations: Stations,
) -> Result<CellRow, Vec<ReliabilityError>> {
    let mut options = options.clone();
    let count = match stations {
        Stations::Single => {
            options.spares = 0;
            options.rule = Rule::AsBuilt;
            options.controllers
        }
        Stations::Pairs => options.controllers.saturating_mul(2),
        Stations::Understudies(each) => {
            options.spares = each;
            options.controllers.saturating_add(each.saturating_mul(options.groups))
        }
    };
    let system = options.system()?;
    let chain: Chain = match stations {
        Stations::Pairs => system.copies_chain(2)?,
        Stations::Single | Stations::Understudies(_) => system.chain()?,
    };
    let networks = options.networks.map(|them| them.count * options.groups);
    Ok(CellRow {
        name: name.to_owned(),
        stations: count,
        remote_ios: options.remote_ios.map(|them| them.boxes()),
        networks,
        boxes: count.saturating_add(options.other_boxes()),
        mttf_hours: chain.mttf().map_err(|error| vec![error])?,
    })
}
