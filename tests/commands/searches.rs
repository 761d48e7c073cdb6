//! Searches that spread: a store that processes share and are killed at, shards of a model check, and the job files for clusters of computers.

#![allow(
    clippy::disallowed_methods,
    reason = "processes are killed at random times of the real clock"
)]

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use understudy_testing::skip;

use crate::{Answer, empty_folder, understudy};

const PRESS_CELL: &str = "examples/press-cell/cluster.toml";

/// Seeds of the store; its runs hold cycles, so that there are failures to keep.
const SEEDS: &str = "12";
const CAMPAIGN: [&str; 12] = [
    "campaign",
    PRESS_CELL,
    "--cycles",
    "150",
    "--runs",
    "6",
    "--property",
    "held",
    "--faults",
    "isolation,loss,crash",
    "--jobs",
    "1",
];

fn text(path: &Path) -> &str {
    path.to_str().expect("text")
}

fn with_store(store: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_understudy"));
    command
        .args(CAMPAIGN)
        .args(["--forever", text(store), "--seeds", SEEDS])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    command
}

fn started(store: &Path) -> Child {
    with_store(store).spawn().expect("the binary is built")
}

/// Whether a store has the findings of a seed.
fn has_findings(store: &Path) -> bool {
    let names = fs::read_dir(store).into_iter().flatten().flatten();
    names.map(|entry| entry.file_name()).any(|name| name.to_string_lossy().starts_with("seeds-"))
}

fn findings(out: &Path) -> String {
    fs::read_to_string(out.join("campaign.json")).expect("findings")
}

/// Processes on two folders, two at a time on one of them, killed at any moment: what they find together is what one process finds that is left alone.
/// `UNDERSTUDY_KILLS` is the number of kills.
#[test]
fn killed_processes_on_two_stores_find_what_one_process_finds() {
    let kills: u64 =
        std::env::var("UNDERSTUDY_KILLS").ok().and_then(|kills| kills.parse().ok()).unwrap_or(10);
    let folder = empty_folder("campaign_stores");
    let path = |name: &str| folder.join(name);
    let alone = with_store(&path("alone")).args(["--out", text(&path("expected"))]).status();
    assert_eq!(alone.expect("it runs").code(), Some(4), "runs with held cycles are found");

    let (first, second) = (path("first"), path("second"));
    let mut steady = started(&first);
    // A fixed sequence of times, from none to most of a process; each process has seeds that it draws.
    let mut time = 17_u64;
    for _ in 0..kills {
        time = (time * 7_919 + 104_729) % 1_000;
        let (mut one, mut other) = (started(&second), started(&first));
        std::thread::sleep(Duration::from_millis(time));
        for process in [&mut one, &mut other] {
            // It may have ended by itself.
            let _ = process.kill();
            process.wait().expect("it ends");
        }
    }
    // On a busy machine it may not have finished a seed yet, and a folder without findings is not merged.
    while !has_findings(&first) && steady.try_wait().expect("it is ours").is_none() {
        std::thread::sleep(Duration::from_millis(10));
    }
    steady.kill().expect("it is ours");
    steady.wait().expect("it ends");
    let merged = path("merged");
    let merge = || {
        let out = ["--out", text(&merged), "--json"];
        let answer =
            understudy(&[&["campaign", "merge", text(&first), text(&second)][..], &out].concat());
        assert_eq!(answer.errors, "", "{}", answer.output);
        answer.json()["result"]["findings"]["seeds"].clone()
    };
    // Seeds that every process was killed at are left: they are run into the folder that has them not.
    merge();
    let last = with_store(&second).status().expect("it runs");
    assert_eq!(last.code(), Some(4));
    assert_eq!(merge(), serde_json::json!([[0, 11]]));
    assert_eq!(findings(&merged), findings(&path("expected")));
    let page = fs::read_to_string(merged.join("campaign.html")).expect("a page");
    assert!(page.contains("[[step]]"));
}

#[test]
fn each_kept_failure_of_a_store_is_a_scenario_that_fails_again() {
    let folder = empty_folder("campaign_store");
    let (store, out) = (folder.join("store"), folder.join("found"));
    let more = ["--forever", text(&store), "--seeds", "3", "--out", text(&out), "--json"];
    let answer = understudy(&[&CAMPAIGN[..], &more].concat());
    assert_eq!(answer.status, 4, "{}", answer.errors);
    let result = &answer.json()["result"];
    assert_eq!(result["findings"]["runs_made"], 18, "{result}");
    let scenarios = result["scenarios"].as_array().expect("a list");
    assert!(!scenarios.is_empty());
    for scenario in scenarios {
        let path = scenario.as_str().expect("a path");
        let again = understudy(&["simulate", PRESS_CELL, "--scenario", path]);
        assert_eq!(again.status, 1, "{path}: {}", again.output);
    }
    // A store that is complete has nothing more to run.
    let again = understudy(&[&CAMPAIGN[..], &more].concat());
    assert_eq!(again.json()["result"]["findings"], result["findings"]);
}

#[test]
fn stores_of_other_campaigns_are_refused() {
    let folder = empty_folder("campaign_store_refused");
    let store = folder.join("store");
    let run = |arguments: &[&str]| understudy(&[&["campaign"], arguments].concat());
    let base =
        [PRESS_CELL, "--forever", text(&store), "--seeds", "1", "--runs", "1", "--jobs", "1"];
    assert_eq!(run(&base).status, 0);
    let check = |answer: Answer, expected: &[&str]| {
        assert_eq!(answer.status, 2, "{}", answer.shown());
        for expected in expected {
            assert!(answer.errors.contains(expected), "{expected}: {}", answer.errors);
        }
    };
    // All differences at once.
    let other = run(&[&base[..], &["--cycles", "160", "--property", "held"]].concat());
    check(other, &["error[U0628]", "--cycles is 200 there and 160 here", "--property is wrong"]);
    let cluster = ["examples/boiler/cluster.toml"];
    check(run(&[&cluster[..], &base[1..]].concat()), &["error[U0628]", "the cluster is"]);
    let path = store.join("store.json");
    let header = fs::read_to_string(&path).expect("text");
    let version = concat!("\"version\": \"", env!("CARGO_PKG_VERSION"), "\"");
    assert!(header.contains(version), "{header}");
    fs::write(&path, header.replace(version, "\"version\": \"0.0.1\"")).expect("written");
    check(run(&base), &["error[U0628]", "the version is 0.0.1 there"]);
    fs::write(&path, "{}").expect("written");
    check(run(&base), &["error[U0629]"]);
    check(run(&["merge", text(&store)]), &["error[U0629]"]);
    check(run(&["merge", "nowhere", "neither"]), &["nowhere", "neither"]);
    check(run(&[PRESS_CELL, "--forever", "x", "--seed", "1"]), &["error[U0600]"]);
    check(run(&[PRESS_CELL, "--seeds", "1"]), &["error[U0600]"]);
    check(run(&[PRESS_CELL, "--forever", "docs"]), &["error[U0629]", "is not a store"]);
}

#[test]
fn shards_of_a_model_check_are_the_whole() {
    let folder = empty_folder("model_check_shards");
    let check = |arguments: &[&str]| understudy(&[&["model-check"], arguments].concat());
    let asked = [PRESS_CELL, "--cycles", "1", "--kinds", "crash,stop"];
    let shard = |shard: &str, out: &str, more: &[&str]| {
        let out = folder.join(out);
        let part = ["--shard", shard, "--out", text(&out)];
        let answer = check(&[&asked[..], &part, more].concat());
        assert_eq!(answer.status, 0, "{}", answer.shown());
        out.to_str().expect("text").to_owned()
    };
    let parts = [shard("2/2", "two", &[]), shard("1/2", "one", &[])];
    let merged = check(&["merge", &parts[0], &parts[1], "--json"]);
    assert_eq!(merged.status, 0, "{}", merged.shown());
    let whole = check(&[&asked[..], &["--json"]].concat());
    let (merged, whole) = (merged.json()["result"].clone(), whole.json()["result"].clone());
    assert_eq!(merged["properties"], whole["properties"]);
    assert!(merged["states"].as_u64() >= whole["states"].as_u64(), "{merged} {whole}");
    let refused = |arguments: &[&str], expected: &[&str]| {
        let answer = check(&[&["merge"], arguments].concat());
        assert_eq!(answer.status, 2, "{}", answer.shown());
        for expected in expected {
            assert!(answer.errors.contains(expected), "{expected}: {}", answer.errors);
        }
    };
    refused(&[&parts[0]], &["error[U0611]", "1 of 2 shards are missing: 1"]);
    refused(&[&parts[0], &parts[0]], &["are both shard 2/2", "are missing: 1"]);
    let other = shard("1/2", "other", &["--faults", "0"]);
    refused(&[&parts[0], &other], &["error[U0611]", "--faults differs"]);
    refused(&["nowhere", "neither"], &["nowhere", "neither"]);
    fs::write(folder.join("one/model-check.json"), "{\"format\": 9}").expect("written");
    refused(&[&parts[1]], &["error[U0610]", "it has format 9, and 1 is expected"]);
}

/// What a job file runs, as JSON: reads it with a parser of its format and holds it against the rules of an indexed job.
const JOB: &str = r#"
import json, sys, yaml
job, = yaml.safe_load_all(open(sys.argv[1]))
spec = job["spec"]
pod = spec["template"]["spec"]
assert (job["apiVersion"], job["kind"]) == ("batch/v1", "Job")
assert spec["completionMode"] == "Indexed" and spec["parallelism"] <= spec["completions"]
# Both need an indexed job; FailIndex needs a back-off per index, and a policy needs pods that are not restarted in place.
assert spec["backoffLimitPerIndex"] >= 1 and 0 < spec["maxFailedIndexes"] <= spec["completions"]
assert "backoffLimit" not in spec and pod["restartPolicy"] == "Never"
container, = pod["containers"]
named = {rule["onExitCodes"]["containerName"] for rule in spec["podFailurePolicy"]["rules"] if "onExitCodes" in rule}
assert named == {container["name"]}
volumes = {volume["name"] for volume in pod["volumes"]}
assert volumes == {mount["name"] for mount in container["volumeMounts"]}
print(json.dumps({"command": container["command"] + container["args"], "completions": spec["completions"],
                  "env": {it["name"]: it["value"] for it in container["env"]}}))
"#;

/// The job files run as their schedulers run them: with the variables that these set, and a cluster and folders of the test.
#[test]
fn job_files_run() {
    let available = Command::new("python3").args(["-c", "import yaml"]).output();
    if !available.is_ok_and(|output| output.status.success()) {
        skip("python3 with yaml is not installed");
        return;
    }
    let folder = empty_folder("job_files");
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let binaries = Path::new(env!("CARGO_BIN_EXE_understudy")).parent().expect("a folder");
    let path = format!("{}:{}", text(binaries), std::env::var("PATH").expect("a path"));
    let (store, parts) = (folder.join("store"), folder.join("parts"));
    let run = |command: &mut Command, more: &[(&str, &str)]| {
        let output = command
            .current_dir(root)
            .env("PATH", &path)
            .envs([("CLUSTER", PRESS_CELL), ("JOBS", "1"), ("SLURM_CPUS_PER_TASK", "1")])
            .envs([("STORE", text(&store)), ("OUT", text(&parts)), ("BUDGET", "1ms")])
            .envs([
                ("FAULTS", "0"),
                ("CYCLES", "1"),
                ("SHARDS", "2"),
                ("SLURM_ARRAY_TASK_COUNT", "2"),
            ])
            .envs(more.iter().copied())
            .output()
            .expect("it runs");
        let errors = String::from_utf8_lossy(&output.stderr).into_owned();
        (output.status.code(), errors)
    };
    let job = |name: &str| -> serde_json::Value {
        let file = root.join("deployment/searches").join(name);
        let output = Command::new("python3").args(["-c", JOB, text(&file)]).output();
        let output = output.expect("python3 runs");
        let errors = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{name}: {errors}");
        serde_json::from_slice(&output.stdout).expect("JSON")
    };
    let of_job = |job: &serde_json::Value, index: &str| {
        let words = job["command"].as_array().expect("a list");
        let words: Vec<&str> = words.iter().map(|word| word.as_str().expect("text")).collect();
        let mut command = Command::new(words[0]);
        command.args(&words[1..]).env("JOB_COMPLETION_INDEX", index);
        command
    };
    let (campaign, model_check) = (job("campaign.yaml"), job("model-check.yaml"));
    let shards = model_check["env"]["SHARDS"].as_str().expect("text").to_owned();
    assert_eq!(shards, model_check["completions"].to_string(), "one shard for each index");
    let slurm = |name: &str, task: &str| {
        let mut command = Command::new("bash");
        command.arg(root.join("deployment/searches").join(name)).env("SLURM_ARRAY_TASK_ID", task);
        command
    };
    assert_eq!(run(&mut slurm("campaign.sbatch", "1"), &[]).0, Some(0));
    assert_eq!(run(&mut of_job(&campaign, "0"), &[]).0, Some(0));
    assert!(store.join("store.json").exists());
    let merged =
        || understudy(&["model-check", "merge", text(&parts.join("0")), text(&parts.join("1"))]);
    for index in ["0", "1"] {
        let (status, errors) = run(&mut of_job(&model_check, index), &[]);
        assert_eq!(status, Some(0), "{errors}");
    }
    assert_eq!(merged().status, 0, "{}", merged().shown());
    fs::remove_dir_all(&parts).expect("its own");
    for task in ["1", "2"] {
        let mut command = slurm("model-check.sbatch", task);
        let (status, errors) = run(command.args(["--faults", "0", "--cycles", "1"]), &[]);
        assert_eq!(status, Some(0), "{errors}");
    }
    let merged =
        understudy(&["model-check", "merge", text(&parts.join("1")), text(&parts.join("2"))]);
    assert_eq!(merged.status, 0, "{}", merged.shown());
    // An error of the command is one of the job: status 2 is not tried again.
    for mut command in [
        of_job(&campaign, "0"),
        of_job(&model_check, "0"),
        slurm("campaign.sbatch", "1"),
        slurm("model-check.sbatch", "1"),
    ] {
        let (status, errors) =
            run(&mut command, &[("STORE", "docs"), ("SHARDS", "0"), ("SLURM_ARRAY_TASK_ID", "9")]);
        assert_eq!(status, Some(2), "{errors}");
    }
}
