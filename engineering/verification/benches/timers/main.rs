//! Programs with long timers compared with NuSMV 2.5.4 -dynamic: `AG (EF y & EF !y)` for each output y, processor time of both in one run.
//!
//! ```text
//! cargo bench -p understudy-verification --bench timers -- [NUSMV] [FIRST..LAST]
//! ```
//!
//! NUSMV is the binary of the peer; without it only this project is measured. The seeds of the random programs are 0..200; with others only these programs
//! are proved. SECONDS_MAX in the environment limits each proof (20 s).
//!
//! The peer is in the source package of pynusmv (build tools, flex, bison and libreadline-dev, libexpat1-dev are needed):
//!
//! ```text
//! pip download --no-deps --no-binary :all: pynusmv && tar xf pynusmv-*.tar.gz
//! cd pynusmv-*/dependencies/NuSMV && tar xf NuSMV-2.5.4.tar.gz && cd NuSMV-2.5.4/cudd-2.4.1.1
//! sed -i 's/union wait status/int status/; s/status\.w_status/status/' util/pipefork.c
//! make -f Makefile_64bit ICFLAGS="-O3 -std=gnu89 -fcommon -w"
//! cd ../nusmv && ./configure --disable-minisat --disable-zchaff CFLAGS="-O3 -std=gnu89 -fcommon -w" && make
//! ```

#![expect(clippy::print_stdout, reason = "a benchmark prints its table")]

mod programs;

use std::ops::Range;
use std::path::PathBuf;
use std::process::Command;
use std::time::Duration;

use programs::{ALARM, Presets, Written, chain, edges, product, random};
use understudy_ladder::parse;
use understudy_verification::program::{Answer, Bounds, Subject};
use understudy_verification::property::{Asked, read};
use understudy_verification::smv;

/// Less than this is not compared: seconds.
const SMALL: f64 = 0.2;

/// Processor time of this thread in seconds.
fn processor() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let nanoseconds = text.split(' ').next().and_then(|first| first.parse::<f64>().ok());
    nanoseconds.unwrap_or(0.0) / 1e9
}

/// Seconds, and for each property whether it holds; `None` where that was not decided.
struct Proved {
    seconds: f64,
    verdicts: Vec<Option<bool>>,
}

impl Proved {
    fn is_whole(&self) -> bool {
        self.verdicts.iter().all(Option::is_some)
    }
}

struct Bench {
    peer: Option<PathBuf>,
    limit: f64,
    folder: PathBuf,
    slower: Vec<String>,
    unequal: Vec<String>,
    totals: [f64; 2],
}

impl Bench {
    fn measure(&mut self, written: &Written) {
        let program = parse(&written.text).program;
        let period = Duration::from_millis(1);
        let subject = Subject::new(&program, period, &Asked::default()).expect("a right program");
        let outputs = program.outputs.iter().map(|output| output.name.as_str());
        let asked: String = outputs.map(|name| format!("AG (EF {name} & EF !{name})\n")).collect();
        let asked = read(&asked, period);
        let properties: Vec<_> = asked
            .properties
            .iter()
            .map(|asked| subject.resolve(asked).expect("its outputs"))
            .collect();
        let model = smv::of_circuit(subject.circuit(), &properties, &[]);
        let begin = processor();
        let go_on = |_| processor() - begin < self.limit;
        let bounds = Bounds { go_on: &go_on, ..Bounds::default() };
        let answers = subject.check(&properties, Vec::new(), bounds, &mut |_, _| {});
        let ours = Proved {
            seconds: processor() - begin,
            verdicts: answers
                .iter()
                .map(|answer| match answer {
                    Answer::Holds(_) => Some(true),
                    Answer::Fails(_) => Some(false),
                    Answer::Undecided(_) => None,
                })
                .collect(),
        };
        let bits = subject.circuit().registers().len();
        let Some(theirs) = self.by_peer(&model, properties.len()) else {
            println!("{:<22} {bits:>5} {:>9.3} s", written.name, ours.seconds);
            return;
        };
        let ratio = ours.seconds / theirs.seconds;
        let is_slower =
            theirs.is_whole() && (!ours.is_whole() || ratio > 1.0 && ours.seconds > SMALL);
        let both = ours.verdicts.iter().zip(&theirs.verdicts);
        let is_unequal =
            both.into_iter().any(|(one, two)| one.is_some() && two.is_some() && one != two);
        let end = |proved: &Proved| if proved.is_whole() { ' ' } else { '>' };
        println!(
            "{:<22} {bits:>5} {}{:>8.3} s {}{:>8.3} s {ratio:>7.3}{}{}",
            written.name,
            end(&ours),
            ours.seconds,
            end(&theirs),
            theirs.seconds,
            if is_slower { "  slower" } else { "" },
            if is_unequal { "  UNEQUAL" } else { "" },
        );
        self.totals[0] += ours.seconds;
        self.totals[1] += theirs.seconds;
        if is_slower {
            self.slower.push(written.name.clone());
        }
        if is_unequal {
            self.unequal.push(written.name.clone());
        }
    }

    fn by_peer(&self, model: &str, count: usize) -> Option<Proved> {
        let peer = self.peer.as_ref()?;
        let file = self.folder.join("model.smv");
        std::fs::write(&file, model).expect("the folder can be written");
        let limit = self.limit.ceil();
        let script = format!("ulimit -t {limit}; \"$0\" -dynamic \"$1\"; times >&2");
        let ended =
            Command::new("bash").arg("-c").arg(script).arg(peer).arg(&file).output().ok()?;
        // `times` tells the time of the children that have ended, in its second line.
        let times = String::from_utf8_lossy(&ended.stderr).into_owned();
        let times = times.lines().last().unwrap_or_default().to_owned();
        let seconds = times.split_whitespace().filter_map(|time| {
            let (minutes, seconds) = time.trim_end_matches('s').split_once('m')?;
            Some(60.0 * minutes.parse::<f64>().ok()? + seconds.parse::<f64>().ok()?)
        });
        let told = String::from_utf8_lossy(&ended.stdout);
        // The last line of one that was ended is not whole.
        let told = told.lines().filter(|line| line.starts_with("-- specification"));
        let mut verdicts: Vec<Option<bool>> = told
            .map(|line| {
                line.ends_with("is true")
                    .then_some(true)
                    .or(line.ends_with("is false").then_some(false))
            })
            .collect();
        verdicts.resize(count, None);
        Some(Proved { seconds: seconds.sum(), verdicts })
    }
}

fn families() -> Vec<Written> {
    let mut all = vec![Written { name: "alarm".to_owned(), text: ALARM.to_owned() }];
    for scans in [40, 100, 200, 400, 1000, 4000] {
        let text = edges("TOF", scans, true);
        all.push(Written { name: format!("off_delays_{scans}"), text });
    }
    for (name, kind, by_edges) in
        [("no_edges", "TOF", false), ("pulses", "TP", true), ("on_delays", "TON", true)]
    {
        all.push(Written { name: format!("{name}_200"), text: edges(kind, 200, by_edges) });
    }
    for timers in [3, 5, 7, 10] {
        for (presets, name) in Presets::ALL {
            let of = [("chain", chain(timers, presets)), ("product", product(timers, presets))];
            all.extend(
                of.map(|(family, text)| Written {
                    name: format!("{family}_{timers}_{name}"),
                    text,
                }),
            );
        }
    }
    all
}

fn main() {
    let mut peer = None;
    let mut asked: Option<Range<u64>> = None;
    for argument in std::env::args().skip(1).filter(|argument| !argument.starts_with("--")) {
        let range = argument.split_once("..");
        match range.and_then(|(first, last)| Some(first.parse().ok()?..last.parse().ok()?)) {
            Some(range) => asked = Some(range),
            None => peer = Some(PathBuf::from(argument)),
        }
    }
    let limit = std::env::var("SECONDS_MAX").ok().and_then(|limit| limit.parse().ok());
    let folder = std::env::temp_dir().join(format!("timers-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder for models");
    let mut bench = Bench {
        peer,
        limit: limit.unwrap_or(20.0),
        folder,
        slower: Vec::new(),
        unequal: Vec::new(),
        totals: [0.0; 2],
    };
    println!("program                 bits  understudy       NuSMV   ratio");
    let families = if asked.is_none() { families() } else { Vec::new() };
    families.iter().for_each(|written| bench.measure(written));
    let seeds = asked.unwrap_or(0..200);
    let programs = seeds.end.saturating_sub(seeds.start);
    for seed in seeds {
        let timers = 2 + (seed % 9) as usize;
        let text = random(seed, timers, 10, 10_000);
        bench.measure(&Written { name: format!("random_{seed}_{timers}"), text });
    }
    println!(
        "{programs} random programs; slower than NuSMV beyond {SMALL} s, or without its answer: {}; other verdicts: {}; {:.1} s, NuSMV {:.1} s",
        bench.slower.len(),
        bench.unequal.len(),
        bench.totals[0],
        bench.totals[1]
    );
    println!("{}", bench.slower.join(" "));
    let _ = std::fs::remove_dir_all(&bench.folder);
}
