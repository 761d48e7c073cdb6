//! A small reader of Structured Text, apart from what writes it: Boolean variables and assignments.

use std::collections::HashMap;

pub(crate) struct StructuredText {
    inputs: Vec<String>,
    outputs: Vec<String>,
    values: HashMap<String, bool>,
    assignments: Vec<(String, Vec<String>)>,
}

impl StructuredText {
    pub(crate) fn read(source: &str) -> Self {
        let mut text = Self {
            inputs: Vec::new(),
            outputs: Vec::new(),
            values: HashMap::new(),
            assignments: Vec::new(),
        };
        let words = words(source);
        let mut words = words.iter().map(String::as_str);
        assert_eq!(words.next(), Some("PROGRAM"));
        words.next().expect("a name");
        loop {
            let word = words.next().expect("END_PROGRAM");
            match word {
                "END_PROGRAM" => break,
                "VAR" | "VAR_INPUT" | "VAR_OUTPUT" => text.declarations(word, &mut words),
                target => {
                    assert_eq!(words.next(), Some(":="));
                    let expression = words.by_ref().take_while(|word| *word != ";");
                    let expression = expression.map(str::to_owned).collect();
                    text.assignments.push((target.to_owned(), expression));
                }
            }
        }
        assert_eq!(words.next(), Some("CONFIGURATION"));
        text
    }

    fn declarations<'a>(&mut self, section: &str, words: &mut impl Iterator<Item = &'a str>) {
        while let Some(name) = words.next().filter(|word| *word != "END_VAR") {
            let legal = |byte: u8| byte.is_ascii_alphanumeric() || byte == b'_';
            assert!(
                name.bytes().all(legal) && !name.contains("__") && !name.ends_with('_'),
                "{name}"
            );
            assert_eq!((words.next(), words.next()), (Some(":"), Some("BOOL")));
            let mut value = false;
            if words.next() == Some(":=") {
                value = words.next() == Some("TRUE");
                assert_eq!(words.next(), Some(";"));
            }
            let same = |known: &String| known.eq_ignore_ascii_case(name);
            assert!(!self.values.keys().any(same), "{name} is declared twice");
            self.values.insert(name.to_owned(), value);
            match section {
                "VAR_INPUT" => self.inputs.push(name.to_owned()),
                "VAR_OUTPUT" => self.outputs.push(name.to_owned()),
                _ => {}
            }
        }
    }

    pub(crate) fn execute(&mut self, inputs: &[bool]) -> Vec<bool> {
        assert_eq!(inputs.len(), self.inputs.len());
        for (name, &value) in self.inputs.iter().zip(inputs) {
            self.values.insert(name.clone(), value);
        }
        for (target, expression) in &self.assignments {
            let mut rest = expression.as_slice();
            let value = or(&mut rest, &self.values);
            assert!(rest.is_empty(), "{rest:?}");
            *self.values.get_mut(target).expect("a declared variable") = value;
        }
        self.outputs.iter().map(|name| self.values[name]).collect()
    }
}

fn words(source: &str) -> Vec<String> {
    let mut text = String::new();
    let mut rest = source;
    while let Some((before, after)) = rest.split_once("(*") {
        text.push_str(before);
        rest = after.split_once("*)").expect("a comment ends").1;
    }
    text.push_str(rest);
    let text = text.replace(":=", " \u{1} ").replace(':', " : ").replace('\u{1}', ":=");
    let text = text.replace(';', " ; ").replace('(', " ( ").replace(')', " ) ");
    text.split_whitespace().map(str::to_owned).collect()
}

type Values = HashMap<String, bool>;

fn chain(
    rest: &mut &[String],
    values: &Values,
    word: &str,
    operand: fn(&mut &[String], &Values) -> bool,
    join: fn(bool, bool) -> bool,
) -> bool {
    let mut value = operand(rest, values);
    while rest.first().is_some_and(|first| first == word) {
        *rest = &rest[1..];
        value = join(value, operand(rest, values));
    }
    value
}

fn or(rest: &mut &[String], values: &Values) -> bool {
    chain(rest, values, "OR", xor, |left, right| left | right)
}

fn xor(rest: &mut &[String], values: &Values) -> bool {
    chain(rest, values, "XOR", and, |left, right| left ^ right)
}

fn and(rest: &mut &[String], values: &Values) -> bool {
    chain(rest, values, "AND", factor, |left, right| left & right)
}

fn factor(rest: &mut &[String], values: &Values) -> bool {
    let (word, after) = rest.split_first().expect("an operand");
    *rest = after;
    match word.as_str() {
        "NOT" => !factor(rest, values),
        "TRUE" => true,
        "FALSE" => false,
        "(" => {
            let value = or(rest, values);
            let (closing, after) = rest.split_first().expect("a closing bracket");
            assert_eq!(closing, ")");
            *rest = after;
            value
        }
        name => values[name],
    }
}
