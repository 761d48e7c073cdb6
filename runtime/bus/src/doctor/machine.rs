//! The machine alone: clock, rights, limits, processors and sockets.
//!
//! Each check reads what the system says, and a function without side effects makes a finding of it.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use nix::sys::resource::{Resource, getrlimit};
use nix::unistd::{User, geteuid};

use super::{Finding, Health, Repair, may_repair};
use crate::cores::{isolated, shared};
use crate::rights::{CYCLE_PRIORITY, lock_memory, run_in_real_time};
use crate::udp::RECEIVE_BUFFER_BYTES;
use crate::wakefulness::Wakefulness;

/// For so long wake-ups are measured.
const SPAN: Duration = Duration::from_secs(1);

/// Clocks that take long to read, or are too coarse.
const SLOW_CLOCKS: [&str; 4] = ["hpet", "acpi_pm", "jiffies", "refined-jiffies"];
const CLOCK_SOURCE: &str = "/sys/devices/system/clocksource/clocksource0/current_clocksource";
const CLOCK_SOURCES: &str = "/sys/devices/system/clocksource/clocksource0/available_clocksource";
const PROCESSORS: &str = "/sys/devices/system/cpu";
/// As the units of systemd grant them.
const WANTED_DESCRIPTORS: u64 = 4096;
const RECEIVE_BUFFER_LIMIT: &str = "/proc/sys/net/core/rmem_max";

/// Who would run the members here.
struct Caller {
    /// As `limits.d` names it; nothing for root, whom no command gives more.
    user: Option<String>,
    program: PathBuf,
}

impl Caller {
    fn this_process() -> Self {
        let id = geteuid();
        let name = User::from_uid(id).ok().flatten().map(|user| user.name);
        let user = name.unwrap_or_else(|| format!("{id}:{id}"));
        Self {
            user: (!may_repair()).then_some(user),
            program: std::env::current_exe().unwrap_or_else(|_| PathBuf::from("understudy")),
        }
    }
}

/// Clock, rights, limits, processors, cores and sockets, for cycles of `period` of members that wait actively where `spins`.
pub fn examine_machine(period: Duration, spins: bool) -> Vec<Finding> {
    let caller = Caller::this_process();
    let findings = [
        Some(clock_source(
            &read(CLOCK_SOURCE).unwrap_or_default(),
            &read(CLOCK_SOURCES).unwrap_or_default(),
        )),
        Some(scheduler(tried_real_time(), &caller)),
        Some(memory(lock_memory(), &caller)),
        Some(descriptors(getrlimit(Resource::RLIMIT_NOFILE).map_or(0, |(_, hard)| hard), &caller)),
        processors(&governors(Path::new(PROCESSORS))),
        Some(cores(&isolated(), &shared(), spins)),
        read(RECEIVE_BUFFER_LIMIT).and_then(|limit| sockets(&limit)),
        Some(sleeps(period)),
    ];
    findings.into_iter().flatten().collect()
}

fn read(path: &str) -> Option<String> {
    Some(fs::read_to_string(path).ok()?.trim().to_owned())
}

fn clock_source(name: &str, available: &str) -> Finding {
    if name.is_empty() {
        return Finding::good("clock", "the kernel does not say which clock it uses");
    }
    if !SLOW_CLOCKS.contains(&name) {
        return Finding::good("clock", format!("the clock source is {name}"));
    }
    let found = format!("the clock source is {name}, which takes long to read");
    let remedy =
        "select `tsc` where the kernel lists it as available, or boot with `clocksource=tsc`";
    Finding::trouble("clock", Health::Warning, found, remedy)
        .repaired_by(Repair::clock_source(available, CLOCK_SOURCE))
}

fn tried_real_time() -> Result<(), String> {
    // In a thread of its own: the rest of the examination is no real-time work.
    let tried = std::thread::spawn(|| run_in_real_time(CYCLE_PRIORITY)).join();
    tried.unwrap_or_else(|_| Err("the attempt ended by itself".to_owned()))
}

fn scheduler(tried: Result<(), String>, caller: &Caller) -> Finding {
    let Err(error) = tried else {
        let found = format!("SCHED_FIFO {CYCLE_PRIORITY} is granted");
        return Finding::good("scheduler", found);
    };
    let found = format!("no SCHED_FIFO ({error}): other programs delay the cycle");
    let remedy = "grant CAP_SYS_NICE: `AmbientCapabilities=CAP_SYS_NICE` in the unit, or a capability of the program's file; root is not needed";
    let user = caller.user.as_ref();
    Finding::trouble("scheduler", Health::Warning, found, remedy)
        .repaired_by(user.map(|_| Repair::real_time(&caller.program)))
}

fn memory(locked: Result<(), String>, caller: &Caller) -> Finding {
    let Err(reason) = locked else {
        return Finding::good("memory", "memory can be locked");
    };
    let found = format!("memory is not locked ({reason}): paging may delay the cycle");
    let remedy = "`LimitMEMLOCK=infinity` in the unit, or a limit of the user";
    let user = caller.user.as_ref();
    Finding::trouble("memory", Health::Warning, found, remedy)
        .repaired_by(user.map(|user| Repair::limit(user, "memlock", "unlimited")))
}

fn descriptors(hard: u64, caller: &Caller) -> Finding {
    if hard >= WANTED_DESCRIPTORS {
        return Finding::good("descriptors", format!("up to {hard} descriptors are granted"));
    }
    let found = format!(
        "at most {hard} descriptors are granted: the cycle keeps its share, and few operators can connect"
    );
    let remedy = format!("`LimitNOFILE={WANTED_DESCRIPTORS}` in the unit, or a limit of the user");
    let user = caller.user.as_ref();
    let value = WANTED_DESCRIPTORS.to_string();
    Finding::trouble("descriptors", Health::Warning, found, remedy)
        .repaired_by(user.map(|user| Repair::limit(user, "nofile", &value)))
}

/// How the frequency of each processor is governed; nothing where the machine does not say.
fn governors(processors: &Path) -> Vec<String> {
    let folders = fs::read_dir(processors).into_iter().flatten().flatten();
    let files = folders.map(|folder| folder.path().join("cpufreq/scaling_governor"));
    let texts = files.filter_map(|file| fs::read_to_string(file).ok());
    let mut governors: Vec<String> = texts.map(|text| text.trim().to_owned()).collect();
    governors.sort();
    governors.dedup();
    governors
}

fn processors(governors: &[String]) -> Option<Finding> {
    let slow: Vec<&str> = governors
        .iter()
        .map(String::as_str)
        .filter(|governor| *governor != "performance")
        .collect();
    if governors.is_empty() {
        return None;
    }
    if slow.is_empty() {
        let found = "the frequency governor is performance";
        return Some(Finding::good("processors", found));
    }
    let found = format!(
        "the frequency governor is {}: a processor that rests wakes up slowly",
        slow.join(" and ")
    );
    let remedy = "use the governor `performance`";
    let finding = Finding::trouble("processors", Health::Warning, found, remedy);
    Some(finding.repaired_by(Some(Repair::governor())))
}

/// Which cores a member can have for itself, to wait actively on them.
fn cores(isolated: &[usize], shared: &[usize], spins: bool) -> Finding {
    let list = |cores: &[usize]| cores.iter().map(usize::to_string).collect::<Vec<_>>().join(", ");
    if !isolated.is_empty() {
        let found = format!("isolated cores: {}", list(isolated));
        return Finding::good("cores", found);
    }
    if !spins {
        return Finding::good("cores", "no core is isolated; members wait without spinning");
    }
    let found = match shared {
        [] => "U0511: `spin = true` has no core of its own: this process may run on one core only; members wait without spinning".to_owned(),
        _ => format!(
            "U0511: no core is isolated: {} members at most wait actively, on cores that other programs use too ({})",
            shared.len(),
            list(shared)
        ),
    };
    let remedy =
        "boot with `isolcpus` for one core of each member that runs here, or remove `spin = true`";
    Finding::trouble("cores", Health::Warning, found, remedy)
}

fn sockets(limit: &str) -> Option<Finding> {
    let limit: usize = limit.parse().ok()?;
    if limit >= RECEIVE_BUFFER_BYTES {
        let found = format!("receive buffers may have {limit} bytes");
        return Some(Finding::good("sockets", found));
    }
    let found = format!(
        "receive buffers may have {limit} bytes, and a member asks for {RECEIVE_BUFFER_BYTES}: a burst of frames may be lost while it waits for a processor"
    );
    let remedy = format!("`net.core.rmem_max = {RECEIVE_BUFFER_BYTES}` in /etc/sysctl.d");
    let finding = Finding::trouble("sockets", Health::Warning, found, remedy);
    Some(finding.repaired_by(Some(Repair::receive_buffer(RECEIVE_BUFFER_BYTES))))
}

/// How late sleepers are woken, which is what a cycle feels of everything above.
fn sleeps(period: Duration) -> Finding {
    let measured = Wakefulness::measure(SPAN, true);
    let found = format!("{measured}; a cycle has {} ms", period.as_secs_f64() * 1e3);
    if measured.keeps(period) {
        return Finding::good("clock", found);
    }
    let remedy = format!(
        "a `period` of {} ms, real-time rights, a kernel with PREEMPT_RT, processors kept free of other work and of interrupts (`isolcpus`, `irqaffinity`), or a machine that is not virtual",
        measured.period().as_millis()
    );
    Finding::trouble("clock", Health::Warning, found, remedy)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn caller(user: Option<&str>) -> Caller {
        Caller { user: user.map(str::to_owned), program: PathBuf::from("/opt/understudy") }
    }

    fn check(finding: Finding, health: Health, command: Option<&str>) {
        let repair = finding.repair.as_ref();
        let made = repair.map(|repair| repair.command.as_str());
        assert_eq!((finding.health, made), (health, command), "{finding:?}");
        assert_eq!(finding.remedy.is_some(), health != Health::Good, "{finding:?}");
    }

    #[test]
    fn a_slow_clock_is_replaced_where_another_one_is_there() {
        check(clock_source("tsc", "tsc hpet"), Health::Good, None);
        check(clock_source("", ""), Health::Good, None);
        let command = "echo tsc > /sys/devices/system/clocksource/clocksource0/current_clocksource";
        check(clock_source("hpet", "tsc hpet"), Health::Warning, Some(command));
        check(clock_source("hpet", "hpet acpi_pm"), Health::Warning, None);
    }

    #[test]
    fn cores_matter_where_members_spin() {
        check(cores(&[2, 3], &[1, 2, 3], true), Health::Good, None);
        check(cores(&[], &[], false), Health::Good, None);
        for shared in [&[][..], &[1, 2]] {
            let finding = cores(&[], shared, true);
            assert!(finding.found.starts_with("U0511: "), "{finding:?}");
            check(finding, Health::Warning, None);
        }
    }

    #[test]
    fn rights_and_limits_are_granted_to_users_and_not_to_root() {
        let lacking = || Err("not permitted".to_owned());
        let (anna, root) = (caller(Some("anna")), caller(None));
        let setcap = "setcap cap_sys_nice+ep /opt/understudy";
        check(scheduler(lacking(), &anna), Health::Warning, Some(setcap));
        check(scheduler(lacking(), &root), Health::Warning, None);
        check(scheduler(Ok(()), &anna), Health::Good, None);
        let file = "/etc/security/limits.d/90-understudy";
        let memlock = format!("echo 'anna - memlock unlimited' > {file}-memlock.conf");
        check(memory(lacking(), &anna), Health::Warning, Some(&memlock));
        check(memory(lacking(), &root), Health::Warning, None);
        let nofile = format!("echo 'anna - nofile 4096' > {file}-nofile.conf");
        check(descriptors(1024, &anna), Health::Warning, Some(&nofile));
        check(descriptors(1024, &root), Health::Warning, None);
        check(descriptors(4096, &anna), Health::Good, None);
    }

    #[test]
    fn processors_and_sockets_are_set_for_everybody() {
        let governors = |names: &[&str]| names.iter().map(ToString::to_string).collect::<Vec<_>>();
        assert_eq!(processors(&governors(&[])), None);
        let fast = processors(&governors(&["performance"])).expect("a finding");
        check(fast, Health::Good, None);
        let mixed = processors(&governors(&["performance", "powersave"])).expect("a finding");
        let command = Repair::governor().command;
        check(mixed, Health::Warning, Some(&command));
        assert_eq!(sockets("no number"), None);
        let small = sockets("212992").expect("a finding");
        check(small, Health::Warning, Some("sysctl -w net.core.rmem_max=1048576"));
        check(sockets("1048576").expect("a finding"), Health::Good, None);
    }
}
