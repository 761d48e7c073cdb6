//! What a member has kept before the power failed, of its own program or of the one before it.

use std::path::Path;

use understudy_bus::{CarriedOver, FoundFile, FoundNotes, Owner, RetainedFiles, Retention};
use understudy_cluster::{Cluster, Code, Security, input_name_after, read_kept};
use understudy_executable::Scratch;
use understudy_keys::authority_of;
use understudy_node::Settings;
use understudy_typed::{CarriedState, Fate};
use understudy_wire::{
    Carried, Digest, Image, Moment, ProgramHash, ProgramId, RetainedProgram, RetainedRun,
    RetainedState,
};

use crate::former;
use crate::run::MemberOptions;

/// What a station has kept of each program with retentive variables that it runs, and the files; values of other programs are taken over to those of
/// `cluster`. `is_loaded` says whether it has loaded a program besides them, by an online change.
pub(crate) fn retained_runs(
    cluster: &Cluster,
    options: &MemberOptions,
    settings: &Settings,
    is_loaded: impl Fn(ProgramId, ProgramHash) -> bool,
) -> (Vec<RetainedRun>, Retention) {
    let (mut runs, mut retention) = (Vec::new(), Retention::default());
    let is_retentive =
        |program: &ProgramId| settings.programs[program.index()].executable.is_retentive();
    let mut retentive = settings.runs().filter(is_retentive);
    let Some(folder) = &options.retain else {
        retention.is_missing = retentive.next().is_some();
        return (runs, retention);
    };
    for program in retentive {
        let owner = owner(cluster, options);
        let files = station_files(cluster, folder, &options.name, program);
        let files = files.with_authority(owner.authority);
        let hash = settings.programs[program.index()].hash;
        let (mut of_program, found) = files.runs(Some(owner));
        let mut former = None;
        if found.is_empty() {
            let all = former::states(cluster, folder, owner, program);
            retention.found.extend(all.iter().map(|it| it.found.clone()));
            former = former::candidate(all, hash);
        }
        let read = match &mut former {
            Some(former) => {
                of_program = std::mem::take(&mut former.runs);
                &former.files
            }
            None => &files,
        };
        for run in &mut of_program {
            // The files have the name of its controller: with other controllers before it, it had another number.
            run.state.program = program;
        }
        retention.found.extend(found);
        let newest = of_program.iter().max_by_key(|run| run.state.number);
        let hash = settings.programs[program.index()].hash;
        let is_other = |newest: &&RetainedRun| {
            newest.state.hash != hash && !is_loaded(program, newest.state.hash)
        };
        if let Some(newest) = newest.filter(is_other) {
            let controller = &cluster.controllers()[program.index()];
            match carried_run(&controller.code, hash, read, newest) {
                Ok((run, state)) => {
                    retention.carried.push(carried_over(&controller.name, &state));
                    of_program.push(run);
                }
                Err(refused) => retention.found.push(refused),
            }
        }
        if former.is_some() {
            for run in &mut of_program {
                // The operator decides.
                let from = run.carried.map_or(run.state.hash, |carried| carried.from);
                run.carried = Some(Carried { from, is_whole: false });
            }
        }
        runs.extend(of_program);
        retention.files.push((Some(program), files));
    }
    (runs, retention)
}

/// The files of a station for one of its programs.
pub fn station_files(
    cluster: &Cluster,
    folder: &Path,
    station: &str,
    program: ProgramId,
) -> RetainedFiles {
    let controller = &cluster.controllers()[program.index()];
    let hash = cluster.programs()[program.index()].hash;
    let name = format!("{}.{station}.{}", cluster.name(), controller.name);
    RetainedFiles::new(folder, name).with_program(controller.code.source().kept(hash))
}

/// Whose records a member takes up.
fn owner(cluster: &Cluster, options: &MemberOptions) -> Owner {
    let keys = options.keys.as_deref().filter(|_| cluster.security() == Security::Keys);
    Owner { cluster: cluster.agreement().cluster, authority: keys.and_then(authority_of) }
}

/// The inputs of a program that operators write and that keep their values, by name.
pub(crate) fn retained_inputs(cluster: &Cluster, program: ProgramId) -> Vec<String> {
    let remote_io = cluster.remote_ios().get(program.index());
    let sources = remote_io.into_iter().flat_map(|remote_io| &remote_io.inputs);
    let retained = sources.filter(|source| source.operator().is_some_and(|it| it.input.retains));
    retained.map(|source| source.name.clone()).collect()
}

/// What a remote I/O has noted, with the inputs in the image of its program in `cluster`, and the files.
pub(crate) fn retained_notes(
    cluster: &Cluster,
    folder: &Path,
    options: &MemberOptions,
    settings: &understudy_remote_io::Settings,
    is_loaded: impl Fn(ProgramId, ProgramHash) -> bool,
) -> (FoundNotes, Retention) {
    let (name, owner) = (options.name.as_str(), owner(cluster, options));
    let program = settings.program;
    let code = &cluster.controllers()[program.index()].code;
    let hash = settings.hash;
    let inputs = code.interface().inputs;
    let input_at = |bit: u16| inputs.iter().find(|point| point.bit == u32::from(bit));
    let retained = retained_inputs(cluster, program);
    let kept = RetainedProgram { inputs: retained.clone(), ..code.source().kept(hash) };
    let files = RetainedFiles::new(folder, format!("{}.{name}", cluster.name()));
    let files = files.with_program(kept).with_authority(owner.authority);
    let mut notes = files.notes(Some(owner));
    let is_retentive = settings.fallback.restart.is_some();
    // A program without retentive variables only waits for what the one before it has kept.
    notes.is_damaged &= notes.was_retentive.unwrap_or(is_retentive) || is_retentive;
    if notes.files.is_empty() {
        notes.files = former::notes(cluster, folder, name, is_retentive);
        notes.is_damaged = !notes.files.is_empty();
    }
    if let Some(note) = &mut notes.newest {
        // The file has the name of this remote I/O: with other controllers before it, its program had another number.
        note.recalled.program = program;
    }
    let controller = cluster.controllers()[program.index()].name.clone();
    let mut carried = CarriedOver { program: controller, ..CarriedOver::default() };
    if let Some(note) =
        notes.newest.as_mut().filter(|note| note.hash != hash && !is_loaded(program, note.hash))
    {
        if note.is_retentive && !is_retentive {
            let problem = "the program before kept values, and this one has no retentive variables";
            notes.files.push(problem_of(&files, note.hash, problem.to_owned()));
        }
        match files.program(note.hash).and_then(of_this_release) {
            Ok((kept, before)) => {
                let old = before.interface().inputs;
                let mut image = settings.layout.undriven.clone();
                for input in &settings.layout.operator_inputs {
                    if let Some(point) = input_at(input.place.bit) {
                        point.set(image.words_mut(), input.initial);
                    }
                }
                let noted = &note.recalled.inputs;
                let names = kept.inputs.iter();
                let names = names.map(|name| [name.clone(), input_name_after(&before, code, name)]);
                let names: Vec<[String; 2]> = names.collect();
                let before = (&old, noted.words());
                let lost = if noted.width() == old.width() {
                    inputs.carry(image.words_mut(), before, &names)
                } else {
                    names.iter().map(|[was, _]| was.as_str()).collect()
                };
                let is_lost = |[was, is]: &&[String; 2]| {
                    lost.contains(&was.as_str()) || !retained.contains(is)
                };
                let dropped = names.iter().filter(is_lost).map(|[was, _]| was.clone());
                carried.dropped.extend(dropped);
                carried.kept = names.len() - carried.dropped.len();
                let is_new = |name: &&String| names.iter().all(|[_, is]| is != *name);
                carried.new = retained.iter().filter(is_new).count();
                note.recalled.inputs = image;
                note.recalled.version = Some(hash);
            }
            Err(problem) => {
                // Nothing tells what its bits are.
                note.recalled.inputs = Image::zero(0);
                let problem = problem_of(&files, note.hash, problem);
                notes.files.push(problem);
            }
        }
    }
    let noted = notes.newest.as_ref().map(|note| &note.recalled.inputs);
    if let Some(noted) = noted.filter(|noted| noted.width() == settings.layout.input_width()) {
        let outside = settings
            .layout
            .operator_inputs
            .iter()
            .filter(|input| input.retains && !input.admits(input.place.get(noted)));
        let outside = outside.filter_map(|input| input_at(input.place.bit));
        carried.dropped.extend(outside.map(|point| point.name.clone()));
    }
    let is_told = carried.kept + carried.new + carried.dropped.len() > 0;
    let carried = is_told.then_some(carried).into_iter().collect();
    let found = std::mem::take(&mut notes.files);
    let retention =
        Retention { files: vec![(None, files)], found, carried, ..Retention::default() };
    (notes, retention)
}

/// The state of another program as this one starts from it.
fn carried_run(
    code: &Code,
    hash: ProgramHash,
    files: &RetainedFiles,
    run: &RetainedRun,
) -> Result<(RetainedRun, CarriedState), FoundFile> {
    let refused = |problem: String| problem_of(files, run.state.hash, problem);
    let kept = files.program(run.state.hash).map_err(refused)?;
    let (_, before) = of_this_release(kept).map_err(refused)?;
    let last = last_state(&before, run)
        .ok_or_else(|| refused("its program has another state".to_owned()))?;
    let carried = code.carried(&before, last.words());
    let executable = code.executable();
    let restarted = executable.restarted(&carried.state);
    let state = Image::from_words(executable.state_count(), &restarted);
    let state = state.map_err(|_| refused("its program has another state".to_owned()))?;
    let is_own = run.carried.is_none_or(|before| before.is_whole);
    let is_whole = is_own && carried.dropped().next().is_none();
    let run = RetainedRun {
        state: RetainedState {
            hash,
            lineage: run.lineage(),
            stepped: run.stepped(),
            digest: Digest::default(),
            state,
            ..run.state.clone()
        },
        steps: Vec::new(),
        carried: Some(Carried { from: run.state.hash, is_whole }),
    };
    Ok((run, carried))
}

/// The state after the last step; none where the run does not fit the program.
pub fn last_state(code: &Code, run: &RetainedRun) -> Option<Image> {
    let executable = code.executable();
    let inputs = executable.input_count();
    let fits = run.state.state.width() == executable.state_count()
        && run.steps.iter().all(|step| step.inputs.width() == inputs);
    if !fits {
        return None;
    }
    let mut state = run.state.state.clone();
    let mut outputs = Image::zero(executable.output_count());
    let mut scratch = Scratch::default();
    for step in &run.steps {
        let (state, outputs) = (state.words_mut(), outputs.words_mut());
        executable.step(&mut scratch, state, step.inputs.words(), outputs);
    }
    Some(state)
}

/// What is kept of a program, and that program.
fn of_this_release(kept: RetainedProgram) -> Result<(RetainedProgram, Code), String> {
    let code = read_kept(&kept);
    let code = code.ok_or_else(|| "this release reads another program from its text".to_owned())?;
    Ok((kept, code))
}

fn problem_of(files: &RetainedFiles, hash: ProgramHash, problem: String) -> FoundFile {
    FoundFile { path: files.program_path(hash), problem: Some(problem) }
}

fn carried_over(program: &str, state: &CarriedState) -> CarriedOver {
    let count = |fate| state.paths.iter().filter(|path| path.fate == fate).count();
    CarriedOver {
        program: program.to_owned(),
        kept: count(Fate::Kept),
        converted: count(Fate::Converted) + count(Fate::Narrowed),
        new: count(Fate::New),
        dropped: state.dropped().map(|path| path.path.clone()).collect(),
    }
}

/// A station founds an epoch that is later than those of what it has kept, whatever its clock shows after the power failure.
pub(crate) fn later_than_retained(mut settings: Settings, runs: &[RetainedRun]) -> Settings {
    let newest = runs.iter().map(|run| run.stepped()).max();
    if let Some(after) = newest.map(Moment::next_epoch) {
        settings.founds = settings.founds.max(after);
    }
    settings
}
