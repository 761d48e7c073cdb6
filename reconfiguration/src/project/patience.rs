//! `[diagnosis]`: how patient a diagnosing ladder is.

use std::time::Duration;

use understudy_diagnostic::Diagnostic;

use super::fields::Fields;
use crate::diagnosis::Patience;

/// Scans of the defaults.
const STEADY_SCANS: u32 = 1;
const GRACE_SCANS: u32 = 3;
const LATE_SCANS: u32 = 5;
const QUIET: Duration = Duration::from_secs(5);
const REPAIRS: usize = 3;

/// Nothing where the file has no such section.
pub(super) fn patience(
    top: &Fields<'_, '_>,
    period: Duration,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<Patience> {
    const KEYS: [&str; 5] = ["steady", "grace", "late", "quiet", "repairs"];
    let (section, span) = top.table("diagnosis", diagnostics)?;
    let fields = Fields::new("[diagnosis]", section, span, &KEYS, diagnostics);
    let repairs = fields.count("repairs", 1..=1000, diagnostics);
    Some(Patience {
        steady: fields.time("steady", period * STEADY_SCANS, diagnostics),
        grace: fields.time("grace", period * GRACE_SCANS, diagnostics),
        late: fields.time("late", period * LATE_SCANS, diagnostics),
        quiet: fields.time("quiet", QUIET, diagnostics),
        repairs: repairs.unwrap_or(REPAIRS) as u16,
    })
}
