//! `understudy keys`, and members that are started with the wrong ones.

use std::fs;
use std::os::unix::fs::PermissionsExt;

use super::{addressed_cell, answer, codes, empty_folder, some_at_a_time, text};

#[test]
fn keys_are_made_listed_revoked_and_made_again() {
    let _one = some_at_a_time();
    let folder = empty_folder("life_of_keys");
    let cluster = addressed_cell(&folder);
    let keys = folder.join("keys");
    let (cluster, keys) = (text(&cluster), text(&keys));

    let (status, made, _) = answer(&["keys", "init", cluster, "--folder", keys, "--days", "90"]);
    assert_eq!(status, 0, "{made:#}");
    assert_eq!(made["result"]["holders"].as_array().map(Vec::len), Some(8));
    assert_eq!(made["result"]["folders"].as_array().map(Vec::len), Some(8));
    let again = answer(&["keys", "init", cluster, "--folder", keys]);
    assert_eq!((again.0, codes(&again.1)), (2, vec!["U0904"]));

    let (status, revoked, _) = answer(&["keys", "revoke", "press", "--folder", keys]);
    assert_eq!(status, 0, "{revoked:#}");
    let state = |name: &str| {
        let (status, list, _) = answer(&["keys", "list", "--folder", keys]);
        assert_eq!(status, 0, "{list:#}");
        let holders = list["result"]["holders"].as_array().expect("a list").clone();
        let found = holders.iter().find(|holder| holder["name"] == name);
        let found = found.expect("it was issued keys").clone();
        (found["state"].as_str().map(str::to_owned), found["generation"].as_u64())
    };
    assert_eq!(state("press"), (Some("revoked".into()), Some(1)));
    assert_eq!(state("robot"), (Some("valid".into()), Some(1)));

    let press = format!("{keys}/members/press");
    let started = answer(&["node", cluster, "--name", "press", "--keys", &press]);
    assert_eq!((started.0, codes(&started.1)), (2, vec!["U0909"]));

    let (status, issued, _) = answer(&["keys", "issue", cluster, "press", "--folder", keys]);
    assert_eq!(status, 0, "{issued:#}");
    assert_eq!(state("press"), (Some("valid".into()), Some(2)));
    let wrong = answer(&["keys", "revoke", "press", "nobody", "noone", "--folder", keys]);
    assert_eq!((wrong.0, codes(&wrong.1)), (2, vec!["U0907", "U0907"]));
    assert_eq!(state("press").0.as_deref(), Some("valid"), "all or nothing");
}

#[test]
fn a_member_without_its_own_keys_does_not_start() {
    let _one = some_at_a_time();
    let folder = empty_folder("wrong_keys");
    let cluster = addressed_cell(&folder);
    let keys = folder.join("keys");
    let (cluster, keys) = (text(&cluster), text(&keys));
    let (status, made, _) = answer(&["keys", "init", cluster, "--folder", keys]);
    assert_eq!(status, 0, "{made:#}");
    let node = |more: &[&str]| {
        let (status, document, _) = answer(&[&["node", cluster, "--name", "robot"], more].concat());
        let codes = codes(&document).into_iter().map(str::to_owned).collect::<Vec<_>>();
        (status, codes)
    };
    let of = |name: &str| format!("{keys}/members/{name}");
    assert_eq!(node(&[]), (2, vec!["U0620".to_owned()]));
    assert_eq!(node(&["--keys", &of("press")]), (2, vec!["U0910".to_owned()]));
    assert_eq!(node(&["--keys", &of("engineer")]), (2, vec!["U0910".to_owned()]));
    let secret = format!("{}/keys.toml", of("robot"));
    fs::set_permissions(&secret, fs::Permissions::from_mode(0o640)).expect("it is ours");
    assert_eq!(node(&["--keys", &of("robot")]), (2, vec!["U0903".to_owned()]));
    fs::remove_file(&secret).expect("it is ours");
    assert_eq!(node(&["--keys", &of("robot")]), (2, vec!["U0901".to_owned()]));
}
