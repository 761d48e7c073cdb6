//! The equipment of a remote I/O, as its process drives it.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use understudy_bus::{FieldDriver, Look};
use understudy_cluster::{ChangedPoints, Cluster, Side};
use understudy_field::{Device, Look as DeviceLook};
use understudy_wire::{Frame, Image, Member, Moment, ProgramHash, ProgramId};

/// Where the points of the versions of one program are in its device, by the changes that its member has loaded. All clones are of one member.
#[derive(Debug, Clone)]
pub(crate) struct Wirings {
    /// That of the remote I/O; nothing for a station or a plant.
    program: Option<ProgramId>,
    known: Arc<Mutex<Vec<Wiring>>>,
}

/// The wiring of one version of the program.
#[derive(Debug, Clone)]
struct Wiring {
    version: ProgramHash,
    inputs: Side,
    outputs: Side,
    fail_safe: Image,
}

/// Why nothing is read or driven.
const UNKNOWN_PLACES: &str = "U0650: the places of its inputs and outputs are not known";

/// Wirings that are known, at most: each change has two.
const MOST_WIRINGS: usize = 64;

impl Wirings {
    /// None are known yet. `member` is that of the process.
    pub(crate) fn new(member: Member) -> Self {
        Self { program: member.sampled_program(), known: Arc::default() }
    }

    /// The program of the remote I/O.
    pub(crate) fn program(&self) -> Option<ProgramId> {
        self.program
    }

    /// Whether a change of these points concerns the device.
    pub(crate) fn are_of(&self, changed: &ChangedPoints) -> bool {
        self.program == Some(changed.program)
    }

    /// Learns that of a cluster.
    pub(crate) fn learn(&self, cluster: &Cluster) {
        let Some(place) = self.program.map(ProgramId::index) else {
            return;
        };
        let places = (cluster.remote_ios().get(place), cluster.controllers().get(place));
        let (Some(remote_io), Some(controller)) = places else {
            return;
        };
        let Some(field) = &remote_io.field else {
            return;
        };
        let mut known = self.known();
        known.retain(|it| it.version != controller.hash);
        known.push(Wiring {
            version: controller.hash,
            inputs: field.inputs.clone(),
            outputs: field.outputs.clone(),
            fail_safe: remote_io.fallback.fail_safe.clone(),
        });
        let more = known.len().saturating_sub(MOST_WIRINGS);
        known.drain(..more);
    }

    /// The wiring of a version.
    fn of(&self, version: ProgramHash) -> Option<Wiring> {
        self.known().iter().find(|it| it.version == version).cloned()
    }

    /// The places of the outputs of a version.
    #[cfg(test)]
    pub(crate) fn outputs(&self, version: ProgramHash) -> Option<Side> {
        self.of(version).map(|wiring| wiring.outputs)
    }

    fn known(&self) -> MutexGuard<'_, Vec<Wiring>> {
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A device behind a remote I/O, in place of a simulated plant.
pub(crate) struct Equipment {
    device: Device,
    wirings: Wirings,
    /// The version that the device was wired for last, with the number of that wiring.
    wired: (ProgramHash, u64),
    /// The version by whose points the newest look was read.
    read_by: ProgramHash,
    /// Whether the places of the points that count are not known: nothing is driven or read by wrong ones.
    is_unwired: bool,
}

impl Equipment {
    /// Wired for the version of the program with this hash.
    pub(crate) fn new(device: Device, version: ProgramHash, wirings: Wirings) -> Self {
        Self { device, wirings, wired: (version, 0), read_by: version, is_unwired: false }
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
        let old = self.wirings.of(before);
        let new = self.wirings.of(version);
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
            _ if self.is_unwired => Look::Lost(UNKNOWN_PLACES.to_owned()),
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
        Equipment::new(device.expect("a thread"), version, wirings.clone())
    }

    #[test]
    fn a_device_is_wired_for_versions_that_were_learned_and_for_no_other() {
        let before = cluster("valve", "valve = \"coil:1\"");
        let after = cluster("lamp, valve", "valve = \"coil:2\", lamp = \"coil:1\"");
        let [old, new] = [&before, &after].map(|it| it.controllers()[0].hash);
        let wirings = Wirings::new(Member::RemoteIo(ProgramId(0)));
        wirings.learn(&before);
        let mut equipment = equipment(&before, &wirings);
        let lost = Some(Look::Lost(UNKNOWN_PLACES.to_owned()));
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
