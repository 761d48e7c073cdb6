//! Records that could not be written.

use std::io;

/// Records that could not be written; the log says when that begins and when it ends.
#[derive(Default)]
pub(crate) struct Tally {
    pub(crate) unwritten: u64,
    is_failing: bool,
}

impl Tally {
    pub(crate) fn count(&mut self, written: io::Result<()>) {
        match written {
            Ok(()) if self.is_failing => {
                self.is_failing = false;
                tracing::error!(self.unwritten, "the journal is written again");
            }
            Ok(()) => {}
            Err(error) => {
                self.unwritten += 1;
                if !std::mem::replace(&mut self.is_failing, true) {
                    tracing::error!(%error, "the journal is not written");
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    /// The first write fails, and each one after the third succeeds.
    struct Full(u32);

    impl Write for Full {
        fn write(&mut self, part: &[u8]) -> io::Result<usize> {
            self.0 += 1;
            if self.0 <= 3 { Err(io::ErrorKind::StorageFull.into()) } else { Ok(part.len()) }
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn what_cannot_be_written_is_counted_until_it_can() {
        let mut tally = Tally::default();
        let mut output = Full(0);
        let mut failing = Vec::new();
        for _ in 0..5 {
            tally.count(output.write_all(b"x"));
            failing.push(tally.is_failing);
        }
        assert_eq!((tally.unwritten, failing), (3, vec![true, true, true, false, false]));
    }
}
