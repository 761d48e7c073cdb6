//! A ladder as a typed program, and its circuit.
//!
//! A ladder is what its Structured Text is: [`Program::typed`] is the program of this text under the names of the ladder, and the circuits
//! are derived from it, as from any program. So what a block does is written in one place, for all languages.
//!
//! A circuit is the scan as x(t+1) = f(x(t), u(t)), y(t) = h(x(t), u(t)), equations (1)-(2). What is read before it is written in a scan is x(t) and
//! becomes a register; what is always written first does not. Timers count scans, up to their preset; counters are as wide as their preset.

mod writes;

use std::collections::{BTreeMap, HashMap, HashSet};
use std::ops::RangeInclusive;
use std::time::Duration;

use understudy_bits::{Compared, Disagreement, Exact, Inexact, Layout, Shown};
use understudy_logic::Circuit;
use understudy_structured_text::{Options, lower, parse};
use understudy_text::{Diagnostic, Severity, has_errors};
use understudy_typed::Program as Typed;

pub use self::writes::Write;
use crate::check::check;
use crate::program::{Comparison, Program};
use crate::structured_text::Written;

/// Periods from one scan to the next that make sense.
pub const PERIODS: RangeInclusive<Duration> = Duration::from_nanos(1)..=Duration::from_secs(3600);

/// Why a program cannot be lowered or run.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum LowerError {
    /// The period is outside of [`PERIODS`].
    #[error("a period of {period:?} is not possible; it is more than 0 and at most one hour")]
    Period {
        /// What was asked for.
        period: Duration,
    },
    /// The program has errors; a parsed one has reported them already.
    #[error("the program `{program}` has errors: {}", list(diagnostics))]
    Invalid {
        /// The program.
        program: String,
        /// All errors.
        diagnostics: Vec<Diagnostic>,
    },
    /// The program is too large for a circuit.
    #[error("the program `{program}` has no circuit: {reason}")]
    NoCircuit {
        /// The program.
        program: String,
        /// What is in the way.
        reason: String,
    },
    /// A scan in which the circuit differs from the program.
    #[error(transparent)]
    Differs(Box<Disagreement>),
}

impl LowerError {
    /// The code of a defect of the derivation; `usual` of everything else.
    pub fn code_or(&self, usual: &'static str) -> &'static str {
        match self {
            Self::Differs(_) => Disagreement::CODE,
            Self::Period { .. } | Self::Invalid { .. } | Self::NoCircuit { .. } => usual,
        }
    }
}

fn list(diagnostics: &[Diagnostic]) -> String {
    let messages: Vec<&str> =
        diagnostics.iter().map(|diagnostic| diagnostic.message.as_str()).collect();
    messages.join("; ")
}

pub(crate) fn validate(program: &Program, period: Duration) -> Result<(), LowerError> {
    if !PERIODS.contains(&period) {
        return Err(LowerError::Period { period });
    }
    without_errors(program, check(program))
}

fn without_errors(program: &Program, mut found: Vec<Diagnostic>) -> Result<(), LowerError> {
    if has_errors(&found) {
        found.retain(|found| found.severity == Severity::Error);
        return Err(LowerError::Invalid { program: program.name.to_string(), diagnostics: found });
    }
    Ok(())
}

/// The program of a text that was written of a ladder.
pub(crate) fn of_text(
    program: &Program,
    written: &Written,
    period: Duration,
) -> Result<Typed, LowerError> {
    let (file, mut found) = parse(&written.text);
    let period = i64::try_from(period.as_nanos()).unwrap_or(i64::MAX);
    let options = Options {
        text: &written.text,
        period: Some(period),
        is_circuit: true,
        ..Options::default()
    };
    let lowered = lower(&file, &options);
    found.extend(lowered.diagnostics);
    without_errors(program, found)?;
    lowered.program.ok_or_else(|| LowerError::NoCircuit {
        program: program.name.to_string(),
        reason: "its text has no program".into(),
    })
}

fn exact(typed: &Typed, shown: Shown<'_>) -> Result<Exact, LowerError> {
    let shown = Shown { keeps_all: true, ..shown };
    Exact::new(typed, shown).map_err(|inexact| match inexact {
        Inexact::Differs(found) => LowerError::Differs(found),
        _ => LowerError::NoCircuit { program: typed.name.clone(), reason: inexact.to_string() },
    })
}

/// The circuit of the typed program of a ladder, as [`Program::lower`] gives it, with its layout.
///
/// # Errors
/// A program that is too large.
pub fn circuit(typed: &Typed) -> Result<Exact, LowerError> {
    exact(typed, Shown::default())
}

/// A ladder as stations execute it.
#[derive(Debug, Clone)]
pub struct Executed {
    /// Its circuit, as [`circuit`] gives it: the first registers of a state are those of this one.
    pub circuit: Circuit,
    /// The circuit whose registers are the state. Behind those that scans read it has all signals and the BOOLs that blocks show, as the last scan has
    /// left them: a changed program may read each of them.
    pub kept: Exact,
}

impl Executed {
    /// Of a ladder whose typed program is `typed`.
    ///
    /// # Errors
    /// A program that is too large.
    pub fn new(typed: &Typed, ladder: &Program) -> Result<Self, LowerError> {
        let variables = ladder.shown();
        let shown = exact(typed, Shown { variables: &variables, ..Shown::default() })?;
        Ok(Self { circuit: shown.of_points(), kept: shown.keeping_shown(typed) })
    }
}

impl Program {
    /// The memory bits, and the output pins of the blocks that are BOOLs, such as `pause.Q`.
    fn shown(&self) -> Vec<String> {
        let blocks = self.blocks();
        let pins = blocks.iter().flat_map(|block| {
            let pins = block.kind.outputs().iter();
            pins.map(|pin| format!("{}.{pin}", block.name))
        });
        self.memory.iter().map(|signal| signal.name.to_string()).chain(pins).collect()
    }

    /// The typed program that does what the scan of this program does, one scan a step, with `period` from one to the next. Its points and
    /// variables have the names of the ladder; what sees the edges of `a` is named `a.rising` or `a.falling`, and what sees those of
    /// the power of a coil `y` is named `y.power.rising` or `y.power.falling`.
    ///
    /// # Errors
    /// A period out of [`PERIODS`], or a program with errors. A preset that is not a multiple of the period is rounded up; see
    /// [`Program::preset_warnings`].
    pub fn typed(&self, period: Duration) -> Result<Typed, LowerError> {
        validate(self, period)?;
        self.typed_without_check(period)
    }

    fn typed_without_check(&self, period: Duration) -> Result<Typed, LowerError> {
        let written = Written::new(self, period, false);
        let mut typed = of_text(self, &written, period)?;
        let names: HashMap<String, String> =
            written.names.into_iter().chain(written.edges).collect();
        typed.rename(&names);
        typed.inputs.put_first(self.inputs.iter().map(|signal| signal.name.as_str()));
        typed.outputs.put_first(self.outputs.iter().map(|signal| signal.name.as_str()));
        self.name.as_str().clone_into(&mut typed.name);
        let signals = self.inputs.iter().chain(self.writable());
        let about: HashMap<&str, Option<&String>> =
            signals.map(|signal| (signal.name.as_str(), signal.description.as_ref())).collect();
        // What holds an expression between two statements was declared by no person.
        let own: HashSet<&str> = names.values().map(String::as_str).collect();
        let (known, held): (Vec<_>, Vec<_>) = std::mem::take(&mut typed.variables)
            .into_iter()
            .partition(|variable| own.contains(variable.name.as_str()));
        typed.hidden.extend(held);
        typed.variables = known;
        for variable in &mut typed.variables {
            variable.description = about.get(variable.name.as_str()).copied().flatten().cloned();
        }
        Ok(typed)
    }

    /// The circuit that does what the scan of this program does, one scan a step, with `period` from one to the next.
    ///
    /// Inputs and outputs are in the order of their declaration; y(t) is what the outputs are after the scan.
    ///
    /// # Errors
    /// Those of [`Program::typed`], and a program that is too large.
    pub fn lower(&self, period: Duration) -> Result<Circuit, LowerError> {
        validate(self, period)?;
        Ok(self.exact(period, Shown::default())?.circuit)
    }

    /// [`Self::lower`], with every memory bit and every output pin of a block (`pause.Q`) as an output behind those of the program, each
    /// as it is after the scan.
    ///
    /// # Errors
    /// As [`Self::lower`].
    pub fn lower_observed(&self, period: Duration) -> Result<Circuit, LowerError> {
        self.lower_showing(period, &BTreeMap::new(), false)
    }

    /// [`Self::lower_observed`], with comparisons of counters of the program as further outputs, each under its name and as it is after the scan. A
    /// program with retentive parts is restarted warm in any scans: where [`POWER_RETURNS`](understudy_bits::POWER_RETURNS), the last input, is TRUE.
    ///
    /// # Errors
    /// As [`Self::lower`].
    pub fn lower_comparing(
        &self,
        period: Duration,
        compared: &BTreeMap<String, Comparison>,
    ) -> Result<Circuit, LowerError> {
        self.lower_showing(period, compared, true)
    }

    fn lower_showing(
        &self,
        period: Duration,
        compared: &BTreeMap<String, Comparison>,
        restarts: bool,
    ) -> Result<Circuit, LowerError> {
        validate(self, period)?;
        let variables = self.shown();
        let compared = compared.iter().map(|(name, comparison)| Compared {
            name: name.clone(),
            number: format!("{}.CV", comparison.counter),
            comparison: comparison.relation,
            stored: comparison.value.into(),
        });
        let compared: Vec<Compared> = compared.collect();
        let shown =
            Shown { variables: &variables, compared: &compared, restarts, ..Shown::default() };
        Ok(self.exact(period, shown)?.circuit)
    }

    /// What the registers of [`Self::lower`] are in the state of [`Self::typed`].
    ///
    /// # Errors
    /// As [`Self::lower`].
    pub fn layout(&self, period: Duration) -> Result<Layout, LowerError> {
        validate(self, period)?;
        Ok(self.exact(period, Shown::default())?.layout)
    }

    fn exact(&self, period: Duration, shown: Shown<'_>) -> Result<Exact, LowerError> {
        exact(&self.typed_without_check(period)?, shown)
    }

    /// A warning for each timer whose preset is not a multiple of `period`.
    pub fn preset_warnings(&self, period: Duration) -> Vec<Diagnostic> {
        if !PERIODS.contains(&period) {
            return Vec::new();
        }
        let blocks = self.blocks();
        let warnings = blocks.iter().filter_map(|block| {
            let preset = block.kind.preset_time()?;
            if preset.as_nanos() % period.as_nanos() == 0 {
                return None;
            }
            let scans = preset.as_nanos().div_ceil(period.as_nanos()).max(1);
            let rounded = period.saturating_mul(u32::try_from(scans).unwrap_or(u32::MAX));
            let message = format!(
                "the preset {preset:?} of `{}` is not a multiple of the period {period:?}; it lasts {scans} scans, {rounded:?}",
                block.name
            );
            let warning = Diagnostic::warning("U0155", message, block.name.span());
            Some(warning.with_help("choose a multiple of the period"))
        });
        warnings.collect()
    }
}
