//! Online changes of what a remote I/O does where nothing is proved: hold times, fail-safe values and ramps count from the acceptance on, also for a
//! remote I/O that starts again and for its twin, and those of before count until then and after a cancellation.

use std::sync::Arc;

use understudy_cluster::{ChangeTexts, Cluster, read};
use understudy_remote_io::Event;
use understudy_simulator::{Action, ChangeStep, Fault, Network, Parts, Record, Simulation, parts};
use understudy_wire::{Image, Member, ProgramId, Source, StationId};

const BEFORE: &str = "fail_safe = { level = 7 }";
const AFTER: &str = "hold_cycles = 6\nfail_safe = { level = 300 }\nramp = { level = 2000 }";
const TWIN: &str = "\ntwin = { name = \"second\", wiring = \"exclusive\", take_over_after = 2 }";

const PLANT: &str = "PROGRAM plant\nVAR_INPUT level : INT; END_VAR\nVAR_OUTPUT go : BOOL; END_VAR\ngo := level > 5;\nEND_PROGRAM";

const REMOTE_IO: Member = Member::RemoteIo(ProgramId(0));
const STATIONS: [Member; 2] = [Member::Station(StationId(0)), Member::Station(StationId(1))];

fn cluster(step: u32, settings: &str) -> Cluster {
    let file = format!(
        "[cluster]\nname = \"cell\"\n\n[[controller]]\nname = \"one\"\nladder = \"one.st\"\n\n[[remote_io]]\ncontroller = \"one\"\ntrial_cycles = 5\n{settings}\n[[plant]]\ncontroller = \"one\"\nladder = \"plant.st\"\n"
    );
    let program = format!(
        "PROGRAM one\nVAR_INPUT go : BOOL; END_VAR\nVAR_OUTPUT level : INT; END_VAR\nVAR n : INT; END_VAR\nn := n + {step};\nlevel := n;\nEND_PROGRAM"
    );
    let loaded = read("cluster.toml", &file, &mut |name| match name {
        "plant.st" => Ok(PLANT.to_owned()),
        _ => Ok(program.clone()),
    });
    loaded.cluster.unwrap_or_else(|| panic!("{:?}", loaded.reports))
}

fn changing(before: &Cluster, after: &Cluster) -> Parts {
    let texts = ChangeTexts::between(before, after).expect("an online change");
    let change = texts.load(before).expect("it is of this cluster");
    Parts { change: Some(Arc::new(change)), ..parts(before) }
}

fn at(cycle: u64, member: Member, action: Action) -> Fault {
    Fault { at_cycle: cycle, phase: 0.3, member, action }
}

fn level(image: &Image) -> i16 {
    let bits = (0..16).map(|bit| i16::from(image.get(bit)) << bit);
    bits.fold(0, |level, bit| level | bit)
}

/// What is applied from the death of all stations at the end of cycle 100 on: the source and the level.
fn after_the_death_of_all(parts: Parts, faults: &[Fault]) -> Vec<(Source, i16)> {
    let mut simulation = Simulation::new(parts, Network::default(), 3);
    for fault in faults {
        simulation.schedule(*fault);
    }
    for station in STATIONS {
        simulation.schedule(Fault { phase: 0.9, ..at(100, station, Action::Crash) });
    }
    let mut applied = Vec::new();
    simulation
        .run(140, 300, &mut |_, cycle, _, record| {
            if let (Record::RemoteIo(Event::Applied { outputs, source, .. }), Some(90..)) =
                (record, cycle)
            {
                applied.push((*source, level(outputs)));
            }
        })
        .expect("everybody comes");
    assert_eq!(simulation.violations(), []);
    let proved = applied.iter().rposition(|(source, _)| *source == Source::Direct);
    applied.split_off(proved.expect("it ran") + 1)
}

/// The level falls to 7 in the fourth deadline.
fn check_old(applied: &[(Source, i16)]) {
    let (held, rest) = applied.split_at(3);
    assert!(held.iter().all(|(source, _)| *source == Source::Held), "{applied:?}");
    assert!(rest.len() > 20 && rest.iter().all(|it| *it == (Source::FailSafe, 7)), "{applied:?}");
}

/// The level goes to 300 by 20 a deadline, from the seventh on.
fn check_new(applied: &[(Source, i16)]) {
    let (held, rest) = applied.split_at(6);
    let (source, begins) = held[0];
    assert!(held.iter().all(|it| *it == (Source::Held, begins)), "{applied:?}");
    assert_eq!(source, Source::Held);
    check_ramp(begins, rest);
}

/// From the deadline on after that in which the level was `begins`.
fn check_ramp(begins: i16, applied: &[(Source, i16)]) {
    let mut last = begins;
    for (source, level) in applied {
        let way = 300 - last;
        last += way.signum() * way.abs().min(20);
        assert_eq!((*source, *level), (Source::FailSafe, last), "from {begins}: {applied:?}");
    }
    assert_eq!(last, 300, "from {begins}: {applied:?}");
}

/// The steps of a change at all members of this run, in the given cycles.
fn steps(members: &[Member], of: &[(u64, ChangeStep)]) -> Vec<Fault> {
    let all = of.iter().flat_map(|(cycle, step)| {
        let action = Action::Change { step: *step };
        members.iter().map(move |member| at(*cycle, *member, action))
    });
    all.collect()
}

/// With a program that changes beside the settings, and without one.
fn both_kinds() -> [(Parts, bool); 2] {
    let before = cluster(1, BEFORE);
    let with_program = changing(&before, &cluster(2, AFTER));
    [(with_program, true), (changing(&before, &cluster(1, AFTER)), false)]
}

#[test]
fn settings_count_from_the_acceptance_on_and_until_a_cancellation() {
    use ChangeStep::{Accept, Forget, ForgetNew, Prepare, Switch, SwitchBack, TakeBack};
    let members = [&STATIONS[..], &[REMOTE_IO]].concat();
    let cases: [(&[(u64, ChangeStep)], bool); 7] = [
        (&[], false),
        (&[(20, Prepare)], false),
        (&[(20, Prepare), (40, Switch)], false),
        (&[(20, Prepare), (40, Switch), (60, Accept)], true),
        (&[(20, Prepare), (40, Switch), (60, Accept), (80, Forget)], true),
        (&[(20, Prepare), (40, Switch), (60, SwitchBack), (80, ForgetNew)], false),
        (
            &[
                (20, Prepare),
                (40, Switch),
                (55, Accept),
                (70, SwitchBack),
                (80, TakeBack),
                (90, ForgetNew),
            ],
            false,
        ),
    ];
    for (of, is_new) in cases {
        for (parts, _) in both_kinds() {
            let applied = after_the_death_of_all(parts, &steps(&members, of));
            if is_new { check_new(&applied) } else { check_old(&applied) }
        }
    }
}

/// A remote I/O that starts again in the middle of the change has the settings of the configuration that it had.
#[test]
fn a_remote_io_that_starts_again_has_its_settings() {
    use ChangeStep::{Accept, Prepare, Switch};
    let members = [&STATIONS[..], &[REMOTE_IO]].concat();
    for (accepts, dies) in [(false, 30), (false, 50), (true, 70)] {
        let mut of = vec![(20, Prepare), (40, Switch)];
        of.extend(accepts.then_some((60, Accept)));
        for (parts, _) in both_kinds() {
            let mut faults = steps(&members, &of);
            faults.retain(|fault| {
                fault.member != REMOTE_IO || !(dies..dies + 15).contains(&fault.at_cycle)
            });
            faults.push(at(dies, REMOTE_IO, Action::Crash));
            faults.push(at(dies + 3, REMOTE_IO, Action::Restart));
            let applied = after_the_death_of_all(parts, &faults);
            if accepts { check_new(&applied) } else { check_old(&applied) }
        }
    }
}

/// Its twin takes over with the same settings, those of before and those of after.
#[test]
fn a_twin_has_the_same_settings() {
    use ChangeStep::{Accept, Prepare, Switch};
    let [before, after] = [(1, BEFORE), (2, AFTER)]
        .map(|(step, settings)| cluster(step, &format!("{settings}{TWIN}")));
    let members = [&STATIONS[..], &[REMOTE_IO, Member::Twin(ProgramId(0))]].concat();
    for accepts in [false, true] {
        let mut of = vec![(20, Prepare), (40, Switch)];
        of.extend(accepts.then_some((60, Accept)));
        let mut faults = steps(&members, &of);
        faults.push(at(75, REMOTE_IO, Action::Crash));
        // The first one is bound by its frames, so the twin drives without stations too.
        faults.push(at(80, REMOTE_IO, Action::Restart));
        let applied = after_the_death_of_all(changing(&before, &after), &faults);
        if accepts { check_new(&applied) } else { check_old(&applied) }
    }
}

/// Outputs that are fail-safe already go on from where they are, along the new ramp to the new value, and back at once where there was no ramp.
#[test]
fn fail_safe_outputs_go_on_to_the_new_values() {
    use ChangeStep::{Accept, Prepare, TakeBack};
    let settings_alone = || both_kinds().into_iter().find(|(_, has_program)| !has_program);
    let (parts, _) = settings_alone().expect("there is one");
    let remote_io = [REMOTE_IO];
    let faults = steps(&remote_io, &[(90, Prepare), (110, Accept)]);
    let applied = after_the_death_of_all(parts.clone(), &faults);
    let begins = applied.iter().rposition(|it| *it == (Source::FailSafe, 7)).expect("it was 7");
    assert!((6..14).contains(&begins), "{applied:?}");
    check_ramp(7, &applied[begins + 1..]);
    let faults = steps(&remote_io, &[(90, Prepare), (110, Accept), (115, TakeBack)]);
    let applied = after_the_death_of_all(parts, &faults);
    let levels: Vec<i16> = applied.iter().map(|it| it.1).collect();
    let top = levels.iter().rposition(|level| *level > 7 + 20).expect("it rose");
    assert!(levels[top] < 300 && levels[top + 1..].iter().all(|level| *level == 7), "{levels:?}");
}
