//! What came of the faults of one kind, and how it is shown.

use std::fmt::Write as _;

use serde::Serialize;
use understudy::{Answer, Status};

/// Result of the faults of one kind.
#[derive(Debug, Serialize)]
pub(super) struct Row {
    pub(super) fault: &'static str,
    pub(super) count: u32,
    pub(super) directory: String,
    /// Wrong outputs, and what else must not happen.
    pub(super) wrong: u64,
    /// What it was.
    pub(super) violations: Vec<String>,
    /// Deadlines with the last true output.
    pub(super) held: u64,
    /// Deadlines with the fail-safe output.
    pub(super) fail_safe: u64,
    /// Held and fail-safe deadlines during host stalls.
    pub(super) by_stall: u64,
    /// Writes that the devices received.
    pub(super) writes: u64,
    /// Connections that have written.
    pub(super) writers: u64,
    /// Writes to a device by a connection after a later one had written.
    pub(super) by_two: u64,
    /// Writes of outputs that no author has driven lately.
    pub(super) unproved: u64,
    /// The same around the end of a process, whose last records are lost.
    pub(super) unrecorded: u64,
    /// Reports that the input modules of a program differ, which they do not.
    pub(super) input_alarms: u64,
    /// Questions to the operator, who answers each after a time: the outputs are held and then fail-safe meanwhile.
    pub(super) questions: u64,
    /// Questions of programs that were not executed again.
    pub(super) unanswered: u64,
    /// Longest time without a write to the devices of a program, in periods.
    pub(super) longest_gap_cycles: f64,
    /// Longest time that a device took to answer, in periods: a remote I/O gives up one that does not answer within its `timeout`.
    pub(super) slowest_answer_cycles: f64,
}

/// What came of all rows; failed where something happened that must not.
pub(super) fn answer(rows: &[Row]) -> Answer {
    let mut text = format!(
        "{:15} {:>6} {:>6} {:>6} {:>9} {:>8} {:>8} {:>8} {:>12} {:>9} {:>11} {:>12} {:>9} {:>10} {:>12} {:>15}\n",
        "fault",
        "count",
        "wrong",
        "held",
        "fail-safe",
        "by stall",
        "writes",
        "writers",
        "two writers",
        "unproved",
        "unrecorded",
        "input alarms",
        "questions",
        "unanswered",
        "longest gap",
        "slowest answer"
    );
    for row in rows {
        let _ = writeln!(
            text,
            "{:15} {:>6} {:>6} {:>6} {:>9} {:>8} {:>8} {:>8} {:>12} {:>9} {:>11} {:>12} {:>9} {:>10} {:>12.1} {:>15.1}",
            row.fault,
            row.count,
            row.wrong,
            row.held,
            row.fail_safe,
            row.by_stall,
            row.writes,
            row.writers,
            row.by_two,
            row.unproved,
            row.unrecorded,
            row.input_alarms,
            row.questions,
            row.unanswered,
            row.longest_gap_cycles,
            row.slowest_answer_cycles
        );
        for violation in &row.violations {
            let _ = writeln!(text, "    {violation}");
        }
    }
    text.push_str("held and fail-safe are deadlines of all remote I/Os; unproved are writes of outputs that no author has driven lately, unrecorded those around a kill;\nan operator answers each question after 30 periods, or after --answer-after; unanswered are programs that were not executed again;\nthe longest gap is that between two writes to the devices of a program, in periods; the slowest answer is that of a device, which a remote I/O gives up after 100 ms\n");
    let is_right = |row: &Row| {
        (row.wrong, row.by_two, row.unproved, row.input_alarms, row.unanswered) == (0, 0, 0, 0, 0)
    };
    let passed = rows.iter().all(is_right);
    let status = if passed { Status::Done } else { Status::Failed };
    Answer::done(text, rows).with_status(status)
}
