//! Clusters of the press cell.

use understudy_cluster::{Cluster, Overrides, press_cell as files, read_with_files};
use understudy_cycle::Mode;

/// The cell of section V.
///
/// # Panics
/// Never: the files come with the program.
pub fn press_cell(mode: Mode) -> Cluster {
    cluster(files()[0].text, mode)
}

/// A robot, the press that it feeds, a robot, and so on: a number of controllers and of understudies.
///
/// # Panics
/// If the protocol does not take these numbers.
pub fn line(controllers: usize, understudies: usize, mode: Mode) -> Cluster {
    let mut text = "[cluster]\nname = \"line\"\nperiod = \"10ms\"\n".to_owned();
    let kinds = ["robot", "press"];
    for place in 0..controllers {
        let kind = kinds[place % 2];
        text += &format!(
            "[[controller]]\nname = \"c{place}\"\nladder = \"{kind}.ladder\"\n\
             [[remote_io]]\nname = \"io{place}\"\ncontroller = \"c{place}\"\n\
             [[plant]]\nname = \"p{place}\"\ncontroller = \"c{place}\"\nmodel = \"{kind}\"\n"
        );
        if place % 2 == 1 {
            text += &format!("fed_by = \"p{}\"\n", place - 1);
        }
    }
    if understudies == 0 {
        text = text.replacen("[cluster]", "understudy = []\n[cluster]", 1);
    }
    for place in 0..understudies {
        text += &format!("[[understudy]]\nname = \"u{place}\"\n");
    }
    cluster(&text, mode)
}

/// The cluster of a text that names the ladders of the press cell.
///
/// # Panics
/// If the text has errors.
pub fn cluster(text: &str, mode: Mode) -> Cluster {
    let overrides = Overrides { mode: Some(mode), ..Overrides::default() };
    let loaded = read_with_files(text, files(), overrides);
    loaded.cluster.unwrap_or_else(|| panic!("{:?}", loaded.reports))
}

/// A program that counts scans for good, in the retentive output `total`, and since the last start.
pub const COUNTER: &str = "
PROGRAM counter
  VAR_INPUT hold : BOOL; END_VAR
  VAR_OUTPUT RETAIN total : DINT; END_VAR
  VAR_OUTPUT since : DINT; END_VAR
  total := total + 1;
  since := since + 1;
END_PROGRAM";

/// The press cell with two controllers, an understudy and the slot of a spare, as the text of a cluster.
pub const CELL_WITH_SPARE: &str = r#"
[cluster]
name = "cell"
[[controller]]
name = "robot"
ladder = "robot.ladder"
[[controller]]
name = "press"
ladder = "press.ladder"
[[understudy]]
name = "understudy"
[[understudy]]
name = "spare"
spare = true
[[plant]]
controller = "robot"
model = "robot"
[[plant]]
controller = "press"
model = "press"
"#;
