//! A file with numbers as PLCopen XML 2.01: types, units with bodies in all languages, configuration.

use understudy_structured_text::print;
use understudy_structured_text::syntax::{
    Body, Class, Declaration, File, Initializer, Retention, TypeDefinition, TypeKind, TypeName,
    Unit, UnitKind,
};

use super::tree::Tree;
use super::{blocks, chart, document, standard_time};
use crate::diagrams::{Style, Widths, networks};

/// Elements that the format has for types; of two names the one of the format.
const ELEMENTARY: [(&str, &str); 23] = [
    ("BOOL", "BOOL"),
    ("BYTE", "BYTE"),
    ("WORD", "WORD"),
    ("DWORD", "DWORD"),
    ("LWORD", "LWORD"),
    ("SINT", "SINT"),
    ("INT", "INT"),
    ("DINT", "DINT"),
    ("LINT", "LINT"),
    ("USINT", "USINT"),
    ("UINT", "UINT"),
    ("UDINT", "UDINT"),
    ("ULINT", "ULINT"),
    ("REAL", "REAL"),
    ("LREAL", "LREAL"),
    ("TIME", "TIME"),
    ("DATE", "DATE"),
    ("DT", "DT"),
    ("DATE_AND_TIME", "DT"),
    ("TOD", "TOD"),
    ("TIME_OF_DAY", "TOD"),
    ("STRING", "string"),
    ("WSTRING", "wstring"),
];

/// A document, and which bodies are in another language than was wanted, with the reason.
#[derive(Debug, Clone, Default)]
pub struct TypedDocument {
    /// The document.
    pub text: String,
    /// A body and the reason, in words.
    pub as_text: Vec<String>,
}

/// The file as a document. Statements are drawn in the `style` of their unit, where it has one.
///
/// # Errors
/// What the format cannot hold, or is not written yet, in words.
pub fn write_typed(
    file: &File,
    name: &str,
    style: &dyn Fn(&Unit) -> Option<Style>,
) -> Result<TypedDocument, String> {
    let mut as_text = Vec::new();
    let mut tree = document(name);
    tree.open("types", &[]);
    tree.open("dataTypes", &[]);
    for definition in &file.types {
        data_type(&mut tree, definition)?;
    }
    tree.close("dataTypes");
    tree.open("pous", &[]);
    for unit in &file.units {
        pou(&mut tree, file, unit, style(unit), &mut as_text)?;
    }
    tree.close("pous");
    tree.close("types");
    instances(&mut tree, file)?;
    tree.close("project");
    let text = tree.finish();
    Ok(TypedDocument { text, as_text })
}

fn data_type(tree: &mut Tree, definition: &TypeDefinition) -> Result<(), String> {
    tree.open("dataType", &[("name", definition.name.as_str())]);
    tree.open("baseType", &[]);
    type_of(tree, &definition.of)?;
    tree.close("baseType");
    initial(tree, definition.initial.as_ref())?;
    tree.close("dataType");
    Ok(())
}

fn pou(
    tree: &mut Tree,
    file: &File,
    unit: &Unit,
    style: Option<Style>,
    as_text: &mut Vec<String>,
) -> Result<(), String> {
    let kind = match unit.kind {
        UnitKind::Program => "program",
        UnitKind::FunctionBlock => "functionBlock",
        UnitKind::Function => "function",
        UnitKind::Method => return Err(not_held(unit, "a method")),
    };
    let is_chart = matches!(unit.body, Body::Chart(_));
    // The methods of a chart are its conditions and actions.
    if !(unit.methods.is_empty() || is_chart)
        || unit.extends.is_some()
        || !unit.implements.is_empty()
    {
        return Err(not_held(unit, "methods, EXTENDS or IMPLEMENTS"));
    }
    tree.open("pou", &[("name", unit.name.as_str()), ("pouType", kind)]);
    tree.open("interface", &[]);
    if let Some(result) = &unit.result {
        tree.open("returnType", &[]);
        type_of(tree, result)?;
        tree.close("returnType");
    }
    let blocks = unit.declarations.chunk_by(|one, other| {
        let key = |of: &Declaration| (of.class, of.constant, of.retention);
        key(one) == key(other)
    });
    for block in blocks {
        variables(tree, block).map_err(|what| not_held(unit, &what))?;
    }
    tree.close("interface");
    if let Body::Chart(of) = &unit.body {
        chart::parts(tree, file, unit, of).map_err(|what| not_held(unit, &what))?;
    }
    tree.open("body", &[]);
    match &unit.body {
        Body::Chart(of) => chart::body(tree, unit, of).map_err(|what| not_held(unit, &what))?,
        Body::Instructions(list) => tree.formatted("IL", print::instructions(list).trim_end()),
        Body::Statements(statements) => {
            let drawn =
                style.map(|style| (style, networks(file, unit, statements, style, Widths::Exact)));
            match drawn {
                Some((style, Ok(networks))) => blocks::write(tree, file, &networks, style),
                other => {
                    if let Some((_, Err(reason))) = other {
                        as_text.push(format!("`{}` has {reason}", unit.name));
                    }
                    tree.formatted("ST", print::statements(statements).trim_end());
                }
            }
        }
    }
    tree.close("body");
    if !unit.comments.is_empty() {
        tree.formatted("documentation", &unit.comments.join("\n"));
    }
    tree.close("pou");
    Ok(())
}

fn not_held(unit: &Unit, what: &str) -> String {
    format!(
        "`{}` has {what}, which PLCopen XML is not written with: convert it to Structured Text (.st)",
        unit.name
    )
}

/// Variables of one block.
fn variables(tree: &mut Tree, block: &[Declaration]) -> Result<(), String> {
    let Some(first) = block.first() else {
        return Ok(());
    };
    let list = match first.class {
        Class::Input => "inputVars",
        Class::Output => "outputVars",
        Class::InOut => "inOutVars",
        Class::Local => "localVars",
        Class::Temporary => "tempVars",
        Class::External => "externalVars",
        Class::Global => "globalVars",
        Class::Static => return Err("variables of VAR_STAT".to_owned()),
    };
    let mut attributes = Vec::new();
    if first.constant {
        attributes.push(("constant", "true"));
    }
    match first.retention {
        Retention::Unstated => {}
        Retention::Retained => attributes.push(("retain", "true")),
        Retention::NotRetained => attributes.push(("nonretain", "true")),
    }
    tree.open(list, &attributes);
    for variable in block {
        if variable.edge.is_some() {
            return Err("inputs of R_EDGE or F_EDGE".to_owned());
        }
        let mut attributes = vec![("name", variable.name.as_str())];
        if let Some(address) = &variable.address {
            attributes.push(("address", address.as_str()));
        }
        tree.open("variable", &attributes);
        tree.open("type", &[]);
        type_of(tree, &variable.of)?;
        tree.close("type");
        initial(tree, variable.initial.as_ref())?;
        if let Some(description) = &variable.description {
            tree.formatted("documentation", description);
        }
        tree.close("variable");
    }
    tree.close(list);
    Ok(())
}

fn type_of(tree: &mut Tree, of: &TypeName) -> Result<(), String> {
    match &of.kind {
        TypeKind::Named(name) => {
            let known = ELEMENTARY.iter().find(|(word, _)| name.is(word));
            match known {
                Some((_, element)) => tree.empty(element, &[]),
                None => tree.empty("derived", &[("name", name.as_str())]),
            }
        }
        TypeKind::Subrange(base, lower, upper) => {
            let is_unsigned = base.key().starts_with('U');
            let element = if is_unsigned { "subrangeUnsigned" } else { "subrangeSigned" };
            let (lower, upper) = (print::expression(lower), print::expression(upper));
            tree.open(element, &[]);
            tree.empty("range", &[("lower", &lower), ("upper", &upper)]);
            tree.open("baseType", &[]);
            tree.empty(base.key().as_str(), &[]);
            tree.close("baseType");
            tree.close(element);
        }
        TypeKind::Text { wide, length } => {
            let element = if *wide { "wstring" } else { "string" };
            match length.as_ref().map(|length| print::expression(length)) {
                Some(length) => tree.empty(element, &[("length", &length)]),
                None => tree.empty(element, &[]),
            }
        }
        TypeKind::Array(dimensions, element) => {
            tree.open("array", &[]);
            for (lower, upper) in dimensions {
                let (lower, upper) = (print::expression(lower), print::expression(upper));
                tree.empty("dimension", &[("lower", &lower), ("upper", &upper)]);
            }
            tree.open("baseType", &[]);
            type_of(tree, element)?;
            tree.close("baseType");
            tree.close("array");
        }
        TypeKind::Structure(fields) => {
            tree.open("struct", &[]);
            for field in fields {
                tree.open("variable", &[("name", field.name.as_str())]);
                tree.open("type", &[]);
                type_of(tree, &field.of)?;
                tree.close("type");
                initial(tree, field.initial.as_ref())?;
                if let Some(description) = &field.description {
                    tree.formatted("documentation", description);
                }
                tree.close("variable");
            }
            tree.close("struct");
        }
        TypeKind::Enumeration(values, base) => {
            tree.open("enum", &[]);
            tree.open("values", &[]);
            for (name, number) in values {
                match number.as_ref().map(print::expression) {
                    Some(number) => {
                        tree.empty("value", &[("name", name.as_str()), ("value", &number)]);
                    }
                    None => tree.empty("value", &[("name", name.as_str())]),
                }
            }
            tree.close("values");
            if let Some(base) = base {
                tree.open("baseType", &[]);
                tree.empty(base.key().as_str(), &[]);
                tree.close("baseType");
            }
            tree.close("enum");
        }
        TypeKind::Pointer(to) => {
            tree.open("pointer", &[]);
            tree.open("baseType", &[]);
            type_of(tree, to)?;
            tree.close("baseType");
            tree.close("pointer");
        }
        TypeKind::OpenArray(..) => return Err("an ARRAY [*]".to_owned()),
    }
    Ok(())
}

fn initial(tree: &mut Tree, value: Option<&Initializer>) -> Result<(), String> {
    let Some(value) = value else {
        return Ok(());
    };
    tree.open("initialValue", &[]);
    initial_value(tree, value)?;
    tree.close("initialValue");
    Ok(())
}

fn initial_value(tree: &mut Tree, value: &Initializer) -> Result<(), String> {
    match value {
        Initializer::Value(value) => {
            tree.empty("simpleValue", &[("value", &print::expression(value))]);
        }
        Initializer::Array(elements, _) => {
            tree.open("arrayValue", &[]);
            for (count, values) in elements {
                let count = count.as_ref().map(print::expression);
                let [value] = values.as_slice() else {
                    return Err("an initial value that repeats several elements".to_owned());
                };
                match &count {
                    Some(count) => tree.open("value", &[("repetitionValue", count)]),
                    None => tree.open("value", &[]),
                }
                initial_value(tree, value)?;
                tree.close("value");
            }
            tree.close("arrayValue");
        }
        Initializer::Structure(fields, _) => {
            tree.open("structValue", &[]);
            for (member, value) in fields {
                tree.open("value", &[("member", member.as_str())]);
                initial_value(tree, value)?;
                tree.close("value");
            }
            tree.close("structValue");
        }
    }
    Ok(())
}

fn instances(tree: &mut Tree, file: &File) -> Result<(), String> {
    if let Some(found) = file.instances.iter().find(|it| it.retention != Retention::Unstated) {
        return Err(format!(
            "RETAIN of the whole program `{}`: declare its variables so",
            found.name
        ));
    }
    tree.open("instances", &[]);
    tree.open("configurations", &[]);
    if !file.instances.is_empty() || !file.globals.is_empty() {
        tree.open("configuration", &[("name", "Configuration0")]);
        tree.open("resource", &[("name", "Resource0")]);
        // The document states a priority of each task, and one without comes after all others.
        let stated = file.tasks.iter().filter_map(|task| task.priority).max();
        let last = stated.map_or(0, |greatest| greatest.saturating_add(1));
        for task in &file.tasks {
            let interval = task.interval.and_then(|interval| u64::try_from(interval).ok());
            let interval =
                interval.map(|interval| standard_time(std::time::Duration::from_nanos(interval)));
            let single = task.single.as_ref().map(print::expression);
            let priority = task.priority.unwrap_or(last).to_string();
            let mut attributes = vec![("name", task.name.as_str()), ("priority", &priority)];
            attributes.extend(interval.as_deref().map(|interval| ("interval", interval)));
            attributes.extend(single.as_deref().map(|single| ("single", single)));
            tree.open("task", &attributes);
            let is_own = |task_of: &Option<understudy_structured_text::syntax::Name>| {
                task_of.as_ref().is_some_and(|name| *name == task.name)
            };
            for instance in file.instances.iter().filter(|instance| is_own(&instance.task)) {
                run(tree, instance)?;
            }
            tree.close("task");
        }
        let blocks = file.globals.chunk_by(|one, other| {
            (one.constant, one.retention) == (other.constant, other.retention)
        });
        for block in blocks {
            variables(tree, block)?;
        }
        for instance in file.instances.iter().filter(|instance| instance.task.is_none()) {
            run(tree, instance)?;
        }
        tree.close("resource");
        tree.close("configuration");
    }
    tree.close("configurations");
    tree.close("instances");
    Ok(())
}

fn run(
    tree: &mut Tree,
    instance: &understudy_structured_text::syntax::ProgramInstance,
) -> Result<(), String> {
    if !instance.connections.is_empty() {
        return Err(format!(
            "the program instance `{}` has connections, which PLCopen XML is not written with",
            instance.name
        ));
    }
    let (name, of) = (instance.name.as_str(), instance.of.as_str());
    tree.empty("pouInstance", &[("name", name), ("typeName", of)]);
    Ok(())
}
