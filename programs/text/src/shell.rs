//! Words of a POSIX shell.

/// A word that a shell reads as `text`, in quotes where it needs them.
pub fn word(text: &str) -> String {
    let is_plain = |letter: char| letter.is_ascii_alphanumeric() || "-_./:=,".contains(letter);
    if !text.is_empty() && text.chars().all(is_plain) { text.to_owned() } else { quoted(text) }
}

/// A word that a shell reads as `text`, always in quotes.
pub fn quoted(text: &str) -> String {
    if text.contains('\'') && !text.contains(['"', '$', '`', '\\', '!']) {
        format!("\"{text}\"")
    } else {
        format!("'{}'", text.replace('\'', r"'\''"))
    }
}

/// A command line that a shell reads as these words.
pub fn line<'a>(words: impl IntoIterator<Item = &'a str>) -> String {
    let words: Vec<String> = words.into_iter().map(word).collect();
    words.join(" ")
}

#[cfg(test)]
mod tests {
    use std::process::Command;

    use super::*;

    #[test]
    fn a_shell_reads_the_words_as_they_are_meant() {
        for text in [
            "",
            "plain",
            "--key=1%,a:b",
            "~",
            "with spaces",
            "it's",
            "it's $HOME",
            "$HOME `id` \"x\"",
            "a;b|c>d",
        ] {
            for word in [word(text), quoted(text)] {
                let printed = Command::new("sh")
                    .args(["-c", &format!("printf '%s;' {word}")])
                    .output()
                    .expect("a shell");
                assert_eq!(String::from_utf8_lossy(&printed.stdout), format!("{text};"));
            }
        }
    }

    #[test]
    fn only_words_that_need_quotes_have_them() {
        assert_eq!(line(["a.toml", "", "two words"]), "a.toml '' 'two words'");
    }
}
