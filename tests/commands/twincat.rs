//! A TwinCAT project is one program: several files, its `.plcproj` or its folder.

use std::fs;

use crate::{empty_folder, understudy_in};

const MODE: &str = "<?xml version=\"1.0\"?>\n<TcPlcObject><DUT Name=\"E_Mode\"><Declaration><![CDATA[TYPE E_Mode : (off, on);\nEND_TYPE]]></Declaration></DUT></TcPlcObject>\n";
const MAIN: &str = "<?xml version=\"1.0\"?>\n<TcPlcObject><POU Name=\"MAIN\"><Declaration><![CDATA[PROGRAM MAIN\nVAR_INPUT a : BOOL; END_VAR\nVAR_OUTPUT q : BOOL; END_VAR\nVAR m : E_Mode; END_VAR]]></Declaration>\n<Implementation><ST><![CDATA[IF a THEN m := E_Mode.on; ELSE m := E_Mode.off; END_IF\nq := m = E_Mode.on;]]></ST></Implementation></POU></TcPlcObject>\n";
const PROJECT: &str = r#"<Project xmlns="http://schemas.microsoft.com/developer/msbuild/2003"><ItemGroup><Compile Include="DUTs\E_Mode.TcDUT"/><Compile Include="MAIN.TcPOU"/></ItemGroup></Project>"#;

/// Comments of a body are kept, wherever in it they are.
#[test]
fn comments_of_a_body_are_kept_to_the_last() {
    let folder = empty_folder("twincat_comments");
    let body = "// above\nq := a; // beside\n(* below *)";
    let text = MAIN.replace("VAR m : E_Mode; END_VAR", "").replace(
        "IF a THEN m := E_Mode.on; ELSE m := E_Mode.off; END_IF\nq := m = E_Mode.on;",
        body,
    );
    assert!(text.contains(body));
    fs::write(folder.join("MAIN.TcPOU"), text).expect("written");
    let written = understudy_in(&folder, &["convert", "MAIN.TcPOU", "--to", "st"]);
    assert_eq!(written.status, 0, "{}", written.shown());
    let places: Vec<Option<usize>> =
        ["above", "beside", "below"].iter().map(|word| written.output.find(word)).collect();
    assert!(places.iter().all(Option::is_some) && places.is_sorted(), "{}", written.output);
}

#[test]
fn the_files_of_a_project_are_one_program() {
    let folder = empty_folder("twincat");
    fs::create_dir(folder.join("DUTs")).expect("a folder");
    let write = |name: &str, text: &str| fs::write(folder.join(name), text).expect("written");
    write("MAIN.TcPOU", MAIN);
    write("DUTs/E_Mode.TcDUT", MODE);
    write("inputs.txt", "0\n1\n0\n");
    let run = |arguments: &[&str]| understudy_in(&folder, arguments);
    let scanned = "0 -> 0\n1 -> 1\n0 -> 0\n";
    // Of a folder without a project, all files.
    assert_eq!(run(&["scan", ".", "--inputs", "inputs.txt"]).output, scanned);
    write("plc.plcproj", PROJECT);
    // A file that the project does not name is not read.
    write(
        "Old.TcPOU",
        "<TcPlcObject><POU Name=\"MAIN\"><Declaration>no</Declaration></POU></TcPlcObject>",
    );
    for project in ["plc.plcproj", "."] {
        assert_eq!(run(&["scan", project, "--inputs", "inputs.txt"]).output, scanned, "{project}");
        let checked = run(&["check", project]);
        assert_eq!(checked.status, 0, "{}", checked.shown());
        assert!(checked.output.contains("E_Mode.TcDUT"), "{}", checked.output);
        for form in ["st", "plcopen"] {
            let written = run(&["convert", project, "--to", form]);
            assert_eq!(written.status, 0, "{}", written.shown());
        }
    }
    let together = run(&["check", "MAIN.TcPOU", "DUTs/E_Mode.TcDUT"]);
    assert_eq!(together.status, 0, "{}", together.shown());
    assert_eq!(run(&["check", "MAIN.TcPOU"]).status, 2);
    // What is wrong is said in its own file.
    write("DUTs/E_Mode.TcDUT", &MODE.replace("(off, on)", "(off, an)"));
    let wrong = run(&["check", "plc.plcproj"]);
    assert_eq!(wrong.status, 2, "{}", wrong.shown());
    assert!(
        wrong.errors.contains("MAIN.TcPOU:7:") || wrong.errors.contains("MAIN.TcPOU:8:"),
        "{}",
        wrong.errors
    );
    write("DUTs/E_Mode.TcDUT", "<TcPlcObject>");
    let wrong = run(&["check", "plc.plcproj"]);
    assert_eq!(wrong.status, 2);
    assert!(
        wrong.errors.contains("U1001") && wrong.errors.contains("E_Mode.TcDUT"),
        "{}",
        wrong.errors
    );
    fs::remove_file(folder.join("DUTs/E_Mode.TcDUT")).expect("a file");
    let absent = run(&["check", "plc.plcproj"]);
    assert_eq!(absent.status, 2);
    assert!(absent.errors.contains("E_Mode.TcDUT"), "{}", absent.errors);
    write("other.plcproj", PROJECT);
    assert!(run(&["check", "."]).errors.contains("several projects"));
}

/// An object of a project, with the lines and the mark that TwinCAT writes.
fn object(element: &str, name: &str, declaration: &str, body: &str) -> String {
    let body = match body {
        "" => String::new(),
        body => format!(
            "    <Implementation>\r\n      <ST><![CDATA[{body}]]></ST>\r\n    </Implementation>\r\n"
        ),
    };
    format!(
        "\u{feff}<?xml version=\"1.0\" encoding=\"utf-8\"?>\r\n<TcPlcObject Version=\"1.1.0.1\">\r\n  <{element} Name=\"{name}\" Id=\"{{0}}\">\r\n    <Declaration><![CDATA[{declaration}]]></Declaration>\r\n{body}  </{element}>\r\n</TcPlcObject>"
    )
}

/// A project as TwinCAT writes it: folders, a list of constants, a block with its interface, a program that another calls.
#[test]
fn a_whole_project_runs_and_shows_every_error() {
    let folder = empty_folder("twincat-project");
    for name in ["POUs", "DUTs", "GVLs"] {
        fs::create_dir(folder.join(name)).expect("a folder");
    }
    let objects = [
        ("POUs/MAIN.TcPOU", object("POU", "MAIN", "PROGRAM MAIN\nVAR_INPUT up : BOOL; END_VAR\nVAR_OUTPUT high : BOOL; END_VAR\nVAR ramp : FB_Ramp; last : ARRAY [0..GVL.cLast] OF DINT; END_VAR", "ramp(up := up);\nlast[GVL.cLast] := ramp.level;\nCount(step := last[GVL.cLast]);\nhigh := Count.sum >= GVL.limit;")),
        ("POUs/Count.TcPOU", object("POU", "Count", "PROGRAM Count\nVAR_INPUT step : DINT; END_VAR\nVAR sum : DINT; END_VAR", "sum := sum + step;")),
        ("POUs/FB_Ramp.TcPOU", object("POU", "FB_Ramp", "FUNCTION_BLOCK FB_Ramp IMPLEMENTS I_Ramp\nVAR_INPUT up : BOOL; END_VAR\nVAR_OUTPUT level : DINT; mode : E_Mode; END_VAR", "IF up AND level < 2 THEN level := level + 1; mode := E_Mode.rising; END_IF")),
        ("POUs/I_Ramp.TcIO", object("Itf", "I_Ramp", "INTERFACE I_Ramp", "")),
        ("DUTs/E_Mode.TcDUT", object("DUT", "E_Mode", "{attribute 'qualified_only'}\nTYPE E_Mode :\n(\n  idle := 0,\n  rising\n);\nEND_TYPE", "")),
        ("GVLs/GVL.TcGVL", object("GVL", "GVL", "{attribute 'qualified_only'}\nVAR_GLOBAL\n  limit : DINT := 4;\nEND_VAR\nVAR_GLOBAL CONSTANT\n  cLast : INT := 3;\nEND_VAR", "")),
        ("Plc.TcTTO", "<?xml version=\"1.0\"?>\n<TcPlcObject><Task Name=\"Plc\" Id=\"{1}\"><CycleTime>20000</CycleTime><Priority>20</Priority><PouCall><Name>MAIN</Name></PouCall></Task></TcPlcObject>".to_owned()),
    ];
    let write = |name: &str, text: &str| fs::write(folder.join(name), text).expect("written");
    let names = objects.iter().map(|(name, _)| name.replace('/', "\\"));
    let named: String = names.map(|name| format!("<Compile Include=\"{name}\"/>")).collect();
    write(
        "Plc.plcproj",
        &format!(
            "<Project xmlns=\"http://schemas.microsoft.com/developer/msbuild/2003\"><ItemGroup>{named}</ItemGroup></Project>"
        ),
    );
    for (name, text) in &objects {
        write(name, text);
    }
    write("inputs.txt", "1\n1\n0\n0\n");
    let run = |arguments: &[&str]| understudy_in(&folder, arguments);
    for project in [".", "Plc.plcproj"] {
        let scanned = run(&["scan", project, "--inputs", "inputs.txt"]);
        assert_eq!(scanned.output, "1 -> 0\n1 -> 0\n0 -> 1\n0 -> 1\n", "{}", scanned.shown());
    }
    // One error in each of three files: all are told, each in its file.
    write("POUs/Count.TcPOU", &objects[1].1.replace("sum + step", "sum + missing"));
    write("POUs/FB_Ramp.TcPOU", &objects[2].1.replace("level < 2", "level < absent"));
    write("DUTs/E_Mode.TcDUT", &objects[4].1.replace("rising\n", "falling\n"));
    let wrong = run(&["check", "."]);
    assert_eq!(wrong.status, 2, "{}", wrong.shown());
    for (file, what) in
        [("Count.TcPOU", "`missing`"), ("FB_Ramp.TcPOU", "`absent`"), ("FB_Ramp.TcPOU", "`rising`")]
    {
        assert!(
            wrong.errors.contains(file) && wrong.errors.contains(what),
            "{what}: {}",
            wrong.errors
        );
    }
    // A program that nothing runs and nothing calls is checked too.
    for (name, text) in &objects {
        write(name, text);
    }
    write(
        "POUs/Idle.TcPOU",
        &object("POU", "Idle", "PROGRAM Idle\nVAR x AT %QX0.0 : BOOL; END_VAR", "x := nowhere;"),
    );
    fs::remove_file(folder.join("Plc.plcproj")).expect("a file");
    let wrong = run(&["check", "."]);
    assert!(wrong.status == 2 && wrong.errors.contains("`nowhere`"), "{}", wrong.shown());
    write(
        "POUs/Idle.TcPOU",
        &object("POU", "Idle", "PROGRAM Idle\nVAR x AT %QX0.0 : BOOL; END_VAR", "x := TRUE;"),
    );
    let scanned = run(&["scan", ".", "--inputs", "inputs.txt"]);
    assert_eq!(scanned.output, "1 -> 0\n1 -> 0\n0 -> 1\n0 -> 1\n", "{}", scanned.shown());
}

/// Each command that takes a program takes a project: its file, its folder, or the only file of one.
#[test]
fn every_command_takes_a_project() {
    let folder = empty_folder("twincat-commands");
    for name in ["bits", "bits/DUTs", "numbers"] {
        fs::create_dir(folder.join(name)).expect("a folder");
    }
    let write = |name: &str, text: &str| fs::write(folder.join(name), text).expect("written");
    write("bits/MAIN.TcPOU", MAIN);
    write("bits/DUTs/E_Mode.TcDUT", MODE);
    write("bits/plc.plcproj", PROJECT);
    let main = "PROGRAM MAIN\nVAR_INPUT a : INT; END_VAR\nVAR_OUTPUT q : INT; END_VAR\nVAR scale : INT := 2; text : STRING := 'GVL.limit'; END_VAR";
    let body = "q := MIN(a, GVL.limit) * scale / GVL.steps[1] + LEN(text);";
    write("numbers/MAIN.TcPOU", &object("POU", "MAIN", main, body));
    write(
        "numbers/GVL.TcGVL",
        &object(
            "GVL",
            "GVL",
            "VAR_GLOBAL\n  limit : INT := 400;\n  steps : ARRAY [0..1] OF INT := [2(2)];\nEND_VAR",
            "",
        ),
    );
    let run = |arguments: &[&str]| understudy_in(&folder, arguments);
    for (place, project) in ["bits", "bits/plc.plcproj", "numbers"].into_iter().enumerate() {
        for command in ["check", "verify", "draw", "convert --to st", "scan --digest 10"] {
            let words: Vec<&str> = command.split(' ').collect();
            let answer = run(&[&words[..1], &[project], &words[1..]].concat());
            assert_eq!(answer.status, 0, "{command} {project}: {}", answer.shown());
            let proposed = format!("understudy init cell --from {project}\n");
            assert!(command != "check" || answer.errors.contains(&proposed), "{}", answer.shown());
        }
        let cell = format!("cell{place}");
        for from in [project.to_owned(), format!("feeder={project}")] {
            let cell = format!("{cell}{}", from.len());
            let answer = run(&["init", &cell, "--from", &from]);
            assert_eq!(answer.status, 0, "{from}: {}", answer.shown());
            let drafted = [format!("{cell}/cluster.toml"), format!("{cell}/kill.toml")];
            let answer = run(&["check", &drafted[0], &drafted[1]]);
            assert_eq!(answer.status, 0, "{from}: {}", answer.shown());
            let text = fs::read_to_string(folder.join(&drafted[0])).expect("a cluster file");
            let name = if from.starts_with("feeder") { "\"feeder\"" } else { "\"MAIN\"" };
            assert!(text.contains(name), "{text}");
        }
    }
    assert_eq!(run(&["allocate", "bits"]).status, run(&["allocate", "cell04/MAIN.st"]).status);
    // Another compiler has no list of that name, and no block that nothing uses.
    for form in ["st", "plcopen"] {
        let written = run(&["convert", "numbers", "--to", form]).output;
        assert!(written.contains("limit") && written.contains("GVL.limit"), "{written}");
        assert_eq!(written.matches("GVL.").count(), 1, "{written}");
        assert!(!written.contains("SCALE"), "{written}");
    }
    // What is wrong is said in its own file, by each of them.
    write("bits/DUTs/E_Mode.TcDUT", &MODE.replace("(off, on)", "(off, an)"));
    for command in ["verify bits", "draw bits", "init other --from bits", "allocate bits"] {
        let answer = run(&command.split(' ').collect::<Vec<_>>());
        assert_eq!(answer.status, 2, "{command}: {}", answer.shown());
        assert!(answer.errors.contains("MAIN.TcPOU:"), "{command}: {}", answer.shown());
    }
}
