//! A program with numbers as a picture: each unit with its variables and its body, in the language that it has.

use understudy_diagram::Picture;
use understudy_structured_text::print;
use understudy_structured_text::syntax::{Body, File, Unit, UnitKind};
use understudy_text::{Diagnostic, has_errors};

use super::{chart, networks};
use crate::format::Format;
use crate::plcopen;
use crate::source::Wanted;
use crate::text::whole;
use crate::typed_text::{Bodies, parsed};

/// The units of the file `name` as SVG, and what was found in the file; nothing where it has errors, or is of a form that has no programs with
/// numbers. Statements that were drawn, or are to be drawn as blocks, are networks as far as these hold them; all others are listed.
pub fn draw_typed(
    name: &str,
    text: &str,
    wanted: Wanted<'_>,
    bodies: Bodies,
) -> (Option<String>, Vec<Diagnostic>) {
    let (Some(file), mut diagnostics) = read(name, text, wanted) else {
        return (None, Vec::new());
    };
    let drawn = match Format::of(name, text) {
        Some(Format::PlcOpen) => plcopen::drawn_units(text),
        _ => Default::default(),
    };
    let mut picture = Picture::new();
    let mut listed = Vec::new();
    let is_wanted = |unit: &&Unit| {
        let is_other = unit.kind == UnitKind::Program;
        !is_other || wanted.program.is_none_or(|name| unit.name.is(name))
    };
    for unit in file.units.iter().filter(is_wanted) {
        let as_blocks = bodies == Bodies::Blocks || drawn.contains(&unit.name.key());
        listed.extend(draw(&mut picture, &file, unit, as_blocks));
    }
    diagnostics.extend(listed);
    (Some(picture.svg(name)), diagnostics)
}

/// The units of the file `name` as Structured Text, and what was found in the file; nothing as for [`draw_typed`].
pub fn listing(name: &str, text: &str, wanted: Wanted<'_>) -> (Option<String>, Vec<Diagnostic>) {
    let (file, diagnostics) = read(name, text, wanted);
    (file.map(|file| print::file(&file)), diagnostics)
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

/// Draws a unit; the finding on a body that is listed in place of a drawing.
fn draw(picture: &mut Picture, file: &File, unit: &Unit, as_blocks: bool) -> Option<Diagnostic> {
    let word = match unit.kind {
        UnitKind::Program => "PROGRAM",
        UnitKind::FunctionBlock => "FUNCTION_BLOCK",
        UnitKind::Function => "FUNCTION",
        UnitKind::Method => "METHOD",
    };
    picture.heading(&format!("{word} {}", unit.name));
    let comments: String = unit
        .comments
        .iter()
        .map(|line| format!("{line}\n"))
        .collect();
    picture.note(&comments);
    picture.note(&print::declarations(&unit.declarations));
    let mut finding = None;
    let mut refused = |reason: String| {
        let message = format!("`{}` is listed and not drawn: it has {reason}", unit.name);
        finding = Some(Diagnostic::warning("U1018", message, unit.name.span()));
    };
    match &unit.body {
        Body::Statements(statements) => match as_blocks.then(|| networks(file, unit, statements)) {
            Some(Ok(networks)) => networks.iter().for_each(|it| picture.network(it)),
            other => {
                if let Some(Err(reason)) = other {
                    refused(reason);
                }
                picture.listing(&print::statements(statements));
            }
        },
        Body::Instructions(list) => picture.listing(&print::instructions(list)),
        Body::Chart(of) => {
            match chart(of) {
                Ok((shown, _)) => picture.chart(&shown),
                Err(reason) => {
                    refused(reason);
                    picture.listing(&print::unit(unit));
                }
            }
            for action in &of.actions {
                picture.title(&format!("ACTION {}", action.name));
                picture.listing(&print::statements(&action.body));
            }
        }
    }
    for method in &unit.methods {
        picture.title(&format!("METHOD {}.{}", unit.name, method.name));
        picture.listing(&print::unit(method));
    }
    finding
}
