//! A scan of the machine compared with `gcc -O2` on the C that matiec makes of the same text, in one run.
//!
//! ```text
//! MATIEC=/path/of/matiec UNDERSTUDY_DATA=/path/of/data cargo bench -p understudy-structured-text --bench peer [-- NAME…]
//! ```
//!
//! `MATIEC` is a built working copy of <https://github.com/beremiz/matiec> (`autoreconf -i && ./configure && make`, with bison and flex); without
//! it only the machine is measured. `UNDERSTUDY_DATA` has the programs: `numbers/*.st` with the inputs of 300 scans in `numbers/vectors.json`.
//! The examples of this repository are compared too, as [`matiec::portable`] writes them.
//!
//! Both sides set the inputs, run the program and read the outputs of each scan. They take turns, and of all turns the shortest counts, which
//! makes the ratio bear a busy machine. An operation is what [`Cost`] counts: about an addition.

mod matiec;

use std::io::Write as _;
use std::path::{Path, PathBuf};

use understudy_structured_text::{Options, lower, parse};
use understudy_typed::{Cost, Machine, Program, Scratch};

/// Turns that each side takes.
const TURNS: usize = 5;

/// Rounds over all scans in one turn.
const ROUNDS: usize = 400;

/// A program and what it is given.
pub(crate) struct Case {
    name: String,
    text: String,
    program: Program,
    /// The stored values of the inputs, a row for each scan.
    scans: Vec<Vec<u64>>,
}

fn main() {
    let wanted: Vec<String> = std::env::args().skip(1).filter(|it| !it.starts_with('-')).collect();
    let cases = numbers().into_iter().chain(examples());
    let mut out = std::io::stdout().lock();
    writeln!(out, "program            operations  ns a scan   ns each   gcc, ns   ratio")
        .expect("standard output");
    for case in cases.filter(|case| wanted.is_empty() || wanted.contains(&case.name)) {
        let peer = matiec::Peer::new(&case);
        let (mut ours, mut theirs) = (f64::MAX, f64::MAX);
        for _ in 0..TURNS {
            theirs = peer.as_ref().map_or(theirs, |peer| peer.nanoseconds().min(theirs));
            ours = machine(&case).min(ours);
        }
        let cost = Cost::new(&case.program);
        let operations = cost.loops.map(|loops| cost.straight + loops);
        let each = operations.map_or(f64::NAN, |operations| ours / operations as f64);
        let count = operations.unwrap_or(0);
        let name = &case.name;
        write!(out, "{name:<20} {count:>8}  {ours:>9.1}  {each:>8.2}").expect("standard output");
        match peer {
            Some(_) => writeln!(out, "  {theirs:>8.1}  {:>6.1}", ours / theirs),
            None => writeln!(out),
        }
        .expect("standard output");
    }
}

/// Nanoseconds of a scan, the best of all rounds.
fn machine(case: &Case) -> f64 {
    let machine = Machine::new(&case.program);
    let mut scratch = Scratch::default();
    let mut state = machine.initial().to_vec();
    let mut outputs = vec![0; machine.output_count().div_ceil(64)];
    let inputs: Vec<Vec<u64>> = case.scans.iter().map(|scan| image(&case.program, scan)).collect();
    let mut best = f64::MAX;
    for _ in 0..ROUNDS {
        #[allow(clippy::disallowed_methods, reason = "a measurement")]
        let start = std::time::Instant::now();
        for inputs in &inputs {
            machine.step(&mut scratch, std::hint::black_box(&mut state), inputs, &mut outputs);
        }
        best = best.min(start.elapsed().as_secs_f64());
    }
    assert_eq!(state[0], 0, "{}: no fault", case.name);
    best * 1e9 / inputs.len() as f64
}

/// The image of the inputs of a scan.
fn image(program: &Program, values: &[u64]) -> Vec<u64> {
    let mut image = vec![0; program.inputs.width().div_ceil(64)];
    for (point, value) in program.inputs.iter().zip(values) {
        point.set(&mut image, *value);
    }
    image
}

fn program(text: &str) -> Program {
    let (file, _) = parse(text);
    let options = Options { text, ..Options::default() };
    let lowered = lower(&file, &options);
    lowered.program.unwrap_or_else(|| panic!("{:?}", lowered.diagnostics))
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The programs that have vectors, with their inputs.
fn numbers() -> Vec<Case> {
    let Some(data) = std::env::var_os("UNDERSTUDY_DATA") else {
        return Vec::new();
    };
    let folder = PathBuf::from(data).join("numbers");
    let vectors: serde_json::Value =
        serde_json::from_str(&read(&folder.join("vectors.json"))).expect("JSON");
    let each = vectors.as_object().expect("an object").iter();
    let case = |(name, vector): (&String, &serde_json::Value)| {
        let text = read(&folder.join(format!("{name}.st")));
        let program = program(&text);
        let scan = |line: &serde_json::Value| {
            let (given, _) = line.as_str()?.split_once(" -> ")?;
            let values = program.inputs.iter().zip(given.split(' '));
            Some(values.map(|(point, text)| stored(point.of, text)).collect())
        };
        let scans = vector["scans"].as_array().expect("scans").iter();
        Case {
            name: name.clone(),
            scans: scans.map(|line| scan(line).expect("inputs -> outputs")).collect(),
            program,
            text,
        }
    };
    each.map(case).collect()
}

fn stored(of: understudy_typed::Elementary, text: &str) -> u64 {
    match of.is_real() {
        true => u64::from_str_radix(text, 16).expect("hexadecimal digits"),
        false => text.parse::<i128>().expect("a number") as u64 & of.mask(),
    }
}

/// Programs of the examples, with inputs that wander about.
fn examples() -> Vec<Case> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples");
    let control = read(&folder.join("../programs/structured-text/src/library/control.st"));
    let paths = [
        "heated-tank/level",
        "heated-tank/temperature",
        "heated-tank/tank",
        "heated-tank/vessel",
        "tennessee-eastman/feed",
        "tennessee-eastman/reactor",
        "tennessee-eastman/separator",
        "tennessee-eastman/stripper",
        "tennessee-eastman/process",
    ];
    let case = |path: &str| {
        let name = path.rsplit('/').next().unwrap_or(path).to_owned();
        let text = matiec::portable(&control, &read(&folder.join(format!("{path}.st"))));
        let program = program(&text);
        let mut random = 1_u64;
        let mut wander = |of: understudy_typed::Elementary| {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            let value = 40.0 + (random >> 33) as f64 / 2_f64.powi(28);
            match of {
                understudy_typed::Elementary::Real => u64::from((value as f32).to_bits()),
                understudy_typed::Elementary::Lreal => value.to_bits(),
                _ => random >> 60 & 1,
            }
        };
        let declared: Vec<_> =
            program.inputs.iter().filter(|point| point.slot != 0).map(|point| point.of).collect();
        let scans = (0..300).map(|_| declared.iter().map(|&of| wander(of)).collect()).collect();
        Case { name, text, program, scans }
    };
    paths.into_iter().map(case).collect()
}
