//! Reading clusters from texts in memory.

use understudy_cluster::{Cluster, Loaded, Overrides, TemplateFile, read_with};
use understudy_executable::Scratch;
use understudy_plant::Plant;
use understudy_text::Report;
use understudy_wire::{Image, ProgramId};

/// Reads `cluster`; ladders come from `files`.
pub(crate) fn load(cluster: &str, files: &[(&str, &str)]) -> Loaded {
    load_with(cluster, files, Overrides::default())
}

/// As [`load`], with values replaced.
pub(crate) fn load_with(cluster: &str, files: &[(&str, &str)], overrides: Overrides) -> Loaded {
    let mut open = |name: &str| {
        let found = files.iter().find(|(file, _)| *file == name);
        found.map(|(_, text)| (*text).to_owned()).ok_or_else(|| "no such file".to_owned())
    };
    read_with("cluster.toml", cluster, overrides, &mut open)
}

/// The ladders among files that come with the program, and the cluster file.
pub(crate) fn split(files: &[TemplateFile]) -> (&'static str, Vec<(&'static str, &'static str)>) {
    let cluster = files.iter().find(|file| file.name == "cluster.toml");
    let ladders = files.iter().map(|file| (file.name, file.text)).collect();
    (cluster.expect("there is a cluster file").text, ladders)
}

/// `file:line:column severity code message | label | help`, line by line.
pub(crate) fn findings(reports: &[Report]) -> String {
    let mut lines = Vec::new();
    for report in reports {
        for diagnostic in &report.diagnostics {
            let place = report.line_and_column(diagnostic.span.start);
            let severity = format!("{:?}", diagnostic.severity).to_lowercase();
            let mut line = format!(
                "{}:{place} {severity} {} {}",
                report.name, diagnostic.code, diagnostic.message
            );
            for part in [&diagnostic.label, &diagnostic.help].into_iter().flatten() {
                line.push_str("\n    ");
                line.push_str(part);
            }
            for related in &diagnostic.related {
                let place = report.line_and_column(related.span.start);
                line.push_str(&format!("\n    {place}: {}", related.message));
            }
            lines.push(line);
        }
    }
    lines.join("\n")
}

/// Closes the loop without a network, each plant feeding the next; answers with finished parts and plant faults of each plant.
pub(crate) fn run(cluster: &Cluster, cycles: usize) -> Vec<(u64, u64)> {
    let count = cluster.controllers().len();
    let mut plants: Vec<Plant> = (0..count)
        .map(|index| {
            let settings = cluster.plant_settings(ProgramId(index as u8));
            settings.expect("each program has a plant").plant
        })
        .collect();
    let mut fields: Vec<_> = plants.iter().map(Plant::field).collect();
    let mut states: Vec<Image> = cluster
        .programs()
        .iter()
        .map(|program| {
            let width = program.executable.state_count();
            Image::from_words(width, program.executable.initial()).expect("in bounds")
        })
        .collect();
    let mut scratch = Scratch::default();
    for _ in 0..cycles {
        let mut arrived = 0;
        for (index, program) in cluster.programs().iter().enumerate() {
            let mut outputs = Image::zero(program.executable.output_count());
            program.executable.step(
                &mut scratch,
                states[index].words_mut(),
                fields[index].sensors.words(),
                outputs.words_mut(),
            );
            let before = fields[index].handed_over;
            fields[index] = plants[index].step(&outputs, arrived);
            arrived = fields[index].handed_over - before;
        }
    }
    let counts = |field: &understudy_wire::Field| (field.finished, field.plant_faults);
    fields.iter().map(counts).collect()
}
