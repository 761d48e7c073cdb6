//! Petri nets and hybrid controllers as a person meets them.

use std::fs;

use insta::assert_snapshot;
use serde_json::json;

use crate::{empty_folder, understudy, understudy_in};

const NET: &str = "examples/assembly-cell/net.toml";

#[test]
fn from_a_net_to_a_proved_ladder() {
    let folder = empty_folder("petri");
    let file = |name: &str| folder.join(name).display().to_string();
    let bounds = understudy(&["petri", "bounds", NET, "--json"]).json();
    assert_eq!(bounds["result"]["markings"], json!(8));
    assert_eq!(bounds["result"]["safe"], json!(true));
    let (keeper, ladder) = (file("keeper.toml"), file("cell.ladder"));
    let model = "examples/assembly-cell/model.toml";
    let made = ["synth", model, "--reduce", "--name", "keeper", "-o", &keeper, "--json"];
    assert_eq!(understudy(&made).json()["result"]["states"], json!(6));
    let made =
        understudy(&["petri", "ladder", NET, "--supervisor", &keeper, "-o", &ladder, "--json"]);
    assert_eq!(made.json()["result"]["proof"]["never_fired"], json!([]));
    let made = fs::read_to_string(&ladder).expect("a ladder");
    let given = fs::read_to_string("examples/assembly-cell/cell.ladder").expect("a ladder");
    assert_eq!(made, given, "the ladder in examples/assembly-cell is another one");
    for form in [
        ["automaton", "-o", "cell.ADS"],
        ["draw", "-o", "cell.svg"],
        ["reduce", "-o", "small.toml"],
    ] {
        let [operation, option, name] = form;
        let answer = understudy(&["petri", operation, NET, option, &file(name)]);
        assert_eq!(answer.status, 0, "{}", answer.errors);
        assert!(folder.join(name).exists());
    }
}

#[test]
fn what_is_wrong_is_said() {
    let folder = empty_folder("petri_wrong");
    let write = |name: &str, text: &str| fs::write(folder.join(name), text).expect("written");
    write(
        "net.toml",
        "name = \"pump\"\n[[place]]\nname = \"idle\"\ntokens = 1\n[[transition]]\nname = \"start\"\ntakes = \"idel\"\nwhen = \"+full [ key\"\n",
    );
    assert_snapshot!(understudy_in(&folder, &["petri", "bounds", "net.toml"]).shown());
    write(
        "grows.toml",
        "name = \"pump\"\n[[place]]\nname = \"drops\"\n[[transition]]\nname = \"fall\"\ngives = \"drops\"\n",
    );
    assert_snapshot!(understudy_in(&folder, &["petri", "ladder", "grows.toml"]).shown());
    write(
        "model.toml",
        "[[plant]]\nnet = \"grows.toml\"\n[[plant]]\nnet = \"net.toml\"\n[[plant]]\nnet = \"gone.toml\"\n",
    );
    assert_snapshot!(understudy_in(&folder, &["synth", "model.toml"]).shown());
}
