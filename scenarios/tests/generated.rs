//! The generated parity controller against the replicas, in every cycle of every scenario: equation (9), where the left side is
//! published with `mode = "paper"` and the right side with the default mode.

use std::collections::BTreeMap;
use std::collections::HashMap;

use understudy_cluster::Cluster;
use understudy_cycle::Mode;
use understudy_executable::Scratch;
use understudy_journal::{Happening, Members};
use understudy_node::Event as StationEvent;
use understudy_parity::sum;
use understudy_remote_io::Event as RemoteIoEvent;
use understudy_scenarios::{read, simulate};
use understudy_testing::press_cell;
use understudy_wire::{Image, Lineage, Member, Moment, ProgramId, ProgramSet, StationId, Word};

/// What each program computes, by a run of its circuit over the samples of the journal.
#[derive(Default)]
struct Reference {
    scratch: Scratch,
    states: HashMap<(ProgramId, Lineage), Image>,
    /// L(i)(t+1) and y(i)(t).
    outputs: HashMap<(ProgramId, Moment), (Lineage, Image)>,
}

impl Reference {
    fn sampled(&mut self, cluster: &Cluster, program: ProgramId, event: &RemoteIoEvent) {
        let RemoteIoEvent::Sampled { moment, inputs, born, before, .. } = event else {
            return;
        };
        let found = &cluster.programs()[program.index()];
        let initial = || {
            let genesis = Lineage::genesis(found.hash, *born);
            assert_eq!(*before, genesis, "the history is known from its start");
            Image::from_words(found.executable.state_count(), found.executable.initial())
                .expect("an initial state")
        };
        let known = self.states.get(&(program, *before)).cloned();
        let mut state = known.unwrap_or_else(initial);
        let mut outputs = Image::zero(found.executable.output_count());
        found.executable.step(
            &mut self.scratch,
            state.words_mut(),
            inputs.words(),
            outputs.words_mut(),
        );
        let after = before.after(inputs);
        self.states.insert((program, after), state);
        self.outputs.insert((program, *moment), (after, outputs));
    }

    fn sum(&self, mask: ProgramSet, moment: Moment) -> Option<Word> {
        let output_of = |program| Some(&self.outputs.get(&(program, moment))?.1);
        sum(mask, output_of)
    }

    fn lineages(&self, all: ProgramSet, moment: Moment) -> Vec<Lineage> {
        all.iter().filter_map(|program| Some(self.outputs.get(&(program, moment))?.0)).collect()
    }
}

/// y(N+1) of each cycle in which the understudy knew all programs, by the lineages of all programs. Each word is compared with
/// the sum of the outputs that the samples lead to.
fn parity_outputs(mode: Mode, text: &str) -> BTreeMap<Vec<u64>, Image> {
    let cluster = press_cell(mode);
    let read = read("scenario.toml", text, Some(&Members::of(&cluster)));
    let scenario = read.scenario.expect("a scenario");
    let all = ProgramSet::first(cluster.controllers().len());
    let mut reference = Reference::default();
    let mut published: Vec<(StationId, Moment, Vec<Word>)> = Vec::new();
    let run =
        simulate(&cluster, &scenario, 1, &mut |record| match (record.member, &record.event) {
            (Some(Member::RemoteIo(program)), Happening::RemoteIo(event)) => {
                reference.sampled(&cluster, program, event);
            }
            (
                Some(Member::Station(station)),
                Happening::Station(StationEvent::Published { moment, words }),
            ) => published.push((station, *moment, words.to_vec())),
            _ => {}
        });
    run.expect("the cluster is synchronised");
    let mut outputs = BTreeMap::new();
    for (station, moment, words) in published {
        for word in &words {
            let truth = reference.sum(word.mask, moment);
            assert_eq!(truth.as_ref(), Some(word), "{mode:?} {station:?} {moment:?}");
        }
        let covered = words.iter().fold(ProgramSet::EMPTY, |covered, word| covered.or(word.mask));
        let understudy = cluster.agreement().schedule.is_understudy(station);
        if understudy && covered == all {
            let mut total = Image::default();
            words.iter().for_each(|word| total.add(&word.sum));
            let lineages = reference.lineages(all, moment);
            let key = lineages.iter().map(|lineage| lineage.0).collect();
            outputs.insert(key, total);
        }
    }
    outputs
}

fn check(text: &str) {
    let replicas = parity_outputs(Mode::Full, text);
    let generated = parity_outputs(Mode::Paper, text);
    let both =
        generated.iter().filter_map(|(lineages, output)| Some((output, replicas.get(lineages)?)));
    let mut compared = 0;
    for (generated, replicas) in both {
        assert_eq!(generated, replicas, "(9)");
        compared += 1;
    }
    assert!(compared > 50, "{compared} cycles of both modes are the same");
}

#[test]
fn the_generated_controller_is_the_sum_of_the_replicas_in_every_cycle() {
    let folder = std::fs::read_dir(env!("CARGO_MANIFEST_DIR")).expect("the folder of scenarios");
    let mut scenarios = 0;
    for file in folder {
        let path = file.expect("a file").path();
        let name = path.file_name().and_then(|name| name.to_str());
        let is_scenario = path.extension().is_some_and(|it| it == "toml")
            && !matches!(name, Some("Cargo.toml" | "clippy.toml"));
        if is_scenario {
            check(&std::fs::read_to_string(&path).expect("a text"));
            scenarios += 1;
        }
    }
    assert!(scenarios >= 8, "{scenarios} scenarios");
}
