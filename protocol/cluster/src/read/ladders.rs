//! The programs that a cluster file names: each is read and parsed once, however many controllers run it.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use understudy_interchange::no_program;
use understudy_logic::Circuit;
use understudy_text::{Diagnostic, Report};

use crate::code::Code;
use crate::fields::Placed;
use crate::source_text::{ReadSource, SourceText};

/// Gives the text of a file by its name, or says why it cannot.
type Open<'a> = &'a mut dyn FnMut(&str) -> Result<String, String>;

/// A file and what it says.
struct File {
    source: Arc<SourceText>,
    read: ReadSource,
}

pub(crate) struct Ladders<'a> {
    open: Open<'a>,
    /// By file: its place in `read`, or why there is none.
    places: BTreeMap<String, Result<usize, String>>,
    read: Vec<File>,
}

impl<'a> Ladders<'a> {
    pub(crate) fn new(open: Open<'a>) -> Self {
        Self { open, places: BTreeMap::new(), read: Vec::new() }
    }

    /// The program of `file` under the name `name`.
    pub(crate) fn code(
        &mut self,
        file: &Placed<String>,
        name: &str,
        period: Duration,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<Code> {
        let place = match self.place(&file.value, period) {
            Ok(place) => place,
            Err(reason) => {
                let message = format!("cannot read the program `{}`: {reason}", file.value);
                diagnostics.push(
                    Diagnostic::error("U0211", message, file.span.clone())
                        .with_help("the name is relative to the cluster file"),
                );
                return None;
            }
        };
        let File { source, read } = &mut self.read[place];
        let code = read.code(Arc::clone(source), name)?;
        match code {
            Ok(code) => Some(code),
            Err(error) => {
                let message = format!("`{}`: {error}", file.value);
                diagnostics.push(Diagnostic::error(
                    error.code_or("U0212"),
                    message,
                    file.span.clone(),
                ));
                None
            }
        }
    }

    /// As [`Self::code`], where a circuit is wanted.
    pub(crate) fn circuit(
        &mut self,
        file: &Placed<String>,
        name: &str,
        period: Duration,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<Circuit> {
        let code = self.code(file, name, period, diagnostics)?;
        match code.exact_circuit() {
            Ok(circuit) => Some(circuit.into_owned().named(name)),
            Err(inexact) => {
                let message = format!("`{}` has no circuit: {inexact}", file.value);
                let code = inexact.code_or("U0212");
                diagnostics.push(Diagnostic::error(code, message, file.span.clone()));
                None
            }
        }
    }

    fn place(&mut self, file: &str, period: Duration) -> Result<usize, String> {
        if let Some(place) = self.places.get(file) {
            return place.clone();
        }
        let place = (self.open)(file).map(|text| {
            let source = SourceText::of(file, &text, period);
            let mut read = source.read();
            if read.is_library {
                read.diagnostics.push(no_program());
            }
            self.read.push(File { source: Arc::new(source), read });
            self.read.len() - 1
        });
        self.places.insert(file.to_owned(), place.clone());
        place
    }

    pub(crate) fn into_reports(self) -> impl Iterator<Item = Report> {
        self.read.into_iter().map(|file| Report {
            name: file.source.file.clone(),
            text: file.source.text.to_string(),
            diagnostics: file.read.diagnostics,
        })
    }
}
