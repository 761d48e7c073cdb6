//! The programs that a cluster file names: each is read and parsed once, however many controllers run it.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use understudy_interchange::{Rungs, Source, SourceFile, Wanted, no_program, read_source};
use understudy_ladder::Program as Ladder;
use understudy_logic::Circuit;
use understudy_text::{Diagnostic, Report};

use crate::code::Code;
use crate::fields::Placed;

/// Gives the text of a file by its name, or says why it cannot.
type Open<'a> = &'a mut dyn FnMut(&str) -> Result<String, String>;

/// A file and what it says.
struct File {
    name: String,
    text: String,
    source: Option<Source>,
    /// The rungs that it is written in.
    ladder: Option<Ladder>,
    diagnostics: Vec<Diagnostic>,
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
        let read = &mut self.read[place];
        let Some(Source::Program(typed)) = &read.source else {
            return None;
        };
        let typed = Arc::clone(typed);
        let Some(ladder) = &read.ladder else {
            return Some(Code::of_text(typed, Arc::from(read.text.as_str())));
        };
        // Several controllers may run one ladder.
        for warning in ladder.preset_warnings(period) {
            if !read.diagnostics.contains(&warning) {
                read.diagnostics.push(warning);
            }
        }
        let mut ladder = ladder.clone();
        ladder.name = name.into();
        match Code::of_ladder(typed, ladder) {
            Ok(code) => Some(code),
            Err(error) => {
                let message = format!("`{}`: {error}", file.value);
                diagnostics.push(Diagnostic::error("U0212", message, file.span.clone()));
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
                diagnostics.push(Diagnostic::error("U0212", message, file.span.clone()));
                None
            }
        }
    }

    fn place(&mut self, file: &str, period: Duration) -> Result<usize, String> {
        if let Some(place) = self.places.get(file) {
            return place.clone();
        }
        let place = (self.open)(file).map(|text| {
            let wanted = Wanted { period: Some(period), program: None };
            let SourceFile { source, rungs, mut diagnostics, .. } =
                read_source(file, &text, wanted);
            let ladder = rungs.and_then(Rungs::written);
            if let Some(Source::Library(_)) = source {
                diagnostics.push(no_program());
            }
            self.read.push(File { name: file.to_owned(), text, source, ladder, diagnostics });
            self.read.len() - 1
        });
        self.places.insert(file.to_owned(), place.clone());
        place
    }

    pub(crate) fn into_reports(self) -> impl Iterator<Item = Report> {
        self.read.into_iter().map(|file| Report {
            name: file.name,
            text: file.text,
            diagnostics: file.diagnostics,
        })
    }
}
