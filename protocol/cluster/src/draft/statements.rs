//! A stand-in for a plant in Structured Text, for a program with numbers.

use std::fmt::Write as _;
use std::time::Duration;

use understudy_text::duration;
use understudy_typed::{Declared, Elementary};

use super::signals::Signal;
use super::stub::{Named, Round, Stub};
use crate::read::MARK;

pub(super) fn text(stub: &Stub<'_>, period: Duration) -> String {
    let name = stub.program.name();
    let (well, moving) = stub.channels();
    let bits: Vec<(&str, &str)> = stub
        .outputs
        .iter()
        .zip(&stub.before)
        .filter(|((_, signal), _)| signal.is_bit())
        .map(|((terminal, _), before)| (terminal.as_str(), before.as_str()))
        .collect();
    let mut text = format!(
        "\
// {MARK} a stand-in for the plant of `{name}`, so that the cluster runs before there is a model of the plant. It moves the
// inputs of the program between two values, one after the other, and pays no attention to the outputs.
// To make it real, replace the assignments by what the plant does, such as
//     level := level + inflow * 0.01;
// Real equipment needs no such file: it is named in [remote_io.field] of the cluster file.
PROGRAM {}
",
        stub.unit
    );
    declare(&mut text, "VAR_INPUT", &mut stub.outputs.iter().map(line));
    let counted = "finished : BOOL;  // counted: how often the program has switched an output on";
    let inputs = stub.inputs.iter().map(line);
    let counted = (!bits.is_empty()).then(|| counted.to_owned());
    declare(&mut text, "VAR_OUTPUT", &mut inputs.chain(counted));
    let own = match moving.is_empty() {
        true => Vec::new(),
        false => vec![format!("{} : TON;", stub.pace), format!("{} : INT;", stub.step)],
    };
    let before = bits.iter().map(|(_, before)| format!("{before} : BOOL;"));
    declare(&mut text, "VAR", &mut own.into_iter().chain(before));
    push_moves(&mut text, stub, &moving, period);
    for (terminal, _) in well {
        let _ = writeln!(text, "  {terminal} := FALSE;");
    }
    if !bits.is_empty() {
        let edges = bits.iter().map(|(terminal, before)| format!("({terminal} AND NOT {before})"));
        let edges: Vec<String> = edges.collect();
        let _ = write!(text, "\n  finished := {};\n", edges.join("\n    OR "));
        for (terminal, before) in &bits {
            let _ = writeln!(text, "  {before} := {terminal};");
        }
    }
    text.push_str("END_PROGRAM\n");
    text
}

fn line((terminal, signal): &Named<'_>) -> String {
    let values = signal.declared.values.as_ref().map(|known| {
        let values = known.values.iter().map(|(name, value)| format!("{name} = {value}"));
        format!("{}: {}", signal.declared, values.collect::<Vec<_>>().join(", "))
    });
    let notes: Vec<&str> = signal.note.as_deref().into_iter().chain(values.as_deref()).collect();
    let note = if notes.is_empty() { String::new() } else { format!("  // {}", notes.join("; ")) };
    // The program has a type of its own: the names of its values are not known here.
    let declared = Declared { values: None, ..signal.declared.clone() };
    format!("{terminal} : {declared};{note}")
}

fn declare(text: &mut String, block: &str, lines: &mut dyn Iterator<Item = String>) {
    let lines: Vec<String> = lines.map(|line| format!("    {line}\n")).collect();
    if !lines.is_empty() {
        let _ = write!(text, "  {block}\n{}  END_VAR\n", lines.concat());
    }
}

fn push_moves(text: &mut String, stub: &Stub<'_>, moving: &[&Named<'_>], period: Duration) {
    if moving.is_empty() {
        return;
    }
    let Stub { pace, step, .. } = stub;
    let Round { half, steps, pace: time } = Round::of(moving.len(), period);
    let _ = write!(
        text,
        "
  // The steps of a round.
  {pace}(IN := NOT {pace}.Q, PT := T#{});
  IF {pace}.Q THEN
    {step} := ({step} + 1) MOD {steps};
  END_IF;
  // Each input has its other value for half a round.
",
        duration::text(time)
    );
    for (place, (terminal, signal)) in moving.iter().enumerate() {
        let (from, to) = (place % half, place % half + half);
        let is_on = format!("{step} > {from} AND {step} <= {to}");
        let _ = match values(signal) {
            Some((usual, other)) => writeln!(
                text,
                "  IF {is_on} THEN {terminal} := {other}; ELSE {terminal} := {usual}; END_IF;{}",
                names(signal).unwrap_or_default()
            ),
            None => writeln!(text, "  {terminal} := {is_on};"),
        };
    }
}

/// The names of the other and the usual value of an enumeration, as a comment.
fn names(signal: &Signal) -> Option<String> {
    let (usual, other) = ends(signal);
    let name = |value: i128| signal.declared.value_name(value as u64);
    Some(format!("  // {}, else {}", name(other)?, name(usual)?))
}

/// The whole numbers that are nearest to 0 and to 100 of those that a signal can have, or to -100 where these are one.
fn ends(signal: &Signal) -> (i128, i128) {
    let (usual, above) = (signal.nearest(0), signal.nearest(100));
    (usual, if above == usual { signal.nearest(-100) } else { above })
}

/// The usual and the other value of a number: the nearest to 0 and to 100 that it can have, or to -100 where these are one. Nothing for a BOOL.
fn values(signal: &Signal) -> Option<(String, String)> {
    let of = signal.declared.of;
    let pair = |usual: &str, other: &str| Some((usual.to_owned(), other.to_owned()));
    match of {
        Elementary::Bool => None,
        Elementary::Time => pair("T#0s", "T#10s"),
        Elementary::Date => pair("D#1970-01-01", "D#2000-01-01"),
        Elementary::TimeOfDay => pair("TOD#00:00:00", "TOD#12:00:00"),
        Elementary::DateAndTime => pair("DT#1970-01-01-00:00:00", "DT#2000-01-01-00:00:00"),
        _ if of.is_real() => pair("0.0", "100.0"),
        _ => {
            let (usual, other) = ends(signal);
            let number = |value: i128| format!("{of}#{value}");
            Some((number(usual), number(other)))
        }
    }
}
