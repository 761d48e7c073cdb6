//! A cluster that `init --from` drafts of a program with numbers runs on processes as it is.

use crate::shared::{answer, empty_folder, some_at_a_time};
use crate::{PERIOD, no_orphan};

#[test]
fn drafted_programs_with_numbers_run() {
    let _one = some_at_a_time();
    for program in ["heated-tank/level", "tennessee-eastman/reactor"] {
        let folder = empty_folder(&format!("draft_{}", program.replace('/', "_")));
        let text = folder.to_str().expect("text");
        let file = format!("examples/{program}.st");
        let (status, document, errors) = answer(&["init", text, "--from", &file]);
        assert_eq!(status, 0, "{document:#}\n{errors}");
        let cluster = format!("{text}/cluster.toml");
        let out = format!("{text}/runs");
        let run = ["lab", &cluster, "--cycles", "60", "--link", "udp", "--period", PERIOD];
        let (_, document, errors) = answer(&[&run[..], &["--out", &out]].concat());
        no_orphan(&folder.join("runs"));
        let summary = &document["result"]["summary"];
        assert_eq!(summary["violation_count"], 0, "{document:#}\n{errors}");
        assert_eq!(summary["cycles_run"], 60, "{document:#}\n{errors}");
    }
}
