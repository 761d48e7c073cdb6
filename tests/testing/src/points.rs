//! A point of each kind of declaration, and a cluster that has them: the table of every place that shows a point.

use serde_json::Value;
use understudy_cluster::{Cluster, Overrides, TemplateFile, read_with_files};

/// A point of each kind, in the order of the declarations.
#[derive(Debug, Clone, Copy)]
pub struct Row {
    /// Its name as an input; the output has `q` in front.
    pub name: &'static str,
    /// Its type, as every place shows it.
    pub of: &'static str,
    /// Its value as a number: a time in nanoseconds, a value of an enumeration as its own.
    pub number: i64,
    /// The value as a file of scans has it.
    pub scan: &'static str,
    /// The value as a cluster file has it.
    pub file: &'static str,
    /// The value as every view of a run has it.
    pub shown: &'static str,
    /// A value that it does not have.
    pub wrong: &'static str,
    /// The least value of an output, as a cluster file has it.
    pub safe: &'static str,
}

const fn row(
    name: &'static str,
    of: &'static str,
    number: i64,
    [scan, file, shown, wrong, safe]: [&'static str; 5],
) -> Row {
    Row { name, of, number, scan, file, shown, wrong, safe }
}

/// Date of the table, in nanoseconds since 1970.
const DAY: i64 = 1_709_164_800_000_000_000;

/// The points.
pub const POINTS: [Row; 16] = [
    row("n", "INT", 20, ["20", "20", "20", "40000", "0"]),
    row("d", "DINT", -70_000, ["-70000", "-70000", "-70000", "3000000000", "0"]),
    row("t", "TIME", 1_500_000_000, ["T#1s500ms", "\"1.5s\"", "1s500ms", "1.5", "\"0ms\""]),
    row("lt", "LTIME", 4000, ["LT#4us", "\"4us\"", "4us", "D#1970-01-01", "\"0ms\""]),
    row(
        "day",
        "DATE",
        DAY,
        ["D#2024-02-29", "\"2024-02-29\"", "2024-02-29", "T#1s", "\"1970-01-01\""],
    ),
    row("m", "Mode", 7, ["Auto", "\"Auto\"", "Auto", "Fast", "\"Off\""]),
    row("s", "INT (3..9)", 5, ["5", "5", "5", "10", "3"]),
    row("bits[0]", "BOOL", 1, ["1", "true", "1", "2", "false"]),
    row("bits[1]", "BOOL", 0, ["0", "false", "0", "x", "false"]),
    row("bits[2]", "BOOL", 1, ["1", "true", "1", "-1", "false"]),
    row("mot.run", "BOOL", 1, ["1", "true", "1", "T#1s", "false"]),
    row("mot.speed", "INT", -7, ["-7", "-7", "-7", "fast", "0"]),
    row("mot.wait", "TIME", 20_000_000, ["T#20ms", "\"20ms\"", "20ms", "Auto", "\"0ms\""]),
    row("mot.mode", "Mode", 3, ["Manual", "\"Manual\"", "Manual", "3.0", "\"Off\""]),
    row("mot.steps[1]", "INT (1..4)", 4, ["4", "4", "4", "0", "1"]),
    row("mot.steps[2]", "INT (1..4)", 1, ["1", "1", "1", "5", "1"]),
];

/// The declarations of a program with these points.
pub const DECLARED: &str = "TYPE
  Mode : (Off, Manual := 3, Auto := 7);
  Motor : STRUCT run : BOOL; speed : INT; wait : TIME; mode : Mode; steps : ARRAY [1..2] OF INT (1..4); END_STRUCT;
END_TYPE
PROGRAM one
  VAR_INPUT n : INT; d : DINT; t : TIME; lt : LTIME; day : DATE; m : Mode; s : INT (3..9); bits : ARRAY [0..2] OF BOOL; mot : Motor; END_VAR
  VAR_OUTPUT qn : INT; qd : DINT; qt : TIME; qlt : LTIME; qday : DATE; qm : Mode; qs : INT (3..9); qbits : ARRAY [0..2] OF BOOL; qmot : Motor; END_VAR
";

/// The values of an enumeration of the table.
pub const MODE: [(&str, i64); 3] = [("Off", 0), ("Manual", 3), ("Auto", 7)];

impl Row {
    /// Whether it is a BOOL.
    pub fn is_bool(&self) -> bool {
        self.of == "BOOL"
    }

    /// Whether views have its value as a text, and not as a number or a truth value.
    pub fn is_text(&self) -> bool {
        matches!(self.of, "DATE" | "Mode")
    }

    /// The value for a program that reads it.
    pub fn told(&self) -> Value {
        match self.of {
            "BOOL" => (self.number != 0).into(),
            _ if self.is_text() => self.shown.into(),
            _ => self.number.into(),
        }
    }

    /// The least value, which it has at first, as [`Self::told`] has it.
    pub fn told_at_first(&self) -> Value {
        let least = self.safe.replace('"', "");
        match self.of {
            "BOOL" => false.into(),
            _ if self.is_text() => least.into(),
            // A time of the table begins at 0.
            _ => least.parse::<i64>().unwrap_or_default().into(),
        }
    }

    /// The least value as every view of a run has it.
    pub fn safe_shown(&self) -> String {
        let least = self.safe.replace('"', "");
        if self.is_bool() { "0".to_owned() } else { least }
    }

    /// Least and greatest value of the setpoint, as a cluster file has them: the value and the least one.
    pub fn limits(&self) -> [&'static str; 2] {
        if self.number < 0 { [self.file, self.safe] } else { [self.safe, self.file] }
    }
}

/// The statements of the program: each output is its input.
pub fn statements() -> String {
    POINTS.iter().map(|Row { name, .. }| format!("  q{name} := {name};\n")).collect()
}

/// A cluster whose operator sets every input of the program in this file, with an alarm on every output. Before the first write each input has its
/// least value.
pub fn cluster_file(program: &str) -> String {
    let mut text = format!(
        "[cluster]\nname = \"cell\"\n[[controller]]\nname = \"one\"\nladder = {program:?}\n[[understudy]]\nname = \"u\"\n[[remote_io]]\ncontroller = \"one\"\n[remote_io.fail_safe]\n"
    );
    for Row { name, file, .. } in &POINTS {
        text += &format!("\"q{name}\" = {file}\n");
    }
    text += "[remote_io.inputs]\n";
    for row in &POINTS {
        let [low, high] = row.limits();
        let kind = match row.is_bool() {
            true => "operator = \"level\"".to_owned(),
            false => format!("operator = \"setpoint\", low = {low}, high = {high}"),
        };
        text += &format!("\"{}\" = {{ {kind}, initial = {} }}\n", row.name, row.safe);
    }
    for Row { name, of, file, .. } in &POINTS {
        let condition = match *of {
            "BOOL" | "Mode" => "when",
            _ => "above",
        };
        text += &format!(
            "[[alarm]]\nsignal = \"one.q{name}\"\n{condition} = {file}\ntext = \"q{name}\"\n"
        );
    }
    text
}

/// The cluster of the program in Structured Text.
///
/// # Panics
/// Never: the files come with the program.
pub fn cluster() -> Cluster {
    // A template has files that come with the program.
    let text = format!("{DECLARED}{}END_PROGRAM\n", statements()).leak();
    let files = [TemplateFile { name: "one.st", text }];
    let loaded = read_with_files(&cluster_file("one.st"), &files, Overrides::default());
    loaded.cluster.unwrap_or_else(|| panic!("{:?}", loaded.reports))
}

/// A scenario in which the operator writes the value of each point in one of the first cycles.
pub fn writes(cycles: u32) -> String {
    let mut text = format!("title = \"writes\"\ncycles = {cycles}\n");
    for (place, Row { name, file, .. }) in POINTS.iter().enumerate() {
        text += &format!(
            "[[step]]\nat = {}\naction = \"write\"\nstation = \"one-io\"\ninput = \"{name}\"\nvalue = {file}\n",
            2 + place / 4
        );
    }
    text
}
