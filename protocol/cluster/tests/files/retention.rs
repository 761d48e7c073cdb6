//! What a warm start keeps of a controller's program, as its stations execute it.

use understudy_executable::{Executable, Scratch};
use understudy_wire::ProgramHash;

use crate::common::{findings, load};

const CLUSTER: &str = "[cluster]\nname = \"cell\"\n[[controller]]\nname = \"one\"\nladder = \"one.";

/// The hash of a program, and what executes it.
fn controller(ending: &str, text: &str) -> (ProgramHash, Executable) {
    let cluster = format!("{CLUSTER}{ending}\"\n");
    let loaded = load(&cluster, &[(&format!("one.{ending}"), text)]);
    let found = findings(&loaded.reports);
    let cluster = loaded.cluster.unwrap_or_else(|| panic!("{found}"));
    let controller = &cluster.controllers()[0];
    (controller.hash, controller.code.executable())
}

/// Two counts of a rising input: the first is retentive where `RETAIN` is replaced.
const PROGRAMS: [(&str, &str, [&str; 2]); 2] = [
    (
        "ladder",
        "program p\ninput a\noutput y\noutput z\nRETAIN\nrung a {CTU c 2} ( y )\nrung a {CTU d 2} ( z )\n",
        ["retain c\n", "retain d\n"],
    ),
    (
        "st",
        "PROGRAM p VAR_INPUT a : BOOL; END_VAR VAR_OUTPUT y, z : BOOL; END_VAR RETAIN\n\
         c(CU := a, PV := 2); d(CU := a, PV := 2); y := c.Q; z := d.Q; END_PROGRAM\n",
        [
            "VAR RETAIN c : CTU; END_VAR VAR d : CTU; END_VAR",
            "VAR c : CTU; END_VAR VAR RETAIN d : CTU; END_VAR",
        ],
    ),
];

#[test]
fn the_hash_covers_what_is_retentive() {
    for (ending, text, [first, second]) in PROGRAMS {
        let without = if ending == "st" { "VAR c, d : CTU; END_VAR" } else { "" };
        let texts =
            [without, first, second].map(|retain| text.replace("RETAIN\n", &format!("{retain}\n")));
        let hashes = texts.each_ref().map(|text| controller(ending, text).0);
        assert!(hashes[0] != hashes[1] && hashes[0] != hashes[2] && hashes[1] != hashes[2]);
    }
}

#[test]
fn a_warm_start_keeps_what_is_retentive() {
    for (ending, text, [first, _]) in PROGRAMS {
        let (_, executable) = controller(ending, &text.replace("RETAIN\n", &format!("{first}\n")));
        assert!(executable.is_retentive(), "{ending}");
        let mut scratch = Scratch::default();
        let mut state = executable.initial().to_vec();
        let mut outputs = vec![0; executable.output_count().div_ceil(64)];
        for inputs in [1, 0] {
            executable.step(&mut scratch, &mut state, &[inputs], &mut outputs);
        }
        state = executable.restarted(&state);
        assert_ne!(state, executable.initial(), "{ending}");
        // The second rise of the retentive counter, the first one of the other.
        executable.step(&mut scratch, &mut state, &[1], &mut outputs);
        assert_eq!(outputs[0] & 3, 1, "{ending}");
    }
}

#[test]
fn a_program_without_retentive_variables_starts_cold() {
    for (ending, text, _) in PROGRAMS {
        let without = if ending == "st" { "VAR c, d : CTU; END_VAR\n" } else { "\n" };
        let (_, executable) = controller(ending, &text.replace("RETAIN\n", without));
        assert!(!executable.is_retentive(), "{ending}");
        let all = vec![u64::MAX; executable.initial().len()];
        assert_eq!(executable.restarted(&all), executable.initial(), "{ending}");
    }
}
