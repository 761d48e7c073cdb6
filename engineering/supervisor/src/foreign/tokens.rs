//! The tokens of libFAUDES' files: words, texts in quotes, flags between plus signs, and tags. A `%` begins a comment.

use std::ops::Range;

/// A token.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Token<'t> {
    /// A word without quotes that is a whole number.
    Number(u64),
    /// A hexadecimal number: flags by their bits.
    Hexadecimal(u64),
    /// Another word, or a text in quotes.
    Text(&'t str),
    /// Flags between plus signs.
    Flags(&'t str),
    /// A tag that begins a section, with its attributes.
    Begin(&'t str, Vec<(&'t str, &'t str)>),
    /// A tag that ends a section.
    End(&'t str),
    /// Quotes or a tag without an end.
    Unfinished,
}

/// A token with its place.
pub(super) type Placed<'t> = (Token<'t>, Range<usize>);

/// The tokens of a text. `<name/>` is a section that begins and ends.
pub(super) fn tokens(text: &str) -> Vec<Placed<'_>> {
    let mut tokens = Vec::new();
    let mut at = 0;
    while let Some(first) = text[at..].chars().next() {
        let rest = &text[at..];
        let length = match first {
            _ if first.is_whitespace() || first == '\u{feff}' => first.len_utf8(),
            '%' => rest.find('\n').unwrap_or(rest.len()),
            '<' if rest.starts_with("<!--") => rest.find("-->").map_or(rest.len(), |end| end + 3),
            '<' => tag(rest, at, &mut tokens),
            '"' => enclosed(rest, at, '"', &mut tokens),
            '+' => enclosed(rest, at, '+', &mut tokens),
            _ => {
                let is_end = |letter: char| letter.is_whitespace() || letter == '<';
                let length = rest.find(is_end).unwrap_or(rest.len());
                tokens.push((word(&rest[..length]), at..at + length));
                length
            }
        };
        at += length;
    }
    tokens
}

fn word(word: &str) -> Token<'_> {
    if let Some(digits) = word.strip_prefix("0x")
        && let Ok(number) = u64::from_str_radix(digits, 16)
    {
        return Token::Hexadecimal(number);
    }
    match word.parse() {
        Ok(number) => Token::Number(number),
        Err(_) => Token::Text(word),
    }
}

/// A text between two equal signs; the length of it.
fn enclosed<'t>(rest: &'t str, at: usize, sign: char, tokens: &mut Vec<Placed<'t>>) -> usize {
    let end = rest[1..].find([sign, '\n']).filter(|&end| rest[1 + end..].starts_with(sign));
    let Some(end) = end else {
        tokens.push((Token::Unfinished, at..at + 1));
        return rest.find('\n').unwrap_or(rest.len());
    };
    let inside = &rest[1..=end];
    let token = if sign == '"' { Token::Text(inside) } else { Token::Flags(inside) };
    tokens.push((token, at..at + end + 2));
    end + 2
}

/// A tag; the length of it. Declarations of XML are no tokens.
fn tag<'t>(rest: &'t str, at: usize, tokens: &mut Vec<Placed<'t>>) -> usize {
    let Some(end) = rest.find('>') else {
        tokens.push((Token::Unfinished, at..at + 1));
        return rest.len();
    };
    let place = at..at + end + 1;
    let inside = rest[1..end].trim();
    if let Some(name) = inside.strip_prefix('/') {
        tokens.push((Token::End(name.trim()), place));
    } else if !inside.starts_with(['?', '!']) {
        let (inside, is_empty) = match inside.strip_suffix('/') {
            Some(inside) => (inside, true),
            None => (inside, false),
        };
        let (name, attributes) = inside.split_once(char::is_whitespace).unwrap_or((inside, ""));
        tokens.push((Token::Begin(name, pairs(attributes)), place.clone()));
        if is_empty {
            tokens.push((Token::End(name), place));
        }
    }
    end + 1
}

/// `key="value"`, as many as there are.
fn pairs(mut text: &str) -> Vec<(&str, &str)> {
    let mut pairs = Vec::new();
    while let Some((key, rest)) = text.split_once('=') {
        let Some((value, rest)) =
            rest.trim_start().strip_prefix('"').and_then(|rest| rest.split_once('"'))
        else {
            break;
        };
        pairs.push((key.trim(), value));
        text = rest;
    }
    pairs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_texts_flags_and_tags() {
        let text =
            "<Generator name=\"a b\">% no\n1 0x1 \"two words\" +Co+ up<Initial/></T>\"open\n+x";
        let found: Vec<Token<'_>> = tokens(text).into_iter().map(|(token, _)| token).collect();
        let expected = [
            Token::Begin("Generator", vec![("name", "a b")]),
            Token::Number(1),
            Token::Hexadecimal(1),
            Token::Text("two words"),
            Token::Flags("Co"),
            Token::Text("up"),
            Token::Begin("Initial", Vec::new()),
            Token::End("Initial"),
            Token::End("T"),
            Token::Unfinished,
            Token::Unfinished,
        ];
        assert_eq!(found, expected);
    }
}
