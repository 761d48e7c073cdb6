//! A project: types, blocks, lists of variables and programs in files of their own, of TwinCAT, as PLCopen XML and as Structured Text.
//!
//! The files are read as one document: objects of TwinCAT and PLCopen documents are elements of it as they are, a Structured Text is the text
//! of an element. Pieces of the files stand in it byte by byte, so a place in the document is a place in a file.

mod groups;
mod named;

use std::ops::Range;

use understudy_text::{Diagnostic, Report};

pub use self::groups::groups;
use self::named::missed;
pub use self::named::{ProjectFile, read_project};
use crate::format::Format;
use crate::plcopen::xml::{elements, parse, start_tag};
use crate::twincat::{ROOT, TEXT};

/// Ends of the names of files of TwinCAT that hold parts of a program.
const ENDINGS: [&str; 5] = ["tcpou", "tcdut", "tcgvl", "tcio", "tctto"];

/// The document without its elements.
const START: &str = "<TcPlcObject>";
const END: &str = "</TcPlcObject>";

/// In front of a text that is kept as it is, and behind it.
const KEPT: (&str, &str) = ("<![CDATA[", "]]>");

/// The files of a project as one document.
#[derive(Debug, Clone, Default)]
pub struct Joined {
    /// The document.
    pub text: String,
    /// Names and texts; that of the project is the last one.
    files: Vec<(String, String)>,
    pieces: Vec<Piece>,
    /// Libraries of the project that are not here, with the places of the references.
    libraries: Vec<(String, Range<usize>)>,
}

/// A part of the document that is a part of a file.
#[derive(Debug, Clone)]
struct Piece {
    /// Where it begins in the document.
    start: usize,
    file: usize,
    /// Where it begins in the file.
    from: usize,
}

/// Whether a file is one of a TwinCAT project, by the end of its name.
pub fn is_part(name: &str) -> bool {
    let ending = name.rsplit_once('.').map(|(_, ending)| ending);
    ending.is_some_and(|ending| ENDINGS.iter().any(|known| known.eq_ignore_ascii_case(ending)))
}

/// Whether a file can be one of a project with other files: it declares what others use.
pub fn can_be_joined(name: &str, text: &str) -> bool {
    matches!(Format::of(name, text), Some(Format::StructuredText | Format::PlcOpen))
}

impl Joined {
    /// Joins files, each with its name.
    ///
    /// # Errors
    /// Reports on the files that are not well-formed, or of a form that has no parts of a project (U1092).
    pub fn of(files: Vec<(String, String)>) -> Result<Self, Vec<Report>> {
        let mut joined = Self { text: START.to_owned(), files, ..Self::default() };
        let mut wrong = Vec::new();
        for (file, (name, text)) in std::mem::take(&mut joined.files).into_iter().enumerate() {
            let found = match Format::of(&name, &text) {
                Some(Format::StructuredText) => {
                    joined.push_text(file, &text);
                    Ok(())
                }
                Some(Format::PlcOpen) => {
                    within(&text).map(|within| joined.push(file, &text, within))
                }
                _ => Err(alone()),
            };
            if let Err(found) = found {
                wrong.push(Report {
                    name: name.clone(),
                    text: text.clone(),
                    diagnostics: vec![found],
                });
            }
            joined.text.push('\n');
            joined.files.push((name, text));
        }
        joined.text += END;
        if wrong.is_empty() { Ok(joined) } else { Err(wrong) }
    }

    /// Joins the files of a project, of which those at the places `missing` in its own file cannot be read: the document says so (U1090).
    ///
    /// # Errors
    /// As [`Self::of`].
    pub fn of_project(
        project: ProjectFile,
        files: Vec<(String, String)>,
        missing: &[Range<usize>],
    ) -> Result<Self, Vec<Report>> {
        let mut joined = Self::of(files)?;
        joined.text.truncate(joined.text.len() - END.len());
        for place in missing {
            joined.push(joined.files.len(), &project.text, place.clone());
        }
        joined.text += END;
        joined.files.push((project.name, project.text));
        joined.libraries = project.libraries;
        Ok(joined)
    }

    fn push(&mut self, file: usize, text: &str, part: Range<usize>) {
        self.pieces.push(Piece { start: self.text.len(), file, from: part.start });
        self.text += &text[part];
    }

    /// A Structured Text; what would end the text of an element is divided.
    fn push_text(&mut self, file: usize, text: &str) {
        self.text += &format!("<{TEXT}>");
        let legal: String = text.chars().flat_map(legal).collect();
        let (opening, closing) = KEPT;
        let mut from = 0;
        while from < legal.len() {
            let end = legal[from..].find(closing).map_or(legal.len(), |place| from + place + 2);
            self.text += opening;
            self.push(file, &legal, from..end);
            self.text += closing;
            from = end;
        }
        self.text += &format!("</{TEXT}>");
    }

    /// The name of the first file.
    pub fn first(&self) -> Option<&str> {
        self.pieces
            .first()
            .and_then(|piece| self.files.get(piece.file))
            .map(|(name, _)| name.as_str())
    }

    /// What was found in the document, file by file. What has no place is a finding on the first file.
    pub fn reports(&self, mut diagnostics: Vec<Diagnostic>) -> Vec<Report> {
        let position = |found: &Diagnostic| {
            let (file, span) = self.place(&found.span);
            self.position(file, span.start)
        };
        let missed = missed(&self.libraries, &self.text, &mut diagnostics, &position);
        let report = |(name, text): &(String, String)| Report {
            name: name.clone(),
            text: text.clone(),
            diagnostics: Vec::new(),
        };
        let mut reports: Vec<Report> = self.files.iter().map(report).collect();
        for mut found in diagnostics {
            let (file, span) = self.place(&found.span);
            found.span = span;
            for mut related in std::mem::take(&mut found.related) {
                let (other, span) = self.place(&related.span);
                related.span = span;
                if other == file {
                    found.related.push(related);
                    continue;
                }
                // An excerpt shows one file.
                let place =
                    format!("{}: {}", self.position(other, related.span.start), related.message);
                let help = found.help.take().map(|help| format!("{help}; "));
                found.help = Some(help.unwrap_or_default() + &place);
            }
            if let Some(report) = reports.get_mut(file) {
                report.diagnostics.push(found);
            }
        }
        if let Some(project) = reports.last_mut() {
            project.diagnostics.extend(missed);
        }
        reports
    }

    /// The file of a place in the document, and the place there.
    fn place(&self, span: &Range<usize>) -> (usize, Range<usize>) {
        let piece = |place: usize| {
            let after = self.pieces.partition_point(|piece| piece.start <= place);
            self.pieces.get(after.saturating_sub(1))
        };
        let Some(first) = piece(span.start) else {
            return (0, 0..0);
        };
        let length = self.files.get(first.file).map_or(0, |(_, text)| text.len());
        let moved = |piece: &Piece, place: usize| {
            (place.saturating_sub(piece.start) + piece.from).min(length)
        };
        let start = moved(first, span.start);
        let end = match span.end.checked_sub(1).and_then(piece) {
            Some(last) if last.file == first.file => moved(last, span.end),
            _ => start,
        };
        (first.file, start..end.max(start))
    }

    /// The name of a file, without its folders, and the line of a place in it.
    fn position(&self, file: usize, place: usize) -> String {
        let (name, text) = self.files.get(file).map_or(("", ""), |(name, text)| (name, text));
        let line = text.get(..place).map_or(1, |before| before.matches('\n').count() + 1);
        format!("{}:{line}", name.rsplit(['/', '\\']).next().unwrap_or(name))
    }
}

/// A letter as XML can have it, in as many bytes: what ends a page is a blank, any other control character one without a meaning.
fn legal(letter: char) -> impl Iterator<Item = char> {
    let count = letter.len_utf8();
    match letter {
        '\u{b}' | '\u{c}' | '\u{feff}' => std::iter::repeat_n(' ', count),
        '\t' | '\n' | '\r' => std::iter::repeat_n(letter, 1),
        '\0'..'\u{20}' | '\u{fffe}' | '\u{ffff}' => std::iter::repeat_n('\u{7f}', count),
        _ => std::iter::repeat_n(letter, 1),
    }
}

/// The error on a file that other files have no part in.
fn alone() -> Diagnostic {
    let message = "a file of this form is a program of its own, and no part of a project";
    let error = Diagnostic::error("U1092", message, 0..0);
    error.with_help("the files of a project are Structured Text, PLCopen XML or of TwinCAT")
}

/// What stands in the document of a file: its objects, or the whole of a PLCopen document.
#[expect(clippy::result_large_err, reason = "once for a file")]
fn within(text: &str) -> Result<Range<usize>, Diagnostic> {
    let document = parse(text)?;
    let root = document.root_element();
    match root.tag_name().name() {
        ROOT => {}
        "project" => return Ok(root.range()),
        name => {
            let message = format!("this is no file of TwinCAT or PLCopen: its root is `{name}`");
            return Err(Diagnostic::error("U1001", message, start_tag(root)));
        }
    }
    let mut objects = elements(root);
    let Some(first) = objects.next() else {
        return Ok(0..0);
    };
    let last = objects.last().unwrap_or(first);
    Ok(first.range().start..last.range().end)
}

#[cfg(test)]
mod tests {
    use understudy_text::has_errors;

    use super::{Joined, is_part, read_project};
    use crate::{Source, Wanted, read_source};

    fn object(element: &str, name: &str, declaration: &str, body: &str) -> (String, String) {
        let ending = if element == "POU" { "TcPOU" } else { "TcDUT" };
        let body = match body {
            "" => String::new(),
            body => format!("<Implementation><ST><![CDATA[{body}]]></ST></Implementation>"),
        };
        let text = format!(
            "\u{feff}<?xml version=\"1.0\"?>\r\n<TcPlcObject Version=\"1\">\r\n<{element} Name=\"{name}\"><Declaration><![CDATA[{declaration}]]></Declaration>{body}</{element}>\r\n</TcPlcObject>\r\n"
        );
        (format!("{name}.{ending}"), text)
    }

    fn files() -> Vec<(String, String)> {
        vec![
            object(
                "POU",
                "MAIN",
                "PROGRAM MAIN VAR_INPUT a : BOOL; END_VAR VAR_OUTPUT q : BOOL; END_VAR VAR s : Switch; END_VAR",
                "s(set := a);\r\nq := s.now = Mode.on;",
            ),
            object("DUT", "Mode", "TYPE Mode : (off, on); END_TYPE", ""),
            object(
                "POU",
                "Switch",
                "FUNCTION_BLOCK Switch VAR_INPUT set : BOOL; END_VAR VAR_OUTPUT now : Mode; END_VAR",
                "IF set THEN now := Mode.on; ELSE now := Mode.off; END_IF",
            ),
            ("Plc.TcTTO".to_owned(), "<TcPlcObject><Task Name=\"Plc\"><CycleTime>20000</CycleTime><Priority>20</Priority><PouCall><Name>MAIN</Name></PouCall></Task></TcPlcObject>".to_owned()),
        ]
    }

    /// In any order the files are one program, with the period of its task.
    #[test]
    fn the_files_of_a_project_are_one_program() {
        for turn in 0..4 {
            let mut files = files();
            files.rotate_left(turn);
            let joined = Joined::of(files).expect("files of TwinCAT");
            let read = read_source("project.plcproj", &joined.text, Wanted::default());
            assert!(!has_errors(&read.diagnostics), "{:#?}", read.diagnostics);
            assert!(matches!(read.source, Some(Source::Program(_))));
            assert_eq!(read.period, Some(std::time::Duration::from_millis(20)));
        }
    }

    /// What is wrong is said in its file, at its place.
    #[test]
    fn a_finding_is_one_of_its_file() {
        for at in 0..3 {
            let mut files = files();
            files.truncate(3);
            let name = files[at].0.clone();
            let wrong = ["missing", "Mode : (off, on", "missing"][at];
            files[at].1 = match at {
                0 => files[at].1.replace("set := a", "set := missing"),
                1 => files[at].1.replace("Mode : (off, on)", "Mode : (off, on"),
                _ => files[at].1.replace("IF set", "IF missing"),
            };
            let joined = Joined::of(files).expect("files of TwinCAT");
            let read = read_source("project.plcproj", &joined.text, Wanted::default());
            let reports = joined.reports(read.diagnostics);
            assert!(!reports.is_empty());
            for report in &reports {
                // A type that is not declared is missed elsewhere too.
                let is_own = report.name == name;
                assert!(report.has_errors() == is_own || at == 1, "{}", report.name);
            }
            let report = reports.iter().find(|report| report.name == name).expect("the file");
            let place = report.text.find(wrong).expect("the word");
            let near = place..place + wrong.len() + 4;
            let first = report.diagnostics.first().expect("a finding");
            assert!(near.contains(&first.span.start), "{wrong}: {first:?}");
        }
    }

    #[test]
    fn a_file_that_is_none_is_reported() {
        let mut files = files();
        files[1].1 = "<TcPlcObject>".to_owned();
        files[2].1 = "<other/>".to_owned();
        let wrong = Joined::of(files).expect_err("two reports");
        assert_eq!(wrong.len(), 2);
        assert!(wrong.iter().all(understudy_text::Report::has_errors));
    }

    #[test]
    fn a_project_names_its_files_and_what_is_not_there() {
        let text = r#"<Project xmlns="http://schemas.microsoft.com/developer/msbuild/2003"><ItemGroup><Compile Include="POUs\MAIN.TcPOU"><SubType>Code</SubType></Compile><Compile Include="Mode.TcDUT"/><Compile Include="Old.TcPOU"><ExcludeFromBuild>true</ExcludeFromBuild></Compile><None Include="a.tmc"/></ItemGroup><ItemGroup><PlaceholderReference Include="Tc2_Standard"/><LibraryReference Include="Tc2_MC2,*,Beckhoff"/></ItemGroup></Project>"#;
        let project = read_project("plc.plcproj", text).expect("a project");
        let names: Vec<&str> = project.files.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["POUs/MAIN.TcPOU", "Mode.TcDUT"]);
        assert!(read_project("a", "<project/>").is_err());
        assert!(is_part("a.b/c.tcgvl") && !is_part("a.st"));
        let mut files = files();
        files[0].1 = files[0].1.replace("s : Switch", "axis : AXIS_REF; s : Switch");
        let missing = [project.files[1].1.clone()];
        let joined = Joined::of_project(project, files, &missing).expect("files of TwinCAT");
        assert_eq!(joined.first(), Some("MAIN.TcPOU"));
        let read = read_source("plc.plcproj", &joined.text, Wanted::default());
        assert!(read.source.is_none());
        let reports = joined.reports(read.diagnostics);
        let own = reports.last().expect("that of the project");
        let found: Vec<(&str, &str)> = own
            .diagnostics
            .iter()
            .map(|found| (found.code, text.get(found.span.clone()).unwrap_or_default()))
            .collect();
        assert_eq!(
            found,
            [("U1090", "<Compile Include=\"Mode.TcDUT\"/>"), ("U1091", "Tc2_MC2,*,Beckhoff")]
        );
        assert!(own.diagnostics[1].message.contains("`AXIS_REF` (MAIN.TcPOU:3)"), "{own:?}");
        assert!(reports[..4].iter().all(|report| !report.has_errors()), "{reports:?}");
    }

    /// Each word of a Structured Text has its place in its file, whatever XML makes of it.
    #[test]
    fn a_text_keeps_its_places() {
        let declared = "\u{feff}FUNCTION_BLOCK Lamp VAR_INPUT a : BOOL; END_VAR\r\nVAR_OUTPUT q : BOOL; END_VAR\r\n\u{c}q := NOT a; END_FUNCTION_BLOCK";
        let body = "b[i[0]]>3 AND é < 1";
        let main = format!(
            "PROGRAM p VAR_OUTPUT q : BOOL; END_VAR VAR f : Lamp; i : ARRAY[0..1] OF INT; b : ARRAY[0..9] OF INT; END_VAR\n(* a < b & c ]]> *) f(a := {body}); q := f.q OR nowhere; END_PROGRAM"
        );
        let files = [("lamp.st", declared), ("main.st", &main)];
        let files = files.map(|(name, text)| (name.to_owned(), text.to_owned()));
        let joined = Joined::of(files.to_vec()).expect("texts");
        let read = read_source("main.st", &joined.text, Wanted::default());
        let reports = joined.reports(read.diagnostics);
        assert!(!reports[0].has_errors(), "{reports:?}");
        let words = reports[1].diagnostics.iter().map(|found| &main[found.span.clone()]);
        assert_eq!(words.collect::<Vec<_>>(), ["é", "nowhere"], "{reports:#?}");
    }
}
