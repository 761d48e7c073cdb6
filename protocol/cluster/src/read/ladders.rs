//! The ladders that a cluster file names: each is read and parsed once, however many controllers run it.

use std::collections::BTreeMap;
use std::time::Duration;

use understudy_interchange::parse_program;
use understudy_ladder::{Parsed, Program};
use understudy_logic::Circuit;
use understudy_text::{Diagnostic, Report, has_errors};

use crate::fields::Placed;

/// Gives the text of a file by its name, or says why it cannot.
type Open<'a> = &'a mut dyn FnMut(&str) -> Result<String, String>;

pub(crate) struct Ladders<'a> {
    open: Open<'a>,
    /// By file: its place in `read`, or why there is none.
    places: BTreeMap<String, Result<usize, String>>,
    read: Vec<(String, String, Parsed)>,
}

impl<'a> Ladders<'a> {
    pub(crate) fn new(open: Open<'a>) -> Self {
        Self {
            open,
            places: BTreeMap::new(),
            read: Vec::new(),
        }
    }

    /// The program of `file` under the name `name`, and its circuit.
    pub(crate) fn lower(
        &mut self,
        file: &Placed<String>,
        name: &str,
        period: Duration,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<(Program, Circuit)> {
        let place = match self.place(&file.value) {
            Ok(place) => place,
            Err(reason) => {
                let message = format!("cannot read the ladder `{}`: {reason}", file.value);
                diagnostics.push(
                    Diagnostic::error("U0211", message, file.span.clone())
                        .with_help("the name is relative to the cluster file"),
                );
                return None;
            }
        };
        let (_, _, parsed) = &mut self.read[place];
        if has_errors(&parsed.diagnostics) {
            return None;
        }
        // Several controllers may run one ladder.
        for warning in parsed.program.preset_warnings(period) {
            if !parsed.diagnostics.contains(&warning) {
                parsed.diagnostics.push(warning);
            }
        }
        let mut program = parsed.program.clone();
        program.name = name.into();
        match program.lower(period) {
            Ok(circuit) => Some((program, circuit)),
            Err(error) => {
                let message = format!("`{}`: {error}", file.value);
                diagnostics.push(Diagnostic::error("U0212", message, file.span.clone()));
                None
            }
        }
    }

    fn place(&mut self, file: &str) -> Result<usize, String> {
        if let Some(place) = self.places.get(file) {
            return place.clone();
        }
        let place = (self.open)(file).map(|text| {
            let parsed = parse_program(file, &text);
            self.read.push((file.to_owned(), text, parsed));
            self.read.len() - 1
        });
        self.places.insert(file.to_owned(), place.clone());
        place
    }

    pub(crate) fn into_reports(self) -> impl Iterator<Item = Report> {
        self.read.into_iter().map(|(name, text, parsed)| Report {
            name,
            text,
            diagnostics: parsed.diagnostics,
        })
    }
}
