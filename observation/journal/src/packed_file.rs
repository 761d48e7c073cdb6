//! A closed segment in a file of its own, packed block by block, and any segment as text again.
//!
//! ```text
//!   MAGIC  bytes of the text (u64)  │ block │ block │ …
//!   block: bytes packed (u32)  bytes of its text (u32)  CRC-32 of the packed bytes (u32)  packed bytes
//! ```
//!
//! Numbers are little-endian. A block is [`BLOCK`] bytes of text and the rest of the last line, and is unpacked by itself: whoever looks for
//! one cycle unpacks a few blocks.

use std::fs::{self, File};
use std::io::{self, BufRead, BufReader, BufWriter, Read, Seek, SeekFrom, Write};
use std::os::unix::fs::MetadataExt;
use std::path::Path;

use crate::packing::{packed, unpacked};

/// Extension of a packed segment.
pub(crate) const PACKED: &str = "packed";

const MAGIC: [u8; 8] = *b"\x89USJ3\r\n\0";

/// Before the first block.
const HEAD_BYTES: u64 = 16;

/// Before the packed bytes of a block.
const BLOCK_HEAD_BYTES: usize = 12;

/// Text of a block.
pub(crate) const BLOCK: usize = 256 * 1024;

/// A block with more text is damaged: a line without an end is cut by its readers long before.
const LARGEST_BLOCK: usize = 64 << 20;

/// Packs the text at `from` into a new file `to`, which is there whole or not at all.
///
/// # Errors
/// What the system says; then `from` is as it was, and there is no `to`.
pub(crate) fn pack_file(from: &Path, to: &Path) -> io::Result<()> {
    let begun = to.with_extension("new");
    let mut text = BufReader::with_capacity(1 << 16, File::open(from)?);
    let mut file = BufWriter::new(File::create(&begun)?);
    file.write_all(&MAGIC)?;
    file.write_all(&0_u64.to_le_bytes())?;
    let mut length = 0;
    loop {
        let block = next_block(&mut text)?;
        if block.is_empty() {
            break;
        }
        length += block.len() as u64;
        let bytes = packed(&block);
        for number in [length_of(&bytes)?, length_of(&block)?, crc32fast::hash(&bytes)] {
            file.write_all(&number.to_le_bytes())?;
        }
        file.write_all(&bytes)?;
    }
    file.seek(SeekFrom::Start(MAGIC.len() as u64))?;
    file.write_all(&length.to_le_bytes())?;
    // On the disk before the text goes: after a power failure one of both is there.
    file.into_inner()?.sync_all()?;
    fs::rename(begun, to)
}

/// Opens a file for reading. A pipe or a device, which could block or never end, is refused.
///
/// # Errors
/// What the system says.
pub fn open_file(path: &Path) -> io::Result<File> {
    if !fs::metadata(path)?.is_file() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "it is not a regular file"));
    }
    File::open(path)
}

fn next_block(text: &mut impl BufRead) -> io::Result<Vec<u8>> {
    let mut block = Vec::new();
    while block.len() < BLOCK {
        if text.read_until(b'\n', &mut block)? == 0 {
            break;
        }
    }
    Ok(block)
}

fn length_of(bytes: &[u8]) -> io::Result<u32> {
    u32::try_from(bytes.len()).map_err(io::Error::other)
}

/// A segment of a journal as the text that it was written as.
#[derive(Debug)]
pub struct SegmentFile {
    file: File,
    inode: u64,
    /// Of a packed one.
    blocks: Option<Blocks>,
    /// Where each piece begins, in the file and in the text; empty until it is asked.
    pieces: Vec<[u64; 2]>,
}

#[derive(Debug)]
struct Blocks {
    text_bytes: u64,
    /// Where the next block begins.
    next: u64,
    block: Vec<u8>,
    /// Bytes of the block that were read.
    read: usize,
}

impl SegmentFile {
    /// Opens a segment. A closed one that was packed meanwhile is found as well.
    ///
    /// # Errors
    /// What the system says.
    pub fn open(path: &Path) -> io::Result<Self> {
        let mut file = match open_file(path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                open_file(&path.with_extension(PACKED)).map_err(|_| error)?
            }
            file => file?,
        };
        let inode = file.metadata()?.ino();
        let mut head = Vec::new();
        (&mut file).take(HEAD_BYTES).read_to_end(&mut head)?;
        let length = head.strip_prefix(&MAGIC).and_then(|length| length.try_into().ok());
        let blocks = length.map(|length| Blocks {
            text_bytes: u64::from_le_bytes(length),
            next: HEAD_BYTES,
            block: Vec::new(),
            read: 0,
        });
        if blocks.is_none() {
            file.seek(SeekFrom::Start(0))?;
        }
        Ok(Self { file, inode, blocks, pieces: Vec::new() })
    }

    /// The number that the system gives the file.
    pub fn inode(&self) -> u64 {
        self.inode
    }

    /// Bytes of its text, of a file that is written as many as there are now.
    ///
    /// # Errors
    /// What the system says.
    pub fn text_bytes(&self) -> io::Result<u64> {
        match &self.blocks {
            Some(blocks) => Ok(blocks.text_bytes),
            None => Ok(self.file.metadata()?.len()),
        }
    }

    /// When it was last written to.
    ///
    /// # Errors
    /// What the system says.
    pub fn modified(&self) -> io::Result<std::time::SystemTime> {
        self.file.metadata()?.modified()
    }

    /// Where its pieces begin, in the file and in the text: the blocks of a packed one, lines about as far apart of a text.
    pub(crate) fn pieces(&mut self) -> io::Result<&[[u64; 2]]> {
        if self.pieces.is_empty() {
            self.pieces = match self.blocks {
                Some(_) => self.found_blocks()?,
                None => self.found_lines()?,
            };
        }
        Ok(&self.pieces)
    }

    fn found_blocks(&mut self) -> io::Result<Vec<[u64; 2]>> {
        let (mut found, mut at, mut text) = (Vec::new(), HEAD_BYTES, 0);
        while let Some([packed_bytes, text_bytes, _]) = self.block_head(at)? {
            found.push([at, text]);
            at += BLOCK_HEAD_BYTES as u64 + u64::from(packed_bytes);
            text += u64::from(text_bytes);
        }
        Ok(found)
    }

    fn found_lines(&mut self) -> io::Result<Vec<[u64; 2]>> {
        let mut found = vec![[0, 0]];
        for at in (BLOCK as u64..self.text_bytes()?).step_by(BLOCK) {
            self.file.seek(SeekFrom::Start(at))?;
            let mut rest = Vec::new();
            BufReader::new((&mut self.file).take(BLOCK as u64)).read_until(b'\n', &mut rest)?;
            if rest.ends_with(b"\n") {
                let line = at + rest.len() as u64;
                found.push([line, line]);
            }
        }
        Ok(found)
    }

    /// The text of a piece; of one that is not packed, its last line may be cut.
    pub(crate) fn text_of(&mut self, piece: usize) -> io::Result<Vec<u8>> {
        let Some([at, _]) = self.pieces()?.get(piece).copied() else {
            return Ok(Vec::new());
        };
        if self.blocks.is_some() {
            return Ok(self.block_at(at)?.map_or_else(Vec::new, |(text, _)| text));
        }
        self.file.seek(SeekFrom::Start(at))?;
        let mut text = Vec::new();
        (&mut self.file).take(BLOCK as u64).read_to_end(&mut text)?;
        Ok(text)
    }

    /// Reads on from the beginning of a piece; how many bytes of the text are before it.
    ///
    /// # Errors
    /// What the system says.
    pub fn go_to(&mut self, piece: usize) -> io::Result<u64> {
        let [at, text] = self.pieces()?.get(piece).copied().unwrap_or_default();
        match &mut self.blocks {
            Some(blocks) => {
                (blocks.next, blocks.read) = (at.max(HEAD_BYTES), 0);
                blocks.block.clear();
            }
            None => {
                self.file.seek(SeekFrom::Start(at))?;
            }
        }
        Ok(text)
    }

    /// Bytes packed, bytes of its text, CRC; nothing where no whole block begins there.
    fn block_head(&mut self, at: u64) -> io::Result<Option<[u32; 3]>> {
        self.file.seek(SeekFrom::Start(at))?;
        let mut head = Vec::new();
        let mut own = (&mut self.file).take(BLOCK_HEAD_BYTES as u64);
        own.read_to_end(&mut head)?;
        let whole = head.len() == BLOCK_HEAD_BYTES;
        let number =
            |at: usize| u32::from_le_bytes([head[at], head[at + 1], head[at + 2], head[at + 3]]);
        Ok(whole.then(|| [number(0), number(4), number(8)]))
    }

    /// The text of the block at `at`, and where the next one begins; nothing at the end. A block that is damaged yields a line that says so.
    fn block_at(&mut self, at: u64) -> io::Result<Option<(Vec<u8>, u64)>> {
        let Some([packed_bytes, text_bytes, crc]) = self.block_head(at)? else {
            return Ok(None);
        };
        self.file.seek(SeekFrom::Start(at + BLOCK_HEAD_BYTES as u64))?;
        let mut bytes = Vec::new();
        (&mut self.file).take(u64::from(packed_bytes)).read_to_end(&mut bytes)?;
        let next = at + BLOCK_HEAD_BYTES as u64 + u64::from(packed_bytes);
        let length = text_bytes as usize;
        let whole = bytes.len() == packed_bytes as usize && crc32fast::hash(&bytes) == crc;
        let text =
            if whole && length <= LARGEST_BLOCK { unpacked(&bytes, length).ok() } else { None };
        let damaged = || {
            format!("the {length} bytes of records packed at byte {at} are damaged\n").into_bytes()
        };
        Ok(Some((text.unwrap_or_else(damaged), next)))
    }
}

impl Read for SegmentFile {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let Some(blocks) = &self.blocks else {
            return self.file.read(into);
        };
        if blocks.read == blocks.block.len() {
            let next = blocks.next;
            let Some(block) = self.block_at(next)? else {
                return Ok(0);
            };
            let Some(blocks) = &mut self.blocks else {
                return Ok(0);
            };
            (blocks.block, blocks.next) = block;
            blocks.read = 0;
        }
        let Some(blocks) = &mut self.blocks else {
            return Ok(0);
        };
        let left = &blocks.block[blocks.read..];
        let length = left.len().min(into.len());
        into[..length].copy_from_slice(&left[..length]);
        blocks.read += length;
        Ok(length)
    }
}

#[cfg(test)]
mod tests {
    use understudy_testing::Folder;

    use super::*;

    fn text() -> Vec<u8> {
        (0..9000_u64)
            .flat_map(|number| format!("{{\"at_ns\":{},\"name\":\"robot\",\"cycle\":{number},\"of\":\"some {} more words\"}}\n", number * 10_000_123, number % 7).into_bytes())
            .collect()
    }

    fn read(path: &Path) -> Vec<u8> {
        let mut found = Vec::new();
        let mut file = SegmentFile::open(path).expect("a file");
        file.read_to_end(&mut found).expect("readable");
        found
    }

    #[test]
    fn a_packed_segment_reads_as_its_text() {
        let folder = Folder::new("packed");
        let (from, to) = (folder.join("a.jsonl"), folder.join("a.packed"));
        for text in [text(), b"torn {\"at_n".to_vec(), Vec::new()] {
            fs::write(&from, &text).expect("written");
            pack_file(&from, &to).expect("packed");
            assert_eq!(read(&to), text);
            assert_eq!(read(&from), text);
            let file = SegmentFile::open(&to).expect("a file");
            assert_eq!(file.text_bytes().expect("known"), text.len() as u64);
        }
    }

    #[test]
    fn a_damaged_block_is_said_and_the_others_are_read() {
        let folder = Folder::new("packed-damaged");
        let (from, to) = (folder.join("a.jsonl"), folder.join("a.packed"));
        fs::write(&from, text()).expect("written");
        pack_file(&from, &to).expect("packed");
        let blocks = SegmentFile::open(&to).and_then(|mut file| file.found_blocks());
        let blocks = blocks.expect("blocks");
        let blocks: Vec<u64> = blocks.iter().map(|[at, _]| *at).collect();
        assert!(blocks.len() > 2, "{blocks:?}");
        let whole = fs::read(&to).expect("bytes");
        let mut changed = whole.clone();
        changed[blocks[1] as usize + 40] ^= 4;
        fs::write(&to, changed).expect("written");
        let found = String::from_utf8(read(&to)).expect("text");
        let expected = String::from_utf8(text()).expect("text");
        let said: Vec<&str> = found.lines().filter(|line| line.ends_with("are damaged")).collect();
        assert_eq!(said.len(), 1);
        let lines = found.lines().filter(|line| !line.ends_with("are damaged"));
        assert!(lines.clone().all(|line| expected.contains(line)));
        assert!(lines.count() > 4000);
        // Cut anywhere, what is read is a beginning, and a block that is not whole is said.
        for cut in (0..whole.len()).step_by(97).chain(blocks.iter().map(|at| *at as usize)) {
            fs::write(&to, &whole[..cut]).expect("written");
            if cut < HEAD_BYTES as usize {
                continue;
            }
            let found = String::from_utf8(read(&to)).expect("text");
            let lines: Vec<&str> = found.lines().collect();
            let (last, before) = lines.split_last().unwrap_or((&"", &[]));
            assert!(
                expected.starts_with(
                    &before.iter().map(|line| format!("{line}\n")).collect::<String>()
                )
            );
            assert!(
                last.is_empty() || last.ends_with("are damaged") || expected.contains(last),
                "{cut}: {last}"
            );
        }
    }
}
