//! Two devices that hand out the next input only when the last one was answered: what is lost, doubled or older than what a device
//! has seen already shows there, whatever the project says of itself. Stations and remote I/Os are killed and suspended meanwhile,
//! links are cut, and connections to the devices break.
//!
//! Some seconds by default; an hour with `UNDERSTUDY_HANDSHAKE_CYCLES=72000`.

use std::fmt::Write as _;
use std::fs;
use std::io;
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use serde_json::Value;

use super::shared::modbus;
use super::{PERIOD, answer, empty_folder, no_orphan, one_at_a_time};

/// Counts requests, and folds the bit that comes with each into a signature of four bits.
const PROGRAM: &str = "
input  req
input  bit
output alive
output ack
output c0
output c1
output c2
output c3
output s0
output s1
output s2
output s3
memory new
memory n0
memory n1
memory n2
memory n3
memory m0
memory m1
memory m2
memory m3
rung ( alive )
rung req ( ack )
rung +req ( new )
rung [ new c0 c1 c2 /c3 | c3 [ /new | /c0 | /c1 | /c2 ] ] ( n3 )
rung [ new c0 c1 /c2 | c2 [ /new | /c0 | /c1 ] ] ( n2 )
rung [ new c0 /c1 | c1 [ /new | /c0 ] ] ( n1 )
rung [ new /c0 | /new c0 ] ( n0 )
rung n0 ( c0 )
rung n1 ( c1 )
rung n2 ( c2 )
rung n3 ( c3 )
rung [ new s2 | /new s3 ] ( m3 )
rung [ new s1 | /new s2 ] ( m2 )
rung [ new s0 | /new s1 ] ( m1 )
rung [ new s3 /bit | new /s3 bit | /new s0 ] ( m0 )
rung m0 ( s0 )
rung m1 ( s1 )
rung m2 ( s2 )
rung m3 ( s3 )
";

const OUTPUTS: [&str; 10] = ["alive", "ack", "c0", "c1", "c2", "c3", "s0", "s1", "s2", "s3"];

/// A number that looks like chance and is the same in every run.
struct Chance(u64);

impl Chance {
    fn below(&mut self, bound: u64) -> u64 {
        let Self(state) = self;
        *state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*state >> 33) % bound
    }
}

/// What a device expects to be told.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Answer {
    count: u8,
    signature: u8,
}

impl Answer {
    fn of(coils: &[bool]) -> Self {
        let number = |bits: &[bool]| {
            let bits = bits.iter().rev();
            bits.fold(0, |number, bit| 2 * number + u8::from(*bit))
        };
        Self { count: number(&coils[2..6]), signature: number(&coils[6..10]) }
    }

    fn after(self, bit: bool) -> Self {
        let Self { count, signature } = self;
        let first = (signature >> 3) ^ u8::from(bit);
        Self { count: (count + 1) % 16, signature: ((signature << 1) | first) & 15 }
    }
}

/// The equipment: it asks, waits for the answer, takes its question back, and asks again.
struct Device {
    chance: Chance,
    asking: bool,
    bit: bool,
    /// What it was told last.
    told: Answer,
    answered: u64,
    /// What does not follow from what it was told before.
    wrong: Vec<String>,
}

impl Device {
    fn new(seed: u64) -> Self {
        Self {
            chance: Chance(seed),
            asking: false,
            bit: false,
            told: Answer { count: 0, signature: 0 },
            answered: 0,
            wrong: Vec::new(),
        }
    }

    /// All its coils are written at once.
    fn written(&mut self, coils: &[bool]) {
        let (alive, acknowledged) = (coils[0], coils[1]);
        if !alive {
            // Fail-safe: the device rests.
            return;
        }
        let said = Answer::of(coils);
        let next = self.told.after(self.bit);
        let wanted = if self.asking && acknowledged { next } else { self.told };
        if said != wanted {
            let Self { answered, asking, bit, told, .. } = self;
            self.wrong.push(format!(
                "after {answered} answers, asking {asking} with {bit}, acknowledged {acknowledged}: {said:?} follows {told:?}"
            ));
            // Goes on from there, so that one fault is told once.
            self.told = said;
            return;
        }
        self.told = said;
        if acknowledged == self.asking {
            self.answered += u64::from(self.asking);
            self.asking = !self.asking;
            if self.asking {
                self.bit = self.chance.below(2) == 1;
            }
        }
    }

    /// The answer to a request of Modbus: its function and what follows.
    fn request(&mut self, request: &[u8]) -> Option<Vec<u8>> {
        match request {
            // Read two discrete inputs.
            [2, 0, 0, 0, 2] => Some(vec![2, 1, u8::from(self.asking) | u8::from(self.bit) << 1]),
            // Its coils cannot be read.
            [1, ..] => Some(vec![0x81, 1]),
            // Write ten coils.
            [15, 0, 0, 0, 10, 2, low, high] => {
                let word = u16::from_le_bytes([*low, *high]);
                let coils: Vec<bool> = (0..10).map(|bit| word >> bit & 1 == 1).collect();
                self.written(&coils);
                Some(vec![15, 0, 0, 0, 10])
            }
            _ => None,
        }
    }
}

/// Serves a device until its listener is closed. One connection in some hundred requests breaks off.
fn serve(listener: &TcpListener, device: &Mutex<Device>) {
    for connection in listener.incoming() {
        // It ends as it likes: the remote I/O makes a new one.
        let _ = connection.and_then(|connection| exchange(connection, device));
    }
}

fn exchange(mut connection: TcpStream, device: &Mutex<Device>) -> io::Result<()> {
    connection.set_nodelay(true)?;
    loop {
        let (head, request) = modbus::request(&mut connection)?;
        let mut device = device.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(answer) = device.request(&request) else {
            let request = format!("a request it does not know: {request:?}");
            device.wrong.push(request);
            return Ok(());
        };
        if device.chance.below(300) == 0 {
            return Ok(());
        }
        drop(device);
        head.answer(&mut connection, &answer)?;
    }
}

/// The devices' cluster: programs `first` and `second`.
fn cluster(folder: &Path, ports: &[u16]) -> String {
    let mut text = format!("[cluster]\nname = \"handshake\"\nperiod = \"{PERIOD}\"\n");
    for (name, port) in ["first", "second"].into_iter().zip(ports) {
        let program = format!("program {name}\n{PROGRAM}");
        fs::write(folder.join(format!("{name}.ladder")), program).expect("written");
        let fail_safe = OUTPUTS.map(|output| format!("{output} = false")).join(", ");
        let coils = OUTPUTS.iter().enumerate();
        let coils: Vec<String> =
            coils.map(|(place, output)| format!("{output} = \"coil:{place}\"")).collect();
        let coils = coils.join(", ");
        write!(
            text,
            "
[[controller]]
name = \"{name}\"
ladder = \"{name}.ladder\"

[[remote_io]]
name = \"{name}-io\"
controller = \"{name}\"
fail_safe = {{ {fail_safe} }}

[remote_io.field]
modbus = \"127.0.0.1:{port}\"
stale_after = \"500ms\"
inputs = {{ req = \"discrete:0\", bit = \"discrete:1\" }}
outputs = {{ {coils} }}
"
        )
        .expect("a text");
    }
    let file = folder.join("cluster.toml");
    fs::write(&file, text).expect("written");
    file.display().to_string()
}

/// Cycles from one fault to the next: enough for a process of an unoptimised build to start and to catch up.
const BETWEEN: u64 = 50;

/// One fault after the other, each of which the cluster masks.
fn scenario(folder: &Path, cycles: u64) -> String {
    let mut text = format!("title = \"Handshakes with two devices\"\ncycles = {cycles}\n");
    let mut chance = Chance(20_261_122);
    let mut step = |at: u64, action: &str, station: &str, to: Option<&str>| {
        let to = to.map_or(String::new(), |to| format!("to = [\"{to}\"]\n"));
        write!(text, "\n[[step]]\nat = {at}\naction = \"{action}\"\nstation = \"{station}\"\n{to}")
            .expect("a text");
    };
    for (number, at) in (10..cycles.saturating_sub(BETWEEN))
        .step_by(usize::try_from(BETWEEN).expect("small"))
        .enumerate()
    {
        let name = ["first", "second"][usize::try_from(chance.below(2)).expect("small")];
        let io = format!("{name}-io");
        let first = at + chance.below(5);
        let last = first + 5 + chance.below(10);
        match number % 7 {
            0 => {
                step(first, "crash", name, None);
                step(last, "restart", name, None);
            }
            1 => {
                // The state of the understudy would age, were the samples not relayed.
                step(first, "cut", &io, Some("understudy"));
                step(last, "crash", name, None);
                step(last + 2, "heal", &io, Some("understudy"));
                step(last + 4, "restart", name, None);
            }
            2 => {
                step(first, "crash", &io, None);
                step(first + 2, "restart", &io, None);
            }
            3 => {
                step(first, "cut", name, Some(&io));
                step(last, "heal", name, Some(&io));
            }
            4 => {
                step(first, "crash", "understudy", None);
                step(last, "restart", "understudy", None);
            }
            5 => {
                step(first, "stop", name, None);
                step(last, "continue", name, None);
            }
            _ => {
                step(first, "cut", &io, Some(name));
                step(last, "heal", &io, Some(name));
            }
        }
    }
    let file = folder.join("faults.toml");
    fs::write(&file, text).expect("written");
    file.display().to_string()
}

/// The losses of state that the journal tells of: each program starts cold once.
fn losses(journal: &str) -> Vec<String> {
    let mut started = Vec::new();
    let mut lost = Vec::new();
    for line in journal.lines() {
        let record: Value = serde_json::from_str(line).expect("a record");
        let (event, name) = (&record["event"]["event"], record["name"].to_string());
        if event == "state-lost" || event == "started-cold" && started.contains(&name) {
            lost.push(line.to_owned());
        } else if event == "started-cold" {
            started.push(name);
        }
    }
    lost
}

#[test]
fn devices_that_wait_for_each_answer_see_none_lost_doubled_or_old() {
    let _one = one_at_a_time();
    let folder = empty_folder("handshake");
    let cycles = std::env::var("UNDERSTUDY_HANDSHAKE_CYCLES");
    let cycles = cycles.map_or(400, |cycles| cycles.parse().expect("a number of cycles"));
    let mut devices = Vec::new();
    let mut ports = Vec::new();
    for seed in [1, 2] {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
        ports.push(listener.local_addr().expect("bound").port());
        let device = Arc::new(Mutex::new(Device::new(seed)));
        devices.push(Arc::clone(&device));
        // It ends with the test.
        thread::spawn(move || serve(&listener, &device));
    }
    let cluster = cluster(&folder, &ports);
    let scenario = scenario(&folder, cycles);
    let runs = folder.join("runs");
    let out = runs.to_str().expect("text");
    let (_, document, errors) =
        answer(&["lab", &cluster, "--scenario", &scenario, "--link", "udp", "--out", out]);
    no_orphan(&folder);
    let summary = &document["result"]["summary"];
    assert_eq!(summary["violation_count"], 0, "{document:#}\n{errors}");
    assert_eq!(summary["cycles_run"], summary["cycles_asked"], "{errors}");
    let journal = fs::read_to_string(runs.join("latest/journal.jsonl")).expect("a journal");
    let lost = losses(&journal);
    if !lost.is_empty() {
        eprintln!("the run tells of these losses: {lost:#?}");
    }
    for (name, device) in ["first", "second"].iter().zip(devices) {
        let device = device.lock().expect("no device failed");
        eprintln!("{name}: {} answers in {cycles} cycles", device.answered);
        assert!(
            device.wrong.is_empty() || !lost.is_empty(),
            "{name}, and no loss is told: {:#?}",
            device.wrong
        );
        assert!(device.answered > cycles / 20, "{name}: {summary:#}");
    }
}
