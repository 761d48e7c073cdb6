//! `understudy doctor --fix`: shows and runs the commands that repair a machine, then checks it again.

use std::fmt::Write as _;
use std::io::{self, IsTerminal, Write as _};
use std::process::Command;

use serde::Serialize;
use understudy_bus::doctor::{Finding, Health, Repair, may_repair};

use crate::console::Console;

/// Results of the repairs.
#[derive(Debug, Serialize)]
pub(super) struct Fixed {
    repairs: Vec<Done>,
    /// Findings without a repair command.
    not_repairable: Vec<String>,
    /// Findings after the commands; none if no command was run.
    #[serde(skip)]
    again: Option<Vec<Finding>>,
}

/// A repair command.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
struct Done {
    command: String,
    effect: &'static str,
    outcome: Outcome,
}

/// Result of the command.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(tag = "outcome", rename_all = "kebab-case")]
enum Outcome {
    /// The command succeeded.
    Ran,
    /// The command failed.
    Failed {
        /// Last line of its output, or its exit status.
        reason: String,
    },
    /// The command was not run.
    Shown {
        /// Reason.
        reason: &'static str,
    },
}

/// Permission to run a command.
enum Consent {
    Given,
    Refused(&'static str),
}

/// Command line for this process, or for the user with sudo.
pub(super) fn shown(repair: &Repair) -> String {
    if may_repair() { repair.command.clone() } else { repair.with_sudo() }
}

/// Shows all commands, runs the permitted ones and checks again.
pub(super) fn fix(
    findings: &[Finding],
    look_again: &dyn Fn() -> Vec<Finding>,
    yes: bool,
    console: &mut Console,
) -> Fixed {
    let asks = !console.is_json() && io::stdin().is_terminal() && io::stderr().is_terminal();
    let mut consent = |repair: &Repair| {
        if !may_repair() {
            return Consent::Refused("it requires root");
        }
        match (yes, asks) {
            (true, _) => {
                console.note(&format!("running: {}", repair.command));
                Consent::Given
            }
            (false, true) => asked(repair),
            (false, false) => Consent::Refused(
                "no terminal for the confirmation; --yes runs it without confirmation",
            ),
        }
    };
    let repairs: Vec<Done> = to_do(findings)
        .into_iter()
        .map(|repair| Done {
            command: shown(repair),
            effect: repair.effect,
            outcome: match consent(repair) {
                Consent::Given => run(&repair.command),
                Consent::Refused(reason) => Outcome::Shown { reason },
            },
        })
        .collect();
    let ran = repairs.iter().any(|done| done.outcome == Outcome::Ran);
    Fixed { not_repairable: not_repairable(findings), again: ran.then(look_again), repairs }
}

/// Distinct commands, in the order of the findings.
fn to_do(findings: &[Finding]) -> Vec<&Repair> {
    let mut repairs: Vec<&Repair> = Vec::new();
    for repair in findings.iter().filter_map(|finding| finding.repair.as_ref()) {
        if !repairs.contains(&repair) {
            repairs.push(repair);
        }
    }
    repairs
}

fn not_repairable(findings: &[Finding]) -> Vec<String> {
    let troubles = findings.iter().filter(|finding| finding.health != Health::Good);
    let without = troubles.filter(|finding| finding.repair.is_none());
    without.map(|finding| format!("{}: {}", finding.check, finding.found)).collect()
}

fn asked(repair: &Repair) -> Consent {
    let mut errors = io::stderr();
    // A prompt that cannot be written counts as refused.
    let _ = write!(errors, "{}\n  ({})\nRun it? [y/N] ", repair.command, repair.effect);
    let _ = errors.flush();
    let mut line = String::new();
    let read = io::stdin().read_line(&mut line);
    match (read, line.trim()) {
        (Ok(_), "y" | "Y" | "yes") => Consent::Given,
        _ => Consent::Refused("it was declined"),
    }
}

fn run(command: &str) -> Outcome {
    let output = match Command::new("sh").args(["-c", command]).output() {
        Ok(output) => output,
        Err(error) => {
            return Outcome::Failed { reason: error.to_string() };
        }
    };
    if output.status.success() {
        return Outcome::Ran;
    }
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    let last = said.lines().rfind(|line| !line.trim().is_empty());
    Outcome::Failed {
        reason: last.map_or_else(|| output.status.to_string(), |line| format!("{line:.200}")),
    }
}

impl Fixed {
    /// Current findings: those of the machine are replaced if it was checked again.
    pub(super) fn applied_to(&self, findings: Vec<Finding>) -> Vec<Finding> {
        let Some(again) = &self.again else {
            return findings;
        };
        let of_machine = |finding: &Finding| again.iter().any(|new| new.check == finding.check);
        let others = findings.into_iter().filter(|finding| !of_machine(finding));
        again.iter().cloned().chain(others).collect()
    }

    /// Text on repairs, improvements and remaining findings; `before` are the findings before the repairs.
    pub(super) fn text(&self, before: &[Finding]) -> String {
        let mut text = String::new();
        if self.repairs.is_empty() && self.not_repairable.is_empty() {
            text += "nothing to repair\n";
        }
        for done in &self.repairs {
            let outcome = match &done.outcome {
                Outcome::Ran => format!("done; {}", done.effect),
                Outcome::Failed { reason } => format!("FAILED: {reason}"),
                Outcome::Shown { reason } => format!("not run: {reason}"),
            };
            let _ = writeln!(text, "{}\n{:8} {outcome}", done.command, "");
        }
        for finding in before.iter().filter(|finding| finding.repair.is_some()) {
            if let Some(now) = self.now(finding) {
                let _ = writeln!(text, "{now} {}: {}", finding.check, finding.found);
            }
        }
        for finding in &self.not_repairable {
            let _ = writeln!(text, "no command repairs {finding}");
        }
        text
    }

    /// Whether the finding is repaired; none without a second check.
    fn now(&self, before: &Finding) -> Option<&'static str> {
        let again = self.again.as_ref()?;
        let still = again
            .iter()
            .any(|finding| finding.check == before.check && finding.repair == before.repair);
        Some(if still { "as before:" } else { "repaired:" })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn finding(check: &'static str, command: Option<&str>) -> Finding {
        let repair =
            command.map(|command| Repair { command: command.to_owned(), effect: "at once" });
        Finding { repair, ..Finding::trouble(check, Health::Warning, "slow", "make it fast") }
    }

    #[test]
    fn a_command_says_itself_whether_it_worked() {
        assert_eq!(run("true"), Outcome::Ran);
        let failed = |reason: &str| Outcome::Failed { reason: reason.to_owned() };
        assert_eq!(run("echo first >&2; echo last >&2; exit 3"), failed("last"));
        assert_eq!(run("exit 3"), failed("exit status: 3"));
    }

    #[test]
    fn each_command_is_given_once_and_the_rest_is_named() {
        let findings = [
            finding("clock", Some("a")),
            finding("memory", None),
            finding("sockets", Some("a")),
            Finding::good("ports", "free"),
        ];
        assert_eq!(to_do(&findings).len(), 1);
        assert_eq!(not_repairable(&findings), ["memory: slow"]);
    }

    #[test]
    fn what_is_better_is_what_is_not_found_again() {
        let before = [finding("clock", Some("a")), finding("sockets", Some("b"))];
        let fixed = Fixed {
            repairs: Vec::new(),
            not_repairable: Vec::new(),
            again: Some(vec![Finding::good("clock", "fast"), before[1].clone()]),
        };
        let text = fixed.text(&before);
        assert!(text.contains("repaired: clock"), "{text}");
        assert!(text.contains("as before: sockets"), "{text}");
        let now = fixed.applied_to(before.to_vec());
        let healths: Vec<_> = now.iter().map(|finding| finding.health).collect();
        assert_eq!(healths, [Health::Good, Health::Warning]);
    }
}
