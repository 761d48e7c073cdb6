//! Files with secrets in them.

use std::fs::{self, DirBuilder, File, OpenOptions};
use std::io::{self, Write};
use std::os::unix::fs::{DirBuilderExt, OpenOptionsExt, PermissionsExt};
use std::path::Path;

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::error::KeysError;

/// No file of keys is longer.
const MAXIMUM_BYTES: u64 = 1 << 20;

/// Makes a folder that only its owner may enter; one that is there already stays as it is.
pub(crate) fn make_folder(path: &Path) -> Result<(), KeysError> {
    DirBuilder::new()
        .recursive(true)
        .mode(0o700)
        .create(path)
        .map_err(|source| KeysError::Write { path: path.to_owned(), source })
}

/// Replaces a file as a whole; at no time can anybody else read it, or see half of it.
pub(crate) fn write(path: &Path, text: &str) -> Result<(), KeysError> {
    let written = || -> io::Result<()> {
        let new = path.with_extension("new");
        // One that a crash left behind.
        match fs::remove_file(&new) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
            _ => {}
        }
        let mut file = OpenOptions::new().write(true).create_new(true).mode(0o600).open(&new)?;
        file.write_all(text.as_bytes())?;
        file.sync_all()?;
        fs::rename(&new, path)?;
        File::open(path.parent().unwrap_or(Path::new(".")))?.sync_all()
    };
    written().map_err(|source| KeysError::Write { path: path.to_owned(), source })
}

pub(crate) fn write_toml(
    path: &Path,
    title: &str,
    value: &impl Serialize,
) -> Result<(), KeysError> {
    let text = toml::to_string(value)
        .map_err(|error| KeysError::Damaged { path: path.to_owned(), reason: error.to_string() })?;
    write(path, &format!("# {title}\n{text}"))
}

/// The text of a file.
pub(crate) fn read(path: &Path) -> Result<String, KeysError> {
    let text = || {
        let length = fs::metadata(path)?.len();
        if length > MAXIMUM_BYTES {
            let message = format!("{length} bytes, and at most {MAXIMUM_BYTES} are read");
            return Err(io::Error::new(io::ErrorKind::FileTooLarge, message));
        }
        fs::read_to_string(path)
    };
    text().map_err(|source| KeysError::Read { path: path.to_owned(), source })
}

pub(crate) fn read_toml<T: DeserializeOwned>(path: &Path) -> Result<T, KeysError> {
    toml::from_str(&read(path)?).map_err(|error| KeysError::Damaged {
        path: path.to_owned(),
        // Without the line, which may show a key.
        reason: error.message().to_owned(),
    })
}

/// Refuses what others than its owner may read or change.
pub(crate) fn private(path: &Path) -> Result<(), KeysError> {
    let metadata =
        fs::metadata(path).map_err(|source| KeysError::Read { path: path.to_owned(), source })?;
    let mode = metadata.permissions().mode() & 0o777;
    if mode & 0o077 == 0 {
        Ok(())
    } else {
        Err(KeysError::Permissions { path: path.to_owned(), mode })
    }
}

pub(crate) fn to_hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Exactly `N` bytes; nothing where the text is anything else.
pub(crate) fn from_hexadecimal<const N: usize>(text: &str) -> Option<[u8; N]> {
    let text = text.as_bytes();
    if text.len() != 2 * N {
        return None;
    }
    let digit = |byte: u8| char::from(byte).to_digit(16);
    let mut bytes = [0; N];
    for (byte, pair) in bytes.iter_mut().zip(text.chunks_exact(2)) {
        *byte = (digit(pair[0])? * 16 + digit(pair[1])?) as u8;
    }
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hexadecimal_is_read_back() {
        let bytes: [u8; 4] = [0, 1, 0xab, 0xff];
        assert_eq!(from_hexadecimal(&to_hexadecimal(&bytes)), Some(bytes));
        for text in ["", "0001abf", "0001abfg", "+001abff", "éé"] {
            assert_eq!(from_hexadecimal::<4>(text), None, "{text}");
        }
    }
}
