//! What `init` writes: it loads without a word, and it works.

use crate::common::{findings, load, run, split};
use understudy_cluster::template;

#[test]
fn the_filling_line_loads_and_fills_boxes() {
    let (cluster, ladders) = split(template());
    let loaded = load(cluster, &ladders);
    assert_eq!(findings(&loaded.reports), "");
    assert_eq!(loaded.reports.len(), 5);
    let cluster = loaded.cluster.expect("nothing is wrong with it");
    assert_eq!(run(&cluster, 700), [(10, 0), (9, 0)]);
}
