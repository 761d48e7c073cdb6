//! The ladder of a remote I/O that finds failed input channels.

use std::sync::Arc;
use std::time::Duration;

use understudy_remote_io::Diagnosis;
use understudy_text::Diagnostic;

use super::Member;
use super::ladders::Ladders;
use crate::cluster::DiagnosisPlace;
use crate::fields::{MAXIMUM_MISFITS, Placed};

/// Reads `file` and binds it to the signals of `member`.
pub(super) fn read(
    file: &Placed<String>,
    period: Duration,
    member: &Member,
    ladders: &mut Ladders<'_>,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<DiagnosisPlace> {
    let name = format!("{}.diagnosis", member.name);
    let circuit = ladders.circuit(file, &name, period, diagnostics)?;
    let (_, program) = member.code.as_ref()?;
    let (inputs, outputs) = (program.inputs.bit_names(), program.outputs.bit_names());
    match Diagnosis::new(&circuit, &inputs, &outputs) {
        Ok(compiled) => Some(DiagnosisPlace {
            ladder: file.value.clone(),
            circuit,
            compiled: Arc::new(compiled),
        }),
        Err(misfits) => {
            for misfit in misfits.iter().take(MAXIMUM_MISFITS) {
                let message = format!("`{}` does not fit `{}`: {misfit}", file.value, member.name);
                diagnostics.push(Diagnostic::error("U0223", message, file.span.clone()));
            }
            None
        }
    }
}
