//! What a program keeps over a restart.

use serde::Serialize;
use understudy_executable::Executable;
use understudy_typed::Program;

/// Names that a line lists.
const LISTED: usize = 5;

/// The retentive part of a program.
#[derive(Clone, Serialize)]
pub(super) struct Retained {
    /// Retentive variables; of one that is retentive in part, each part that is.
    variables: Vec<String>,
    /// Bits of the state that a warm start keeps, with the count of scans where stations hold it.
    kept_bits: usize,
    /// Bits of the state.
    state_bits: usize,
    /// Bytes that each of its stations writes to its files in a day, at most; a disk writes whole blocks, which is several times as much. Only of the program of a cluster, whose period is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    bytes_a_day: Option<u64>,
}

impl Retained {
    /// Of a program with retentive variables, as stations execute it.
    pub(super) fn of(
        program: &Program,
        executable: impl FnOnce() -> Option<Executable>,
    ) -> Option<Self> {
        if !program.is_retentive() {
            return None;
        }
        let executable = executable()?;
        let kept = executable.retained().into_iter().flatten();
        Some(Self {
            variables: program.retentive_names(),
            kept_bits: kept.map(|word| word.count_ones() as usize).sum(),
            state_bits: executable.state_count(),
            bytes_a_day: None,
        })
    }

    /// With what its stations write in a day.
    pub(super) fn writing(self, bytes_a_day: Option<u64>) -> Self {
        Self { bytes_a_day, ..self }
    }

    pub(super) fn text(&self) -> String {
        let names = self.variables.iter().take(LISTED);
        let names: Vec<&str> = names.map(String::as_str).collect();
        let more = match self.variables.len() - names.len() {
            0 => String::new(),
            more => format!(" and {more} more"),
        };
        let (names, kept) = (names.join(", "), self.kept_bits);
        let written = self.bytes_a_day.map_or_else(String::new, |bytes| {
            format!(", {:.2} GB a day to the files of each station", bytes as f64 / 1e9)
        });
        format!("; retentive: {names}{more}, {kept} of {} state bits{written}", self.state_bits)
    }
}
