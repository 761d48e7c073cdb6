//! The text of a program, from which the same program is read again.

use std::sync::Arc;
use std::time::Duration;

use understudy_interchange::{Rungs, Source, SourceFile, Wanted, read_source};
use understudy_ladder::{LowerError, Program as Ladder};
use understudy_text::Diagnostic;
use understudy_typed::{Program as Typed, Renamed};
use understudy_wire::{ProgramHash, RetainedProgram};

use crate::code::Code;

/// The file of a program, as it was read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SourceText {
    /// Its name, whose ending tells the language.
    pub file: String,
    /// Its text.
    pub text: Arc<str>,
    /// The period of the cluster.
    pub period: Duration,
    /// Paths of the program before it and the ones that they have here, as the cluster file pairs them.
    pub renamed: Vec<Renamed>,
}

/// What a file says.
pub(crate) struct ReadSource {
    pub(crate) program: Option<Arc<Typed>>,
    /// The rungs that it is written in.
    pub(crate) ladder: Option<Ladder>,
    /// Whether it is a library: it has parts of programs, and none of its own.
    pub(crate) is_library: bool,
    pub(crate) diagnostics: Vec<Diagnostic>,
}

impl SourceText {
    /// The text of a file, for one period.
    pub fn of(file: &str, text: &str, period: Duration) -> Self {
        Self { file: file.to_owned(), text: Arc::from(text), period, renamed: Vec::new() }
    }

    pub(crate) fn read(&self) -> ReadSource {
        let wanted = Wanted { period: Some(self.period), program: None };
        let SourceFile { source, rungs, mut diagnostics, .. } =
            read_source(&self.file, &self.text, wanted);
        let ladder = rungs.and_then(Rungs::written);
        let presets = ladder.iter().flat_map(|ladder| ladder.preset_warnings(self.period));
        diagnostics.extend(presets);
        let (program, is_library) = match source {
            Some(Source::Program(program)) => (Some(program), false),
            Some(Source::Library(_)) => (None, true),
            None => (None, false),
        };
        ReadSource { program, ladder, is_library, diagnostics }
    }

    /// What a station keeps of the program of this text.
    pub fn kept(&self, hash: ProgramHash) -> RetainedProgram {
        RetainedProgram {
            hash,
            file: self.file.clone(),
            period: u64::try_from(self.period.as_nanos()).unwrap_or(u64::MAX),
            text: self.text.to_string(),
            inputs: Vec::new(),
            renamed: self.renamed.clone(),
        }
    }
}

impl ReadSource {
    pub(crate) fn code(
        &self,
        source: Arc<SourceText>,
        name: &str,
    ) -> Option<Result<Code, LowerError>> {
        let typed = Arc::clone(self.program.as_ref()?);
        let ladder = self.ladder.clone();
        let named = |ladder| Ladder { name: name.into(), ..ladder };
        Some(Code::of(typed, ladder.map(named), source))
    }
}

/// The program that a member has kept: none where this release reads another one from its text.
pub fn read_kept(kept: &RetainedProgram) -> Option<Code> {
    let source = Arc::new(SourceText {
        file: kept.file.clone(),
        text: Arc::from(kept.text.as_str()),
        period: Duration::from_nanos(kept.period),
        renamed: kept.renamed.clone(),
    });
    let code = source.read().code(Arc::clone(&source), "")?.ok()?;
    (code.hash() == kept.hash).then_some(code)
}
