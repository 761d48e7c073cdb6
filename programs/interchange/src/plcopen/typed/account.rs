//! The account of a document: each element and attribute is one that is understood, or changes nothing, or is refused by its name.

use understudy_text::xml::Node;
use understudy_text::{Diagnostic, MAXIMUM_FINDINGS};

use crate::plcopen::xml::{held, start_tag};

/// Elements with the attributes that they may have. Those in front of `|` are understood; behind it, they change nothing.
const KNOWN: [(&str, &str); 98] = [
    ("project", "|xmlns schemaLocation"),
    ("types", ""),
    ("dataTypes", ""),
    ("dataType", "name"),
    ("baseType", ""),
    ("initialValue", ""),
    ("simpleValue", "value"),
    ("arrayValue", ""),
    ("structValue", ""),
    ("value", "name value repetitionValue member"),
    ("values", ""),
    ("enum", ""),
    ("struct", ""),
    ("array", ""),
    ("dimension", "lower upper"),
    ("subrangeSigned", ""),
    ("subrangeUnsigned", ""),
    ("range", "lower upper"),
    ("pointer", ""),
    ("derived", "name"),
    ("string", "length"),
    ("wstring", "length"),
    ("STRING", "length"),
    ("WSTRING", "length"),
    ("pous", ""),
    ("pou", "name pouType|globalId"),
    ("interface", ""),
    ("returnType", ""),
    ("inputVars", VARIABLES),
    ("outputVars", VARIABLES),
    ("inOutVars", VARIABLES),
    ("localVars", VARIABLES),
    ("tempVars", VARIABLES),
    ("externalVars", VARIABLES),
    ("globalVars", VARIABLES),
    ("variable", "name address formalParameter negated edge storage|globalId hidden"),
    ("type", ""),
    ("actions", ""),
    ("action", "name qualifier duration indicator|localId width height globalId executionOrderId"),
    ("transitions", ""),
    ("transition", "name localId priority negated|height width globalId executionOrderId"),
    ("body", "|WorksheetName globalId"),
    ("ST", "|globalId"),
    ("IL", "|globalId"),
    ("LD", ""),
    ("FBD", ""),
    ("SFC", ""),
    ("instances", ""),
    ("configurations", ""),
    ("configuration", "name|globalId"),
    ("resource", "name|globalId"),
    ("task", "name single interval priority|globalId"),
    ("pouInstance", "name typeName type|globalId"),
    ("leftPowerRail", PLACED),
    ("rightPowerRail", PLACED),
    (
        "contact",
        "localId negated edge storage executionOrderId variable|height width globalId lineNumber",
    ),
    (
        "coil",
        "localId negated edge storage kind executionOrderId variable|height width globalId lineNumber",
    ),
    ("block", "localId typeName instanceName executionOrderId|height width globalId lineNumber"),
    ("inputVariables", ""),
    ("outputVariables", ""),
    ("inOutVariables", ""),
    ("inVariable", SIGNED),
    ("outVariable", SIGNED),
    (
        "inOutVariable",
        "localId executionOrderId negatedIn edgeIn storageIn negatedOut edgeOut storageOut|height width globalId",
    ),
    ("expression", ""),
    ("connectionPointIn", "|globalId"),
    ("connectionPointOut", "formalParameter|globalId"),
    ("connection", "refLocalId formalParameter|globalId"),
    ("connector", "name localId|executionOrderId height width globalId"),
    ("continuation", "name localId|executionOrderId height width globalId"),
    ("comment", "|localId height width globalId executionOrderId"),
    ("step", "localId name initialStep negated|height width globalId executionOrderId"),
    ("condition", "negated"),
    ("reference", "name"),
    ("inline", "|name"),
    ("connectionPointOutAction", "|formalParameter globalId"),
    ("selectionDivergence", PLACED),
    ("selectionConvergence", PLACED),
    ("simultaneousDivergence", "localId|name height width globalId executionOrderId"),
    ("simultaneousConvergence", PLACED),
    ("jumpStep", "localId targetName|height width globalId executionOrderId"),
    ("actionBlock", "localId negated|height width globalId executionOrderId"),
    ("jump", "localId label executionOrderId|height width globalId"),
    ("label", "localId label executionOrderId|height width globalId"),
    ("return", "localId executionOrderId|height width globalId"),
    ("rung", "localId|lineNumber"),
    ("macroStep", "localId name|height width globalId executionOrderId"),
    // Refused where objects are read.
    ("vendorElement", "localId|height width globalId executionOrderId"),
    ("alternativeText", "*"),
    ("error", "localId|height width globalId executionOrderId"),
    ("qualifier", ""),
    // Places on the sheet.
    ("position", "|x y"),
    ("relPosition", "|x y"),
    ("content", ""),
    ("inOutVariablesEnd", ""),
    ("fileHeader", "*"),
    ("contentHeader", "*"),
    ("documentation", "*"),
];

const VARIABLES: &str = "constant retain persistent nonretain|nonpersistent name globalId";
const PLACED: &str = "localId|height width globalId executionOrderId";
const SIGNED: &str = "localId executionOrderId negated edge storage|height width globalId";

/// Elementary types stand as elements of their names.
const ELEMENTARY: [&str; 27] = [
    "BOOL",
    "BYTE",
    "WORD",
    "DWORD",
    "LWORD",
    "SINT",
    "INT",
    "DINT",
    "LINT",
    "USINT",
    "UINT",
    "UDINT",
    "ULINT",
    "REAL",
    "LREAL",
    "TIME",
    "DATE",
    "DT",
    "TOD",
    "LTIME",
    "LDATE",
    "LDT",
    "LTOD",
    "DATE_AND_TIME",
    "TIME_OF_DAY",
    "CHAR",
    "WCHAR",
];

/// Elements whose contents are texts, headers or pictures: what stands in them is read as a whole, or changes nothing.
const WHOLE: [&str; 8] = [
    "fileHeader",
    "contentHeader",
    "documentation",
    "content",
    "ST",
    "IL",
    "expression",
    "alternativeText",
];

/// Additional data of tools that holds parts of the program.
const PROGRAM_DATA: [&str; 11] = [
    "method",
    "property",
    "interface",
    "action",
    "transition",
    "application",
    "pou",
    "datatype",
    "globalvars",
    "mixedattrsvarlist",
    "union",
];

/// Those that are read, in a project or a resource.
const READ_DATA: [&str; 4] = ["application", "pou", "datatype", "globalvars"];

/// Reports every element and attribute that nothing here understands.
pub(super) fn check(root: Node<'_, '_>, diagnostics: &mut Vec<Diagnostic>) {
    let mut waiting = vec![root];
    while let Some(node) = waiting.pop() {
        if diagnostics.len() >= MAXIMUM_FINDINGS {
            return;
        }
        let name = node.tag_name().name();
        if name == "addData" {
            waiting.extend(data(node, diagnostics));
            continue;
        }
        let known = KNOWN.iter().find(|(known, _)| *known == name);
        let attributes = match known {
            Some((_, attributes)) => attributes,
            None if ELEMENTARY.contains(&name) => "",
            None => {
                let parent = node.parent_element().map(|parent| parent.tag_name().name());
                let message = format!(
                    "the element `{name}` in `{}` is not known",
                    parent.unwrap_or_default()
                );
                diagnostics.push(Diagnostic::error("U1010", message, start_tag(node)));
                continue;
            }
        };
        if attributes != "*" {
            for attribute in node.attributes() {
                let mut words = attributes.split([' ', '|']);
                if !words.any(|word| word == attribute.name()) && !attribute.value().is_empty() {
                    let message =
                        format!("the attribute `{}` of `{name}` is not known", attribute.name());
                    diagnostics.push(Diagnostic::error("U1010", message, attribute.range()));
                }
            }
        }
        if !WHOLE.contains(&name) {
            waiting.extend(node.children().filter(Node::is_element));
        }
    }
}

/// Additional data of a tool is read past, unless it holds a part of the program; what of it is read.
fn data<'a, 'i>(node: Node<'a, 'i>, diagnostics: &mut Vec<Diagnostic>) -> Vec<Node<'a, 'i>> {
    let parent = node.parent_element().map(|parent| parent.tag_name().name());
    let is_read = |word: &&str| match parent {
        Some("project") => true,
        Some("resource") => **word != *"application",
        _ => false,
    };
    let mut read = Vec::new();
    for data in node.children().filter(Node::is_element) {
        let holds = |word: &&&str| held(data).eq_ignore_ascii_case(word);
        if READ_DATA.iter().filter(|word| is_read(word)).any(|word| holds(&word)) {
            read.extend(data.children().filter(Node::is_element));
        } else if PROGRAM_DATA.iter().any(|word| holds(&word)) {
            let message = format!(
                "the additional data `{}` of a tool holds a part of the program",
                held(data)
            );
            let found = Diagnostic::error("U1010", message, start_tag(data));
            diagnostics
                .push(found.with_help("export the project without additional data of the tool"));
        }
    }
    read
}
