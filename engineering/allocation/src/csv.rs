//! Comma-separated values as RFC 4180 has them: quotes around fields with commas, quotes or line ends; a quote in quotes is doubled.
//!
//! Every field remembers where it stood, so that what is wrong with it can be pointed at.

use std::ops::Range;

use understudy_text::Diagnostic;

/// A field and where it stood.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Field {
    pub(crate) text: String,
    pub(crate) span: Range<usize>,
}

/// The records of `text`, without empty lines; what is wrong with quotes is added to `wrong`.
pub(crate) fn records(text: &str, wrong: &mut Vec<Diagnostic>) -> Vec<Vec<Field>> {
    let mut records = Vec::new();
    let mut record = Vec::new();
    let mut at = if text.starts_with('\u{feff}') { 3 } else { 0 };
    loop {
        let (field, next) = field(text, at, wrong);
        let rest = &text[next..];
        record.push(field);
        if rest.starts_with(',') {
            at = next + 1;
            continue;
        }
        let is_empty = record.len() == 1 && record[0].text.is_empty();
        let whole = std::mem::take(&mut record);
        if !is_empty {
            records.push(whole);
        }
        if rest.is_empty() {
            return records;
        }
        at = next + if rest.starts_with("\r\n") { 2 } else { 1 };
    }
}

/// The field at `at` and the place of the comma or line end behind it.
fn field(text: &str, at: usize, wrong: &mut Vec<Diagnostic>) -> (Field, usize) {
    let end_of_plain = |from: usize| {
        let end = text[from..].find([',', '\n', '\r']);
        end.map_or(text.len(), |end| from + end)
    };
    if !text[at..].starts_with('"') {
        let end = end_of_plain(at);
        let plain = &text[at..end];
        if let Some(quote) = plain.find('"') {
            let span = at + quote..at + quote + 1;
            let message = "a quote inside a field that does not begin with one";
            let help = "quote the whole field and double the quotes in it";
            wrong.push(Diagnostic::error("U1101", message, span).with_help(help));
        }
        let field = Field { text: plain.trim().to_owned(), span: at..end };
        return (field, end);
    }
    let mut content = String::new();
    let mut from = at + 1;
    loop {
        let Some(quote) = text[from..].find('"').map(|quote| from + quote) else {
            let message = "missing closing quote in this field";
            wrong.push(Diagnostic::error("U1101", message, at..at + 1));
            let field = Field { text: content, span: at..text.len() };
            return (field, text.len());
        };
        content.push_str(&text[from..quote]);
        if text[quote + 1..].starts_with('"') {
            content.push('"');
            from = quote + 2;
            continue;
        }
        let end = end_of_plain(quote + 1);
        if !text[quote + 1..end].trim().is_empty() {
            let message = "text after the closing quote of this field";
            wrong.push(Diagnostic::error("U1101", message, quote + 1..end));
        }
        let field = Field { text: content, span: at..end };
        return (field, end);
    }
}

/// A record as a line.
pub(crate) fn line<S: AsRef<str>>(fields: &[S]) -> String {
    let mut line = String::new();
    for (place, field) in fields.iter().enumerate() {
        if place > 0 {
            line.push(',');
        }
        let field = field.as_ref();
        let plain = !field.contains([',', '"', '\n', '\r']) && field.trim() == field;
        if plain {
            line.push_str(field);
        } else {
            line.push('"');
            line.push_str(&field.replace('"', "\"\""));
            line.push('"');
        }
    }
    line.push('\n');
    line
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(text: &str) -> (Vec<Vec<String>>, usize) {
        let mut wrong = Vec::new();
        let found = records(text, &mut wrong).into_iter();
        let found = found.map(|record| record.into_iter().map(|field| field.text).collect());
        (found.collect(), wrong.len())
    }

    #[test]
    fn quotes_hold_commas_and_line_ends() {
        let (found, wrong) = texts("a,\"b, \"\"c\"\"\nd\"\r\n\r\n,x\n");
        assert_eq!(found, [["a", "b, \"c\"\nd"], ["", "x"]]);
        assert_eq!(wrong, 0);
    }

    #[test]
    fn bad_quotes_are_said_and_nothing_is_lost_in_silence() {
        assert_eq!(texts("a\"b,c").1, 1);
        assert_eq!(texts("\"a").1, 1);
        assert_eq!(texts("\"a\"b,c").1, 1);
        assert_eq!(texts("é\"é,\"é").1, 2);
    }

    #[test]
    fn what_is_written_is_read_again() {
        let fields = ["", "a", " b ", "c,d", "e\"f", "g\nh", "\"", "ü"];
        let (found, wrong) = texts(&line(&fields));
        assert_eq!((found, wrong), (vec![fields.map(str::to_owned).to_vec()], 0));
    }
}
