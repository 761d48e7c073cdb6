//! Ladders of timers: the families that were measured first, and random ones from a seed. A scan is 1 ms.

use std::fmt::Write as _;

/// A ladder, by its name.
pub(crate) struct Written {
    /// Its name, for the table of results.
    pub(crate) name: String,
    /// The ladder text.
    pub(crate) text: String,
}

/// Presets of a family, in scans.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Presets {
    Equal,
    Short,
    Mixed,
}

impl Presets {
    pub(crate) const ALL: [(Self, &str); 3] =
        [(Self::Short, "short"), (Self::Mixed, "mixed"), (Self::Equal, "equal")];

    fn of(self, timer: usize) -> u32 {
        const MIXED: [u32; 10] = [700, 1500, 4000, 2300, 350, 3100, 900, 1999, 2750, 1234];
        match self {
            Self::Equal => 4000,
            Self::Short => 300,
            Self::Mixed => MIXED[timer % MIXED.len()],
        }
    }
}

/// On-delays in a row: each begins when the one before it is over.
pub(crate) fn chain(timers: usize, presets: Presets) -> String {
    let mut text = String::from("program chain\n\ninput start\ninput stop\n\n");
    (0..timers).for_each(|timer| line(&mut text, format_args!("output y{timer}")));
    line(&mut text, format_args!("memory y\n\nrung\n    [ start | y ] /stop ( y )"));
    let mut before = String::from("y");
    for timer in 0..timers {
        let preset = presets.of(timer);
        line(
            &mut text,
            format_args!("rung\n    {before} {{TON t{timer} {preset}ms}} ( y{timer} )"),
        );
        before = format!("y{timer}");
    }
    text
}

/// Independent on-delays and off-delays, and outputs that need all of them.
pub(crate) fn product(timers: usize, presets: Presets) -> String {
    let mut text = String::from("program product\n\n");
    for timer in 0..timers {
        line(&mut text, format_args!("input u{timer}\nmemory m{timer}"));
    }
    line(&mut text, format_args!("output all\noutput any\noutput first"));
    let names = |prefix: &str, from: usize, between: &str| {
        let names: Vec<String> = (from..timers).map(|timer| format!("{prefix}m{timer}")).collect();
        names.join(between)
    };
    for timer in 0..timers {
        let (kind, preset) = (["TON", "TOF"][timer % 2], presets.of(timer));
        line(
            &mut text,
            format_args!("rung\n    u{timer} {{{kind} t{timer} {preset}ms}} ( m{timer} )"),
        );
    }
    let (all, any, none) = (names("", 0, " "), names("", 0, " | "), names("/", 1, " "));
    line(
        &mut text,
        format_args!(
            "rung\n    {all} ( all )\nrung\n    [ {any} ] ( any )\nrung\n    m0 {none} ( first )"
        ),
    );
    text
}

/// Three off-delays of four seconds in parallel, and an alarm that needs them all.
pub(crate) const ALARM: &str = "program alarm\n\ninput left\ninput middle\ninput right\ninput reset\n\noutput gate\noutput lamp\noutput horn\n\nmemory alarm\n\
rung\n    [ left {TOF a 4s} | middle {TOF b 4s} | right {TOF c 4s} ] ( gate )\nrung\n    a.Q b.Q c.Q ( S alarm )\n\
rung\n    reset /gate ( R alarm )\nrung\n    alarm gate ( lamp )\nrung\n    alarm /left ( horn )\n";

/// Three delays of `scans` scans, each begun by the edge of the one before.
pub(crate) fn edges(kind: &str, scans: u32, by_edges: bool) -> String {
    let edge =
        |number: usize| if by_edges { format!(" {{R_TRIG e{number}}}") } else { String::new() };
    let (one, two) = (edge(1), edge(2));
    format!(
        "program edges\n\ninput begin\ninput wanted\ninput allowed\n\noutput flush\noutput lid\noutput fan\noutput arm\noutput first\noutput second\n\
         memory over\n\nrung\n    [ wanted | flush ] allowed ( flush )\nrung\n    [ begin | lid ] /over ( lid ) ( fan )\n\
         rung\n    begin {{{kind} hold {scans}ms}}\nrung\n    hold.Q ( arm )\nrung\n    /arm{one} {{{kind} seal1 {scans}ms}}\n\
         rung\n    seal1.Q ( first )\nrung\n    /first{two} {{{kind} seal2 {scans}ms}}\nrung\n    seal2.Q ( second )\nrung\n    lid -second ( over )\n"
    )
}

/// Numbers from a seed (SplitMix64).
struct Random(u64);

impl Random {
    fn below(&mut self, bound: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (mixed ^ (mixed >> 31)) % bound
    }

    fn one_in(&mut self, bound: u64) -> bool {
        self.below(bound) == 0
    }

    /// From `least` to `most`, each order of magnitude alike.
    fn preset(&mut self, least: u32, most: u32) -> u32 {
        let share = self.below(1000) as f64 / 999.0;
        let (least, most) = (f64::from(least), f64::from(most));
        (least * (most / least).powf(share)).round() as u32
    }
}

/// A random program of `timers` timers with presets from `least` to `most` scans: on-delays, off-delays and pulses that begin by inputs, by each other,
/// by edges, that reset each other, and counters between them.
pub(crate) fn random(seed: u64, timers: usize, least: u32, most: u32) -> String {
    let mut random = Random(seed);
    let inputs = 1 + random.below(3);
    let equal = random.one_in(3).then(|| random.preset(least, most));
    let mut text = String::from("program random\n\n");
    (0..inputs).for_each(|input| line(&mut text, format_args!("input u{input}")));
    (0..timers).for_each(|timer| line(&mut text, format_args!("output y{timer}")));
    line(&mut text, format_args!(""));
    for timer in 0..timers {
        let begin = begin(&mut random, timer, inputs);
        let kind = ["TON", "TOF", "TP"][random.below(3) as usize];
        let preset = equal.unwrap_or_else(|| random.preset(least, most));
        // One that comes later holds it back: they reset each other.
        let other = random.below(timers as u64);
        let held = if other != timer as u64 && random.one_in(4) {
            format!(" /y{other}")
        } else {
            String::new()
        };
        line(&mut text, format_args!("rung\n    {begin}{held} {{{kind} t{timer} {preset}ms}}"));
        let coil = if random.one_in(6) {
            let (count, reset) = (2 + random.below(4), random.below(inputs));
            format!("t{timer}.Q {{CTU c{timer} {count} R=u{reset}}}")
        } else {
            format!("t{timer}.Q")
        };
        line(&mut text, format_args!("rung\n    {coil} ( y{timer} )"));
    }
    text
}

/// What starts a timer.
fn begin(random: &mut Random, timer: usize, inputs: u64) -> String {
    let input = format!("u{}", random.below(inputs));
    if timer == 0 {
        return input;
    }
    let before = timer as u64 - 1 - random.below(2.min(timer as u64));
    match random.below(8) {
        0 => input,
        1 => format!("{input} y{before}"),
        2 => format!("[ {input} | y{before} ]"),
        3 => format!("/y{before} {{R_TRIG e{timer}}}"),
        4 => format!("+y{before}"),
        5 => format!("-y{before}"),
        6 => format!("/y{before}"),
        _ => format!("y{before}"),
    }
}

fn line(text: &mut String, line: std::fmt::Arguments<'_>) {
    // A text takes everything.
    let _ = writeln!(text, "{line}");
}
