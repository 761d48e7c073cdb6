//! `[diagnosis]`: how patient a diagnosing ladder is.

use std::time::Duration;

use understudy_text::Diagnostic;
use understudy_text::tables::Fields;

use super::TIMES;
use crate::diagnosis::Patience;

/// Scans of the defaults.
const STEADY_SCANS: u32 = 1;
const GRACE_SCANS: u32 = 3;
const LATE_SCANS: u32 = 5;
const QUIET: Duration = Duration::from_secs(5);
const REPAIRS: u16 = 3;

/// Of a ladder that is scanned once in a `period`.
pub(super) fn patience(
    mut fields: Fields<'_, '_>,
    period: Duration,
    diagnostics: &mut Vec<Diagnostic>,
) -> Patience {
    let repairs = fields.count("repairs", 1..=1000, diagnostics);
    let mut time = |key, absent| {
        let time = fields.time(key, TIMES, diagnostics);
        time.unwrap_or(absent)
    };
    let patience = Patience {
        steady: time("steady", period * STEADY_SCANS),
        grace: time("grace", period * GRACE_SCANS),
        late: time("late", period * LATE_SCANS),
        quiet: time("quiet", QUIET),
        repairs: repairs.map_or(REPAIRS, |repairs| repairs.value as u16),
    };
    fields.finish(diagnostics);
    patience
}
