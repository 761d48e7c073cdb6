//! What is suspicious in a ladder: a ladder for each remark, and random ones against a search through every state.

use std::collections::BTreeSet;
use std::time::Duration;

use proptest::prelude::*;
use understudy_ladder::{CoilKind, Element, Name, Program, Write, parse, print, visit};
use understudy_logic::{Circuit, Scan, Scratch, bit};
use understudy_verification::program::{Bounds, Remarks, Subject};
use understudy_verification::property::Asked;

use crate::replay::replays;
use understudy_verification::{Shown, draw_runs};

const PERIOD: Duration = Duration::from_millis(100);

fn remarks(program: &Program) -> (Subject, Remarks) {
    let subject = Subject::new(program, PERIOD, &Asked::default()).expect("a right program");
    let remarks = subject.remarks(program, PERIOD, Bounds::default()).expect("a right program");
    (subject, remarks)
}

/// Codes and the scans of each remark.
fn check(rungs: &str, expected: &[(&str, usize)]) {
    let text = format!(
        "program p\ninput a\ninput b\noutput y\noutput z\nmemory m = 0\nmemory n = 0\n{rungs}"
    );
    let parsed = parse(&text);
    let (program, _) = parsed.into_result().expect("a right program");
    let (subject, remarks) = remarks(&program);
    let found = remarks.found.iter().map(|remark| {
        let scans = remark.trace.as_ref().map_or(0, |trace| {
            assert!(replays(subject.circuit(), trace));
            trace.scans.len()
        });
        (remark.diagnostic.code, scans)
    });
    assert_eq!(found.collect::<Vec<_>>(), expected, "{rungs}");
    assert_eq!(remarks.undecided, 0);
}

#[test]
fn nothing_is_said_of_a_sound_ladder() {
    check("rung\n    [ a | y ] /b ( y )\nrung\n    y {TON t 300ms} ( z )\n", &[]);
}

#[test]
fn a_rung_without_effect() {
    check("rung\n    a b ( y )\nrung\n    y /a ( z )\n", &[("U0443", 0)]);
}

/// Rungs made from the statements of a text: their order is the order of the statements.
#[test]
fn nothing_is_said_of_rungs_that_nobody_wrote() {
    let text = "program p\ninput a\ninput b\noutput y\nrung\n    a ( y )\nrung\n    b ( y )\n";
    let (mut program, _) = parse(text).into_result().expect("a right program");
    assert!(!remarks(&program).1.found.is_empty());
    for rung in &mut program.rungs {
        rung.coils[0].target = Name::from("y");
    }
    assert_eq!(remarks(&program).1, Remarks::default());
}

/// The vendor's light of a staircase: the button that sets the light is the one that resets it.
#[test]
fn an_edge_that_resets_what_it_has_set() {
    check(
        "rung\n    [ +a | +b ] /m (S m)\nrung\n    [ +a | +b ] m (R m)\nrung\n    m ( y )\n",
        &[("U0445", 1), ("U0443", 0)],
    );
    // The other way around it toggles, and one of both can be wanted at a time.
    check(
        "rung\n    [ +a | +b ] m (R m)\nrung\n    [ +a | +b ] /m (S m) ( n )\nrung\n    m /n ( y )\n",
        &[("U0444", 2)],
    );
}

/// It can happen in the first scan only, and not whatever that scan's inputs are.
#[test]
fn what_only_the_first_scan_can_show() {
    check("rung\n    /y +a ( y ) (/ y )\n", &[("U0445", 1)]);
}

/// The automaton of figure 4 of Uzam and Gelen: a second `a` is to lead on, and the first one does.
#[test]
fn an_avalanche() {
    let steps = |second: &str| {
        format!(
            "rung\n    /a /b n (R n)\nrung\n    +a /m /n (S m)\nrung\n    {second} m (R m) (S n)\nrung\n    n ( y )\nrung\n    m ( z )\n"
        )
    };
    check(&steps("b"), &[("U0446", 1)]);
    // With the same edge for both steps the first one is never seen.
    check(&steps("+a"), &[("U0445", 1), ("U0443", 0)]);
}

#[test]
fn a_race_of_set_and_reset() {
    check("rung\n    a (S y)\nrung\n    b (R y)\n", &[("U0444", 1)]);
    check("rung\n    a /b (S y)\nrung\n    b (R y)\n", &[]);
}

#[test]
fn a_race_of_double_coils() {
    check("rung\n    a ( y )\nrung\n    b ( y )\n", &[("U0444", 1)]);
}

#[test]
fn runs_are_drawn_into_the_ladder() {
    let text = "program p\ninput a\ninput b\noutput y\noutput z\nrung\n    a (S y)\nrung\n    b (R y)\nrung\n    a ( z )\n";
    let program = parse(text).program;
    let (subject, remarks) = remarks(&program);
    let shown: Vec<Shown<'_>> = remarks
        .found
        .iter()
        .filter_map(|remark| {
            Some(Shown {
                title: &remark.diagnostic.message,
                verdict: "<remark>",
                trace: remark.trace.as_ref()?,
            })
        })
        .collect();
    let page = draw_runs(&program, PERIOD, subject.circuit(), &shown).expect("a right program");
    assert_eq!(page.matches("<svg").count(), 1);
    assert!(page.contains("&lt;remark&gt;") && page.contains("class=\"live\""));
    // The third rung has nothing to do with it.
    assert!(!page.contains(">z<"));
}

/// What every coil does in every scan that can be reached: power, target before and behind it.
fn every_scan(circuit: &Circuit, writes: &[Write], see: &mut dyn FnMut(&[[bool; 3]])) {
    let scan = Scan::new(circuit);
    let mut scratch = Scratch::default();
    let mut outputs = vec![0; scan.output_count().div_ceil(64).max(1)];
    let mut known = BTreeSet::from([scan.initial().to_vec()]);
    let mut pending = vec![scan.initial().to_vec()];
    while let Some(state) = pending.pop() {
        for inputs in 0..1_u64 << scan.input_count() {
            let mut next = state.clone();
            scan.step(&mut scratch, &mut next, &[inputs], &mut outputs);
            let bit = |place: usize| bit(&outputs, place);
            let bits = writes.iter();
            let bits: Vec<[bool; 3]> =
                bits.map(|write| [bit(write.power), bit(write.before), bit(write.after)]).collect();
            see(&bits);
            if known.insert(next.clone()) {
                pending.push(next);
            }
        }
    }
}

/// Code and name (for U0443 the number of the rung) of what is to be said.
fn expected(program: &Program) -> BTreeSet<(&'static str, String)> {
    let (circuit, writes) = program.lower_writes(PERIOD).expect("a right program");
    let coil = |write: &Write| &program.rungs[write.rung].coils[write.coil];
    let mut changed = vec![false; program.rungs.len()];
    let targets: BTreeSet<String> =
        writes.iter().map(|write| coil(write).target.to_string()).collect();
    let of_target = |target: &str| -> Vec<usize> {
        let all = writes.iter().enumerate();
        all.filter(|(_, write)| coil(write).target.as_str() == target)
            .map(|(place, _)| place)
            .collect()
    };
    let mut lost = BTreeSet::new();
    let mut kept = BTreeSet::new();
    let mut through = BTreeSet::new();
    let mut race = BTreeSet::new();
    every_scan(&circuit, &writes, &mut |bits| {
        for (write, [_, before, after]) in writes.iter().zip(bits) {
            changed[write.rung] |= before != after;
        }
        for target in &targets {
            let places = of_target(target);
            let end = bits[places[places.len() - 1]][2];
            let mut risen = false;
            for (order, &place) in places.iter().enumerate() {
                let [power, before, after] = bits[place];
                let rises = !before && after;
                risen |= rises;
                let undone =
                    places[order + 1..].iter().any(|&later| bits[later][1] && !bits[later][2]);
                if rises && undone && !end {
                    lost.insert(place);
                }
                if rises && end {
                    kept.insert(place);
                }
                for &earlier in &places[..order] {
                    let acts =
                        |place: usize, power: bool| !coil(&writes[place]).kind.is_latch() || power;
                    let twins = writes[earlier].rung == writes[place].rung
                        && coil(&writes[earlier]).kind == coil(&writes[place]).kind;
                    let wants = bits[earlier][2] != after;
                    if !twins && acts(place, power) && acts(earlier, bits[earlier][0]) && wants {
                        race.insert(target.clone());
                    }
                }
            }
            if !bits[places[0]][1] && risen && !end {
                through.insert(target.clone());
            }
        }
    });
    let mut said = BTreeSet::new();
    for (rung, changed) in changed.iter().enumerate() {
        if !changed && !program.rungs[rung].coils.is_empty() {
            said.insert(("U0443", (rung + 1).to_string()));
        }
    }
    for target in &targets {
        let places = of_target(target);
        let reads = |place: &usize| {
            let mut reads = false;
            visit(&program.rungs[writes[*place].rung].network, &mut |element| {
                if let Element::Contact(contact) = element {
                    reads |= contact.operand.as_str() == target;
                }
            });
            reads
        };
        if places.iter().any(|place| lost.contains(place) && !kept.contains(place)) {
            said.insert(("U0445", target.clone()));
        } else if through.contains(target) && places[1..].iter().all(reads) {
            said.insert(("U0446", target.clone()));
        } else if race.contains(target) && !places[1..].iter().any(reads) {
            said.insert(("U0444", target.clone()));
        }
    }
    said
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]
    #[test]
    fn remarks_are_right(seed: u64) {
        let written = understudy_testing::random::random_program(seed, 3);
        let (mut program, _) = parse(&print(&written)).into_result().expect("a right program");
        // Edge coils and blocks only make the states more.
        for coil in program.rungs.iter_mut().flat_map(|rung| &mut rung.coils) {
            coil.kind = match coil.kind {
                CoilKind::Rising => CoilKind::Set,
                CoilKind::Falling => CoilKind::Reset,
                kind => kind,
            };
        }
        let (circuit, _) = program.lower_writes(PERIOD).expect("a right program");
        prop_assume!(circuit.registers().len() <= 10);
        let (subject, remarks) = remarks(&program);
        let mut said = BTreeSet::new();
        for remark in &remarks.found {
            let code = remark.diagnostic.code;
            let name = if code == "U0443" {
                remark.diagnostic.message.split_whitespace().nth(1).unwrap_or_default().to_owned()
            } else {
                remark.diagnostic.message.split('`').nth(1).unwrap_or_default().to_owned()
            };
            if let Some(trace) = &remark.trace {
                prop_assert!(replays(subject.circuit(), trace));
            }
            said.insert((code, name));
        }
        let expected = expected(&program);
        // Where some of the rungs that can reset a target read it and others do not, which one the run shows decides between the two codes.
        for (code, name) in &expected {
            prop_assert!(said.contains(&(*code, name.clone())), "{code} {name} is missing in {said:?}");
        }
        let targets = |set: &BTreeSet<(&'static str, String)>, code: &str| -> BTreeSet<String> {
            set.iter().filter(|said| said.0 == code).map(|said| said.1.clone()).collect()
        };
        for code in ["U0443", "U0445"] {
            prop_assert_eq!(targets(&said, code), targets(&expected, code));
        }
    }
}
