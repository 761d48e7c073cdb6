//! Clusters that come with the program: the press cell of section V, and a small one to begin with.

use crate::read::{Loaded, Overrides, read_with};

/// A file of a cluster that comes with the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TemplateFile {
    /// Its name, without folders.
    pub name: &'static str,
    /// Its text.
    pub text: &'static str,
}

macro_rules! files {
    ($folder:literal: $($name:literal),* $(,)?) => {
        &[$(TemplateFile { name: $name, text: include_str!(concat!($folder, $name)) }),*]
    };
}

/// Reads the text of a cluster file whose programs are among some files.
pub fn read_with_files(text: &str, files: &[TemplateFile], overrides: Overrides) -> Loaded {
    read_with("cluster.toml", text, overrides, &mut |name| {
        let file = files.iter().find(|file| file.name == name);
        let text = file.map(|file| file.text.to_owned());
        text.ok_or_else(|| "no such file".to_owned())
    })
}

/// The robot and the press of section V, with the ladders of their working reading.
pub fn press_cell() -> &'static [TemplateFile] {
    files!("../../../examples/press-cell/": "cluster.toml", "robot.ladder", "press.ladder")
}

/// One program and one understudy.
pub fn minimal() -> &'static [TemplateFile] {
    files!("../template/minimal/": "cluster.toml", "pump.ladder", "sump.ladder", "kill.toml")
}

/// A tank behind a Modbus TCP device, with a simulation of the device, and the press of section V.
pub fn modbus_cell() -> &'static [TemplateFile] {
    files!("../../../examples/modbus-cell/":
        "cluster.toml",
        "tank.ladder",
        "press.ladder",
        "device.py",
        "kill.toml",
    )
}

/// A tank that fills boxes and a conveyor, with plants that are ladders, a scenario and a page to begin with.
pub fn template() -> &'static [TemplateFile] {
    files!("../template/":
        "README.md",
        "cluster.toml",
        "tank.ladder",
        "conveyor.ladder",
        "tank-plant.ladder",
        "conveyor-plant.ladder",
        "kill.toml",
    )
}
