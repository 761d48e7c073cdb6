//! A remote I/O that is suspended and goes on, in front of a device that stamps each of its answers: what was read or proved before the suspension
//! is not sampled and not written after it.

use std::fs;
use std::io;
use std::net::{TcpListener, TcpStream};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use nix::sys::signal::Signal;
use understudy_journal::monotonic_ns;

use super::deaths::{Records, is};
use super::shared::deployed::Running;
use super::shared::{DEADLINE, empty_folder, modbus, some_at_a_time};
use super::{no_orphan, running_cluster, signal};

/// Longer than `timeout` and `stale_after` of the device together, and than outputs are held.
const SUSPENDED: Duration = Duration::from_millis(1_500);

const READ: u8 = 4;
const WRITE: u8 = 6;

/// At which request of the device its remote I/O is suspended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum At {
    /// Before the answer to a function, which then waits to be read.
    Before(u8),
    /// After the answer to it.
    After(u8),
}

/// Has a number of the newest answer, which the program writes back.
#[derive(Debug, Default)]
struct Device {
    stamp: u16,
    written: Vec<u16>,
    /// Which process is suspended, and at which request.
    suspends: Option<(u32, At)>,
}

impl Device {
    fn answer(&mut self, request: &[u8]) -> Vec<u8> {
        match request {
            [READ, 0, 0, 0, 1] => {
                self.stamp += 1;
                [vec![READ, 2], self.stamp.to_be_bytes().to_vec()].concat()
            }
            [WRITE, 0, 0, high, low] => {
                self.written.push(u16::from_be_bytes([*high, *low]));
                request.to_vec()
            }
            // Its outputs cannot be read.
            [function, ..] => vec![function | 0x80, 1],
            [] => Vec::new(),
        }
    }

    fn suspend_at(&mut self, at: At) {
        if let Some((process, _)) = self.suspends.take_if(|(_, wanted)| *wanted == at) {
            signal(process, Signal::SIGSTOP);
            wait_until("it is suspended", || state(process) == Some('T'));
        }
    }
}

/// The state of a process, of `/proc`.
fn state(process: u32) -> Option<char> {
    let line = fs::read_to_string(format!("/proc/{process}/stat")).expect("it lives");
    line.rsplit_once(") ").and_then(|(_, rest)| rest.chars().next())
}

fn wait_until(what: &str, mut is_so: impl FnMut() -> bool) {
    let deadline = Instant::now() + DEADLINE;
    while !is_so() {
        assert!(Instant::now() < deadline, "{what}: did not come");
        std::thread::yield_now();
    }
}

fn lock(device: &Mutex<Device>) -> MutexGuard<'_, Device> {
    device.lock().unwrap_or_else(PoisonError::into_inner)
}

fn exchange(mut connection: TcpStream, device: &Mutex<Device>) -> io::Result<()> {
    connection.set_nodelay(true)?;
    loop {
        let (head, request) = modbus::request(&mut connection)?;
        let function = request.first().copied().unwrap_or_default();
        let answer = {
            let mut device = lock(device);
            device.suspend_at(At::Before(function));
            device.answer(&request)
        };
        head.answer(&mut connection, &answer)?;
        lock(device).suspend_at(At::After(function));
    }
}

/// Serves each connection in a thread of its own: a suspended client does not end its connection.
fn serve() -> (u16, Arc<Mutex<Device>>) {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
    let port = listener.local_addr().expect("bound").port();
    let device = Arc::new(Mutex::new(Device::default()));
    let served = Arc::clone(&device);
    std::thread::spawn(move || {
        for connection in listener.incoming().flatten() {
            let device = Arc::clone(&served);
            // A connection ends as its remote I/O likes.
            std::thread::spawn(move || exchange(connection, &device));
        }
    });
    (port, device)
}

#[test]
fn a_remote_io_that_stood_still_neither_samples_nor_writes_what_is_old() {
    let _one = some_at_a_time();
    let out = empty_folder("suspended");
    let (port, device) = serve();
    let program = "PROGRAM echo\n  VAR_INPUT stamp : UINT; END_VAR\n  VAR_OUTPUT seen : UINT; END_VAR\n  \
                   seen := stamp;\nEND_PROGRAM\n";
    fs::write(out.join("echo.st"), program).expect("written");
    let cluster = format!(
        "[cluster]\nname = \"echo\"\n\n[[controller]]\nname = \"echo\"\nladder = \"echo.st\"\n\n\
         [[remote_io]]\nname = \"echo-io\"\ncontroller = \"echo\"\nfail_safe = {{ seen = 0 }}\n\n\
         [remote_io.field]\nmodbus = \"127.0.0.1:{port}\"\ntimeout = \"300ms\"\nstale_after = \"500ms\"\n\
         inputs = {{ stamp = \"input:0 uint\" }}\noutputs = {{ seen = \"holding:0 uint\" }}\n"
    );
    fs::write(out.join("cluster.toml"), cluster).expect("written");
    let runs = out.join("runs");
    let (child, _errors) = running_cluster(&out.join("cluster.toml"), &runs, &[]);
    // It ends with a test that fails, too.
    let mut laboratory = Running(child);
    let run = fs::canonicalize(runs.join("latest")).expect("a run");
    let process = Records::of(&run).ready("echo-io");
    for at in [At::Before(READ), At::After(READ), At::Before(WRITE), At::After(WRITE)].repeat(2) {
        let mut records = Records::of(&run);
        lock(&device).suspends = Some((process, at));
        wait_until("a request", || lock(&device).suspends.is_none());
        let goes_on = monotonic_ns() + u64::try_from(SUSPENDED.as_nanos()).expect("short");
        records.wait_for("cycles without it", |record| {
            is(record, "echo", "published") && record["at_ns"].as_u64() > Some(goes_on)
        });
        let (newest, written) = {
            let device = lock(&device);
            (device.stamp, device.written.len())
        };
        signal(process, Signal::SIGCONT);
        let is_new = |value: &u16| *value > newest;
        wait_until("a new output", || lock(&device).written[written..].iter().any(is_new));
        let after = lock(&device).written[written..].to_vec();
        let old: Vec<&u16> = after.iter().filter(|value| **value != 0 && !is_new(value)).collect();
        assert_eq!(old, [&0; 0], "{at:?}: answers up to {newest} are old: {after:?}");
    }
    signal(laboratory.0.id(), Signal::SIGINT);
    laboratory.0.wait().expect("it ends");
    no_orphan(&runs);
}
