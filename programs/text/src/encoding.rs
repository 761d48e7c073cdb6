//! The text of a file from its bytes: UTF-8, UTF-16 with a byte order mark, and XML in the encoding that it declares.

use std::fmt;

/// The encodings that are read, in words.
const KNOWN: &str = "UTF-8, UTF-16, ISO-8859-1, Windows-1252 and US-ASCII";

/// Why bytes are not a text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum NotText {
    /// A byte that the encoding does not have at this place.
    Invalid {
        /// The encoding.
        encoding: &'static str,
        /// The first byte that cannot be read, from 0.
        offset: usize,
        /// The line of it, from 1.
        line: usize,
    },
    /// An XML declaration names an encoding that is not read.
    Unknown {
        /// The encoding as it is declared.
        declared: String,
    },
}

impl fmt::Display for NotText {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Invalid { encoding, offset, line } => write!(
                formatter,
                "byte {offset}, in line {line}, is not {encoding}; save the file as UTF-8"
            ),
            Self::Unknown { declared } => write!(
                formatter,
                "its encoding `{declared}` is not supported (known: {KNOWN}); save the file as UTF-8"
            ),
        }
    }
}

impl std::error::Error for NotText {}

/// How bytes stand for characters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Encoding {
    Utf8,
    Utf16 { big: bool },
    Ascii,
    Latin1,
    Windows1252,
}

/// The text that the bytes of a file stand for, without a byte order mark.
///
/// # Errors
/// [`NotText`].
pub fn decode(bytes: Vec<u8>) -> Result<String, NotText> {
    let (encoding, mark) = encoding(&bytes)?;
    let invalid = |encoding, offset: usize| NotText::Invalid {
        encoding,
        offset,
        line: bytes_before(&bytes, offset) + 1,
    };
    match encoding {
        Encoding::Utf8 if mark == 0 => String::from_utf8(bytes).map_err(|error| {
            let offset = error.utf8_error().valid_up_to();
            NotText::Invalid {
                encoding: "UTF-8",
                offset,
                line: bytes_before(error.as_bytes(), offset) + 1,
            }
        }),
        Encoding::Utf8 => match std::str::from_utf8(&bytes[mark..]) {
            Ok(text) => Ok(text.to_owned()),
            Err(error) => Err(invalid("UTF-8", mark + error.valid_up_to())),
        },
        Encoding::Utf16 { big } => {
            let units = bytes[mark..].chunks(2).map(|pair| match *pair {
                [first, second] if big => u16::from_be_bytes([first, second]),
                [first, second] => u16::from_le_bytes([first, second]),
                // Half a character stands for none.
                _ => 0xd800,
            });
            let mut offset = mark;
            let mut text = String::with_capacity(bytes.len() / 2);
            for character in char::decode_utf16(units) {
                let character = character.map_err(|_| invalid("UTF-16", offset))?;
                offset += 2 * character.len_utf16();
                text.push(character);
            }
            Ok(text)
        }
        Encoding::Ascii => match bytes.iter().position(|byte| !byte.is_ascii()) {
            Some(offset) => Err(invalid("US-ASCII", offset)),
            None => Ok(bytes.into_iter().map(char::from).collect()),
        },
        Encoding::Latin1 => Ok(bytes.into_iter().map(char::from).collect()),
        Encoding::Windows1252 => Ok(bytes.into_iter().map(windows_1252).collect()),
    }
}

fn bytes_before(bytes: &[u8], offset: usize) -> usize {
    let before = bytes[..offset.min(bytes.len())].iter();
    before.filter(|byte| **byte == b'\n').count()
}

/// The encoding, and how long its byte order mark is.
fn encoding(bytes: &[u8]) -> Result<(Encoding, usize), NotText> {
    let found = match bytes {
        [0xef, 0xbb, 0xbf, ..] => (Encoding::Utf8, 3),
        [0xff, 0xfe, ..] => (Encoding::Utf16 { big: false }, 2),
        [0xfe, 0xff, ..] => (Encoding::Utf16 { big: true }, 2),
        // XML of a tool that leaves the mark out.
        [b'<', 0, b'?', 0, ..] => (Encoding::Utf16 { big: false }, 0),
        [0, b'<', 0, b'?', ..] => (Encoding::Utf16 { big: true }, 0),
        _ => (declared(bytes)?, 0),
    };
    Ok(found)
}

/// The encoding of an XML declaration; UTF-8 where there is none.
fn declared(bytes: &[u8]) -> Result<Encoding, NotText> {
    let blank = bytes.iter().take_while(|byte| byte.is_ascii_whitespace());
    let start = &bytes[blank.count()..];
    let start = String::from_utf8_lossy(&start[..start.len().min(400)]);
    let Some((declaration, _)) = start.strip_prefix("<?xml").and_then(|rest| rest.split_once("?>"))
    else {
        return Ok(Encoding::Utf8);
    };
    let Some((_, value)) = declaration.split_once("encoding") else {
        return Ok(Encoding::Utf8);
    };
    let value = value.trim_start().strip_prefix('=').unwrap_or_default();
    let name = value.trim_start().split(['"', '\'']).nth(1);
    let name = name.unwrap_or_default();
    match name.to_ascii_lowercase().as_str() {
        // The bytes are those of single characters, so it is not UTF-16, whatever a tool has left there.
        "utf-8" | "utf8" | "utf-16" | "utf16" | "unicode" => Ok(Encoding::Utf8),
        "us-ascii" | "ascii" => Ok(Encoding::Ascii),
        "iso-8859-1" | "iso_8859-1" | "iso8859-1" | "latin1" | "latin-1" => Ok(Encoding::Latin1),
        "windows-1252" | "cp1252" => Ok(Encoding::Windows1252),
        _ => Err(NotText::Unknown { declared: name.to_owned() }),
    }
}

/// As Latin-1, except for the characters in place of its second control characters.
fn windows_1252(byte: u8) -> char {
    const OTHERS: [char; 32] = [
        '€', '\u{81}', '‚', 'ƒ', '„', '…', '†', '‡', 'ˆ', '‰', 'Š', '‹', 'Œ', '\u{8d}', 'Ž',
        '\u{8f}', '\u{90}', '‘', '’', '“', '”', '•', '–', '—', '˜', '™', 'š', '›', 'œ', '\u{9d}',
        'ž', 'Ÿ',
    ];
    match byte {
        0x80..=0x9f => OTHERS[usize::from(byte - 0x80)],
        _ => char::from(byte),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn xml(encoding: &str) -> String {
        format!("<?xml version=\"1.0\" encoding='{encoding}'?>\n<a b=\"Füll€\"/>")
    }

    fn utf_16(text: &str, big: bool) -> Vec<u8> {
        let bytes = |unit: u16| {
            if big { unit.to_be_bytes() } else { unit.to_le_bytes() }
        };
        text.encode_utf16().flat_map(bytes).collect()
    }

    #[test]
    fn each_encoding_gives_the_same_text() {
        let check = |bytes: Vec<u8>, text: &str| assert_eq!(decode(bytes).as_deref(), Ok(text));
        let text = xml("utf-8");
        check(text.clone().into_bytes(), &text);
        check(format!("\u{feff}{text}").into_bytes(), &text);
        for big in [false, true] {
            let text = xml("UTF-16");
            check(utf_16(&text, big), &text);
            check(utf_16(&format!("\u{feff}{text}"), big), &text);
            check(utf_16("\u{feff}program 🚰", big), "program 🚰");
        }
        let single = |text: &str, euro: u8| -> Vec<u8> {
            let byte = |letter: char| if letter == '€' { euro } else { letter as u8 };
            text.chars().map(byte).collect()
        };
        let text = xml("windows-1252");
        check(single(&text, 0x80), &text);
        let text = xml("ISO-8859-1").replace('€', "ß");
        check(single(&text, 0), &text);
        check(b"program a".to_vec(), "program a");
        check(Vec::new(), "");
    }

    #[test]
    fn what_is_no_text_is_said_with_its_place() {
        let check = |bytes: Vec<u8>, expected: &str| {
            let said = decode(bytes).expect_err("no text").to_string();
            assert_eq!(said, expected);
        };
        check(
            b"program a\n-- F\xfcll".to_vec(),
            "byte 14, in line 2, is not UTF-8; save the file as UTF-8",
        );
        check(
            b"\xef\xbb\xbfa\xff".to_vec(),
            "byte 4, in line 1, is not UTF-8; save the file as UTF-8",
        );
        check(
            vec![0xff, 0xfe, b'a', 0, 0, 0xd8],
            "byte 4, in line 1, is not UTF-16; save the file as UTF-8",
        );
        check(
            vec![0xff, 0xfe, b'a', 0, b'b'],
            "byte 4, in line 1, is not UTF-16; save the file as UTF-8",
        );
        check(
            xml("Shift_JIS").into_bytes(),
            "its encoding `Shift_JIS` is not supported (known: UTF-8, UTF-16, ISO-8859-1, Windows-1252 and US-ASCII); save the file as \
             UTF-8",
        );
        check(
            xml("us-ascii").into_bytes(),
            "byte 49, in line 2, is not US-ASCII; save the file as UTF-8",
        );
    }
}
