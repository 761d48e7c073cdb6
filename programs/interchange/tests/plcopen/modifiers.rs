//! Signs, edges and storage: each of them counts at each object and pin, in both forms of programs, or is refused.

use understudy_interchange::Format;
use understudy_interchange::plcopen::read_typed;

use crate::ablation::codes;
use crate::reading::reading;

/// What a file is as a program with numbers, with its findings.
fn with_numbers(text: &str) -> String {
    let (file, found) = read_typed(text);
    let found = found.iter().map(|found| format!("\n{} {}", found.code, found.message));
    understudy_structured_text::print::file(&file) + &found.collect::<String>()
}

/// Bodies with a `?` where an object or a pin has modifiers: of a wire that is read, that is written, and of what has one sign alone.
const MODIFIED: [(&str, &str); 17] = [
    (
        "a contact",
        r#"<LD><leftPowerRail localId="1"/><contact localId="2" ?>{1}<connectionPointOut/><variable>a</variable></contact><coil localId="3">{2}<variable>y</variable></coil></LD>"#,
    ),
    (
        "a coil",
        r#"<LD><leftPowerRail localId="1"/><contact localId="2">{1}<connectionPointOut/><variable>a</variable></contact><coil localId="3" ?>{2}<variable>y</variable></coil></LD>"#,
    ),
    (
        "a coil in a rung",
        r#"<LD><rung localId="1"><contact variable="a"/><coil variable="y" ?/></rung></LD>"#,
    ),
    (
        "a contact in a rung",
        r#"<LD><rung localId="1"><contact variable="a" ?/><coil variable="y"/></rung></LD>"#,
    ),
    (
        "a variable that is read",
        r#"<FBD>{a?}<outVariable localId="9">{2}<expression>y</expression></outVariable></FBD>"#,
    ),
    (
        "a variable that is written",
        r#"<FBD>{a}<outVariable localId="9" ?>{2}<expression>y</expression></outVariable></FBD>"#,
    ),
    (
        "an in-out variable, written",
        r#"<FBD>{a}<inOutVariable localId="8" ~In>{2}<connectionPointOut/><expression>y</expression></inOutVariable></FBD>"#,
    ),
    (
        "an in-out variable, read",
        r#"<FBD>{a}<inOutVariable localId="8" ~Out>{2}<connectionPointOut/><expression>y</expression></inOutVariable><outVariable localId="9">{8}<expression>z</expression></outVariable></FBD>"#,
    ),
    (
        "an input of a function of bits",
        r#"<FBD>{a}{b}<block localId="8" typeName="AND"><inputVariables>{IN1?2}{IN2 5}</inputVariables><inOutVariables/><outputVariables>{OUT}</outputVariables></block>{y8}</FBD>"#,
    ),
    (
        "an input of a function",
        r#"<FBD>{a}{b}<block localId="8" typeName="SEL"><inputVariables>{G?2}{IN0 5}{IN1 2}</inputVariables><inOutVariables/><outputVariables>{OUT}</outputVariables></block>{y8}</FBD>"#,
    ),
    (
        "an input of a function of the file",
        r#"<FBD>{a}<block localId="8" typeName="same"><inputVariables>{x?2}</inputVariables><inOutVariables/><outputVariables>{OUT}</outputVariables></block>{y8}</FBD>"#,
    ),
    (
        "an input of a function of the file with outputs",
        r#"<FBD>{a}<block localId="8" typeName="both"><inputVariables>{x?2}</inputVariables><inOutVariables/><outputVariables>{OUT}</outputVariables></block>{y8}</FBD>"#,
    ),
    (
        "EN of a function",
        r#"<FBD>{a}{b}<block localId="8" typeName="OR"><inputVariables>{EN?2}{IN1 5}{IN2 2}</inputVariables><inOutVariables/><outputVariables>{OUT}</outputVariables></block>{y8}</FBD>"#,
    ),
    (
        "EN of a function of the file",
        r#"<FBD>{a}{b}<block localId="8" typeName="both"><inputVariables>{EN?2}{x 5}</inputVariables><inOutVariables/><outputVariables>{OUT}</outputVariables></block>{y8}</FBD>"#,
    ),
    (
        "an input of a block",
        r#"<FBD>{a}{b}<block localId="8" typeName="SR" instanceName="s"><inputVariables>{S1?2}{R 5}</inputVariables><inOutVariables/><outputVariables>{Q1}</outputVariables></block>{y8}</FBD>"#,
    ),
    (
        "EN of a block",
        r#"<FBD>{a}{b}<block localId="8" typeName="SR" instanceName="s"><inputVariables>{EN?2}{S1 5}</inputVariables><inOutVariables/><outputVariables>{Q1}</outputVariables></block>{y8}</FBD>"#,
    ),
    (
        "an output of a block",
        r#"<FBD>{a}{b}<block localId="8" typeName="SR" instanceName="s"><inputVariables>{S1 2}{R 5}</inputVariables><inOutVariables/><outputVariables><variable formalParameter="Q1" ?><connectionPointOut/></variable></outputVariables></block>{y8}</FBD>"#,
    ),
];

/// A body with one modifier at its place.
fn modified(body: &str, name: &str, value: &str) -> String {
    let modifier = format!("{name}=\"{value}\"");
    let from = |id: &str| {
        format!(r#"<connectionPointIn><connection refLocalId="{id}"/></connectionPointIn>"#)
    };
    let pin = |name: &str, modifier: &str, id: &str| {
        let from = from(id);
        format!(r#"<variable formalParameter="{name}" {modifier}>{from}</variable>"#)
    };
    let given = |id: u32, name: &str, modifier: &str| {
        format!(
            r#"<inVariable localId="{id}" {modifier}><connectionPointOut/><expression>{name}</expression></inVariable>"#
        )
    };
    let mut text = String::new();
    let mut parts = body.split(['{', '}']);
    text += parts.next().unwrap_or_default();
    while let (Some(part), Some(rest)) = (parts.next(), parts.next()) {
        text += &match part {
            "a" => given(2, "a", ""),
            "a?" => given(2, "a", &modifier),
            "b" => given(5, "b", ""),
            "y8" => {
                let from = from("8");
                format!(
                    r#"<outVariable localId="9">{from}<expression>y</expression></outVariable>"#
                )
            }
            "OUT" | "Q1" => {
                format!(r#"<variable formalParameter="{part}"><connectionPointOut/></variable>"#)
            }
            part => match (part.split_once('?'), part.split_once(' ')) {
                (Some((name, id)), _) => pin(name, &modifier, id),
                (_, Some((name, id))) => pin(name, "", id),
                _ => from(part),
            },
        };
        text += rest;
    }
    text = text.replace(" ?", &format!(" {modifier}"));
    for end in ["In", "Out"] {
        text = text.replace(&format!(" ~{end}"), &format!(" {name}{end}=\"{value}\""));
    }
    let unit = |name: &str, outputs: &str, body: &str| {
        format!(
            r#"<pou name="{name}" pouType="function"><interface><returnType><BOOL/></returnType><inputVars><variable name="x"><type><BOOL/></type></variable></inputVars>{outputs}</interface><body><ST><p>{body}</p></ST></body></pou>"#
        )
    };
    let outputs = r#"<outputVars><variable name="o"><type><BOOL/></type></variable></outputVars>"#;
    let units = unit("same", "", "same := x;") + &unit("both", outputs, "both := x; o := x;");
    let variables = ["a", "b"]
        .map(|name| format!(r#"<variable name="{name}"><type><BOOL/></type></variable>"#));
    let written = ["y", "z"]
        .map(|name| format!(r#"<variable name="{name}"><type><BOOL/></type></variable>"#));
    format!(
        r#"<project xmlns="http://www.plcopen.org/xml/tc6_0201"><types><dataTypes/><pous>{units}<pou name="main" pouType="program"><interface><inputVars>{}</inputVars><outputVars>{}</outputVars><localVars><variable name="s"><type><derived name="SR"/></type></variable></localVars></interface><body>{text}</body></pou></pous></types><instances><configurations/></instances></project>"#,
        variables.concat(),
        written.concat()
    )
}

#[test]
fn every_modifier_of_every_object_and_pin_counts() {
    for (what, body) in MODIFIED {
        let plain = modified(body, "negated", "false");
        assert_eq!(codes(&plain), Vec::<&str>::new(), "{what}\n{plain}");
        let (ladder, numbers) = (reading(Format::PlcOpen, &plain), with_numbers(&plain));
        for (name, value) in [
            ("negated", "true"),
            ("edge", "rising"),
            ("edge", "falling"),
            ("storage", "set"),
            ("storage", "reset"),
            ("negated", "yes"),
            ("edge", "both"),
            ("storage", "keep"),
        ] {
            let text = modified(body, name, value);
            assert_ne!(reading(Format::PlcOpen, &text), ladder, "{name} {value} of {what}\n{text}");
            assert_ne!(
                with_numbers(&text),
                numbers,
                "{name} {value} of {what}, with numbers\n{text}"
            );
            if ["yes", "both", "keep"].contains(&value) {
                assert!(codes(&text).contains(&"U1010"), "{name} {value} of {what}");
            }
        }
    }
}

#[test]
fn a_chart_has_no_signs_but_those_of_its_conditions() {
    let chart = r#"<SFC><step localId="1" name="idle" initialStep="true"{0}/><transition localId="2"{1}>{from}<condition{2}><inline name=""><ST><p>a</p></ST></inline></condition></transition><jumpStep localId="3" targetName="idle">{next}</jumpStep><actionBlock localId="4"{3}>{from}<action><reference name="y"/></action></actionBlock></SFC>"#;
    let from = |id: u32| {
        format!(r#"<connectionPointIn><connection refLocalId="{id}"/></connectionPointIn>"#)
    };
    let with = |place: usize| {
        let mut text = chart.replace("{from}", &from(1)).replace("{next}", &from(2));
        for at in 0..4 {
            let sign = if at == place { r#" negated="true""# } else { "" };
            text = text.replace(&format!("{{{at}}}"), sign);
        }
        modified(&text, "", "")
    };
    let plain = with_numbers(&with(9));
    for place in 0..4 {
        let text = with(place);
        assert_ne!(with_numbers(&text), plain, "{text}");
        let expected: &[&str] = if place == 2 { &[] } else { &["U1010"] };
        assert_eq!(codes(&text), expected, "{text}");
    }
}

/// What is said of a loss of power is a boolean, and says one thing.
#[test]
fn attributes_of_a_loss_of_power_are_read_or_refused() {
    let text = |attributes: &str| {
        format!(
            r#"<project xmlns="http://www.plcopen.org/xml/tc6_0201"><fileHeader companyName="" productName="" productVersion="1" creationDateTime="2026-01-01T00:00:00"/><contentHeader name="p"><coordinateInfo><fbd><scaling x="1" y="1"/></fbd><ld><scaling x="1" y="1"/></ld><sfc><scaling x="1" y="1"/></sfc></coordinateInfo></contentHeader><types><dataTypes/><pous><pou name="main" pouType="program"><interface><localVars {attributes}><variable name="n"><type><INT/></type></variable></localVars></interface><body><ST><xhtml:p xmlns:xhtml="http://www.w3.org/1999/xhtml">n := n + 1;</xhtml:p></ST></body></pou></pous></types><instances><configurations/></instances></project>"#
        )
    };
    for right in ["", r#"retain="true""#, r#"nonretain="1" retain="false""#, r#"retain="0""#] {
        assert!(!codes(&text(right)).contains(&"U1010"), "{right}: {:?}", codes(&text(right)));
    }
    for wrong in [
        r#"retain="yes""#,
        r#"persistent="TRUE""#,
        r#"nonretain="no""#,
        r#"retain="true" nonretain="true""#,
        r#"persistent="1" nonretain="1""#,
    ] {
        assert!(codes(&text(wrong)).contains(&"U1010"), "{wrong}: {:?}", codes(&text(wrong)));
    }
}
