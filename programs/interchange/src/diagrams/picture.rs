//! A program with numbers as pictures: each unit with its variables and its body, in the language that it has.

use understudy_diagram::Picture;
use understudy_diagram::blocks::Network;
use understudy_diagram::chart::Chart;
use understudy_structured_text::print;
use understudy_structured_text::syntax::{Body, File, Statement, Unit, UnitKind};
use understudy_text::{Diagnostic, has_errors};

use super::{Style, Widths, chart, networks};
use crate::format::Format;
use crate::plcopen;
use crate::source::Wanted;
use crate::text::whole;
use crate::typed_text::{Bodies, parsed, with_written_names};

/// A unit as it is drawn.
#[derive(Debug, Clone)]
pub struct DrawnUnit {
    /// Its name.
    pub name: String,
    /// Whether it is a PROGRAM.
    pub is_program: bool,
    /// What it is, and its name.
    pub heading: String,
    /// Comments and declarations.
    pub notes: String,
    /// Its body.
    pub body: DrawnBody,
    /// Headings and texts of its actions and methods.
    pub parts: Vec<(String, String)>,
}

/// A body as it is drawn.
#[derive(Debug, Clone)]
pub enum DrawnBody {
    /// Function blocks, or a ladder.
    Networks(Vec<Network>),
    /// A sequential function chart.
    Chart(Chart),
    /// Text, and why it is not drawn where it was to be, in words.
    Text(String, Option<String>),
}

impl DrawnUnit {
    /// Paints the body.
    pub fn paint_body(&self, picture: &mut Picture) {
        match &self.body {
            DrawnBody::Networks(networks) => networks.iter().for_each(|it| picture.network(it)),
            DrawnBody::Chart(chart) => picture.chart(chart),
            DrawnBody::Text(text, _) => picture.listing(text),
        }
    }

    fn paint(&self, picture: &mut Picture) {
        picture.heading(&self.heading);
        picture.note(&self.notes);
        self.paint_body(picture);
        for (heading, text) in &self.parts {
            picture.title(heading);
            picture.listing(text);
        }
    }
}

/// The units of the file `name` as they are drawn; nothing for a form that has no programs with numbers. Statements that were drawn, or are to be
/// drawn, are networks as far as these hold them.
pub fn drawn_units(name: &str, text: &str, bodies: Bodies) -> Option<Vec<DrawnUnit>> {
    let (file, _) = parsed(name, text)?;
    Some(units(name, text, &file, bodies))
}

/// The units of the file `name` as SVG, and what was found in the file; nothing where it has errors, or for a form that has no programs with numbers.
/// What is not drawn is listed.
pub fn draw_typed(
    name: &str,
    text: &str,
    wanted: Wanted<'_>,
    bodies: Bodies,
) -> (Option<String>, Vec<Diagnostic>) {
    let (file, mut diagnostics) = read(name, text, wanted);
    let Some(file) = file else {
        return (None, diagnostics);
    };
    let mut picture = Picture::new();
    let is_wanted = |unit: &DrawnUnit| {
        let wanted = wanted.program;
        !unit.is_program || wanted.is_none_or(|name| unit.name.eq_ignore_ascii_case(name))
    };
    for unit in units(name, text, &file, bodies).iter().filter(|it| is_wanted(it)) {
        unit.paint(&mut picture);
        if let DrawnBody::Text(_, Some(reason)) = &unit.body {
            let message = format!("`{}` is listed and not drawn: it has {reason}", unit.name);
            diagnostics.push(Diagnostic::warning("U1018", message, 0..0));
        }
    }
    (Some(picture.svg(name)), diagnostics)
}

/// The units of the file `name` as Structured Text that can be read again, and what was found in the file; nothing as for [`draw_typed`].
pub fn listing(name: &str, text: &str, wanted: Wanted<'_>) -> (Option<String>, Vec<Diagnostic>) {
    let (file, diagnostics) = read(name, text, wanted);
    (file.map(|file| with_written_names(&file, print::file(&file))), diagnostics)
}

/// A file of a program with numbers without errors, and what was found in it.
fn read(name: &str, text: &str, wanted: Wanted<'_>) -> (Option<File>, Vec<Diagnostic>) {
    let Some((file, found)) = parsed(name, text) else {
        return (None, Vec::new());
    };
    let read = whole(text, (file.clone(), found), wanted.program, wanted.period);
    let is_right = !has_errors(&read.diagnostics);
    (is_right.then_some(file), read.diagnostics)
}

fn units(name: &str, text: &str, file: &File, bodies: Bodies) -> Vec<DrawnUnit> {
    let drawn = match Format::of(name, text) {
        Some(Format::PlcOpen) => plcopen::drawn_units(text),
        _ => Default::default(),
    };
    let units = file.units.iter();
    let units = units.map(|unit| {
        let style = bodies.style(drawn.get(&unit.name.key()).copied());
        drawn_unit(file, unit, style)
    });
    units.collect()
}

fn drawn_unit(file: &File, unit: &Unit, style: Option<Style>) -> DrawnUnit {
    let word = match unit.kind {
        UnitKind::Program => "PROGRAM",
        UnitKind::FunctionBlock => "FUNCTION_BLOCK",
        UnitKind::Function => "FUNCTION",
        UnitKind::Method => "METHOD",
    };
    let mut notes: String = unit.comments.iter().map(|line| format!("{line}\n")).collect();
    notes += &print::declarations(&unit.declarations);
    let mut parts = Vec::new();
    let body = match &unit.body {
        Body::Statements(list) => statements(file, unit, list, style),
        Body::Instructions(list) => DrawnBody::Text(print::instructions(list), None),
        Body::Chart(of) => {
            let actions = of.actions.iter();
            let action = |action: &understudy_structured_text::syntax::Action| {
                (format!("ACTION {}", action.name), print::statements(&action.body))
            };
            parts.extend(actions.map(action));
            match chart(of) {
                Ok((shown, _)) => DrawnBody::Chart(shown),
                Err(reason) => DrawnBody::Text(print::unit(unit), Some(reason)),
            }
        }
    };
    let methods = unit.methods.iter();
    let methods = methods.map(|method| {
        let heading = format!("METHOD {}.{}", unit.name, method.name);
        (heading, print::unit(method))
    });
    parts.extend(methods);
    DrawnUnit {
        name: unit.name.to_string(),
        is_program: unit.kind == UnitKind::Program,
        heading: format!("{word} {}", unit.name),
        notes,
        body,
        parts,
    }
}

fn statements(file: &File, unit: &Unit, list: &[Statement], style: Option<Style>) -> DrawnBody {
    match style.map(|style| networks(file, unit, list, style, Widths::Shown)) {
        Some(Ok(networks)) => DrawnBody::Networks(networks),
        Some(Err(reason)) => DrawnBody::Text(print::statements(list), Some(reason)),
        None => DrawnBody::Text(print::statements(list), None),
    }
}
