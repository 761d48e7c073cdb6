use understudy_typed::Elementary;

use super::*;

fn literal(text: &str) -> Literal {
    let lexemes = lex(text);
    assert!(lexemes.diagnostics.is_empty(), "{text}: {:?}", lexemes.diagnostics);
    assert_eq!(lexemes.placed.len(), 2, "{text}");
    match &lexemes.placed[0].lexeme {
        Lexeme::Literal(literal) => (**literal).clone(),
        other => panic!("{text}: {other:?}"),
    }
}

fn code(text: &str) -> &'static str {
    lex(text).diagnostics.first().expect(text).code
}

#[test]
fn lexemes_and_comments() {
    let text = "(* above (* nested *) *) a := 16#fF; // behind\n{attribute 'x'} B >= 1..2 /* c */";
    let lexemes = lex(text);
    assert!(lexemes.diagnostics.is_empty(), "{:?}", lexemes.diagnostics);
    let written: Vec<&str> =
        lexemes.placed.iter().map(|placed| &text[placed.span.clone()]).collect();
    assert_eq!(written, ["a", ":=", "16#fF", ";", "B", ">=", "1", "..", "2", ""]);
    let comments = |index: usize| lexemes.placed[index].comments.clone().unwrap_or_default();
    assert_eq!(comments(0).above, ["above (* nested *)"]);
    assert_eq!(comments(3).behind.as_deref(), Some("behind"));
    assert_eq!(comments(8).behind.as_deref(), Some("c"));
    assert!(lexemes.placed[4].starts_line && !lexemes.placed[5].starts_line);
}

#[test]
fn a_comment_that_does_not_nest_ends_at_the_first_end() {
    let lexemes = lex("(* a (* b *) x; (* c *) y;");
    assert!(lexemes.diagnostics.is_empty());
    assert_eq!(lexemes.placed.len(), 5);
}

#[test]
fn lines_of_a_debugger_are_no_part_of_the_text() {
    let program = "(* a (* b *) x;\n";
    let debugger = [
        "(*DBG:char sum[] = \"0123\";*)",
        "(*DBG:/**)",
        "(*DBG: * text *)",
        "(*DBG: */*)",
        "(*DBG:void *place(int i)*)",
        "(*DBG:    return (void *)&((cell_t *) ptr)->value;*)",
        "(*DBG:*)",
    ];
    let words = |text: &str| {
        let lexemes = lex(text);
        assert!(lexemes.diagnostics.is_empty(), "{text}: {:?}", lexemes.diagnostics);
        let placed = lexemes.placed.iter().filter(|placed| !placed.span.is_empty());
        placed.map(|placed| text[placed.span.clone()].to_owned()).collect::<Vec<_>>()
    };
    for end in ["\n", "\r\n"] {
        for first in 0..debugger.len() {
            let lines = debugger[first..].join(end);
            assert_eq!(words(&format!("{program}{lines}")), ["x", ";"]);
            assert_eq!(
                words(&format!("{lines}{end}{program}{lines}{end}y;")),
                ["x", ";", "y", ";"]
            );
        }
    }
    // Such words in a line, or without an end in their line, are a comment like others.
    assert_eq!(words("x (*DBG: a *) ; (*DBG:*)"), ["x", ";"]);
    assert_eq!(words("(*DBG: a\n b *) x ;"), ["x", ";"]);
}

#[test]
fn whole_numbers() {
    let check = |text: &str, expected, kind| {
        let based = text.split('#').any(|part| matches!(part, "2" | "8" | "16"));
        let expected = Literal::Integer { value: expected, of: kind, based };
        assert_eq!(literal(text), expected, "{text}");
    };
    check("1_000", 1000, None);
    check("2#1010_1010", 0xAA, None);
    check("8#17", 15, None);
    check("18446744073709551615", i128::from(u64::MAX), None);
    check("INT#-5", -5, Some(Elementary::Int));
    check("int#16#FFFF", -1, Some(Elementary::Int));
    check("WORD#16#FF_FF", 0xFFFF, Some(Elementary::Word));
    check("W#16#12", 0x12, Some(Elementary::Word));
    check("USINT#255", 255, Some(Elementary::Usint));
    for text in
        ["18446744073709551616", "3#1", "2#2", "5abc", "SINT#128", "UINT#-1", "BOOL#2", "16#"]
    {
        assert_eq!(code(text), "U1032", "{text}");
    }
}

#[test]
fn real_numbers_are_kept_as_written() {
    let check = |text, expected: &str, of| {
        let text_of = expected.to_owned();
        assert_eq!(literal(text), Literal::Real { text: text_of, of }, "{text}");
    };
    check("3.000_300", "3.000300", None);
    check("3.2E+1", "3.2E+1", None);
    check("1e3", "1e3", None);
    check("REAL#-2.0E-8", "-2.0E-8", Some(Elementary::Real));
    check("LREAL#11", "11", Some(Elementary::Lreal));
    assert_eq!(literal("BOOL#1"), Literal::Boolean(true));
    assert_eq!(lex("1..2").placed.len(), 4);
    assert_eq!(lex("a.3.%X4").placed.len(), 6);
}

#[test]
fn times_are_nanoseconds() {
    let check = |text, expected, of| {
        let expected = Literal::Time { nanoseconds: expected, of };
        assert_eq!(literal(text), expected, "{text}");
    };
    check("T#1m30s", 90_000_000_000, Elementary::Time);
    check("t#-2.5ms", -2_500_000, Elementary::Time);
    check("TIME#1d_2h", 93_600_000_000_000, Elementary::Time);
    check("LTIME#1us5ns", 1_005, Elementary::Time);
    check("TIME#3.0d 4.0h", 273_600_000_000_000, Elementary::Time);
    check("T#106751d", 9_223_286_400_000_000_000, Elementary::Time);
    check("D#1970-01-02", 86_400_000_000_000, Elementary::Date);
    check("DATE#1969-12-31", -86_400_000_000_000, Elementary::Date);
    check("TOD#14:30:20.5", 52_220_500_000_000, Elementary::TimeOfDay);
    check("DT#2000-03-01-00:00:01", 951_868_801_000_000_000, Elementary::DateAndTime);
    let invalid = [
        "T#1s1h",
        "T#5",
        "T#",
        "T#1.5.2s",
        "T#200000d",
        "D#2023-02-29",
        "D#2023-13-01",
        "TOD#24:00:00",
        "DT#2023-01-01",
        "D#3000-01-01",
    ];
    for text in invalid {
        assert_eq!(code(text), "U1032", "{text}");
    }
}

#[test]
fn a_day_is_found_again() {
    for day in (-100_000..100_000).step_by(37) {
        let (year, month, of_month) = calendar(day);
        let text = format!("D#{year:04}-{month:02}-{of_month:02}");
        if let Literal::Time { nanoseconds, .. } = literal(&text) {
            assert_eq!(nanoseconds / 86_400_000_000_000, day, "{text}");
        }
    }
}

#[test]
fn texts_resolve_their_sequences() {
    let check = |text, expected: &[u8], wide| {
        let bytes = expected.to_vec();
        assert_eq!(literal(text), Literal::Text { bytes, wide }, "{text}");
    };
    check("'a$'b$$$0Ac$l'", b"a'b$\nc\n", false);
    check("'é \"'", b"\xE9 \"", false);
    check("\"a'$0041\"", b"a'A", true);
    check("STRING#'x'", b"x", false);
    assert_eq!(code("'$zz'"), "U1032");
    assert_eq!(code("'日'"), "U1040");
    assert_eq!(code("'a\nb'"), "U1031");
    assert_eq!(code("(* a"), "U1031");
    assert_eq!(code("{IF defined (x)}"), "U1040");
    assert_eq!(code("größe"), "U1030");
    assert_eq!(code("S5T#1s"), "U1040");
}
