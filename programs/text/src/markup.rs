//! Text in XML, SVG and HTML.

/// A text as the content of an element or as a value in double quotes.
///
/// XML cannot hold most control characters; `U+FFFD` replaces them.
pub fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\n' => escaped.push('\n'),
            _ if character.is_control() || matches!(character, '\u{fffe}' | '\u{ffff}') => {
                escaped.push('\u{fffd}');
            }
            _ => escaped.push(character),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signs_of_markup_and_control_characters_are_replaced() {
        assert_eq!(
            escaped("a<b> & \"c\"\n\u{7}'d'"),
            "a&lt;b&gt; &amp; &quot;c&quot;\n\u{fffd}'d'"
        );
    }
}
