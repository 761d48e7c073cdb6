//! `understudy scan`.

use std::fs;

use crate::understudy;

/// Outputs of the examples with numbers, bit for bit, as they were on x86-64 and on aarch64 (docs/evidence/performance.md).
#[test]
fn digests_of_numeric_programs_are_those_of_every_processor() {
    let mut lines = Vec::new();
    for example in ["heated-tank", "modbus-level", "tennessee-eastman", "two-shuttles"] {
        let folder = format!("{}/examples/{example}", env!("CARGO_MANIFEST_DIR"));
        let files = fs::read_dir(folder).expect("a folder");
        let names = files.map(|file| file.expect("a file").file_name());
        let mut names: Vec<String> = names.filter_map(|name| name.into_string().ok()).collect();
        names.retain(|name| name.ends_with(".st"));
        names.sort();
        for name in names {
            let file = format!("examples/{example}/{name}");
            let answer = understudy(&["scan", &file, "--digest", "1000"]);
            assert_eq!(answer.status, 0, "{file}\n{}", answer.errors);
            lines.push(format!("{file}: {}", answer.output.trim_end()));
        }
    }
    insta::assert_snapshot!(lines.join("\n"));
}
