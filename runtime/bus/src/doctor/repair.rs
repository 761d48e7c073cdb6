//! Commands that repair what was found on a machine. They are composed here, from what was found alone; the caller shows and runs them.

use std::path::Path;

use nix::unistd::geteuid;
use serde::Serialize;
use understudy_text::shell;

/// A command of a shell that repairs one finding. It needs the rights of root.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Repair {
    /// As root gives it.
    pub command: String,
    /// When it takes effect, and for how long.
    pub effect: &'static str,
}

/// Whether this process may run repairs.
pub fn may_repair() -> bool {
    geteuid().is_root()
}

const UNTIL_RESTART: &str = "takes effect at once, until the machine restarts";
const NEXT_LOGIN: &str = "takes effect at the next login";

impl Repair {
    /// As a user gives it who may become root.
    pub fn with_sudo(&self) -> String {
        let simple = |letter: char| letter.is_ascii_alphanumeric() || " +-_./=,:".contains(letter);
        if self.command.chars().all(simple) {
            format!("sudo {}", self.command)
        } else {
            format!("sudo sh -c {}", shell::quoted(&self.command))
        }
    }

    /// Selects a clock that is fast to read, where the kernel has one.
    pub(super) fn clock_source(available: &str, file: &str) -> Option<Self> {
        let fast = available.split_whitespace().find(|name| *name == "tsc")?;
        Some(Self { command: format!("echo {fast} > {file}"), effect: UNTIL_RESTART })
    }

    /// Lets the program run in real time, whoever starts it.
    pub(super) fn real_time(program: &Path) -> Self {
        let program = program.display().to_string();
        Self {
            command: format!("setcap cap_sys_nice+ep {}", shell::word(&program)),
            effect: "takes effect when the program is started again, until its file is replaced",
        }
    }

    /// Sets a limit of a user.
    pub(super) fn limit(user: &str, item: &str, value: &str) -> Self {
        Self {
            command: format!(
                "echo '{user} - {item} {value}' > /etc/security/limits.d/90-understudy-{item}.conf"
            ),
            effect: NEXT_LOGIN,
        }
    }

    /// Keeps the processors at their highest frequency.
    pub(super) fn governor() -> Self {
        Self {
            command: "for file in /sys/devices/system/cpu/cpu*/cpufreq/scaling_governor; do echo performance > $file; done"
                .to_owned(),
            effect: UNTIL_RESTART,
        }
    }

    /// Lets sockets have the receive buffer that a member asks for.
    pub(super) fn receive_buffer(bytes: usize) -> Self {
        Self { command: format!("sysctl -w net.core.rmem_max={bytes}"), effect: UNTIL_RESTART }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sudo_gives_the_rights_to_the_whole_command() {
        let check = |repair: Repair, expected: &str| assert_eq!(repair.with_sudo(), expected);
        check(
            Repair::real_time(Path::new("/usr/bin/understudy")),
            "sudo setcap cap_sys_nice+ep /usr/bin/understudy",
        );
        // A redirection outside the quotes would be done without the rights.
        check(
            Repair::limit("anna", "memlock", "unlimited"),
            "sudo sh -c \"echo 'anna - memlock unlimited' > /etc/security/limits.d/90-understudy-memlock.conf\"",
        );
        check(Repair::receive_buffer(1024), "sudo sysctl -w net.core.rmem_max=1024");
        check(
            Repair::real_time(Path::new("/home/anna/my programs/understudy")),
            "sudo sh -c \"setcap cap_sys_nice+ep '/home/anna/my programs/understudy'\"",
        );
    }
}
