//! A TwinCAT project is one program: several files, its `.plcproj` or its folder.

use std::fs;

use crate::{empty_folder, understudy_in};

const MODE: &str = "<?xml version=\"1.0\"?>\n<TcPlcObject><DUT Name=\"E_Mode\"><Declaration><![CDATA[TYPE E_Mode : (off, on);\nEND_TYPE]]></Declaration></DUT></TcPlcObject>\n";
const MAIN: &str = "<?xml version=\"1.0\"?>\n<TcPlcObject><POU Name=\"MAIN\"><Declaration><![CDATA[PROGRAM MAIN\nVAR_INPUT a : BOOL; END_VAR\nVAR_OUTPUT q : BOOL; END_VAR\nVAR m : E_Mode; END_VAR]]></Declaration>\n<Implementation><ST><![CDATA[IF a THEN m := E_Mode.on; ELSE m := E_Mode.off; END_IF\nq := m = E_Mode.on;]]></ST></Implementation></POU></TcPlcObject>\n";
const PROJECT: &str = r#"<Project xmlns="http://schemas.microsoft.com/developer/msbuild/2003"><ItemGroup><Compile Include="DUTs\E_Mode.TcDUT"/><Compile Include="MAIN.TcPOU"/></ItemGroup></Project>"#;

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
    // A file that the project does not name is none of it.
    write(
        "Old.TcPOU",
        "<TcPlcObject><POU Name=\"MAIN\"><Declaration>no</Declaration></POU></TcPlcObject>",
    );
    for project in ["plc.plcproj", "."] {
        assert_eq!(run(&["scan", project, "--inputs", "inputs.txt"]).output, scanned, "{project}");
        let checked = run(&["check", project]);
        assert_eq!(checked.status, 0, "{}", checked.shown());
        assert!(checked.output.contains("E_Mode.TcDUT"), "{}", checked.output);
        for form in ["st", "ladder"] {
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
