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

use super::{Commander, OperatorAction, Refusal, acknowledgement};

/// In the directory of a run.
const SOCKET: &str = "operator.sock";

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
    BufReader::new(reading.take(LINE_BYTES))
        .read_line(&mut line)
        .await?;
    let done = match serde_json::from_str::<OperatorAction>(&line) {
        Ok(action) => commander.act(action).await,
        Err(error) => Err(Refusal::Said(format!("U0557: this is no command: {error}"))),
    };
    let answer = Answer {
        refused: done.err().map(|refusal| refusal.to_string()),
    };
    let mut line = serde_json::to_vec(&answer)?;
    line.push(b'\n');
    writing.write_all(&line).await
}

/// Asks whoever writes the run. An acknowledgement goes to the end of a journal that nobody writes any more.
pub(super) async fn ask(run: &Path, action: &OperatorAction) -> Result<(), Refusal> {
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
                Ok(true) => Ok(()),
                Ok(false) => Err(Refusal::Busy),
                Err(error) => Err(Refusal::System {
                    name: "the journal".to_owned(),
                    reason: error.to_string(),
                }),
            };
        }
        (Err(_), OperatorAction::Command { .. }) => return Err(Refusal::Busy),
    };
    match told {
        Ok(Ok(Answer { refused: None })) => Ok(()),
        Ok(Ok(Answer { refused: Some(why) })) => Err(Refusal::Said(why)),
        Ok(Err(_)) | Err(_) => Err(Refusal::Busy),
    }
}

async fn tell(mut stream: UnixStream, action: &OperatorAction) -> io::Result<Answer> {
    let mut line = serde_json::to_vec(action)?;
    line.push(b'\n');
    stream.write_all(&line).await?;
    let mut answer = String::new();
    BufReader::new((&mut stream).take(LINE_BYTES))
        .read_line(&mut answer)
        .await?;
    Ok(serde_json::from_str(&answer)?)
}

/// The address of a socket has 108 bytes at most, and a directory may have a longer name: the system knows it by its number as well.
fn in_folder<T>(run: &Path, work: impl FnOnce(&Path) -> io::Result<T>) -> io::Result<T> {
    let folder = fs::File::open(run)?;
    let short = format!("/proc/self/fd/{}/{SOCKET}", folder.as_raw_fd());
    work(Path::new(&short))
}
