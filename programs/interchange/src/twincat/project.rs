//! A TwinCAT project: every type and every unit stands in a file of its own.
//!
//! The files are read as one document. Each keeps its bytes and its lines there; only what is around its objects becomes blanks, so a place in
//! the document is a place in its file.

use std::ops::Range;

use understudy_text::{Diagnostic, Report};

use super::ROOT;
use crate::plcopen::xml::{attribute, elements, parse, start_tag};

/// Ends of the names of files that hold parts of a program.
const ENDINGS: [&str; 5] = ["tcpou", "tcdut", "tcgvl", "tcio", "tctto"];

/// The files of a project as one document.
#[derive(Debug, Clone, Default)]
pub struct Joined {
    /// The document.
    pub text: String,
    parts: Vec<Part>,
}

#[derive(Debug, Clone)]
struct Part {
    name: String,
    text: String,
    /// Where it begins in the document.
    start: usize,
}

/// Whether a file is one of a project, by the end of its name.
pub fn is_part(name: &str) -> bool {
    let ending = name.rsplit_once('.').map(|(_, ending)| ending);
    ending.is_some_and(|ending| ENDINGS.iter().any(|known| known.eq_ignore_ascii_case(ending)))
}

/// The files that a project (`.plcproj`) names, in its order.
///
/// # Errors
/// A text that is not well-formed, or no project.
#[expect(clippy::result_large_err, reason = "once for a project")]
pub fn files_of_project(text: &str) -> Result<Vec<String>, Diagnostic> {
    let document = parse(text)?;
    let root = document.root_element();
    if root.tag_name().name() != "Project" {
        let message = format!("this is no project: its root is `{}`", root.tag_name().name());
        return Err(Diagnostic::error("U1001", message, start_tag(root)));
    }
    let named = root.descendants().filter(|node| node.tag_name().name() == "Compile");
    let named = named.filter_map(|node| attribute(node, "Include"));
    let named = named.map(|name| name.replace('\\', "/"));
    Ok(named.filter(|name| is_part(name)).collect())
}

impl Joined {
    /// Joins files, each with its name.
    ///
    /// # Errors
    /// Reports on the files that are not well-formed, or not of TwinCAT.
    pub fn of(files: Vec<(String, String)>) -> Result<Self, Vec<Report>> {
        let mut joined = Self { text: format!("<{ROOT}>"), parts: Vec::new() };
        let mut wrong = Vec::new();
        for (name, text) in files {
            match within(&text) {
                Ok(within) => {
                    let start = joined.text.len();
                    joined.blank(&text[..within.start]);
                    joined.text += &text[within.clone()];
                    joined.blank(&text[within.end..]);
                    joined.text.push('\n');
                    joined.parts.push(Part { name, text, start });
                }
                Err(found) => wrong.push(Report { name, text, diagnostics: vec![found] }),
            }
        }
        joined.text += &format!("</{ROOT}>");
        if wrong.is_empty() { Ok(joined) } else { Err(wrong) }
    }

    fn blank(&mut self, text: &str) {
        let blanks = text.bytes().map(|byte| if byte == b'\n' { '\n' } else { ' ' });
        self.text.extend(blanks);
    }

    /// The name of the first file.
    pub fn first(&self) -> Option<&str> {
        self.parts.first().map(|part| part.name.as_str())
    }

    /// What was found in the document, file by file. What has no place is a finding on the first file.
    pub fn reports(&self, diagnostics: Vec<Diagnostic>) -> Vec<Report> {
        let mut reports: Vec<Report> = self
            .parts
            .iter()
            .map(|part| Report {
                name: part.name.clone(),
                text: part.text.clone(),
                diagnostics: Vec::new(),
            })
            .collect();
        for mut found in diagnostics {
            let after = self.parts.partition_point(|part| part.start <= found.span.start);
            let at = after.saturating_sub(1);
            let (Some(part), Some(report)) = (self.parts.get(at), reports.get_mut(at)) else {
                continue;
            };
            let moved = |span: &Range<usize>| {
                let place = |place: usize| place.saturating_sub(part.start).min(part.text.len());
                place(span.start)..place(span.end)
            };
            let end = part.start + part.text.len();
            // A second place in another file has no excerpt here.
            found.related.retain(|it| part.start <= it.span.start && it.span.start < end);
            for related in &mut found.related {
                related.span = moved(&related.span);
            }
            found.span = moved(&found.span);
            report.diagnostics.push(found);
        }
        reports
    }
}

/// Where the objects of a file stand in it.
#[expect(clippy::result_large_err, reason = "once for a file")]
fn within(text: &str) -> Result<Range<usize>, Diagnostic> {
    let document = parse(text)?;
    let root = document.root_element();
    if root.tag_name().name() != ROOT {
        let message =
            format!("this is no file of TwinCAT: its root is `{}`", root.tag_name().name());
        return Err(Diagnostic::error("U1001", message, start_tag(root)));
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

    use super::{Joined, files_of_project, is_part};
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
        files[2].1 = "<project/>".to_owned();
        let wrong = Joined::of(files).expect_err("two reports");
        assert_eq!(wrong.len(), 2);
        assert!(wrong.iter().all(understudy_text::Report::has_errors));
    }

    #[test]
    fn a_project_names_its_files() {
        let text = r#"<Project xmlns="http://schemas.microsoft.com/developer/msbuild/2003"><ItemGroup><Compile Include="POUs\MAIN.TcPOU"><SubType>Code</SubType></Compile><Compile Include="Mode.TcDUT"/><None Include="a.tmc"/></ItemGroup></Project>"#;
        assert_eq!(files_of_project(text).expect("a project"), ["POUs/MAIN.TcPOU", "Mode.TcDUT"]);
        assert!(files_of_project("<project/>").is_err());
        assert!(is_part("a.b/c.tcgvl") && !is_part("a.st"));
    }
}
