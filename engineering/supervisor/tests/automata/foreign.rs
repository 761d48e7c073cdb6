//! Modules of Supremica and generators of libFAUDES: read, written and read again.

use std::fmt::Write as _;

use understudy_supervisor::operations::{isomorph, supcon};
use understudy_supervisor::{
    Alphabet, Automaton, Bounds, EventSource, Label, Model, ReadForeign, agree_on_events,
    read_generator, read_module, synthesise, write_ads, write_generator, write_module,
};

use crate::models::{self, MODELS, counts};

fn module(text: &str) -> Model {
    let read = read_module(text);
    read.model.unwrap_or_else(|| panic!("{:?}\n{text}", read.diagnostics))
}

fn generator(text: &str) -> Automaton {
    let read = read_generator(text);
    let model = read.model.unwrap_or_else(|| panic!("{:?}\n{text}", read.diagnostics));
    model.supervisors.into_iter().next().expect("an automaton")
}

fn ads(automaton: &Automaton) -> String {
    write_ads(automaton, &[]).expect("labels of TCT")
}

#[test]
fn a_model_comes_back_from_supremica_and_its_supervisor_is_that_of_tct() {
    for name in MODELS {
        let given = models::Model::read(name);
        let model = Model {
            name: name.to_owned(),
            plants: given.plants.clone(),
            specifications: given.specifications.clone(),
            ..Model::default()
        };
        let back = module(&write_module(&model));
        for (one, other) in model.plants.iter().zip(&back.plants) {
            assert_eq!(ads(one), ads(other), "{name}");
        }
        let made = synthesise(&back.plants(), &back.specifications(), Bounds::default());
        let made = made.expect("it fits").supervisor;
        assert_eq!(Some(counts(&made)), given.counts("super"), "{name}");
        isomorph(&made, &given.file("_SUPER")).expect("the supervisor of TCT");
    }
}

#[test]
fn files_of_libfaudes_agree_on_their_events_by_name() {
    for name in MODELS {
        let given = models::Model::read(name);
        // Each in a file of its own, in which the labels are others.
        let read = |automata: &[Automaton]| -> Vec<Automaton> {
            automata.iter().map(|one| generator(&named(&write_generator(one)))).collect()
        };
        let (mut plants, mut specifications) = (read(&given.plants), read(&given.specifications));
        let all = plants.iter_mut().chain(&mut specifications);
        let mut sources: Vec<EventSource<'_>> = all
            .enumerate()
            .map(|(number, one)| EventSource {
                file: format!("{number}.gen"),
                automata: vec![one],
                is_by_name: true,
            })
            .collect();
        agree_on_events(&Alphabet::default(), &mut sources).expect("the same events");
        let plants: Vec<&Automaton> = plants.iter().collect();
        let specifications: Vec<&Automaton> = specifications.iter().collect();
        let made = synthesise(&plants, &specifications, Bounds::default()).expect("it fits");
        assert_eq!(Some(counts(&made.supervisor)), given.counts("super"), "{name}");
    }
}

/// The same generator with words for the numbers of its events.
fn named(text: &str) -> String {
    text.replace(" \"", " \"move ").replace("\n\"", "\n\"move ")
}

#[test]
fn names_marks_and_blocked_events_come_back() {
    let text = include_str!("../../../../examples/boiler/pilot.toml");
    let read = understudy_supervisor::read_model(text, |_| Err("absent".to_owned()));
    let model = read.model.expect("a model");
    let back = module(&write_module(&model));
    let text = |model: &Model| {
        let automata = model.plants.iter().chain(&model.specifications);
        let line = |one: &Automaton| {
            let mut text = format!("{} {:?} ", one.name(), one.marked().collect::<Vec<_>>());
            for step in one.transitions() {
                let (from, to) = (one.state_name(step.source), one.state_name(step.target));
                let event = one.alphabet().name(step.label);
                let _ = write!(text, "{from} {event} {} {to}; ", step.label.is_controllable());
            }
            let blocked = one.blocked_events().into_iter();
            blocked.for_each(|label| text.push_str(&one.alphabet().name(label)));
            text
        };
        let mut lines: Vec<String> = automata.map(line).collect();
        lines.sort();
        lines
    };
    assert_eq!(
        text(&back).iter().map(|line| line.len()).collect::<Vec<_>>(),
        text(&model).iter().map(|line| line.len()).collect::<Vec<_>>()
    );
    for one in model.plants.iter().chain(&model.specifications) {
        let back = generator(&write_generator(one));
        let word = |one: &Automaton, word: &[Label]| -> Vec<String> {
            word.iter().map(|&label| one.alphabet().name(label)).collect()
        };
        assert_eq!(counts(&back), counts(one));
        let blocked = |one: &Automaton| {
            let mut blocked = word(one, &one.blocked_events());
            blocked.sort();
            blocked
        };
        assert_eq!(blocked(&back), blocked(one), "{}", one.name());
        let names = |one: &Automaton| -> Vec<String> {
            one.states().map(|state| one.state_name(state).into_owned()).collect()
        };
        assert_eq!(names(&back), names(one));
    }
}

/// What Supremica's editor writes: geometry, comments, an event in a block with others.
const MODULE: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Module xmlns="http://waters.sourceforge.net/xsd/module" xmlns:B="http://waters.sourceforge.net/xsd/base" Name="cell">
<B:Comment>Two events.</B:Comment>
<EventDeclList>
<EventDecl Kind="PROPOSITION" Name=":accepting"/>
<EventDecl Kind="CONTROLLABLE" Name="start"/>
<EventDecl Kind="UNCONTROLLABLE" Name="done" Observable="false"/>
</EventDeclList>
<ComponentList>
<SimpleComponent Kind="PLANT" Name="machine">
<Graph>
<LabelBlock><SimpleIdentifier Name="start"/><LabelGeometry Anchor="NW"><Point X="1" Y="2"/></LabelGeometry></LabelBlock>
<NodeList>
<SimpleNode Name="busy"><PointGeometry><Point X="1" Y="2"/></PointGeometry></SimpleNode>
<SimpleNode Initial="true" Name="idle"><EventList><SimpleIdentifier Name=":accepting"/></EventList></SimpleNode>
</NodeList>
<EdgeList>
<Edge Source="idle" Target="busy"><LabelBlock><SimpleIdentifier Name="start"/></LabelBlock></Edge>
<Edge Source="busy" Target="idle"><LabelBlock><SimpleIdentifier Name="done"/></LabelBlock></Edge>
</EdgeList>
</Graph>
</SimpleComponent>
</ComponentList>
</Module>
"#;

#[test]
fn the_first_state_is_the_initial_one_wherever_it_stands() {
    let ReadForeign { model, unobservable, diagnostics } = read_module(MODULE);
    let machine = &model.expect("a model").plants[0];
    assert_eq!(machine.state_names(), Some(&["idle".to_owned(), "busy".to_owned()][..]));
    assert_eq!(machine.marked().map(|state| state.number()).collect::<Vec<_>>(), [0]);
    assert_eq!(unobservable, [Label::new(0)]);
    assert_eq!(diagnostics.iter().map(|found| found.code).collect::<Vec<_>>(), ["U0838"]);
}

fn codes(read: &ReadForeign) -> String {
    let codes: Vec<&str> = read.diagnostics.iter().map(|found| found.code).collect();
    codes.join(" ")
}

#[test]
fn everything_that_is_wrong_with_a_module_is_said() {
    let check = |from: &str, to: &str, expected: &str| {
        assert!(MODULE.contains(from), "{from}");
        let read = read_module(&MODULE.replacen(from, to, 1));
        assert_eq!(codes(&read), expected, "{from} -> {to}: {:?}", read.diagnostics);
        assert_eq!(read.model.is_some(), !expected.replace("U0838", "").contains('U'));
    };
    check("</Module>", "", "U0833");
    check("<Module ", "<Automata ", "U0833");
    check("</EventDeclList>", "</EventDeclList><EventAliasList/>", "U0838 U0834");
    check("<NodeList>", "<NodeList><GroupNode Name=\"g\"/>", "U0838 U0834");
    check("Kind=\"PLANT\"", "Kind=\"GOAL\"", "U0838 U0835");
    check("Kind=\"PLANT\"", "Kind=\"PROPERTY\"", "U0838 U0838");
    check("Name=\"busy\"><P", "Name=\"idle\"><P", "U0838 U0838 U0838 U0835 U0836 U0836");
    check("Target=\"busy\"", "Target=\"busi\"", "U0838 U0836");
    check("<SimpleIdentifier Name=\"done\"/>", "<SimpleIdentifier Name=\"dun\"/>", "U0838 U0836");
    check("Source=\"busy\" Target=\"idle\"", "Source=\"idle\" Target=\"idle\"", "U0838");
    check(
        "<SimpleIdentifier Name=\"done\"/></LabelBlock></Edge>",
        "<SimpleIdentifier Name=\"start\"/></LabelBlock></Edge><Edge Source=\"busy\" Target=\"busy\"><LabelBlock><SimpleIdentifier Name=\"start\"/></LabelBlock></Edge>",
        "U0838 U0837",
    );
    check("<SimpleNode Name=\"busy\"", "<SimpleNode Initial=\"true\" Name=\"busy\"", "U0838 U0837");
    check("<EventList><SimpleIdentifier Name=\":accepting\"/></EventList>", "", "U0838 U0838");
    check(
        "Name=\":accepting\"/></EventList>",
        "Name=\":forbidden\"/></EventList>",
        "U0838 U0838 U0834",
    );
    let guard = "<GuardActionBlock><Guards><BinaryExpression Text=\"n &lt; 3\"/></Guards></GuardActionBlock></Edge>";
    check("</Edge>", guard, "U0838 U0834");
}

const GENERATOR: &str = "<Generator>\n\"cell\" % a comment\n<Alphabet>\nstart +C+ \"done\" +o+\n</Alphabet>\n\
    <States>\nbusy idle#7\n</States>\n<TransRel>\nidle#7 start busy\nbusy \"done\" 7\n</TransRel>\n\
    <InitStates> idle </InitStates>\n<MarkedStates> 7 </MarkedStates>\n</Generator>\n";

/// The same with tags.
const WITH_TAGS: &str = "<?xml version=\"1.0\"?>\n<!DOCTYPE Generator>\n<Generator name=\"cell\" ftype=\"System\">\n\
    <Alphabet><Event name=\"start\"><Controllable/></Event><Event name=\"done\"><Observable value=\"0\"/></Event></Alphabet>\n\
    <StateSet><State id=\"1\" name=\"busy\"/><State id=\"7\" name=\"idle\"><Initial/><Marked/></State></StateSet>\n\
    <TransitionRelation><Transition x1=\"7\" event=\"start\" x2=\"1\"/><Transition x1=\"1\" event=\"done\" x2=\"7\"/></TransitionRelation>\n\
    </Generator>\n";

#[test]
fn both_forms_of_libfaudes_are_the_same_automaton() {
    let one = read_generator(GENERATOR);
    let other = read_generator(WITH_TAGS);
    assert_eq!(one.model, other.model, "{:?} {:?}", one.diagnostics, other.diagnostics);
    assert_eq!((&one.unobservable, codes(&one).as_str()), (&vec![Label::new(0)], "U0838"));
    let automaton = generator(GENERATOR);
    assert_eq!(automaton.state_names(), Some(&["idle".to_owned(), "busy".to_owned()][..]));
    let numbers = "<Generator> x <Alphabet>a b</Alphabet><States><Consecutive>1 3</Consecutive></States>\
        <TransRel>1 a 2 2 b 3</TransRel><InitStates>1</InitStates><MarkedStates><Consecutive>2 3</Consecutive></MarkedStates></Generator>";
    let automaton = generator(numbers);
    assert_eq!((automaton.state_count(), automaton.marked().count()), (3, 2));
    assert_eq!(automaton.state_names(), None);
    // Numbers without quotes are indices, whatever the names are.
    let crossed = "<Generator> x <A> go </A> <S> \"2\" \"1\" </S> <T> 1 go 2 </T> <I> \"2\" </I> <M> 2 </M> </Generator>";
    let crossed = generator(crossed);
    assert_eq!(crossed.state_names(), Some(&["2".to_owned(), "1".to_owned()][..]));
    assert_eq!(crossed.marked().map(|state| state.number()).collect::<Vec<_>>(), [1]);
    assert_eq!(counts(&crossed), (2, 1));
    // Names of other people go through a model file too.
    let named = read_generator(&GENERATOR.replace("start", "t\\a,[1]")).model.expect("a model");
    let text = understudy_supervisor::write_model(&named);
    let read = understudy_supervisor::read_model(&text, |_| Err("absent".to_owned()));
    assert_eq!(read.model.as_ref(), Some(&named), "{text} {:?}", read.diagnostics);
    // An event without a transition stays one that is forbidden.
    let blocked = generator(&GENERATOR.replace("start +C+", "start +C+ never"));
    assert_eq!(blocked.blocked_events(), [Label::new(0)]);
    assert_eq!(generator(&write_generator(&blocked)).blocked_events(), [Label::new(0)]);
    let open = "<Generator> x <T> a go b b stop a </T> <I> a </I> </Generator>";
    assert_eq!(counts(&generator(open)), (2, 2));
}

#[test]
fn everything_that_is_wrong_with_a_generator_is_said() {
    let check = |from: &str, to: &str, expected: &str| {
        assert!(GENERATOR.contains(from), "{from}");
        let read = read_generator(&GENERATOR.replacen(from, to, 1));
        assert_eq!(codes(&read), expected, "{from} -> {to}: {:?}", read.diagnostics);
    };
    check("<Generator>", "<Timed>", "U0833");
    check("</Generator>", "", "U0838 U0835");
    check("<Generator>", "<cGenerator><Generator>", "U0834 U0838");
    check("</Generator>", "</Generator><Controllable>start</Controllable>", "U0838 U0834");
    check("+C+", "+YP+", "U0838 U0834");
    check("+C+", "0x11", "U0838 U0834");
    check("<InitStates>", "<Colors>\"red\"</Colors><InitStates>", "U0838 U0834");
    check("start busy", "start 3 4", "U0838 U0836 U0836 U0836 U0836 U0835");
    check("start busy", "stort busy", "U0838 U0836");
    check("\"done\" +o+", "\"done", "U0835 U0836");
    check("busy idle#7", "busy busy idle#7", "U0838 U0835");
    check("<InitStates> idle", "<InitStates> idle busy", "U0838 U0837");
    check("<InitStates> idle </InitStates>", "", "U0838 U0838");
    check("busy \"done\" 7", "busy \"done\" 7 busy \"done\" busy", "U0838 U0837");
    check("busy \"done\" 7", "busy \"done\"", "U0838 U0835");
}

#[test]
fn files_whose_events_do_not_fit_together_do_not_meet() {
    let text =
        |flags: &str| format!("<Generator> g <T> a go{flags} b </T> <I> a </I> </Generator>");
    let text = |flags: &str| {
        text("")
            .replace("<T>", &format!("<Alphabet> go {flags} </Alphabet><States>a b</States><T>"))
    };
    let (mut one, mut other) = (generator(&text("+C+")), generator(&text("")));
    let meet = |one: &mut Automaton, other: &mut Automaton, is_by_name: bool| {
        let source = |file: &str, automaton| EventSource {
            file: file.to_owned(),
            automata: vec![automaton],
            is_by_name,
        };
        let mut sources = [source("one", one), source("other", other)];
        let result = agree_on_events(&Alphabet::default(), &mut sources);
        result.map_err(|error| error.to_string()).err()
    };
    let error = meet(&mut one, &mut other, true);
    assert_eq!(
        error.as_deref(),
        Some("U0839: event go is controllable in one and uncontrollable in other")
    );
    // Files that give labels themselves.
    let with = |name: &str| generator(&text("").replace("go", name));
    let error = meet(&mut with("go"), &mut with("stop"), false);
    assert_eq!(
        error.as_deref(),
        Some(
            "U0839: label 0 is event go in one and event stop in other: give each of them a `label` of its own"
        )
    );
    let (mut one, mut other) = (with("go"), with("stop"));
    assert_eq!(meet(&mut one, &mut other, true), None);
    let both = supcon(&one, &other, Bounds::default()).expect("it fits");
    assert_eq!(both.supervisor.alphabet().len(), 2);
}
