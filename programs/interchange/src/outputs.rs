//! Variables that are meant as outputs of a program and are declared as its memory.

use understudy_structured_text::syntax::{Class, Declaration, File, Name, UnitKind};
use understudy_structured_text::{parse, print};
use understudy_text::Severity;

use crate::apart::{Apart, Copies, read_apart};
use crate::format::Format;
use crate::source::{Source, Wanted};
use crate::typed_text::{Bodies, typed_text_with};
use crate::written::WriteError;

/// Code of the error on a variable that becomes no output.
pub const NO_OUTPUT: &str = "U0639";

/// The address of an output that is nowhere in particular.
const ANYWHERE: &str = "%Q*";

/// Programs of which variables were made outputs.
#[derive(Debug)]
pub struct WithOutputs {
    /// Each in a text of its own.
    pub programs: Vec<Apart>,
    /// Those of the wanted variables that they have.
    pub outputs: Vec<String>,
}

/// Why a program was not written with other outputs.
#[derive(Debug)]
pub enum OutputError {
    /// The program cannot be written.
    Write(WriteError),
    /// A variable cannot be an output: the code and the reason.
    Refused(&'static str, String),
}

/// Reads the programs of the file `name`, which has no errors, with the `wanted` variables as outputs: `NAME`, or `PROGRAM.NAME` of one program
/// among several. Nothing where it has none of them.
///
/// # Errors
/// A program that cannot be written, and a variable of a type that no output has.
pub fn read_with_outputs(
    name: &str,
    text: &str,
    wanted: &[String],
) -> Result<Option<WithOutputs>, OutputError> {
    let to = (Format::StructuredText, Bodies::AsRead);
    let written = typed_text_with(name, text, Wanted::default(), to, None);
    let (Some(written), _) = written.map_err(OutputError::Write)? else {
        return Ok(None);
    };
    let (mut file, _) = parse(&written.text);
    let outputs = wanted.iter().filter(|wanted| make_output(&mut file, wanted));
    let outputs: Vec<String> = outputs.cloned().collect();
    if outputs.is_empty() {
        return Ok(None);
    }
    let (programs, found) = read_apart("outputs.st", &print::file(&file), Copies::Written);
    match found.into_iter().find(|found| found.severity == Severity::Error) {
        Some(error) => {
            let reason = format!("with {} as outputs: {}", outputs.join(", "), error.message);
            Err(OutputError::Refused(error.code, reason))
        }
        None => match outputs.iter().find(|output| !is_output(&programs, output)) {
            Some(output) => {
                let reason = format!("`{output}` is of a type that has no outputs");
                Err(OutputError::Refused(NO_OUTPUT, reason))
            }
            None => Ok(Some(WithOutputs { programs, outputs })),
        },
    }
}

/// Whether a variable, or a part of it, is an output of a program.
fn is_output(programs: &[Apart], wanted: &str) -> bool {
    let (_, name) = wanted.rsplit_once('.').unwrap_or(("", wanted));
    let mut points = programs.iter().flat_map(|apart| match &apart.source {
        Source::Program(typed) => typed.outputs.iter(),
        Source::Library(_) => [].iter(),
    });
    points.any(|point| {
        let whole = point.name.split(['.', '[']).next().unwrap_or_default();
        whole.eq_ignore_ascii_case(name)
    })
}

/// Makes the variable of a program, or a global one, an output; false where there is none of that name.
fn make_output(file: &mut File, wanted: &str) -> bool {
    let (of, name) = match wanted.split_once('.') {
        Some((of, name)) => (Some(of), name),
        None => (None, wanted),
    };
    let programs = file.units.iter_mut().filter(|unit| unit.kind == UnitKind::Program);
    let programs = programs.filter(|unit| of.is_none_or(|of| unit.name.is(of)));
    let is_it = |declared: &&mut Declaration| declared.name.is(name) && !declared.constant;
    let mut is_found = false;
    for declared in programs.flat_map(|unit| &mut unit.declarations).filter(is_it) {
        match (declared.class, &declared.address) {
            (Class::Local | Class::Static, None) => declared.class = Class::Output,
            (Class::Output, _) => {}
            _ => continue,
        }
        is_found = true;
    }
    if is_found {
        return true;
    }
    let mut globals = file.globals.iter_mut().filter(is_it);
    match globals.next() {
        Some(global) if global.address.is_none() => {
            global.address = Some(Name::new(ANYWHERE, global.name.span()));
            true
        }
        _ => false,
    }
}
