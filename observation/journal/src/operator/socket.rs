//! The socket of a run, by which other processes of the same user act on it: one line of JSON, and one line as the answer.
//!
//! Whoever may open it may end the processes as well; it adds no right.

use std::fs;
use std::io;
use std::os::fd::AsRawFd;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use serde::{Deserialize, Serialize};
use tokio::io::{AsyncBufReadExt, AsyncReadExt, AsyncWriteExt, BufReader};
use tokio::net::{UnixListener, UnixStream};
use tokio::sync::Semaphore;
use tokio::task::JoinHandle;

use super::{Command, Commander, Done, OperatorAction, Refusal, acknowledgement};

/// In the directory of a run.
pub(crate) const SOCKET: &str = "operator.sock";

/// Bytes of one line, at most.
const LINE_BYTES: u64 = 8192;

/// Callers at once, at most; others wait.
const CALLERS: usize = 16;

/// A caller says what he wants within this time, and is answered within it.
const PATIENCE: Duration = Duration::from_secs(10);

#[derive(Debug, Serialize, Deserialize)]
struct Answer {
    /// Why it was not done.
    refused: Option<String>,
    /// Cycle from which a written value is in effect.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    cycle: Option<u64>,
}

/// A socket that takes actions; gone when it is dropped.
#[derive(Debug)]
pub struct RunSocket {
    path: PathBuf,
    listening: JoinHandle<()>,
}

impl RunSocket {
    /// Takes actions for the run in a directory. To be called in a runtime.
    ///
    /// # Errors
    /// What the system says.
    pub fn open(run: &Path, commander: Commander) -> io::Result<Self> {
        let path = run.join(SOCKET);
        match fs::remove_file(&path) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
            _ => {}
        }
        let listener = in_folder(run, |path| UnixListener::bind(path))?;
        fs::set_permissions(&path, fs::Permissions::from_mode(0o600))?;
        let places = Arc::new(Semaphore::new(CALLERS));
        let listening = tokio::spawn(async move {
            loop {
                let Ok(place) = Arc::clone(&places).acquire_owned().await else {
                    return;
                };
                let Ok((stream, _)) = listener.accept().await else {
                    // Too many files are open: some of them will be closed.
                    tokio::time::sleep(Duration::from_millis(100)).await;
                    continue;
                };
                let commander = commander.clone();
                tokio::spawn(async move {
                    let _place = place;
                    // A caller that says nothing, or goes, loses only his own call.
                    let _ = tokio::time::timeout(PATIENCE, take(stream, &commander)).await;
                });
            }
        });
        Ok(Self { path, listening })
    }
}

impl Drop for RunSocket {
    fn drop(&mut self) {
        self.listening.abort();
        // Where it is gone already, nobody finds it.
        let _ = fs::remove_file(&self.path);
    }
}

async fn take(mut stream: UnixStream, commander: &Commander) -> io::Result<()> {
    let (reading, mut writing) = stream.split();
    let mut line = String::new();
    BufReader::new(reading.take(LINE_BYTES)).read_line(&mut line).await?;
    let done = match serde_json::from_str::<OperatorAction>(&line) {
        Ok(action) => commander.act(action).await,
        Err(error) => Err(Refusal::Said(format!("U0557: this is no command: {error}"))),
    };
    let answer = Answer {
        cycle: done.as_ref().ok().and_then(|done| done.cycle),
        refused: done.err().map(|refusal| refusal.to_string()),
    };
    let mut line = serde_json::to_vec(&answer)?;
    line.push(b'\n');
    writing.write_all(&line).await
}

/// Asks whoever writes the run. An acknowledgement goes to the end of a journal that nobody writes any more.
pub(super) async fn ask(run: &Path, action: &OperatorAction) -> Result<Done, Refusal> {
    let connecting = in_folder(run, |path| {
        std::os::unix::net::UnixStream::connect(path).and_then(|stream| {
            stream.set_nonblocking(true)?;
            UnixStream::from_std(stream)
        })
    });
    let told = match (connecting, action) {
        (Ok(stream), _) => tokio::time::timeout(PATIENCE, tell(stream, action)).await,
        (Err(_), OperatorAction::Acknowledge(seen)) => {
            let appended = acknowledgement::append(run, seen);
            return match appended {
                Ok(true) => Ok(Done::default()),
                Ok(false) => Err(Refusal::Busy),
                Err(error) => Err(Refusal::System {
                    name: "the journal".to_owned(),
                    reason: error.to_string(),
                }),
            };
        }
        (Err(_), _) => return Err(Refusal::Busy),
    };
    match told {
        Ok(Ok(Answer { refused: None, cycle })) => Ok(Done { cycle }),
        Ok(Ok(Answer { refused: Some(why), .. })) => Err(Refusal::Said(why)),
        // A write may have been taken before the answer was lost.
        Ok(Err(_)) | Err(_) => Err(match action {
            OperatorAction::Command { command: Command::Write(_), .. } => Refusal::Undecided,
            _ => Refusal::Busy,
        }),
    }
}

async fn tell(mut stream: UnixStream, action: &OperatorAction) -> io::Result<Answer> {
    let mut line = serde_json::to_vec(action)?;
    line.push(b'\n');
    stream.write_all(&line).await?;
    let mut answer = String::new();
    BufReader::new((&mut stream).take(LINE_BYTES)).read_line(&mut answer).await?;
    Ok(serde_json::from_str(&answer)?)
}

/// The address of a socket has 108 bytes at most, and a directory may have a longer name: the system knows it by its number as well.
fn in_folder<T>(run: &Path, work: impl FnOnce(&Path) -> io::Result<T>) -> io::Result<T> {
    let folder = fs::File::open(run)?;
    let short = format!("/proc/self/fd/{}/{SOCKET}", folder.as_raw_fd());
    work(Path::new(&short))
}

#[cfg(test)]
mod tests {
    use std::io::{BufRead, BufReader, Write};
    use std::os::unix::net::UnixStream as Stream;

    use understudy_testing::Folder;
    use understudy_wire::{Member, StationId};

    use super::super::{Acknowledgement, Command, commands};
    use super::*;
    use crate::journal::records_of;
    use crate::record::{Happening, RunEvent};
    use crate::version::journal_header;
    use crate::writer::WriterLock;

    /// A run whose path is longer than the address of a socket may be.
    fn folder(name: &str) -> Folder {
        Folder::new(&format!("{name}-{:0>100}", 1))
    }

    fn seen() -> Acknowledgement {
        Acknowledgement {
            name: "press-io".to_owned(),
            alarm: "fail-safe".to_owned(),
            raised_ns: 7,
            cycle: 3,
            owner: "anna".to_owned(),
            at_unix_s: 11,
        }
    }

    fn runtime() -> tokio::runtime::Runtime {
        let runtime =
            tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build();
        runtime.expect("a runtime")
    }

    #[test]
    fn another_process_is_answered_and_nonsense_ends_nothing() {
        let run = folder("socket");
        let runtime = runtime();
        let (commander, mut commands) = commands();
        let socket = runtime.block_on(async { RunSocket::open(&run, commander) });
        let socket = socket.expect("a socket");
        runtime.spawn(async move {
            loop {
                let commanded = commands.next().await;
                let done = match commanded.action {
                    OperatorAction::Acknowledge(_) => Ok(Done::default()),
                    _ => Err(Refusal::Down("robot".to_owned())),
                };
                commanded.answer(done);
            }
        });
        let nonsense = ["", "\n", "{\"action\":\"kill\"}\n", &"x".repeat(20_000)];
        for line in nonsense {
            let mut stream = in_folder(&run, |path| Stream::connect(path)).expect("it listens");
            // Where it has heard enough, it hears no more.
            let _ = stream.write_all(line.as_bytes());
            let _ = stream.shutdown(std::net::Shutdown::Write);
            let mut answer = String::new();
            let _ = BufReader::new(stream).read_line(&mut answer);
            assert!(answer.is_empty() || answer.contains("U0557"), "{answer}");
        }
        let there = Commander::of_run(run.to_path_buf());
        let asked = runtime.block_on(async {
            let member = Member::Station(StationId(0));
            let by = ("anna".to_owned(), "to see it".to_owned());
            let cut = there.give(member, Command::Isolate, by.0, by.1).await;
            (there.acknowledge(seen()).await, cut)
        });
        let refused = Refusal::Said(Refusal::Down("robot".to_owned()).to_string());
        assert_eq!(asked, (Ok(Done::default()), Err(refused)));
        drop(socket);
        assert!(!run.join(SOCKET).exists());
    }

    #[test]
    fn an_alarm_of_a_run_that_is_over_is_seen_in_its_journal() {
        let run = folder("over");
        let journal = run.join("journal.jsonl");
        // Its writer was killed in the middle of a line.
        let begun = [journal_header(1).as_slice(), b"{\"at_ns\":1,\"na"].concat();
        std::fs::write(&journal, begun).expect("written");
        let there = Commander::of_run(run.to_path_buf());
        let writer = WriterLock::take(&run).expect("a file");
        assert_eq!(there.acknowledge_and_wait(seen()), Err(Refusal::Busy));
        drop(writer);
        assert_eq!(there.acknowledge_and_wait(seen()), Ok(Done::default()));
        assert_eq!(there.acknowledge_and_wait(seen()), Ok(Done::default()));
        let read = records_of(&journal).expect("readable");
        let events: Vec<_> = read.flatten().map(|record| record.event).collect();
        let expected = Happening::Run(RunEvent::Acknowledged(seen()));
        assert_eq!(events, [expected.clone(), expected]);
    }
}
