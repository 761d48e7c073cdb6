//! Text from files, from the network and from other people, made fit for a terminal.
//!
//! A terminal obeys control characters: they clear it, change what it shows, or answer in the place of the person. Characters that turn the
//! direction of text show another text than there is. All text that is printed goes through here.

use std::borrow::Cow;
use std::fmt::Write as _;

/// Whether a terminal does not show a character, but obeys it. Tabs and the ends of lines are shown.
fn is_hidden(character: char) -> bool {
    let turns = matches!(
        character,
        '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}'
    );
    turns || character.is_control() && !matches!(character, '\n' | '\t')
}

/// `text` with each hidden character as its escape sequence in Rust, such as `\u{1b}`. The end of a line may be CR LF.
pub fn visible(text: &str) -> Cow<'_, str> {
    replaced(text, |visible, character| {
        // A string takes all that is written.
        let _ = write!(visible, "{}", character.escape_unicode());
    })
}

/// A JSON text with each hidden character as its escape sequence in JSON, such as `\u009b`. Such characters are in strings only.
pub fn visible_json(text: &str) -> Cow<'_, str> {
    replaced(text, |visible, character| {
        let mut units = [0; 2];
        for unit in character.encode_utf16(&mut units) {
            let _ = write!(visible, "\\u{unit:04x}");
        }
    })
}

fn replaced(text: &str, replace: impl Fn(&mut String, char)) -> Cow<'_, str> {
    if !text.contains(is_hidden) {
        return Cow::Borrowed(text);
    }
    let mut visible = String::with_capacity(text.len() + 16);
    let mut characters = text.chars().peekable();
    while let Some(character) = characters.next() {
        let ends_line = character == '\r' && characters.peek() == Some(&'\n');
        if is_hidden(character) && !ends_line {
            replace(&mut visible, character);
        } else {
            visible.push(character);
        }
    }
    Cow::Owned(visible)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hidden_characters_are_shown_and_no_others_change() {
        let check = |text: &str, expected: &str| assert_eq!(visible(text), expected);
        check("\u{1b}]0;title\u{7}", "\\u{1b}]0;title\\u{7}");
        check("a\rb\r\nc\td", "a\\u{d}b\r\nc\td");
        check("\u{9b}2J \u{202e}abc", "\\u{9b}2J \\u{202e}abc");
        check("Füllstand ≥ 5 °C 水位", "Füllstand ≥ 5 °C 水位");
        assert!(matches!(visible("plain"), Cow::Borrowed(_)));
    }

    /// All characters that there are.
    #[test]
    fn no_character_that_a_terminal_obeys_is_left() {
        for character in '\0'..=char::MAX {
            let text = String::from(character);
            let shown = visible(&text);
            assert!(!shown.contains(is_hidden), "{character:?}");
            assert_eq!(shown == text, !is_hidden(character), "{character:?}");
        }
    }

    #[test]
    fn a_json_text_keeps_its_meaning() {
        for character in ('\0'..='\u{2100}').chain(['\u{10ffff}', '水']) {
            let text = serde_json::json!({ "line": format!("a{character}b") }).to_string();
            let shown = visible_json(&text);
            assert!(!shown.contains(is_hidden), "{character:?}");
            let (read, written): (serde_json::Value, serde_json::Value) = (
                serde_json::from_str(&shown).expect("JSON"),
                serde_json::from_str(&text).expect("JSON"),
            );
            assert_eq!(read, written);
        }
    }
}
