//! The schema describes what the reader takes.

use understudy_cluster::schema;

#[test]
fn the_schema_as_it_is_published() {
    let text = serde_json::to_string_pretty(&schema()).expect("it is JSON");
    insta::assert_snapshot!(text);
}
