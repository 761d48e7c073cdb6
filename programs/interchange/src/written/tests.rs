use super::*;

const EVERY_ELEMENT: &str = include_str!("../../../ladder/tests/ladder/every-element.ladder");

fn program() -> Program {
    let (program, _) =
        understudy_ladder::parse(EVERY_ELEMENT).into_result().expect("a sound program");
    program
}

/// Whether a difference between the program and the text is found.
fn is_found(format: Format, program: &Program, text: &str) -> bool {
    let period = Some(Duration::from_millis(10));
    let whole = write(format, program, period).expect("it can be written");
    match compare(format, program, period, text) {
        Err(_) => true,
        Ok((losses, compared)) => losses != whole.losses || compared != whole.compared,
    }
}

/// No line of a text can be taken away without a finding, but those that hold nothing of the program.
fn no_line_goes_unnoticed(format: Format, means_nothing: &dyn Fn(&str) -> bool) {
    let program = program();
    let written = write(format, &program, Some(Duration::from_millis(10)));
    let text = written.expect("it can be written").text;
    let lines: Vec<&str> = text.lines().collect();
    let mut missed = Vec::new();
    for place in 0..lines.len() {
        let mut less = lines.clone();
        let line = less.remove(place);
        if !means_nothing(line) && !is_found(format, &program, &less.join("\n")) {
            missed.push(line);
        }
    }
    assert!(missed.is_empty(), "{missed:#?}\n{text}");
}

#[test]
fn no_line_of_a_ladder_goes_unnoticed() {
    no_line_goes_unnoticed(Format::Ladder, &|line| line.trim().is_empty());
}

#[test]
fn no_line_of_structured_text_goes_unnoticed() {
    no_line_goes_unnoticed(Format::StructuredText, &|line| {
        let line = line.trim();
        let is_frame = ["VAR", "END_VAR", "RESOURCE", "END_RESOURCE", "PROGRAM instance0"];
        line.is_empty() || is_frame.iter().any(|word| line.starts_with(word))
    });
}

#[test]
fn what_a_form_cannot_hold_is_a_warning() {
    let written = write(Format::Ladder, &program(), Some(Duration::from_millis(20)));
    let losses = written.expect("it can be written").losses;
    let messages: Vec<&str> = losses.iter().map(|found| found.message.as_str()).collect();
    assert_eq!(messages, ["the ladder format does not keep the interval of the task: 20ms"]);
}

#[test]
fn a_text_that_does_something_else_is_refused() {
    let program = program();
    let text = print(&program).replacen("500ms", "510ms", 1);
    assert!(is_found(Format::Ladder, &program, &text));
    let text = print(&program).replacen("(S ", "(R ", 1);
    let found = compare(Format::Ladder, &program, None, &text);
    assert!(matches!(found, Err(WriteError::Different(_))), "{found:?}");
}
