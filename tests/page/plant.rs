//! The page of a plant from outside: groups that two laboratories run, and the page of each of them.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::time::Instant;

use serde_json::Value;

use crate::browser::{browser, drive_page};
use crate::shared::DEADLINE;
use crate::{Page, empty_folder, one_at_a_time, understudy};

/// A laboratory, ended when this is dropped.
struct Laboratory(Child);

impl Drop for Laboratory {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The plant of the example at a period that a busy machine keeps.
fn plant(folder: &Path) -> PathBuf {
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/shared-spare");
    for group in ["line-1", "line-2"] {
        let (from, to) = (example.join(group), folder.join(group));
        fs::create_dir_all(&to).expect("a folder");
        for ladder in ["robot.ladder", "press.ladder"] {
            fs::copy(from.join(ladder), to.join(ladder)).expect("an example");
        }
        let cluster = fs::read_to_string(from.join("cluster.toml")).expect("an example");
        let cluster = cluster.replace("period = \"10ms\"", "period = \"50ms\"\nlink = \"udp\"");
        fs::write(to.join("cluster.toml"), cluster).expect("written");
    }
    fs::copy(example.join("plant.toml"), folder.join("plant.toml")).expect("an example");
    folder.join("plant.toml")
}

/// The laboratory of a group in which the robot crashes.
fn laboratory(folder: &Path, group: &str) -> Laboratory {
    let scenario = folder.join(format!("{group}.scenario.toml"));
    let steps = "[[step]]\nat = 20\naction = \"crash\"\nstation = \"robot\"\n";
    fs::write(&scenario, format!("title = \"a crash\"\ncycles = 100000\n{steps}"))
        .expect("written");
    let mut command = understudy(&["lab"]);
    command.arg(folder.join(group).join("cluster.toml"));
    command.arg("--scenario").arg(scenario).arg("--out").arg(folder.join("runs"));
    let errors = fs::File::create(folder.join(format!("{group}.errors"))).expect("a file");
    let child = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(errors).spawn();
    Laboratory(child.expect("the binary is built"))
}

#[test]
fn the_page_of_a_plant_names_each_unprotected_group_and_links_to_it() {
    let _turn = one_at_a_time();
    let folder = empty_folder("plant-page");
    let file = plant(&folder);
    let _running = ["line-1", "line-2"].map(|group| laboratory(&folder, group));
    let mut command = understudy(&["watch", "--address", "127.0.0.1:0"]);
    command.arg(file).arg("--out").arg(folder.join("runs"));
    let page = Page::start(command);
    let begun = Instant::now();
    let plant = loop {
        let plant = page.get("/api/plant").json();
        let states = plant["groups"].as_array().expect("groups").iter();
        if states.map(|group| &group["state"]).all(|state| state == "unprotected") {
            break plant;
        }
        assert!(begun.elapsed() < DEADLINE, "{plant}");
        std::thread::sleep(std::time::Duration::from_millis(100));
    };
    for group in ["line-1", "line-2"] {
        let alarm = format!("{group} is UNPROTECTED (failed: robot)");
        let alarms = plant["alarms"].as_array().expect("alarms");
        let is_named = |alarm: &str| {
            alarms.iter().any(|it| it["text"].as_str().is_some_and(|text| text.starts_with(alarm)))
        };
        assert!(is_named(&alarm), "{plant}");
        assert_eq!(page.get(&format!("/group/{group}")).status, 308);
        // The journal of a group is read when its page is opened.
        loop {
            let run = page.get(&format!("/group/{group}/api/run")).json();
            if run["cluster"] == group {
                break;
            }
            assert!(begun.elapsed() < DEADLINE, "{run}");
            std::thread::sleep(std::time::Duration::from_millis(100));
        }
        // A path with parts of its own; while the journal is being read, its answer is that.
        loop {
            let ladder = page.get(&format!("/group/{group}/api/ladder/0"));
            if ladder.status == 200 {
                break;
            }
            assert_eq!(ladder.json()["error"]["code"], "U0688");
            assert!(begun.elapsed() < DEADLINE, "{group}");
            std::thread::sleep(std::time::Duration::from_millis(100));
        }
        let command = r#"{"member":"press","command":{"command":"kill"},"owner":"a","reason":"b"}"#;
        let refused = page.post(&format!("/group/{group}/api/command"), command);
        assert!((400..500).contains(&refused.status), "{}", refused.status);
    }
    assert_eq!(page.get("/group/line-3/").status, 404);
    assert_ne!(plant["spares"][0]["state"], Value::from("asleep"));
    if let Some(browser) = browser() {
        drive_page(&browser, &page, &folder, "plant.mjs", Vec::new());
    }
}
