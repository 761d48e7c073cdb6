//! `understudy verify`: proofs of properties of programs.

mod answer;
mod numbers;
mod scenario;

use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::{Args, ValueEnum};
use serde_json::json;
use understudy_bits::Disagreement;
use understudy_cluster::{Cluster, Overrides};
use understudy_interchange::{NOT_EXECUTED, Source, Wanted};
use understudy_journal::Members;
use understudy_ladder::{LowerError, Program};
use understudy_scenarios::{Scenario, write};
use understudy_text::duration::parse_positive;
use understudy_text::{Diagnostic, Report, Severity, has_errors};
use understudy_verification::program::{Bounds, Remarks, Subject};
use understudy_verification::property::{
    Asked, Properties, Property, not_of_one_scan, read, read_one,
};
use understudy_verification::symbolic::Resolved;
use understudy_verification::{GoOn, Refutation, draw_runs, prove_parity_while, smv};

use crate::answer::{Answer, Status};
use crate::console::Console;
use crate::files;
use crate::patience::{Patience, Resources};
use answer::{Finding, ProgramAnswer, UnderstudyProof};

/// Prove properties of programs or show counterexamples
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy verify examples/press-cell/press.ladder
  understudy verify examples/press-cell/press.ladder --property \"never move_down and stop\" --property \"AG EF move_down\"
  understudy verify examples/boiler/pilot.ladder --properties examples/boiler/pilot.properties --period 100ms
  understudy verify examples/press-cell/press.ladder --property \"never move_down and stop\" --draw runs.html
  understudy verify examples/press-cell/press.ladder --smv scan --output press.smv
  understudy verify examples/two-shuttles/left.st --property \"never program.fault\"
  understudy verify examples/heated-tank/temperature.st --property \"never heater > 100.0\" --assume \"level <= 2.0\"
  understudy verify examples/press-cell/cluster.toml
  understudy verify examples/two-shuttles/cluster.toml --property \"never left.inside and right.inside\"
  understudy verify examples/press-cell/cluster.toml --property \"never press.move_up and press.move_down\" --scenario fails.toml
  understudy verify examples/boiler/complete.ladder --period 100ms --budget 60s
  understudy verify examples/painting-system/painting-system.ladder --resources

Without a property the command proves the standard property of every ladder: each output can always be switched on and off again. It
also remarks on rungs without effect, coils with conflicting values in one scan, and sequence steps that are passed in one scan. Of a program
of statements it proves the same where its inputs and outputs are BOOLs and all values are finite, and of one that can stop, that no program
fault stops it. For a cluster it proves that the understudy equals the sum of its members, or the
given properties of all programs together. Formulas, sentences and property files: docs/reference/properties.md.

Exit status: 0 if everything is proved, 1 if a property fails or is undecided, 2 for invalid input.")]
pub(crate) struct Arguments {
    /// Program or cluster file
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Program of a file that has several
    #[arg(long, value_name = "NAME")]
    program: Option<String>,
    /// File with one property per line
    #[arg(long, value_name = "FILE")]
    properties: Option<PathBuf>,
    /// Property, as a CTL formula or a sentence; repeatable
    #[arg(long, value_name = "TEXT")]
    property: Vec<String>,
    /// Fairness condition, true infinitely often in every run considered; repeatable
    #[arg(long, value_name = "TEXT")]
    fair: Vec<String>,
    /// Assumption about inputs, true in every scan of the runs considered, such as "level <= 4095"; repeatable
    #[arg(long, value_name = "TEXT")]
    assume: Vec<String>,
    /// Scan period; determines the length of timers in scans. Default: that of the file, else 10ms
    #[arg(long, value_name = "TIME", value_parser = parse_positive)]
    period: Option<Duration>,
    /// Maximum number of live nodes of decision diagrams
    #[arg(long, value_name = "NUMBER", default_value_t = 4_000_000)]
    nodes: usize,
    /// Time limit; the remaining properties stay undecided. Default: none
    #[arg(long, value_name = "TIME", value_parser = parse_positive)]
    budget: Option<Duration>,
    /// Maximum depth of the induction, in scans, for undecided properties
    #[arg(long, value_name = "SCANS", default_value_t = 20)]
    induction: u32,
    /// Print the time, the nodes of decision diagrams, the listed states and the memory that the proofs took
    #[arg(long, conflicts_with = "smv")]
    resources: bool,
    /// HTML page with all counterexamples and witnesses, drawn into the ladder scan by scan
    #[arg(long, value_name = "FILE.html", conflicts_with = "smv")]
    draw: Option<PathBuf>,
    /// Scenario for `simulate` and `lab` in which the first property that fails does so as in its counterexample; FILE is a cluster file
    #[arg(long, value_name = "FILE.toml", conflicts_with = "smv")]
    scenario: Option<PathBuf>,
    /// Write the program and its properties for NuSMV instead of proving them
    #[arg(long, value_enum)]
    smv: Option<Smv>,
    /// Output file for --smv; default: standard output
    #[arg(long, short, value_name = "FILE", requires = "smv")]
    output: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Smv {
    /// One step per scan
    Scan,
    /// One module per rung, as in the paper on the deployment of controllers
    Rungs,
}

pub(crate) fn run(arguments: &Arguments, console: &mut Console) -> Result<Answer, Answer> {
    let is_cluster = arguments.file.extension().is_some_and(|extension| extension == "toml");
    let patience = Patience::new(arguments.budget, console).naming_budget();
    if is_cluster {
        return cluster(arguments, &patience);
    }
    if arguments.scenario.is_some() {
        let message = "--scenario is for the programs of a cluster; name its cluster file, and its signals as `CONTROLLER.NAME`";
        return Err(Answer::failed(Status::BadInput, "U0437", message));
    }
    let wanted = Wanted { period: arguments.period, program: arguments.program.as_deref() };
    let (source, mut file, period) = files::program(&arguments.file, wanted)?;
    // What a program misses of one that is not executed: a proof would be about initial values.
    for found in file.report.diagnostics.iter_mut().filter(|found| found.code == NOT_EXECUTED) {
        found.severity = Severity::Error;
    }
    if file.report.has_errors() {
        return Err(Answer::bad_files(file.reports()));
    }
    let Source::Program(typed) = source else {
        let message = "the file has no PROGRAM: properties are of programs";
        return Err(Answer::failed(Status::BadInput, "U0436", message));
    };
    let Some(program) = file.rungs.take().map(|rungs| rungs.ladder) else {
        return numbers::of_program(arguments, (&typed, period), file, &patience);
    };
    if arguments.smv == Some(Smv::Rungs) && !program.retained.is_empty() {
        let message = "--smv rungs has no warm starts, and the program has retentive variables; use --smv scan";
        return Err(Answer::failed(Status::BadInput, "U0438", message));
    }
    let texts = Texts::read(arguments, period)?;
    let subject = Subject::new(&program, period, &texts.asked()).map_err(not_lowered)?;
    let wrong = |assumed: &Property| subject.wrong_assumption(assumed);
    let asked = match texts.resolved(&|property| subject.resolve(property), &wrong) {
        Ok(asked) => asked,
        Err(mut answer) => {
            answer.reports.splice(0..0, file.reports());
            return Err(answer);
        }
    };
    let answer = match arguments.smv {
        Some(form) => {
            let text = text_for_nusmv(form, &program, &subject, &asked);
            files::deliver(arguments.output.as_deref(), &text, json!({ "text": text }))?
        }
        None => {
            let go_on = |work| patience.goes_on(work);
            let bounds = bounds(arguments, &go_on);
            patience.turn_to("the order and the effect of the rungs".to_owned());
            let remarks = subject.remarks(&program, period, bounds).map_err(not_lowered)?;
            let told = remarks.found.iter().map(|remark| remark.diagnostic.clone());
            let told: Vec<Diagnostic> = told.collect();
            file.report.diagnostics.extend(told.iter().cloned());
            proved(arguments, (&program, period), &subject, &remarks, &asked, &patience, bounds)?
                .and_next(&[&"init", &"cell", &"--from", &arguments.file])
                .and_told(told)
        }
    };
    Ok(answer.with_used(file.reports()))
}

/// The failure of a program that does not become a circuit.
fn not_lowered(error: LowerError) -> Answer {
    Answer::failed(Status::BadInput, error.code_or("U0436"), error)
}

fn bounds<'a>(arguments: &Arguments, go_on: GoOn<'a>) -> Bounds<'a> {
    Bounds { nodes: arguments.nodes, scans: arguments.induction, go_on, ..Bounds::default() }
}

/// The requested properties and fairness conditions over the signals of the program.
#[derive(Default)]
struct ToProve {
    properties: Vec<(Property, Resolved)>,
    fair: Vec<Resolved>,
}

/// The formula of a property over the signals of what is verified.
type Resolve<'a> = &'a dyn Fn(&Property) -> Result<Resolved, Vec<Diagnostic>>;

/// Properties as they were read, each with its file or option.
struct Texts(Vec<(String, String, Properties)>);

impl Texts {
    /// Reads the file of properties and the options; what cannot be read is told with what has no meaning.
    fn read(arguments: &Arguments, period: Duration) -> Result<Self, Answer> {
        let mut texts = Vec::new();
        if let Some(path) = &arguments.properties {
            let text = files::text(path)?;
            let found = read(&text, period);
            texts.push((path.display().to_string(), text, found));
        }
        let options = [
            ("--property", &arguments.property),
            ("--fair", &arguments.fair),
            ("--assume", &arguments.assume),
        ];
        for (option, text) in
            options.iter().flat_map(|(option, all)| all.iter().map(|text| (*option, text)))
        {
            let mut found = Properties::default();
            let kind = match option {
                "--fair" => &mut found.fair,
                "--assume" => &mut found.assumed,
                _ => &mut found.properties,
            };
            match read_one(text, period) {
                Ok(property) => kind.push(property),
                Err(wrong) => found.diagnostics = wrong,
            }
            texts.push((option.to_owned(), text.clone(), found));
        }
        Ok(Self(texts))
    }

    /// What they ask of a program before it is made ready for them.
    fn asked(&self) -> Asked<'_> {
        Asked::of(self.0.iter().map(|(_, _, found)| found))
    }

    /// Their formulas over the signals of what is verified; `wrong_assumption` says what keeps a property from being one.
    fn resolved(
        self,
        resolve: Resolve<'_>,
        wrong_assumption: &dyn Fn(&Property) -> Vec<Diagnostic>,
    ) -> Result<ToProve, Answer> {
        let mut asked = ToProve::default();
        let mut wrong = Vec::new();
        for (name, text, found) in self.0 {
            let mut diagnostics = found.diagnostics;
            for property in found.properties {
                match resolve(&property) {
                    Ok(formula) => asked.properties.push((property, formula)),
                    Err(unknown) => diagnostics.extend(unknown),
                }
            }
            for condition in found.fair {
                match resolve(&condition) {
                    Ok(formula) if formula.is_of_one_scan() => asked.fair.push(formula),
                    Ok(_) => {
                        diagnostics.push(not_of_one_scan("a fairness condition", 0..text.len()));
                    }
                    Err(unknown) => diagnostics.extend(unknown),
                }
            }
            diagnostics.extend(found.assumed.iter().flat_map(wrong_assumption));
            if has_errors(&diagnostics) {
                diagnostics.sort_by_key(|found| found.span.start);
                wrong.push(Report { name, text, diagnostics });
            }
        }
        if wrong.is_empty() { Ok(asked) } else { Err(Answer::bad_files(wrong)) }
    }
}

fn text_for_nusmv(form: Smv, program: &Program, subject: &Subject, asked: &ToProve) -> String {
    let formulas: Vec<Resolved> =
        asked.properties.iter().map(|(_, formula)| formula.clone()).collect();
    match form {
        Smv::Scan => {
            let (formulas, fair) = subject.assuming(&formulas, &asked.fair);
            smv::of_circuit(subject.circuit(), &formulas, &fair)
        }
        Smv::Rungs => smv::of_rungs(program),
    }
}

fn proved(
    arguments: &Arguments,
    (ladder, period): (&Program, Duration),
    subject: &Subject,
    remarks: &Remarks,
    asked: &ToProve,
    patience: &Patience<'_>,
    bounds: Bounds<'_>,
) -> Result<Answer, Answer> {
    patience.turn_to("the states of every output".to_owned());
    let mut program = ProgramAnswer::of(subject, bounds, remarks);
    let formulas: Vec<Resolved> =
        asked.properties.iter().map(|(_, formula)| formula.clone()).collect();
    let mut answered = 0;
    let about = |answered| format!("{answered} of {} properties answered", formulas.len());
    patience.turn_to(about(0));
    let answers = subject.check(&formulas, asked.fair.clone(), bounds, &mut |_, _| {
        answered += 1;
        patience.turn_to(about(answered));
    });
    for ((property, formula), proof) in asked.properties.iter().zip(answers) {
        let finding = Finding::new(subject.circuit(), property, formula, proof);
        program.properties.push(finding.of_inputs(subject.is_of_inputs(property)));
    }
    let page = arguments.draw.as_deref();
    let page = page.map(|path| draw(path, period, ladder, subject, &program));
    let used = used(arguments, patience);
    Ok(answer::of_programs(vec![program], None, page.transpose()?, used))
}

/// Writes the page of runs and returns its name.
fn draw(
    path: &Path,
    period: Duration,
    ladder: &Program,
    subject: &Subject,
    proved: &ProgramAnswer,
) -> Result<String, Answer> {
    let page = draw_runs(ladder, period, subject.circuit(), &proved.runs());
    files::write_output(path, &page.map_err(not_lowered)?)?;
    Ok(path.display().to_string())
}

/// Proves the given properties of all programs of a cluster together, or else the standard properties of each, and that the understudy
/// is the sum of its members.
fn cluster(arguments: &Arguments, patience: &Patience<'_>) -> Result<Answer, Answer> {
    if arguments.smv.is_some() || arguments.draw.is_some() {
        let message =
            "--draw and --smv apply to one ladder program; name its file instead of the cluster";
        return Err(Answer::failed(Status::BadInput, "U0437", message));
    }
    let (cluster, reports) = files::cluster(&arguments.file, Overrides::default())?;
    let go_on = |work| patience.goes_on(work);
    let bounds = bounds(arguments, &go_on);
    let is_asked = !arguments.property.is_empty() || arguments.properties.is_some();
    if arguments.scenario.is_some() && !is_asked {
        let message = "--scenario is of a property that fails; state one by --property";
        return Err(Answer::failed(Status::BadInput, "U0437", message));
    }
    if is_asked {
        let (together, scenario) = numbers::of_cluster(arguments, &cluster, bounds, patience)?;
        let answer = answer::of_programs(vec![together], None, None, used(arguments, patience));
        let answer = with_scenario(answer, arguments, &cluster, scenario)?;
        return Ok(answer.with_used(reports).and_next(&[&"simulate", &arguments.file]));
    }
    let mut programs = Vec::new();
    for controller in cluster.controllers() {
        patience.turn_to(format!("`{}`", controller.name));
        let period = cluster.agreement().schedule.period();
        match controller.ladder() {
            Some(ladder) => {
                let subject =
                    Subject::new(ladder, period, &Asked::default()).map_err(not_lowered)?;
                let remarks = subject.remarks(ladder, period, bounds).map_err(not_lowered)?;
                programs.push(ProgramAnswer::of(&subject, bounds, &remarks));
            }
            None => programs.push(numbers::standard(controller.code.typed(), bounds)?),
        }
    }
    patience.turn_to("the understudy".to_owned());
    let understudy = parity_proof(&cluster, bounds)?;
    Ok(answer::of_programs(programs, Some(understudy), None, used(arguments, patience))
        .with_used(reports)
        .and_next(&[&"simulate", &arguments.file]))
}

/// Writes the scenario of a counterexample where one is asked for, or says why there is none.
fn with_scenario(
    mut answer: Answer,
    arguments: &Arguments,
    cluster: &Cluster,
    found: Option<Result<Scenario, String>>,
) -> Result<Answer, Answer> {
    let Some(path) = &arguments.scenario else {
        return Ok(answer);
    };
    let name = path.display();
    match found {
        None => answer.text += &format!("\n{name} is not written: no property fails with a run"),
        Some(Err(reason)) => answer.text += &format!("\n{name} is not written: {reason}"),
        Some(Ok(scenario)) => {
            let remark = "Written by `understudy verify --scenario`: the program starts cold, and its inputs are set scan by scan.";
            let text = write(&scenario, &Members::of(cluster), &[remark.to_owned()]);
            files::write_output(path, &text)?;
            answer = answer.and_next(&[&"simulate", &arguments.file, &"--scenario", path]);
            answer = answer.and_written(path);
        }
    }
    Ok(answer)
}

/// What the proofs took, if it is asked for.
fn used(arguments: &Arguments, patience: &Patience<'_>) -> Option<Resources> {
    arguments.resources.then(|| patience.resources())
}

/// Whether the generated understudy is the sum of its members. With programs that are not executed as circuits stations execute all programs and add
/// their outputs; then the parity controller is generated and compared that `understudy parity` prints.
fn parity_proof(cluster: &Cluster, bounds: Bounds<'_>) -> Result<UnderstudyProof, Answer> {
    let (members, generated) = match files::understudy_of(cluster) {
        Ok(found) => found,
        Err((code @ Disagreement::CODE, reason)) => {
            return Err(Answer::failed(Status::Failed, code, reason));
        }
        Err((_, reason)) => {
            return Ok(UnderstudyProof::LeftOut(format!(
                "no parity controller is generated and compared, since {reason}; the understudy executes the programs themselves and adds their outputs"
            )));
        }
    };
    let proof = prove_parity_while(&members, generated.circuit(), bounds.nodes, bounds.go_on);
    Ok(match proof {
        Ok(proof) => UnderstudyProof::Proved(format!(
            "the understudy equals the sum of its members: {} registers and {} outputs compared",
            proof.registers, proof.outputs
        )),
        Err(undecided @ Refutation::Undecided { .. }) => {
            UnderstudyProof::Undecided(undecided.to_string())
        }
        Err(refutation) => UnderstudyProof::Fails(refutation.to_string()),
    })
}
