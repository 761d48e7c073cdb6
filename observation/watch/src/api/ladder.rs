//! A program as a picture with the power flow of one scan, and its cross-reference.

use std::collections::BTreeMap;
use std::sync::Arc;

use axum::Json;
use axum::extract::rejection::{PathRejection, QueryRejection};
use axum::extract::{Path, Query, State};
use serde::{Deserialize, Serialize};
use understudy_cluster::Controller;
use understudy_ladder::{Program, draw_svg_rungs};
use understudy_view::{ShownLine, ViewError};
use understudy_wire::ProgramId;

use super::Answered;
use super::facts::{at_cycle, known};
use crate::app::App;
use crate::error::Problem;
use crate::model::Known;
use crate::renamed::by_address;
use crate::shown;

/// Rungs on one page, at most.
const RUNGS_ON_A_PAGE: usize = 40;

#[derive(Debug, Deserialize)]
pub(super) struct Wanted {
    cycle: Option<i64>,
    #[serde(default)]
    names: Names,
    /// How a program with numbers is shown: as text or as a drawing.
    #[serde(default)]
    view: View,
    #[serde(default)]
    find: String,
    /// Of the rungs that were found, from 0; the last one where there are fewer.
    #[serde(default)]
    page: usize,
    /// The page with this rung, from 1, in place of `page`.
    rung: Option<usize>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Names {
    #[default]
    Symbols,
    Addresses,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum View {
    #[default]
    Text,
    /// Function blocks and charts.
    Drawing,
}

#[derive(Debug, Serialize)]
pub(super) struct Picture {
    cycle: i64,
    /// Cycle and lineage of the picture, and the share of the program that it shows.
    words: String,
    /// Empty for the text of a program with numbers.
    svg: String,
    /// Nothing for a program with numbers.
    rungs: Option<Rungs>,
    /// The text of a program with numbers, in place of a drawing.
    lines: Option<Vec<ShownLine>>,
}

/// Which rungs a picture shows.
#[derive(Debug, Serialize)]
struct Rungs {
    page: usize,
    pages: usize,
    /// Rungs of the program.
    count: usize,
    found: usize,
    /// Numbers of the first and the last rung on the page.
    shown: Option<(usize, usize)>,
}

/// The page of the found rungs that is wanted.
fn page<'r>(found: &'r [usize], count: usize, wanted: &Wanted) -> (Rungs, &'r [usize]) {
    let pages = found.len().div_ceil(RUNGS_ON_A_PAGE).max(1);
    let of_rung = wanted.rung.map(|rung| {
        let before = found.partition_point(|&place| place + 1 < rung);
        before / RUNGS_ON_A_PAGE
    });
    let page = of_rung.unwrap_or(wanted.page).min(pages - 1);
    let own = found.chunks(RUNGS_ON_A_PAGE).nth(page).unwrap_or_default();
    let rungs = Rungs {
        page,
        pages,
        count,
        found: found.len(),
        shown: own.first().zip(own.last()).map(|(first, last)| (first + 1, last + 1)),
    };
    (rungs, own)
}

pub(super) async fn picture(
    State(app): State<Arc<App>>,
    program: Result<Path<u8>, PathRejection>,
    wanted: Result<Query<Wanted>, QueryRejection>,
) -> Answered<Json<Picture>> {
    let Path(program) = program?;
    let Query(wanted) = wanted?;
    at_cycle(&app, wanted.cycle, |known, cycle| draw(known, ProgramId(program), cycle, &wanted))
        .map(Json)
}

/// With the program that took the sample of a cycle, or that runs.
fn controller_of(known: &Known, program: ProgramId, cycle: Option<i64>) -> Answered<&Controller> {
    known.run.controller_at(program, cycle).ok_or_else(|| {
        let count = known.run.cluster().controllers().len();
        Problem::unknown(format!("the cluster has {count} programs, not program {}", program.0))
    })
}

fn draw(known: &Known, program: ProgramId, cycle: i64, wanted: &Wanted) -> Answered<Picture> {
    let controller = controller_of(known, program, Some(cycle))?;
    let Some(ladder) = controller.ladder() else {
        return Ok(match wanted.view {
            View::Text => text(known, program, cycle, wanted.find.trim()),
            View::Drawing => drawing(known, program, cycle),
        });
    };
    let evaluation = known.run.evaluation(program, cycle);
    let found: Vec<usize> = found(ladder, wanted.find.trim()).collect();
    let (rungs, shown) = page(&found, ladder.rungs.len(), wanted);
    let flow = evaluation.as_ref().ok();
    let svg = match wanted.names {
        Names::Symbols => draw_svg_rungs(ladder, shown, flow),
        Names::Addresses => draw_svg_rungs(&by_address(ladder), shown, flow),
    };
    let mut words = format!("{}, cycle {cycle}", shown::program_name(&known.run, program));
    let step = known.run.history(program).and_then(|steps| steps.at(cycle));
    match (&evaluation, step.and_then(|step| step.sampled.as_ref())) {
        (Ok(_), Some(sampled)) => {
            words += &format!(": as evaluated, lineage {}", sampled.before);
        }
        (Err(error), _) => words += &format!(": without power flow: {}", error.words()),
        (Ok(_), None) => {}
    }
    if rungs.found < rungs.count {
        words += &format!("; {} of {} rungs", rungs.found, rungs.count);
    }
    Ok(Picture { cycle, words, svg: without_style(&svg), rungs: Some(rungs), lines: None })
}

/// A program with numbers as its text, with the values after the scan of a cycle; of a search the lines that have the words.
fn text(known: &Known, program: ProgramId, cycle: i64, find: &str) -> Picture {
    let (mut lines, error) = known.run.text_at(program, cycle).unwrap_or_default();
    let mut words = stamp(known, program, cycle, error);
    let find = find.to_lowercase();
    let count = lines.len();
    lines.retain(|line| line.text.to_lowercase().contains(&find));
    if lines.len() < count {
        words += &format!("; {} of {count} lines", lines.len());
    }
    Picture { cycle, words, svg: String::new(), rungs: None, lines: Some(lines) }
}

/// A program with numbers as function blocks or as a chart, with the values of a scan.
fn drawing(known: &Known, program: ProgramId, cycle: i64) -> Picture {
    let (svg, error) = known.run.drawing_at(program, cycle).unwrap_or_default();
    Picture {
        cycle,
        words: stamp(known, program, cycle, error),
        svg: without_style(&svg),
        rungs: None,
        lines: None,
    }
}

/// Of which scan the values of a program with numbers are.
fn stamp(known: &Known, program: ProgramId, cycle: i64, error: Option<ViewError>) -> String {
    let name = shown::program_name(&known.run, program);
    let step = known.run.history(program).and_then(|steps| steps.at(cycle));
    let of = match (error, step.and_then(|step| step.sampled.as_ref())) {
        (Some(error), _) => format!(": without values: {}", error.words()),
        (None, Some(sampled)) => format!(": as executed, lineage {}", sampled.before),
        (None, None) => String::new(),
    };
    format!("{name}, cycle {cycle}{of}")
}

/// The page has the styles of its own theme and palette.
fn without_style(svg: &str) -> String {
    match (svg.find("<style>"), svg.find("</style>")) {
        (Some(from), Some(to)) if from < to => {
            format!("{}{}", &svg[..from], &svg[to + "</style>".len()..])
        }
        _ => svg.to_owned(),
    }
}

/// Rungs that have to do with a name, an address or a word of their title.
fn found<'p>(program: &'p Program, find: &str) -> impl Iterator<Item = usize> + 'p {
    let find = find.to_lowercase();
    let signals = program.inputs.iter().chain(program.writable());
    let named: Vec<String> = signals
        .filter(|signal| {
            let address = signal.address.as_ref().map(ToString::to_string);
            address.is_some_and(|address| address.to_lowercase().contains(&find))
        })
        .map(|signal| signal.name.to_string())
        .collect();
    let rungs = program.rungs.iter().enumerate();
    rungs
        .filter(move |(_, rung)| {
            let title = rung.title.as_deref().unwrap_or_default().to_lowercase();
            let (read, written) = rung.names();
            let mut names = read.into_iter().chain(written);
            title.contains(&find)
                || names.any(|name| {
                    name.to_lowercase().contains(&find) || named.iter().any(|known| known == name)
                })
        })
        .map(|(place, _)| place)
}

#[derive(Debug, Serialize)]
pub(super) struct CrossReference {
    /// `rung` or `line`: what the numbers are of.
    place: &'static str,
    signals: Vec<Line>,
}

#[derive(Debug, Serialize)]
struct Line {
    name: String,
    address: Option<String>,
    description: Option<String>,
    /// Rungs or lines, counted from 0.
    written: Vec<usize>,
    read: Vec<usize>,
}

pub(super) async fn cross_reference(
    State(app): State<Arc<App>>,
    program: Result<Path<u8>, PathRejection>,
) -> Answered<Json<CrossReference>> {
    let Path(program) = program?;
    let model = app.model();
    let known = known(&model)?;
    let program = ProgramId(program);
    let Some(ladder) = controller_of(known, program, None)?.ladder() else {
        return Ok(Json(uses(known, program)));
    };
    let (mut read, mut written) = (BTreeMap::new(), BTreeMap::new());
    for (place, rung) in ladder.rungs.iter().enumerate() {
        let (reads, writes) = rung.names();
        note(&mut read, reads, place);
        note(&mut written, writes, place);
    }
    let signals = ladder.inputs.iter().chain(ladder.writable());
    let lines = signals.map(|signal| {
        let name = signal.name.to_string();
        Line {
            address: signal.address.as_ref().map(ToString::to_string),
            description: signal.description.clone(),
            written: written.get(&name).cloned().unwrap_or_default(),
            read: read.get(&name).cloned().unwrap_or_default(),
            name,
        }
    });
    Ok(Json(CrossReference { place: "rung", signals: lines.collect() }))
}

/// The variables of a program with numbers, by lines of its text.
fn uses(known: &Known, program: ProgramId) -> CrossReference {
    let uses = known.run.uses(program).unwrap_or_default();
    let places = |lines: Vec<u32>| lines.into_iter().map(|line| line as usize - 1).collect();
    let signals = uses.into_iter().map(|own| Line {
        name: own.name,
        address: own.address,
        description: own.description,
        written: places(own.written),
        read: places(own.read),
    });
    CrossReference { place: "line", signals: signals.collect() }
}

fn note(rungs: &mut BTreeMap<String, Vec<usize>>, names: Vec<&str>, place: usize) {
    for name in names {
        let of_name = rungs.entry(name.to_owned()).or_default();
        if of_name.last() != Some(&place) {
            of_name.push(place);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_found_rung_is_on_one_page() {
        for length in [0, 1, 39, 40, 41, 80, 200] {
            // Every third rung was found.
            let found: Vec<usize> = (0..length).map(|place| place * 3).collect();
            let of = |page, rung| Wanted {
                cycle: None,
                names: Names::Symbols,
                view: View::Text,
                find: String::new(),
                page,
                rung,
            };
            let (first, _) = page(&found, length * 3, &of(0, None));
            let all = (0..first.pages).flat_map(|number| {
                let (rungs, own) = page(&found, length * 3, &of(number, None));
                assert_eq!(rungs.page, number);
                assert!(own.len() <= RUNGS_ON_A_PAGE);
                own.to_vec()
            });
            assert_eq!(all.collect::<Vec<_>>(), found);
            for &place in &found {
                let (_, own) = page(&found, length * 3, &of(0, Some(place + 1)));
                assert!(own.contains(&place), "rung {}", place + 1);
            }
            // One behind the last is the last page.
            let (last, _) = page(&found, length * 3, &of(99, Some(usize::MAX)));
            assert_eq!(last.page, last.pages - 1);
        }
    }
}
