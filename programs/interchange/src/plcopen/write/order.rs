//! A second opinion on the order of written function blocks.
//!
//! The reader of these documents and their writer could share a mistake about the order, and then a comparison of what is read again finds
//! nothing. So the order is derived here from the numbers in the document alone, as a tool does that executes one box after the other, and
//! compared with the statements.

use std::collections::HashMap;

use understudy_structured_text::print;
use understudy_structured_text::syntax::{
    Argument, Body, Expression, ExpressionKind, File, Path, Statement, StatementKind,
};
use understudy_text::xml::Node;

use crate::plcopen::typed::make;
use crate::plcopen::xml::{child, children, elements, parse, word};

/// What a box or a variable does when its turn comes, in capitals.
#[derive(Debug, Clone, PartialEq)]
enum Effect {
    Call(String),
    Write(String),
}

impl Effect {
    fn changed(&self) -> &str {
        match self {
            Self::Call(name) | Self::Write(name) => name,
        }
    }
}

/// What has a turn.
struct Turn {
    order: u64,
    effect: Option<Effect>,
    /// What it reads itself, in capitals.
    read: Vec<String>,
    /// The localId of what it is connected to and has a turn too.
    from: Vec<u64>,
}

/// Confirms that each body in function blocks is executed as its statements are.
///
/// # Errors
/// Where it is not, in words.
pub(crate) fn confirm(document: &str, file: &File) -> Result<(), String> {
    let Ok(document) = parse(document) else {
        return Err("it is not well-formed".to_owned());
    };
    let units = document.descendants().filter(|node| node.tag_name().name() == "pou");
    for pou in units {
        let name = pou.attribute("name").unwrap_or_default();
        let body = child(pou, "body").and_then(|body| child(body, "FBD"));
        let statements = file.units.iter().find(|unit| unit.name.is(name));
        let statements = statements.map(|unit| &unit.body);
        if let (Some(body), Some(Body::Statements(statements))) = (body, statements) {
            let turns = turns(body).map_err(|what| format!("{what} of `{name}` has no turn"))?;
            let mut wanted = Vec::new();
            statements.iter().for_each(|statement| effects(statement, &mut wanted));
            follows(&turns, &wanted).map_err(|what| format!("in `{name}` {what}"))?;
        }
    }
    Ok(())
}

/// What has a turn, by localId.
fn turns(body: Node<'_, '_>) -> Result<HashMap<u64, Turn>, String> {
    let number = |node: Node<'_, '_>, name: &str| node.attribute(name)?.parse::<u64>().ok();
    let mut values = HashMap::new();
    for value in children(body, "inVariable") {
        if let Some(id) = number(value, "localId") {
            let text = child(value, "expression").map(word);
            values.insert(id, text.map(|text| text.as_str().to_uppercase()).unwrap_or_default());
        }
    }
    let mut found = HashMap::new();
    for node in elements(body) {
        let kind = node.tag_name().name();
        if !["block", "outVariable", "inOutVariable"].contains(&kind) {
            continue;
        }
        let id = number(node, "localId").ok_or(kind)?;
        let order = number(node, "executionOrderId").ok_or_else(|| format!("the {kind} {id}"))?;
        let effect = match kind {
            "block" => node.attribute("instanceName").map(|name| Effect::Call(name.to_uppercase())),
            _ => child(node, "expression")
                .map(|text| Effect::Write(word(text).as_str().to_uppercase())),
        };
        let mut turn = Turn { order, effect, read: Vec::new(), from: Vec::new() };
        for connection in node.descendants().filter(|it| it.tag_name().name() == "connection") {
            let from =
                number(connection, "refLocalId").ok_or_else(|| format!("the {kind} {id}"))?;
            match values.get(&from) {
                Some(text) => turn.read.push(text.clone()),
                None => turn.from.push(from),
            }
        }
        found.insert(id, turn);
    }
    Ok(found)
}

/// The effects of a statement, in their order.
fn effects(statement: &Statement, found: &mut Vec<Effect>) {
    let path = |path: &Path| print::expression(&make::read(path.clone())).to_uppercase();
    match &statement.kind {
        StatementKind::Assign(to, value) => {
            outputs(value, found);
            found.push(Effect::Write(path(to)));
        }
        StatementKind::Call(called, arguments) => {
            for argument in arguments {
                if let Argument::Placed(value) | Argument::Given(_, value) = argument {
                    outputs(value, found);
                }
            }
            found.push(Effect::Call(path(called)));
            for argument in arguments {
                if let Argument::Taken { to, .. } = argument {
                    found.push(Effect::Write(path(to)));
                }
            }
        }
        StatementKind::If(branches, otherwise) => {
            for (condition, body) in branches {
                outputs(condition, found);
                body.iter().for_each(|statement| effects(statement, found));
            }
            otherwise.iter().for_each(|statement| effects(statement, found));
        }
        _ => {}
    }
}

/// What calls of functions in a value write.
fn outputs(value: &Expression, found: &mut Vec<Effect>) {
    match &value.kind {
        ExpressionKind::Not(inner) | ExpressionKind::Minus(inner) => outputs(inner, found),
        ExpressionKind::Chain(first, rest) => {
            outputs(first, found);
            rest.iter().for_each(|(_, value)| outputs(value, found));
        }
        ExpressionKind::Call(_, arguments) => {
            for argument in arguments {
                match argument {
                    Argument::Placed(value) | Argument::Given(_, value) => outputs(value, found),
                    Argument::Taken { to, .. } => {
                        let to = print::expression(&make::read(to.clone())).to_uppercase();
                        found.push(Effect::Write(to));
                    }
                }
            }
        }
        _ => {}
    }
}

/// Compares the turns with the effects that are wanted.
fn follows(turns: &HashMap<u64, Turn>, wanted: &[Effect]) -> Result<(), String> {
    let mut order: Vec<&Turn> = turns.values().collect();
    order.sort_by_key(|turn| turn.order);
    if let Some(two) = order.windows(2).find(|two| two[0].order == two[1].order) {
        return Err(format!("two boxes have the turn {}", two[0].order));
    }
    let found: Vec<&Effect> = order.iter().filter_map(|turn| turn.effect.as_ref()).collect();
    let first = found.iter().zip(wanted).find(|(found, wanted)| **found != *wanted);
    if let Some((found, wanted)) = first {
        return Err(format!("`{}` has the turn of `{}`", found.changed(), wanted.changed()));
    }
    if found.len() != wanted.len() {
        return Err(format!("{} statements are {} boxes", wanted.len(), found.len()));
    }
    for turn in turns.values() {
        let mut later = turn.from.iter().filter_map(|id| turns.get(id));
        if let Some(later) = later.find(|from| from.order > turn.order) {
            return Err(format!("the box {} feeds the earlier {}", later.order, turn.order));
        }
        let Some(done) = done(turns, turn) else {
            continue;
        };
        // What is written between a box and the statement that it belongs to was read too early.
        let between = order.iter().filter(|it| turn.order < it.order && it.order < done);
        for effect in between.filter_map(|it| it.effect.as_ref()) {
            if turn.read.iter().any(|text| reads(text, effect.changed())) {
                return Err(format!("`{}` is read before it is written", effect.changed()));
            }
        }
    }
    Ok(())
}

/// The turn of the effect that a box belongs to: the first behind it.
fn done(turns: &HashMap<u64, Turn>, of: &Turn) -> Option<u64> {
    if of.effect.is_some() {
        return None;
    }
    let mut reached = vec![of.order];
    let mut order: Vec<&Turn> = turns.values().filter(|turn| turn.order > of.order).collect();
    order.sort_by_key(|turn| turn.order);
    for turn in order {
        let mut from = turn.from.iter().filter_map(|id| turns.get(id));
        if from.any(|from| reached.contains(&from.order)) {
            if turn.effect.is_some() {
                return Some(turn.order);
            }
            reached.push(turn.order);
        }
    }
    None
}

/// Whether a text reads a variable, or a part of one.
fn reads(text: &str, changed: &str) -> bool {
    let is_part = |letter: char| letter.is_alphanumeric() || letter == '_' || letter == '%';
    let root = changed.split(['.', '[']).next().unwrap_or(changed);
    text.match_indices(root).any(|(at, _)| {
        let before = text[..at].chars().next_back();
        let after = text[at + root.len()..].chars().next();
        !before.is_some_and(|letter| is_part(letter) || letter == '.')
            && !after.is_some_and(is_part)
    })
}

#[cfg(test)]
mod tests {
    use understudy_executable::{Executable, Interface, digest};
    use understudy_structured_text::parse;

    use super::confirm;
    use crate::diagrams::Style;
    use crate::plcopen::{read_typed, write_typed};
    use crate::text::whole;

    /// What was found: `later` switches one scan later where the function before it has no turn. And others, with all that has a turn.
    const TEXTS: [&str; 4] = [
        "PROGRAM main VAR_INPUT a : BOOL; END_VAR VAR_OUTPUT o : BOOL; later : BOOL; END_VAR later := o OR a AND o; o := a; END_PROGRAM",
        "PROGRAM main VAR_INPUT a : BOOL; b : DINT; END_VAR VAR_OUTPUT x : DINT; y : DINT; q : BOOL; END_VAR VAR t : TON; c : CTU; END_VAR
            t(IN := a AND NOT t.Q, PT := T#30ms); c(CU := t.Q, R := b > 90, PV := 5); x := y + b * 3; y := x - b; q := c.Q XOR t.Q; END_PROGRAM",
        "PROGRAM main VAR_INPUT a : BOOL; b : DINT; END_VAR VAR_OUTPUT x : DINT; y : DINT; END_VAR
            IF a THEN x := y + 1; END_IF y := MAX(x, b) + x; IF x > b THEN x := b; END_IF END_PROGRAM",
        "FUNCTION_BLOCK Two VAR_INPUT i : DINT; END_VAR VAR_OUTPUT o : DINT; p : DINT; END_VAR o := i + p; p := o - 1; END_FUNCTION_BLOCK
            PROGRAM main VAR_INPUT b : DINT; END_VAR VAR_OUTPUT x : DINT; y : DINT; END_VAR VAR f : Two; g : Two; END_VAR
            f(i := b + y); g(i := f.o * 2, p => y); x := g.o + f.p + y; END_PROGRAM",
    ];

    fn account(document: &str) -> Option<String> {
        let read = whole(document, read_typed(document), None, None);
        let typed = read.typed.as_ref()?;
        Some(format!("{:?}", digest(&Executable::from(typed), &Interface::from(typed), 500)))
    }

    /// Whatever two turns are exchanged: the body is refused, or does what it did.
    #[test]
    fn a_wrong_order_is_found_without_the_reader() {
        let (mut refused, mut kept) = (0, 0);
        for text in TEXTS {
            let (file, _) = parse(text);
            let written =
                write_typed(&file, "main", &|_| Some(Style::Blocks)).expect("a document").text;
            assert_eq!(confirm(&written, &file), Ok(()), "{text}");
            let right = account(&written).expect("a program");
            let mark = "executionOrderId=\"";
            let places: Vec<usize> =
                written.match_indices(mark).map(|(at, _)| at + mark.len()).collect();
            let number = |at: usize| written[at..].split('"').next().expect("a number").to_owned();
            assert!(places.len() > 3, "{text}");
            for (first, &one) in places.iter().enumerate() {
                let without = format!(
                    "{}{}",
                    &written[..one - mark.len()],
                    &written[one + number(one).len() + 1..]
                );
                assert!(confirm(&without, &file).is_err(), "a box without a turn");
                for &other in &places[first + 1..] {
                    let (left, right_number) = (number(one), number(other));
                    let changed = format!(
                        "{}{right_number}{}{left}{}",
                        &written[..one],
                        &written[one + left.len()..other],
                        &written[other + right_number.len()..]
                    );
                    if confirm(&changed, &file).is_ok() {
                        kept += 1;
                        assert_eq!(
                            account(&changed).as_ref(),
                            Some(&right),
                            "{left} {right_number}\n{text}"
                        );
                    } else {
                        refused += 1;
                    }
                }
            }
        }
        assert!(refused > 100 && kept > 0, "{refused} {kept}");
    }
}
