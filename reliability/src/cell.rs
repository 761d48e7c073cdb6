//! A whole cell compared with other ways to build it: stations, remote I/Os, field devices and networks, each single or redundant.

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
    /// Field devices, with those of twins; nothing where no time of them is given.
    pub field_devices: Option<u32>,
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

/// Which parts of the inputs and outputs are redundant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Field {
    /// Nothing.
    Single,
    /// Remote I/Os, each two at one field device.
    Twins,
    /// Remote I/Os, each with a field device of its own.
    Modules,
}

/// The cell of `options`, and other ways to build it with boxes of the same times. Nothing where the options have times of stations only.
///
/// # Errors
/// Everything that is wrong with the options, or the first result that cannot be had.
pub fn compare_cells(options: &Options) -> Result<Vec<CellRow>, Vec<ReliabilityError>> {
    if !options.is_whole_cell() {
        return Ok(Vec::new());
    }
    let asked = Stations::Understudies(options.spares);
    let one = Stations::Understudies(1);
    let mut built = vec![
        ("nothing redundant", 1, Field::Single, Stations::Single),
        ("hot-standby pairs, single I/O and network", 1, Field::Single, Stations::Pairs),
        ("hot-standby pairs, redundant I/O, two networks", 2, Field::Modules, Stations::Pairs),
        ("one understudy, single I/O and network", 1, Field::Single, one),
        ("one understudy, single I/O, two networks", 2, Field::Single, one),
        ("one understudy, twins, two networks", 2, Field::Twins, one),
    ];
    if options.field_devices.is_some() {
        built.push(("one understudy, parallel twins, two networks", 2, Field::Modules, one));
    }
    let mut rows = vec![row("this cell", options, asked)?];
    for (name, networks, field, stations) in built {
        rows.push(row(name, &redundant(options, networks, field), stations)?);
    }
    Ok(rows)
}

/// Parts of a kind of which each one stops the cell.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct SinglePoint {
    /// Name of the part.
    pub part: String,
    /// Number of parts.
    pub count: u32,
}

/// Parts of the model of which each one stops the cell with its first failure.
pub fn single_points(options: &Options) -> Vec<SinglePoint> {
    let stations = (options.spares == 0).then_some(("controller", options.controllers));
    let remote_ios =
        options.remote_ios.map(|them| ("remote I/O", them.count.saturating_sub(them.twins)));
    let devices = options
        .field_devices
        .map(|them| ("field device", them.count.saturating_sub(them.redundant)));
    let networks = options.networks.filter(|them| them.count < 2);
    let networks = networks.map(|_| ("network", options.groups));
    let shared = options.shared.iter().filter(|part| part.pair.is_none());
    let shared = shared.map(|part| (part.name.as_str(), part.count));
    let all = [stations, remote_ios, devices, networks].into_iter().flatten().chain(shared);
    let single = all.filter(|(_, count)| *count > 0);
    single.map(|(part, count)| SinglePoint { part: part.to_owned(), count }).collect()
}

/// Parts of the cell that the model leaves out, whatever their number is.
pub fn left_out(options: &Options) -> Vec<&'static str> {
    let of_options = [
        ("remote I/Os", options.remote_ios.is_none()),
        ("field devices", options.field_devices.is_none()),
        ("networks", options.networks.is_none()),
    ];
    let of_options = of_options.into_iter().filter(|(_, is_left_out)| *is_left_out);
    of_options.map(|(part, _)| part).chain(["sensors", "actuators"]).collect()
}

/// What is single, and what is not counted, for people.
pub(crate) fn single_points_text(points: &[SinglePoint], left_out: &[&str]) -> String {
    let plural = |point: &SinglePoint| {
        let ends = if point.count == 1 { "" } else { "s" };
        format!("{} {}{ends}", point.count, point.part)
    };
    let single = match points {
        [] => "none of the model".to_owned(),
        points => points.iter().map(plural).collect::<Vec<_>>().join(", "),
    };
    format!(
        "single points of failure of this cell: {single}\nnot in the model: {}\n",
        left_out.join(", ")
    )
}

/// The rows for people.
pub fn cells_text(rows: &[CellRow]) -> String {
    let has_devices = rows.iter().any(|row| row.field_devices.is_some());
    let count = |count: Option<u32>| count.map_or("-".to_owned(), |count| count.to_string());
    let devices = |shown: String| if has_devices { format!(" {shown:>7}") } else { String::new() };
    let mut text = format!(
        "{:<46} {:>8} {:>11}{} {:>8} {:>6} {:>14}\n",
        "whole cell",
        "stations",
        "remote I/Os",
        devices("devices".to_owned()),
        "networks",
        "boxes",
        "MTTF in h"
    );
    for row in rows {
        let _ = writeln!(
            text,
            "{:<46} {:>8} {:>11}{} {:>8} {:>6} {:>14}",
            row.name,
            row.stations,
            count(row.remote_ios),
            devices(count(row.field_devices)),
            count(row.networks),
            row.boxes,
            grouped(row.mttf_hours)
        );
    }
    text
}

/// The same cell with this number of networks, and with this redundancy of its inputs and outputs.
fn redundant(options: &Options, networks: u32, field: Field) -> Options {
    let mut changed = options.clone();
    if let Some(them) = &mut changed.remote_ios {
        them.twins = if field >= Field::Twins { them.count } else { 0 };
    }
    if let Some(them) = &mut changed.field_devices {
        them.redundant = if field == Field::Modules { them.count } else { 0 };
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
        field_devices: options.field_devices.map(|them| them.boxes()),
        networks,
        boxes: count.saturating_add(options.other_boxes()),
        mttf_hours: chain.mttf().map_err(|error| vec![error])?,
    })
}
