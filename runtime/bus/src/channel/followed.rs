//! A writer whose lines others can follow.

use std::io::{self, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

/// Lines of the journal that wait for those who follow it, at most; they lose what comes on top.
const WAITING_LINES: usize = 1024;

/// A line without an end is cut here.
const LINE_BYTES: usize = 64 * 1024;

/// The journal's end of the channel: what is written goes to `inner`, and line by line to those who follow.
pub(crate) struct Followed<W> {
    inner: W,
    begun: Vec<u8>,
    lines: SyncSender<Vec<u8>>,
    lost: Arc<AtomicU64>,
}

/// A channel that is not started yet.
pub(crate) struct Telemetry {
    pub(super) lines: Receiver<Vec<u8>>,
    pub(super) wake: SyncSender<Vec<u8>>,
    pub(super) lost: Arc<AtomicU64>,
}

pub(crate) fn followed<W: Write>(inner: W) -> (Followed<W>, Telemetry) {
    let (sender, lines) = sync_channel(WAITING_LINES);
    let lost = Arc::new(AtomicU64::new(0));
    let followed =
        Followed { inner, begun: Vec::new(), lines: sender.clone(), lost: Arc::clone(&lost) };
    let telemetry = Telemetry { lines, wake: sender, lost };
    (followed, telemetry)
}

impl<W: Write> Write for Followed<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.inner.write(bytes)?;
        for piece in bytes[..written].split_inclusive(|&byte| byte == b'\n') {
            self.begun.extend_from_slice(piece);
            if piece.ends_with(b"\n") || self.begun.len() > LINE_BYTES {
                let mut line = std::mem::take(&mut self.begun);
                line.truncate(LINE_BYTES);
                if self.lines.try_send(line).is_err() {
                    self.lost.fetch_add(1, Ordering::Relaxed);
                }
            }
        }
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.inner.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_followed_line_by_line_and_never_waited_for() {
        let (mut followed, telemetry) = followed(Vec::new());
        followed.write_all(b"one\ntw").expect("it is memory");
        followed.write_all(b"o\n").expect("it is memory");
        let lines: Vec<Vec<u8>> = telemetry.lines.try_iter().collect();
        assert_eq!(lines, [b"one\n".to_vec(), b"two\n".to_vec()]);
        for _ in 0..WAITING_LINES + 7 {
            followed.write_all(b"more\n").expect("it is memory");
        }
        assert_eq!(telemetry.lost.load(Ordering::Relaxed), 7);
        followed.write_all(&[b'x'; LINE_BYTES * 2]).expect("it is memory");
        assert_eq!(followed.inner.len(), 8 + 5 * (WAITING_LINES + 7) + LINE_BYTES * 2);
        assert!(followed.begun.len() <= LINE_BYTES);
    }
}
