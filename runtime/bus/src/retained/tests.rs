mod programs;

use std::fs;
use std::sync::Arc;
use std::sync::mpsc::sync_channel;
use std::time::{Duration, Instant};

use proptest::prelude::*;
use understudy_testing::Folder;
use understudy_wire::{
    Cycle, Digest, Epoch, Image, Lineage, Recalled, RetainedState, RetainedStep, SamplesReceived,
    StationSet,
};

use super::writing::{Failure, NOTES_IN_A_FILE, Turn, WAITING_RECORDS, Writer};
use super::*;

const CLUSTER: ClusterHash = ClusterHash(1);
const OWNER: Owner = Owner { cluster: CLUSTER, authority: None };
const HASH: understudy_wire::ProgramHash = understudy_wire::ProgramHash(2);
const PROGRAM: ProgramId = ProgramId(0);

fn moment(cycle: u64) -> Moment {
    Moment { epoch: Epoch(1), cycle: Cycle(cycle) }
}

fn inputs(cycle: u64) -> Image {
    Image::from_words(64, &[cycle]).expect("64 bits")
}

/// The lineage after the sample of `cycle`.
fn lineage(cycle: u64) -> Lineage {
    (1..=cycle).fold(Lineage(7), |lineage, cycle| lineage.after(&inputs(cycle)))
}

fn state(cycle: u64) -> Retained {
    Retained::State(RetainedState {
        cluster: CLUSTER,
        program: PROGRAM,
        hash: HASH,
        number: cycle,
        born: moment(0),
        lineage: lineage(cycle),
        stepped: moment(cycle),
        digest: Digest(0),
        state: inputs(cycle),
    })
}

fn step(cycle: u64) -> Retained {
    Retained::Step(RetainedStep {
        program: PROGRAM,
        stepped: moment(cycle),
        inputs: inputs(cycle),
        after: lineage(cycle),
    })
}

fn note(cycle: u64) -> Retained {
    Retained::Note(Note {
        cluster: CLUSTER,
        configuration: understudy_wire::ConfigurationHash(3),
        hash: HASH,
        is_retentive: true,
        number: cycle,
        lineage: lineage(cycle),
        begun: None,
        recalled: Recalled {
            program: PROGRAM,
            sampled: moment(cycle),
            received: SamplesReceived::Later,
            applied: Some(moment(cycle)),
            excluded: StationSet::EMPTY,
            accounted_for: StationSet::EMPTY,
            writes: Default::default(),
            pulses: Default::default(),
            inputs: inputs(cycle),
            version: None,
        },
    })
}

/// Keeps a state in every tenth cycle and the steps in between, from `first` to `last`.
fn keep(files: &RetainedFiles, first: u64, last: u64) {
    let retainer = Retainer::start(vec![(Some(PROGRAM), files.clone())]).expect("threads");
    for cycle in first..=last {
        retainer.keep(if cycle == first || cycle % 10 == 0 { state(cycle) } else { step(cycle) });
    }
    retainer.finish();
}

/// The newest cycle that is read.
fn newest(files: &RetainedFiles) -> Option<u64> {
    let (runs, _) = files.runs(Some(OWNER));
    runs.iter().map(|run| run.stepped().cycle.0).max()
}

#[test]
fn the_newest_cycle_comes_back_over_several_lives() {
    let folder = Folder::new("retained-lives");
    let files = RetainedFiles::new(&folder, "robot.robot".to_owned());
    assert_eq!(newest(&files), None);
    let mut last = 0;
    for life in [1, 5, 9, 10, 11, 25, 31] {
        keep(&files, last + 1, last + life);
        last += life;
        assert_eq!(newest(&files), Some(last));
    }
    let (_, found) = files.runs(Some(OWNER));
    assert!(found.iter().all(|file| file.problem.is_none()), "{found:?}");
}

fn newest_of(files: &RetainedFiles) -> Option<Moment> {
    files.notes(Some(OWNER)).newest.and_then(|note| note.applied())
}

/// A note that may not be the newest proves nothing: a file that is damaged, cut or emptied leaves none.
#[test]
fn a_damaged_note_leaves_none() {
    let folder = Folder::new("retained-damaged-notes");
    let files = RetainedFiles::new(&folder, "robot-io".to_owned());
    let retainer = Retainer::start(vec![(None, files.clone())]).expect("threads");
    (1..=20).for_each(|cycle| retainer.keep(note(cycle)));
    retainer.finish();
    assert_eq!(newest_of(&files), Some(moment(20)));
    let [path, _] = files.paths();
    let bytes = fs::read(&path).expect("a file");
    let flipped = |place: usize| {
        let mut flipped = bytes.clone();
        flipped[place] ^= 1;
        flipped
    };
    let half = bytes.len() / 2 - 1;
    for (damaged, cycle) in
        [Vec::new(), bytes[..half].to_vec(), flipped(0), flipped(half)].into_iter().zip(21..)
    {
        fs::write(&path, &damaged).expect("written");
        assert_eq!(newest_of(&files), None);
        // The next life has a note again as soon as it makes one, in whichever file.
        let retainer = Retainer::start(vec![(None, files.clone())]).expect("threads");
        retainer.keep(note(cycle));
        retainer.finish();
        assert_eq!(newest_of(&files), Some(moment(cycle)));
    }
}

/// One that is missing may have had the newest note: the other one proves nothing then.
#[test]
fn a_missing_file_of_notes_leaves_none() {
    let folder = Folder::new("retained-missing-notes");
    let files = RetainedFiles::new(&folder, "robot-io".to_owned());
    let mut made = 0;
    for (life, notes) in [1, 3, 1, 5].into_iter().enumerate() {
        let retainer = Retainer::start(vec![(None, files.clone())]).expect("threads");
        (0..notes).for_each(|_| {
            retainer.keep(note(made));
            made += 1;
        });
        retainer.finish();
        assert_eq!(newest_of(&files), Some(moment(made - 1)), "life {life}");
        for path in files.paths() {
            let bytes = fs::read(&path).expect("both are there");
            fs::remove_file(&path).expect("removed");
            let found = files.notes(Some(OWNER));
            assert!(found.newest.is_none() && found.is_damaged, "life {life}: {found:?}");
            let problem = found.files.iter().find(|file| file.path == path);
            assert!(problem.is_some_and(|file| file.problem.is_some()), "{found:?}");
            fs::write(&path, bytes).expect("written");
        }
    }
    // The power fails before the other file is begun.
    let early = RetainedFiles::new(&folder, "early-io".to_owned());
    let mut bytes = Vec::new();
    note(0).write(&mut bytes);
    fs::write(&early.paths()[1], bytes).expect("written");
    assert_eq!(newest_of(&early), Some(moment(0)));
    // The next life numbers its notes anew: what is left of the one before does not come back.
    for path in files.paths() {
        fs::remove_file(&path).expect("removed");
        let retainer = Retainer::start(vec![(None, files.clone())]).expect("threads");
        retainer.keep(note(2));
        retainer.finish();
        assert_eq!(newest_of(&files), Some(moment(2)));
    }
}

/// A copy of the cluster on a test bench has its name and its programs, and other keys: the operator decides about its values, and its notes prove
/// nothing.
#[test]
fn what_was_kept_with_other_keys_is_told_apart() {
    let folder = Folder::new("retained-keys");
    let keys = [None, Some(AuthorityHash(5)), Some(AuthorityHash(6))];
    for (number, kept_with) in (1..).zip(keys) {
        let files = RetainedFiles::new(&folder, format!("robot.robot-{number}"));
        keep(&files.clone().with_authority(kept_with), 1, number * 10);
        for authority in keys {
            let (runs, found) = files.runs(Some(Owner { authority, ..OWNER }));
            let is_own = authority == kept_with;
            assert_eq!(runs.iter().map(|run| run.stepped().cycle.0).max(), Some(number * 10));
            let is_whole = |run: &RetainedRun| run.carried.is_none_or(|carried| carried.is_whole);
            assert!(runs.iter().all(|run| is_whole(run) == is_own), "{kept_with:?} {authority:?}");
            assert_eq!(found.iter().any(|file| file.problem.is_some()), !is_own);
        }
    }
    for (life, kept_with) in (1..).zip(keys) {
        let named = |authority| {
            let files = RetainedFiles::new(&folder, format!("robot-io-{life}"));
            files.with_authority(authority)
        };
        let retainer = Retainer::start(vec![(None, named(kept_with))]).expect("threads");
        (1..=life).for_each(|cycle| retainer.keep(note(cycle)));
        retainer.finish();
        for authority in keys {
            let found = named(authority).notes(Some(Owner { authority, ..OWNER }));
            let newest = found.newest.and_then(|note| note.applied());
            let is_own = authority == kept_with;
            assert_eq!(newest, is_own.then(|| moment(life)));
            assert_eq!(found.is_damaged, !is_own);
        }
        // Once it has a note of its own keys, however it is numbered, it asks no more.
        let next = named(Some(AuthorityHash(7)));
        let retainer = Retainer::start(vec![(None, next.clone())]).expect("threads");
        retainer.keep(note(0));
        retainer.finish();
        let owner = Owner { authority: Some(AuthorityHash(7)), ..OWNER };
        let found = next.notes(Some(owner));
        assert_eq!(
            found.newest.and_then(|note| note.applied()),
            Some(moment(0)),
            "{:?}",
            found.files
        );
    }
}

/// States of a member with other keys are left out once there are own ones, however many the others were.
#[test]
fn own_states_come_before_those_of_other_keys() {
    let folder = Folder::new("retained-own-keys");
    let files = RetainedFiles::new(&folder, "robot.robot".to_owned());
    let other = files.clone().with_authority(Some(AuthorityHash(5)));
    keep(&other, 500, 540);
    keep(&files, 3, 3);
    let (runs, found) = files.runs(Some(OWNER));
    assert_eq!(runs.iter().map(|run| run.stepped().cycle.0).max(), Some(3));
    assert!(found.iter().any(|file| file.problem.is_some()), "{found:?}");
}

#[test]
fn the_newest_note_comes_back() {
    let folder = Folder::new("retained-notes");
    let files = RetainedFiles::new(&folder, "robot-io".to_owned());
    let retainer = Retainer::start(vec![(None, files.clone())]).expect("threads");
    let last = u64::from(NOTES_IN_A_FILE) * 2 + 7;
    let mut cycle = 0;
    while cycle < last {
        // The queue is shorter than the number of notes.
        for _ in 0..WAITING_RECORDS.min((last - cycle) as usize) / 2 + 1 {
            cycle += 1;
            retainer.keep(Retained::Note(match note(1) {
                Retained::Note(mut of) => {
                    of.number = cycle;
                    of.recalled.sampled = moment(cycle);
                    of.recalled.applied = Some(moment(cycle));
                    of
                }
                _ => unreachable!("a note"),
            }));
        }
        wait_until(|| newest_of(&files) == Some(moment(cycle)));
    }
    retainer.finish();
    let found = files.notes(Some(OWNER));
    assert_eq!(found.newest.and_then(|note| note.applied()), Some(moment(cycle)));
    assert!(!found.is_damaged, "{:?}", found.files);
    let foreign = files.notes(Some(Owner { cluster: ClusterHash(9), ..OWNER }));
    assert!(foreign.newest.is_none() && foreign.is_damaged, "{:?}", foreign.files);
}

/// A folder that cannot be written is reported, and so is that it can be again; nothing ends.
#[test]
fn a_disk_that_takes_nothing_is_reported_until_it_does() {
    let folder = Folder::new("retained-full");
    let path = folder.join("below");
    fs::write(&path, "a file in place of the folder").expect("written");
    let files = RetainedFiles::new(&path, "robot.robot".to_owned());
    let mut retainer = Retainer::start(vec![(Some(PROGRAM), files.clone())]).expect("threads");
    let wait = |retainer: &mut Retainer, cycle: u64| {
        let patience = Instant::now() + Duration::from_secs(60);
        retainer.keep(state(cycle));
        loop {
            if let Some(change) = retainer.take_change() {
                return change;
            }
            assert!(Instant::now() < patience, "no change");
            std::thread::yield_now();
        }
    };
    let reason = wait(&mut retainer, 1).expect("a reason");
    assert!(reason.contains("below"), "{reason}");
    fs::remove_file(&path).expect("removed");
    assert_eq!(wait(&mut retainer, 2), None);
    retainer.keep(step(3));
    retainer.finish();
    assert_eq!(newest(&files), Some(3));
}

/// What happens to a file while the power is off.
#[derive(Debug, Clone)]
enum Damage {
    None,
    Missing,
    /// It ends at this share of its bytes.
    Torn(f64),
    /// A bit flips at this share of its bytes.
    Flipped(f64),
    /// It is of another cluster.
    Foreign,
}

fn damages() -> impl Strategy<Value = Damage> {
    prop_oneof![
        Just(Damage::None),
        Just(Damage::Missing),
        (0.0f64..1.0).prop_map(Damage::Torn),
        (0.0f64..1.0).prop_map(Damage::Flipped),
        Just(Damage::Foreign),
    ]
}

/// Damages a file; answers with the newest cycle that is intact in it, for these records.
fn damage(path: &Path, damage: &Damage) -> Option<u64> {
    let bytes = fs::read(path).ok()?;
    let (records, _) = Retained::read(&bytes);
    let cycles: Vec<u64> = records
        .iter()
        .map(|record| match record {
            Retained::State(state) => state.stepped.cycle.0,
            Retained::Step(step) => step.stepped.cycle.0,
            Retained::Note(_) | Retained::Authority(_) => 0,
        })
        .collect();
    let mut ends = vec![0];
    for record in &records {
        let mut one = Vec::new();
        record.write(&mut one);
        ends.push(ends[ends.len() - 1] + one.len());
    }
    let intact_before =
        |byte: usize| cycles[..ends.iter().filter(|end| **end <= byte).count() - 1].last().copied();
    let at = |share: f64| ((bytes.len() as f64 * share) as usize).min(bytes.len() - 1);
    match damage {
        Damage::None => cycles.last().copied(),
        Damage::Missing => {
            fs::remove_file(path).expect("removed");
            None
        }
        Damage::Torn(share) => {
            fs::write(path, &bytes[..at(*share)]).expect("written");
            intact_before(at(*share))
        }
        Damage::Flipped(share) => {
            let mut flipped = bytes.clone();
            flipped[at(*share)] ^= 0x04;
            fs::write(path, &flipped).expect("written");
            intact_before(at(*share))
        }
        Damage::Foreign => {
            let mut foreign = Vec::new();
            if let Retained::State(of) = state(1) {
                Retained::State(RetainedState { cluster: ClusterHash(99), ..of })
                    .write(&mut foreign);
            }
            fs::write(path, &foreign).expect("written");
            None
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]

    /// Whatever happens to the files: the newest intact cycle is read, none that never was, and the next life goes on.
    #[test]
    fn the_newest_intact_cycle_is_read(last in 1u64..60, both in prop::array::uniform2(damages())) {
        let folder = Folder::new("retained-damaged");
        let files = RetainedFiles::new(&folder, "robot.robot".to_owned());
        keep(&files, 1, last);
        let intact = files.paths().iter().zip(&both).filter_map(|(path, of)| damage(path, of)).max();
        let (runs, found) = files.runs(Some(OWNER));
        for run in &runs {
            let cycle = run.stepped().cycle.0;
            prop_assert_eq!(run.steps.last().map_or(run.state.lineage, |step| step.after), lineage(cycle));
        }
        prop_assert_eq!(newest(&files), intact);
        // Every file that is not used to its end is named.
        for (path, of) in files.paths().iter().zip(&both) {
            let file = found.iter().find(|file| file.path == *path);
            let told = file.is_some_and(|file| file.problem.is_some());
            match of {
                Damage::Foreign | Damage::Flipped(_) => prop_assert!(told || file.is_none()),
                Damage::None | Damage::Missing => prop_assert!(!told, "{:?}", file),
                // One that ends between two records has an end like any other.
                Damage::Torn(_) => {}
            }
        }
        keep(&files, last + 1, last + 3);
        prop_assert_eq!(newest(&files), Some(last + 3));
    }
}

/// Waits until something is so.
fn wait_until(mut is_so: impl FnMut() -> bool) {
    let patience = Instant::now() + Duration::from_secs(60);
    while !is_so() {
        assert!(Instant::now() < patience, "it is not so");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// Keeps states until something changes: the reason why the disk takes nothing, or none where it does.
fn changed(retainer: &mut Retainer, cycle: u64) -> Option<String> {
    let mut change = None;
    wait_until(|| {
        retainer.keep(state(cycle));
        change = retainer.take_change();
        change.is_some()
    });
    change.flatten()
}

/// A disk that is full: every write fails, and nothing ends.
#[test]
fn a_full_disk_is_reported_until_it_has_room() {
    let folder = Folder::new("retained-no-room");
    let files = RetainedFiles::new(&folder, "robot.robot".to_owned());
    let mut retainer = Retainer::start(vec![(Some(PROGRAM), files.clone())]).expect("threads");
    retainer.keep(state(1));
    wait_until(|| newest(&files) == Some(1));
    let full = || {
        for path in files.paths() {
            let _ = fs::remove_file(&path);
            std::os::unix::fs::symlink("/dev/full", path).expect("a link");
        }
    };
    full();
    let reason = changed(&mut retainer, 2).expect("a reason");
    assert!(reason.contains("No space left"), "{reason}");
    for path in files.paths() {
        fs::remove_file(path).expect("removed");
    }
    assert_eq!(changed(&mut retainer, 3), None);
    retainer.finish();
    assert_eq!(newest(&files), Some(3));
}

/// A disk that takes nothing for a while: the cycle goes on, what has no room is left out, and that is reported. The steps behind the gap are not used.
#[test]
fn a_slow_disk_leaves_records_out_and_says_so() {
    let folder = Folder::new("retained-slow");
    let files = RetainedFiles::new(&folder, "robot.robot".to_owned());
    let failure = Failure::default();
    let (queue, records) = sync_channel(WAITING_RECORDS);
    let mut retainer = Retainer {
        queue: Some(queue),
        failure: Arc::clone(&failure),
        reported: false,
        writer: None,
    };
    let room = WAITING_RECORDS as u64;
    retainer.keep(state(1));
    (2..=room + 50).for_each(|cycle| retainer.keep(step(cycle)));
    let reason = retainer.take_change().flatten().expect("a reason");
    assert!(reason.contains("wait for the disk"), "{reason}");
    // The disk is back.
    let (sync, _) = sync_channel(1);
    let turns = vec![Turn::new(Some(PROGRAM), files.clone())];
    let writer = std::thread::spawn(move || Writer { turns, sync, failure }.run(&records));
    wait_until(|| newest(&files) == Some(room));
    assert_eq!(retainer.take_change(), None);
    retainer.keep(step(room + 51));
    assert_eq!(changed(&mut retainer, room + 60), None);
    retainer.finish();
    writer.join().expect("it ends");
    let (runs, _) = files.runs(Some(OWNER));
    let cycles = runs.iter().flat_map(|run| run.steps.iter().map(|step| step.stepped.cycle.0));
    assert_eq!(cycles.max(), Some(room));
    assert_eq!(newest(&files), Some(room + 60));
}
