//! matiec and gcc: C of a text, with inputs and outputs as in a scan.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::Command;

use understudy_typed::{Elementary, Point};

use crate::{Case, ROUNDS};

/// A program of C that measures itself; removed at the end.
pub(crate) struct Peer {
    folder: PathBuf,
}

impl Peer {
    /// The program that gcc makes; `None` where there is no matiec, or where it refuses the text.
    pub(crate) fn new(case: &Case) -> Option<Self> {
        let matiec = PathBuf::from(std::env::var_os("MATIEC")?);
        let folder = std::env::temp_dir().join(format!("understudy-peer-{}", std::process::id()));
        std::fs::create_dir_all(&folder).ok()?;
        let peer = Self { folder };
        let name = &case.program.routines[case.program.tasks[0].routine.0 as usize].name;
        let text = format!(
            "{}\nCONFIGURATION config RESOURCE resource1 ON PLC TASK t(INTERVAL := T#10ms, PRIORITY := 0);
             PROGRAM instance0 WITH t : {name}; END_RESOURCE END_CONFIGURATION\n",
            case.text
        );
        std::fs::write(peer.folder.join("program.st"), text).ok()?;
        std::fs::write(peer.folder.join("peer.c"), c(case)).ok()?;
        let run = |command: &mut Command| {
            let output = command.current_dir(&peer.folder).output().ok()?;
            if !output.status.success() {
                return None;
            }
            Some(())
        };
        run(Command::new(matiec.join("iec2c"))
            .arg("-I")
            .arg(matiec.join("lib"))
            .arg("program.st"))?;
        let include = matiec.join("lib/C");
        run(Command::new("gcc")
            .args(["-O2", "-fwrapv", "-ffp-contract=off", "-w", "-I"])
            .arg(&include)
            .args(["peer.c", "-o", "peer", "-lm"]))?;
        Some(peer)
    }

    /// Nanoseconds of a scan, the best of all rounds.
    pub(crate) fn nanoseconds(&self) -> f64 {
        let output = Command::new(self.folder.join("peer")).output().expect("the peer runs");
        let text = String::from_utf8(output.stdout).expect("a text");
        text.trim().parse().expect("a number")
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        std::fs::remove_dir_all(&self.folder).ok();
    }
}

/// What runs the scans of a case.
fn c(case: &Case) -> String {
    let declared = |points: &understudy_typed::Points| -> Vec<Point> {
        points.iter().filter(|point| point.slot != 0).cloned().collect()
    };
    let (inputs, outputs) = (declared(&case.program.inputs), declared(&case.program.outputs));
    let fields = |points: &[Point]| -> String {
        let field = |point: &Point| format!("{} {};", point.of.name(), point.name.to_uppercase());
        points.iter().map(field).collect()
    };
    let each = |points: &[Point], form: &str| -> String {
        points.iter().map(|point| form.replace('X', &point.name.to_uppercase())).collect()
    };
    let mut rows = String::new();
    for scan in &case.scans {
        let values = inputs.iter().zip(scan).map(|(point, &value)| literal(point.of, value));
        let _ = writeln!(rows, "{{{}}},", values.collect::<Vec<_>>().join(", "));
    }
    format!(
        "#include \"resource1.c\"
#include <stdio.h>
#include <time.h>
TIME __CURRENT_TIME; BOOL __DEBUG; unsigned long long common_ticktime__ = 10000000;
static const struct {{ {} }} u[] = {{ {rows} }};
static volatile struct {{ {} }} y;
static unsigned long tick;
__attribute__((noinline)) static void scan(int t) {{
{}
    RESOURCE1_run__(tick++);
    __CURRENT_TIME.tv_nsec += 10000000;
    if (__CURRENT_TIME.tv_nsec >= 1000000000) {{ __CURRENT_TIME.tv_nsec -= 1000000000; __CURRENT_TIME.tv_sec++; }}
{}
}}
int main(void) {{
    int count = sizeof u / sizeof *u;
    double best = 1e9;
    RESOURCE1_init__();
    for (int round = 0; round < {ROUNDS}; round++) {{
        struct timespec a, b;
        clock_gettime(CLOCK_MONOTONIC, &a);
        for (int t = 0; t < count; t++) scan(t);
        clock_gettime(CLOCK_MONOTONIC, &b);
        double took = (b.tv_sec - a.tv_sec) * 1e9 + (b.tv_nsec - a.tv_nsec);
        if (took < best) best = took;
    }}
    printf(\"%.3f\\n\", best / count);
    return 0;
}}
",
        fields(&inputs),
        fields(&outputs),
        each(&inputs, "    RESOURCE1__INSTANCE0.X.value = u[t].X;\n"),
        each(&outputs, "    y.X = RESOURCE1__INSTANCE0.X.value;\n"),
    )
}

fn literal(of: Elementary, stored: u64) -> String {
    match of {
        Elementary::Real => format!("{:e}f", f32::from_bits(stored as u32)),
        Elementary::Lreal => format!("{:e}", f64::from_bits(stored)),
        _ if of.is_signed() => format!("({}) - 1", of.signed(stored) + 1),
        _ => stored.to_string(),
    }
}

/// A text with the control blocks that it uses, in words that matiec knows; both sides are given the same.
///
/// matiec has no TIME() and no LTIME, converts no REAL to LREAL by itself, and reserves names such as DT and N. So blocks are called each 10 ms or
/// at the interval that they are given, and all reals are LREAL.
pub(crate) fn portable(control: &str, text: &str) -> String {
    let is_used = |block: &str| {
        let name = block.split("FUNCTION_BLOCK ").nth(1);
        let name = name.and_then(|rest| rest.split_whitespace().next());
        name.is_some_and(|name| text.contains(&format!(": {name};")))
    };
    let blocks = control.split_inclusive("END_FUNCTION_BLOCK");
    let used: String = blocks.filter(|block| is_used(block)).collect();
    let used = used
        .replace("LTIME_TO_LREAL(TIME() - LAST) / 1.0E9", "0.01")
        .replace("LAST := TIME();", "")
        .replace("LTIME_TO_LREAL", "TIME_TO_LREAL");
    let whole = format!("{used}\n{text}").replace("LREAL_TO_REAL(", "(");
    let mut ported = String::new();
    let mut before = "";
    for word in words(&whole) {
        match word {
            "REAL" => ported.push_str("LREAL"),
            "stage" | "TEMPERATURE" | "DT" | "DS" | "PS" | "PID" | "N" | "L" | "R" | "S" | "D"
            | "P" | "PI" => {
                ported.push_str(word);
                ported.push('X');
            }
            "temperature" | "level" if before == "PROGRAM" => ported.push_str("program0"),
            _ => ported.push_str(word),
        }
        if !word.trim().is_empty() {
            before = word;
        }
    }
    ported
}

/// The words of a text and what is between them.
fn words(text: &str) -> impl Iterator<Item = &str> {
    let is_word = |character: char| character.is_alphanumeric() || character == '_';
    let mut rest = text;
    std::iter::from_fn(move || {
        let first = rest.chars().next()?;
        let end = rest.find(|character| is_word(character) != is_word(first)).unwrap_or(rest.len());
        let (word, behind) = rest.split_at(end);
        rest = behind;
        Some(word)
    })
}
