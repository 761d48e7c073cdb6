//! What is read of a file, to be compared.

use understudy_interchange::{
    Bodies, Format, Source, SourceFile, Wanted, read, read_source, typed_text,
};
use understudy_ladder::print;

/// The program of a file with what is found in it, as every command takes it.
pub(crate) fn source(format: Format, text: &str) -> SourceFile {
    read_source(name(format), text, Wanted::default())
}

fn name(format: Format) -> &'static str {
    match format {
        Format::Ladder => "file.ladder",
        Format::PlcOpen | Format::Digraph => "file.xml",
        Format::StructuredText => "file.st",
        Format::LdMicro => "file.ld",
    }
}

/// What a reading is, but for the places in the file.
pub(crate) fn reading(format: Format, text: &str) -> String {
    let file = source(format, text);
    let ladder = file.ladder().map(print);
    let SourceFile { source, period, diagnostics, .. } = file;
    let program = match source {
        Some(Source::Program(_)) if ladder.is_some() => ladder.unwrap_or_default(),
        Some(Source::Program(program)) => {
            // Comments stand in what is written of it.
            let form = Format::StructuredText;
            let written = typed_text(name(format), text, Wanted::default(), form, Bodies::AsRead);
            let written = written.unwrap_or_else(|error| panic!("{error}\n{text}")).0;
            format!("{program:?}\n{}", written.map(|it| it.text).unwrap_or_default())
        }
        other => format!("{other:?}"),
    };
    let notes = read(format, "file", text, None).fidelity.notes;
    let mut said: Vec<String> = diagnostics
        .iter()
        .map(|found| format!("{:?} {} {}", found.severity, found.code, found.message))
        .chain(notes.iter().map(|note| note.message.clone()))
        .collect();
    said.sort();
    format!("{program}\n{period:?}\n{}", said.join("\n"))
}
