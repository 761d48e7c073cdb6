//! Variables that have another name in the new program: their values go on by the pairs of the new cluster file.

use understudy_cluster::{
    ChangeTexts, Cluster, NeedsStop, PairReason, Unfit, Way, done_pairs, fates, read_kept,
};
use understudy_cycle::OnlineChange;
use understudy_executable::{Executable, Scratch};
use understudy_typed::{Fate, WrongPair};

use crate::common::{findings, load};

fn file(name: &str, renamed: &str) -> String {
    format!(
        "[cluster]\nname = \"cell\"\nperiod = \"100ms\"\n[[controller]]\nname = \"one\"\nladder = \"{name}\"\n{renamed}\n"
    )
}

fn cluster(name: &str, text: &str, renamed: &str) -> Cluster {
    let loaded = load(&file(name, renamed), &[(name, text)]);
    let found = findings(&loaded.reports);
    loaded.cluster.unwrap_or_else(|| panic!("{found}\n{text}"))
}

/// Counts in `count`, and in a member of a structure.
fn program(types: &str, variables: &str, count: &str, hours: &str) -> String {
    format!(
        "TYPE pump : STRUCT {types} END_STRUCT; END_TYPE\nPROGRAM one\nVAR_INPUT a : BOOL; END_VAR\nVAR_OUTPUT y : DINT; END_VAR\n\
         VAR {variables} p : pump; END_VAR\n{count} := {count} + 1; {hours} := {hours} + 100; y := {count} + {hours};\nEND_PROGRAM"
    )
}

fn old() -> Cluster {
    cluster("one.st", &program("hours : DINT;", "count : INT;", "count", "p.hours"), "")
}

fn change(before: &Cluster, after: &Cluster) -> Result<OnlineChange, Vec<NeedsStop>> {
    let texts = ChangeTexts::between(before, after)?;
    Ok(texts.load(before).expect("a change of this cluster"))
}

fn step(executable: &Executable, state: &mut [u64], inputs: u64) -> u64 {
    let mut outputs = vec![0; executable.output_count().div_ceil(64)];
    executable.step(&mut Scratch::default(), state, &[inputs], &mut outputs);
    outputs[0]
}

#[test]
fn values_go_on_under_their_new_names_and_back() {
    let old = old();
    let text = program("total : DINT;", "sum : DINT;", "sum", "p.total");
    let pairs = "renamed = { count = \"sum\", \"p.hours\" = \"p.total\" }";
    let new = cluster("one.st", &text, pairs);
    let [before, after] = [&old, &new].map(|cluster| &cluster.controllers()[0].code);
    let paths = fates(before, after, Way::There);
    let of = |name: &str| paths.iter().find(|path| path.path == name).expect("it is listed");
    assert_eq!(
        (of("sum").fate, of("sum").renamed_from.as_deref()),
        (Fate::Converted, Some("count"))
    );
    assert_eq!(
        (of("p.total").fate, of("p.total").renamed_from.as_deref()),
        (Fate::Kept, Some("p.hours"))
    );
    assert!(paths.iter().all(|path| !matches!(path.fate, Fate::Dropped | Fate::New)), "{paths:?}");
    let change = change(&old, &new).expect("it needs no stop");
    let [change] = &change.programs[..] else { panic!("one program") };
    let mut state = change.before.executable.initial().to_vec();
    assert_eq!([0; 3].map(|_| step(&change.before.executable, &mut state, 0)), [101, 202, 303]);
    let mut state = change.forward.convert(&state);
    assert_eq!(step(&change.after.executable, &mut state, 0), 404);
    let mut state = change.back.convert(&state);
    assert_eq!(step(&change.before.executable, &mut state, 0), 505);
}

/// Members that take different pairs are members with different programs.
#[test]
fn pairs_are_a_part_of_what_members_agree_on() {
    let text = program("hours : DINT;", "sum : INT; other : INT;", "sum", "p.hours");
    let of = |pairs: &str| cluster("one.st", &text, pairs);
    let [none, first, second, again] = [
        "",
        "renamed = { count = \"sum\" }",
        "renamed = { count = \"other\" }",
        "renamed = { count = \"sum\" }",
    ]
    .map(of);
    let hash = |cluster: &Cluster| cluster.programs()[0].hash;
    let configuration = |cluster: &Cluster| cluster.agreement().configuration;
    for (one, other) in [(&none, &first), (&first, &second), (&none, &second)] {
        assert_ne!(hash(one), hash(other));
        assert_ne!(configuration(one), configuration(other));
    }
    assert_eq!((hash(&first), configuration(&first)), (hash(&again), configuration(&again)));
    // What members are given and what they keep on their disks is the program with its pairs.
    let code = &first.controllers()[0].code;
    let kept = read_kept(&code.source().kept(hash(&first))).expect("the same program");
    assert_eq!(kept.source().renamed, code.source().renamed);
    let texts = ChangeTexts::between(&old(), &first).expect("it needs no stop");
    let sent = serde_json::to_string(&texts).expect("text");
    let mut received: ChangeTexts = serde_json::from_str(&sent).expect("JSON");
    assert_eq!(received, texts);
    assert!(received.load(&old()).is_ok());
    received.programs[0].after.renamed[0].1 = "other".to_owned();
    assert!(received.load(&old()).is_err(), "other pairs are another program");
}

#[test]
fn the_cluster_file_names_variables_of_its_program_once_each() {
    let text = program(
        "hours : DINT;",
        "sum : INT; list : ARRAY[1..3] OF INT; count : INT;",
        "sum",
        "p.hours",
    );
    let pairs = "renamed = { a1 = \"sum\", a2 = \"summ\", a3 = \"p.ours\", a4 = \"Sum\", a5 = \"list[1]\", a6 = \"p.hours\" }";
    let found = findings(&load(&file("one.st", pairs), &[("one.st", &text)]).reports);
    let codes: Vec<&str> = found
        .lines()
        .filter(|line| line.starts_with("cluster.toml"))
        .map(|line| line.split(' ').nth(2).unwrap_or_default())
        .collect();
    assert_eq!(codes, ["U0209", "U0209", "U0208", "U0209"], "{found}");
    for (name, code) in
        [("summ", "U0209"), ("p.ours", "U0209"), ("Sum", "U0208"), ("list[1]", "U0209")]
    {
        let is = |line: &str| line.contains(code) && line.contains(&format!("`{name}`"));
        assert!(found.lines().any(is), "{name}: {found}");
    }
    // The two names of a pair are the wrong way round.
    let turned = "renamed = { sum = \"count before\" }";
    let found = findings(&load(&file("one.st", turned), &[("one.st", &text)]).reports);
    assert!(found.contains("new name of the old `sum`"), "{found}");
    assert!(found.contains("`\"count before\" = \"sum\"`"), "{found}");
}

/// All that is wrong with pairs for the program that runs is said in one run.
#[test]
fn pairs_that_do_not_fit_the_program_before_are_refused() {
    let old = cluster(
        "one.st",
        &program(
            "hours : DINT;",
            "count : INT; name : STRING[5]; stays : INT;",
            "count",
            "p.hours",
        ),
        "",
    );
    let text = program(
        "hours : DINT;",
        "sum : INT; title : INT; more : INT; stays : INT;",
        "sum",
        "p.hours",
    );
    let pairs = "renamed = { counter = \"sum\", name = \"title\", stays = \"more\" }";
    let reasons = ChangeTexts::between(&old, &cluster("one.st", &text, pairs));
    let reasons = reasons.expect_err("no pair fits");
    assert!(reasons.iter().all(|reason| reason.code() == "U0637"), "{reasons:?}");
    let of = |wanted: &str| {
        let mut reasons = reasons.iter();
        let found = reasons.find_map(|reason| match reason {
            NeedsStop::Unfit(Unfit::Pair { new, why, .. }) if new == wanted => Some(why.clone()),
            _ => None,
        });
        found.unwrap_or_else(|| panic!("{wanted}: {reasons:?}"))
    };
    let names = |why| PairReason::Names(why);
    assert_eq!(of("sum"), names(WrongPair::NoSuchPath("counter".to_owned())));
    assert_eq!(of("more"), names(WrongPair::StillThere("stays".to_owned())));
    assert!(matches!(of("title"), PairReason::Types { .. }));
    assert_eq!(reasons.len(), 3);
}

/// The file of before is the beginning of the next one, with the pairs of a change that is over: a name in both programs is one variable, and a new
/// variable that has the old name again begins with its initial value.
#[test]
fn a_pair_that_has_done_its_work_does_nothing() {
    let pairs = "renamed = { count = \"sum\" }";
    let renamed =
        cluster("one.st", &program("hours : DINT;", "sum : INT;", "sum", "p.hours"), pairs);
    let text = program("hours : DINT;", "count : INT := 7; sum : INT;", "sum", "p.hours");
    let next = cluster("one.st", &text, pairs);
    let plain = cluster("one.st", &text, "");
    for (after, done) in [(&next, 1), (&plain, 0)] {
        let [one, other] = [&renamed, after].map(|cluster| &cluster.controllers()[0].code);
        assert_eq!(done_pairs(one, other).len(), done);
        let paths = fates(one, other, Way::There);
        let of = |name: &str| paths.iter().find(|path| path.path == name).expect("it is listed");
        assert_eq!((of("sum").fate, of("count").fate), (Fate::Kept, Fate::New), "{paths:?}");
        assert!(paths.iter().all(|path| path.renamed_from.is_none()), "{paths:?}");
        let change = change(&renamed, after).expect("it needs no stop");
        let [change] = &change.programs[..] else { panic!("one program") };
        let mut state = change.before.executable.initial().to_vec();
        (0..3).for_each(|_| {
            step(&change.before.executable, &mut state, 0);
        });
        let mut state = change.forward.convert(&state);
        assert_eq!(step(&change.after.executable, &mut state, 0), 404);
    }
    // Both names are in both programs now.
    let again = change(&next, &cluster("one.st", &text.replace("+ 100", "+ 200"), pairs));
    let again = again.expect("it needs no stop");
    let mut state = again.programs[0].before.executable.initial().to_vec();
    step(&again.programs[0].before.executable, &mut state, 0);
    let mut state = again.programs[0].forward.convert(&state);
    assert_eq!(step(&again.programs[0].after.executable, &mut state, 0), 302);
}

/// A name that an earlier change replaced is given to a new variable, while the next change replaces the name that came after it. The pair of the earlier
/// file does not count for the variable that the new one pairs, on the way there and on the way back.
#[test]
fn a_pair_of_an_earlier_change_takes_no_value_of_a_later_one() {
    let earlier = "renamed = { count = \"total\" }";
    let before =
        cluster("one.st", &program("hours : DINT;", "total : DINT;", "total", "p.hours"), earlier);
    let variables = "count : DINT := 5000000; total2 : DINT;";
    let text = program("hours : DINT;", variables, "total2", "p.hours");
    let text = text.replace("y := total2", "y := count + total2");
    let after = cluster("one.st", &text, "renamed = { total = \"total2\" }");
    let [one, other] = [&before, &after].map(|cluster| &cluster.controllers()[0].code);
    let told = |from, to, way| {
        let mut paths: Vec<(String, Fate, Option<String>)> = fates(from, to, way)
            .into_iter()
            .filter(|path| path.fate != Fate::Kept || path.renamed_from.is_some())
            .map(|path| (path.path, path.fate, path.renamed_from))
            .collect();
        paths.sort_by(|one, other| one.0.cmp(&other.0));
        paths
    };
    let named =
        |name: &str, fate, from: Option<&str>| (name.to_owned(), fate, from.map(str::to_owned));
    assert_eq!(
        told(one, other, Way::There),
        [named("count", Fate::New, None), named("total2", Fate::Kept, Some("total"))]
    );
    assert_eq!(
        told(other, one, Way::Back),
        [named("count", Fate::Dropped, None), named("total", Fate::Kept, Some("total2"))]
    );
    let change = change(&before, &after).expect("it needs no stop");
    let [change] = &change.programs[..] else { panic!("one program") };
    let mut state = change.before.executable.initial().to_vec();
    assert_eq!([0; 2].map(|_| step(&change.before.executable, &mut state, 0)), [101, 202]);
    let mut state = change.forward.convert(&state);
    assert_eq!(step(&change.after.executable, &mut state, 0), 5_000_000 + 303);
    let mut state = change.back.convert(&state);
    assert_eq!(step(&change.before.executable, &mut state, 0), 404);
}

/// What sees the edges of a signal goes with it: a signal that is TRUE already is no new edge.
#[test]
fn signals_of_rungs_keep_their_values_and_their_edges() {
    let rungs = |memory: &str| {
        format!(
            "program one\ninput a\ninput b\noutput y = 0\nmemory {memory} = 0\nrung\n    a ( {memory} )\nrung\n    +{memory} (S y )\nrung\n    b (R y )\n"
        )
    };
    let old = cluster("one.ladder", &rungs("m"), "");
    let new = cluster("one.ladder", &rungs("motor"), "renamed = { m = \"motor\" }");
    let paths = fates(&old.controllers()[0].code, &new.controllers()[0].code, Way::There);
    assert!(paths.iter().all(|path| path.fate == Fate::Kept), "{paths:?}");
    let change = change(&old, &new).expect("it needs no stop");
    let [change] = &change.programs[..] else { panic!("one program") };
    let (a, b) = (1, 2);
    let mut state = change.before.executable.initial().to_vec();
    assert_eq!(step(&change.before.executable, &mut state, a), 1, "it is set by the edge");
    assert_eq!(step(&change.before.executable, &mut state, a | b), 0, "and reset");
    let mut state = change.forward.convert(&state);
    assert_eq!(step(&change.after.executable, &mut state, a), 0, "there is no new edge");
    step(&change.after.executable, &mut state, 0);
    assert_eq!(step(&change.after.executable, &mut state, a), 1);
}

/// A power failure in the place of an online change: the values that a station has kept are those of the renamed variables.
#[test]
fn retentive_values_are_taken_over_by_pairs_at_a_restart() {
    let text = |name: &str| {
        format!(
            "PROGRAM one\nVAR_INPUT a : BOOL; END_VAR\nVAR_OUTPUT y : DINT; END_VAR\nVAR RETAIN {name} : INT; END_VAR\n{name} := {name} + 1; y := {name};\nEND_PROGRAM"
        )
    };
    let old = cluster("one.st", &text("count"), "");
    let new = cluster("one.st", &text("sum"), "renamed = { count = \"sum\" }");
    let [before, after] = [&old, &new].map(|cluster| &cluster.controllers()[0].code);
    let mut state = before.executable().initial().to_vec();
    (0..4).for_each(|_| {
        step(&before.executable(), &mut state, 0);
    });
    let mut carried = after.carried(before, &state);
    assert_eq!(carried.dropped().count(), 0);
    assert_eq!(step(&after.executable(), &mut carried.state, 0), 5);
}
