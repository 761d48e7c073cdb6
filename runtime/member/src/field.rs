//! The equipment of a remote I/O, as its process drives it.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use understudy_bus::{FieldDriver, Look};
use understudy_cluster::{Cluster, Side};
use understudy_field::{Device, Look as DeviceLook};
use understudy_wire::{Frame, Image, Moment, ProgramHash, ProgramId};

/// Where the points of the versions of one program are in its device, by the changes that its member has loaded. All clones are of one member.
#[derive(Debug, Clone, Default)]
pub(crate) struct Wirings(Arc<Mutex<Vec<Wiring>>>);

/// The wiring of one version of a program.
#[derive(Debug, Clone)]
struct Wiring {
    program: ProgramId,
    version: ProgramHash,
    inputs: Side,
    outputs: Side,
    fail_safe: Image,
}

/// Wirings that are known, at most: each change has two.
const MOST_WIRINGS: usize = 64;

impl Wirings {
    /// Learns those of a cluster.
    pub(crate) fn learn(&self, cluster: &Cluster) {
        let places = (0..).map(ProgramId).zip(cluster.remote_ios()).zip(cluster.controllers());
        for ((program, remote_io), controller) in places {
            let Some(field) = &remote_io.field else {
                continue;
            };
            let mut known = self.known();
            known.retain(|it| (it.program, it.version) != (program, controller.hash));
            known.push(Wiring {
                program,
                version: controller.hash,
                inputs: field.inputs.clone(),
                outputs: field.outputs.clone(),
                fail_safe: remote_io.fallback.fail_safe.clone(),
            });
            let more = known.len().saturating_sub(MOST_WIRINGS);
            known.drain(..more);
        }
    }

    /// The wiring of a version.
    fn of(&self, program: ProgramId, version: ProgramHash) -> Option<Wiring> {
        let known = self.known();
        known.iter().find(|it| (it.program, it.version) == (program, version)).cloned()
    }

    /// The places of the outputs of a version.
    #[cfg(test)]
    pub(crate) fn outputs(&self, program: ProgramId, version: ProgramHash) -> Option<Side> {
        self.of(program, version).map(|wiring| wiring.outputs)
    }

    fn known(&self) -> MutexGuard<'_, Vec<Wiring>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A device behind a remote I/O, in place of a simulated plant.
pub(crate) struct Equipment {
    device: Device,
    program: ProgramId,
    wirings: Wirings,
    /// The version that the device was wired for last, with the number of that wiring.
    wired: (ProgramHash, u64),
    /// The version by whose points the newest look was read.
    read_by: ProgramHash,
    /// Whether the places of the points that count are not known: nothing is driven or read by wrong ones.
    is_unwired: bool,
}

impl Equipment {
    /// Of a program, whose version is the one with this hash.
    pub(crate) fn new(
        device: Device,
        (program, version): (ProgramId, ProgramHash),
        wirings: Wirings,
    ) -> Self {
        Self { device, program, wirings, wired: (version, 0), read_by: version, is_unwired: false }
    }
}

impl FieldDriver for Equipment {
    fn drive(&mut self, _moment: Moment, outputs: &Image, age: Duration) -> Option<Frame> {
        if !self.is_unwired {
            self.device.drive(outputs, age);
        }
        None
    }

    fn connect(&mut self, connects: bool) {
        self.device.connect(connects);
    }

    fn end_with(&mut self, outputs: &Image) {
        self.device.end_with(outputs);
    }

    fn lay_out(&mut self, version: ProgramHash) {
        let (before, _) = self.wired;
        let old = self.wirings.of(self.program, before);
        let new = self.wirings.of(self.program, version);
        self.is_unwired = old.is_none() || new.is_none();
        if let (Some(old), Some(new)) = (old, new) {
            let number = self.device.rewire(&new.inputs, &new.outputs, &old.fail_safe);
            self.wired = (version, number);
        }
    }

    fn read_by(&mut self) -> Option<ProgramHash> {
        let (version, number) = self.wired;
        let is_new = self.device.looked_by() == number && self.read_by != version;
        is_new.then(|| {
            self.read_by = version;
            version
        })
    }

    fn sense<'frame>(&mut self, _frame: &'frame Frame) -> Option<&'frame Image> {
        None
    }

    fn look(&mut self) -> Option<Look> {
        self.device.look().map(|look| match look {
            _ if self.is_unwired => Look::Lost("the places of its points are not known".into()),
            DeviceLook::Sensors(sensors) => Look::Sensors(sensors),
            DeviceLook::Lost(reason) => Look::Lost(reason),
        })
    }

    fn contested(&mut self) -> Option<bool> {
        self.device.contested()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PROGRAM: ProgramId = ProgramId(0);

    /// A cluster whose device takes no connection.
    fn cluster(outputs: &str, places: &str) -> Cluster {
        let text = format!(
            "[cluster]\nname = \"line\"\nsecurity = \"off\"\n[[controller]]\nname = \"tank\"\nladder = \"tank.st\"\n\
             [[remote_io]]\ncontroller = \"tank\"\nfail_safe = {{ valve = true }}\n[remote_io.field]\n\
             modbus = \"127.0.0.1:9\"\ninputs = {{ low = \"discrete:0\" }}\noutputs = {{ {places} }}\n"
        );
        let program = format!(
            "PROGRAM tank\nVAR_INPUT low : BOOL; END_VAR\nVAR_OUTPUT {outputs} : BOOL; END_VAR\nvalve := low;\nEND_PROGRAM"
        );
        let loaded = understudy_cluster::read("cluster.toml", &text, &mut |_| Ok(program.clone()));
        loaded.cluster.unwrap_or_else(|| panic!("{:?}", loaded.reports))
    }

    fn equipment(cluster: &Cluster, wirings: &Wirings) -> Equipment {
        let remote_io = &cluster.remote_ios()[0];
        let field = remote_io.field.clone().expect("it has a device");
        let fail_safe = remote_io.fallback.fail_safe.clone();
        let device = Device::start(field, fail_safe, Duration::from_millis(10), false);
        let version = cluster.controllers()[0].hash;
        Equipment::new(device.expect("a thread"), (PROGRAM, version), wirings.clone())
    }

    #[test]
    fn a_device_is_wired_for_versions_that_were_learned_and_for_no_other() {
        let before = cluster("valve", "valve = \"coil:1\"");
        let after = cluster("lamp, valve", "valve = \"coil:2\", lamp = \"coil:1\"");
        let [old, new] = [&before, &after].map(|it| it.controllers()[0].hash);
        let wirings = Wirings::default();
        wirings.learn(&before);
        let mut equipment = equipment(&before, &wirings);
        let lost = Some(Look::Lost("the places of its points are not known".to_owned()));
        let look = |equipment: &mut Equipment| {
            std::iter::repeat_with(|| equipment.look()).find(Option::is_some).flatten()
        };
        equipment.lay_out(new);
        assert_eq!(look(&mut equipment), lost);
        assert_eq!((equipment.wired, equipment.read_by()), ((old, 0), None));
        wirings.learn(&after);
        equipment.lay_out(new);
        assert_eq!(equipment.wired, (new, 1));
        assert_ne!(look(&mut equipment), lost);
    }
}
