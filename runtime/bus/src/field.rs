//! What stands between a remote I/O and its sensors and actuators.

pub(crate) mod silence;

use std::sync::Arc;
use std::time::Duration;

use understudy_cycle::Agreement;
use understudy_wire::{
    Actuation, Body, Configurations, Frame, Header, Image, Member, Moment, ProgramHash, ProgramId,
};

/// Drives and senses the field of one member; never blocks.
pub trait FieldDriver: Send {
    /// Drives y(i) in the cycle `moment`, which was decided `age` ago: a member may be suspended in between. Answers with a frame where the
    /// field is reached over the link.
    fn drive(&mut self, moment: Moment, outputs: &Image, age: Duration) -> Option<Frame>;

    /// Connects the field or lets it go: of two remote I/Os of a program, the author only is connected. Nothing is written when it is let go.
    fn connect(&mut self, connects: bool) {
        let _ = connects;
    }

    /// What the outputs are left with where this process ends in order, from now on.
    fn end_with(&mut self, outputs: &Image) {
        let _ = outputs;
    }

    /// The points of this version of the program count from now on: the field is read and driven by them, and outputs that only the version before has get
    /// their fail-safe values.
    fn lay_out(&mut self, version: ProgramHash) {
        let _ = version;
    }

    /// The version by whose points the last [`Self::look`] was read, where that is another one than that of the look before.
    fn read_by(&mut self) -> Option<ProgramHash> {
        None
    }

    /// u(i), where `frame` comes from this field.
    fn sense<'frame>(&mut self, frame: &'frame Frame) -> Option<&'frame Image>;

    /// The member has these configurations from now on.
    fn agree(&mut self, _configurations: Configurations) {}

    /// How long a field that is reached over the link may be silent.
    fn patience(&self) -> Option<Duration> {
        None
    }

    /// How old the sensors of a field that is reached over the link may be, where the other remote I/O of the program reads modules of its own: older ones
    /// are not compared with those.
    fn stale_after(&self) -> Option<Duration> {
        None
    }

    /// What is new since the last look, where the field is reached by another way than the link.
    fn look(&mut self) -> Option<Look> {
        None
    }

    /// Whether somebody else drives the outputs too, where that is new.
    fn contested(&mut self) -> Option<bool> {
        None
    }
}

/// What is new of a field that is not reached over the link.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Look {
    /// u(i).
    Sensors(Image),
    /// The sensors cannot be seen, and why.
    Lost(String),
}

/// Of a station or a plant: there is no field.
#[derive(Debug, Clone, Copy, Default)]
pub struct NoField;

impl FieldDriver for NoField {
    fn drive(&mut self, _moment: Moment, _outputs: &Image, _age: Duration) -> Option<Frame> {
        None
    }

    fn sense<'frame>(&mut self, _frame: &'frame Frame) -> Option<&'frame Image> {
        None
    }
}

/// A plant sends in every period; one that has sent nothing for so long is suspended, has ended, or is not received.
const PLANT_PATIENCE: Duration = Duration::from_secs(1);

/// Periods without sensors after which they are stale: one frame of a plant may be lost, and one late.
const STALE_PERIODS: u32 = 3;

/// Of a remote I/O whose plant is a process of its own and is reached over the link.
#[derive(Debug, Clone)]
pub struct SimulatedField {
    own: Member,
    program: ProgramId,
    agreement: Arc<Agreement>,
    configurations: Configurations,
    has_plant: bool,
    connected: bool,
    has_own_modules: bool,
}

impl SimulatedField {
    /// The field of the remote I/O of `program`.
    pub fn new(program: ProgramId, agreement: Arc<Agreement>) -> Self {
        let own = Member::RemoteIo(program);
        let configurations = Configurations { own: agreement.configuration, prepared: None };
        Self {
            own,
            program,
            agreement,
            configurations,
            has_plant: false,
            connected: true,
            has_own_modules: false,
        }
    }

    /// Of `own`, one of two remote I/Os of the program: it is connected when it is told to, or from the start on where it has modules of its own.
    #[must_use]
    pub fn of_pair(self, own: Member, has_own_modules: bool) -> Self {
        Self { own, connected: has_own_modules, has_own_modules, ..self }
    }

    /// The cluster has a plant there, whose silence is reported.
    #[must_use]
    pub fn with_plant(self) -> Self {
        Self { has_plant: true, ..self }
    }
}

impl FieldDriver for SimulatedField {
    fn drive(&mut self, moment: Moment, outputs: &Image, _age: Duration) -> Option<Frame> {
        Some(Frame {
            header: Header {
                cluster: self.agreement.cluster,
                configuration: self.configurations.own,
                prepared: self.configurations.prepared,
                moment,
                sender: self.own,
                alone: false,
            },
            body: Body::Actuation(Actuation { outputs: outputs.clone() }),
        })
    }

    fn connect(&mut self, connects: bool) {
        self.connected = connects;
    }

    fn sense<'frame>(&mut self, frame: &'frame Frame) -> Option<&'frame Image> {
        let header = &frame.header;
        let ours = header.cluster == self.agreement.cluster
            && self.configurations.admit(header)
            && header.sender == Member::Plant(self.program);
        match &frame.body {
            Body::Field(field) if ours => Some(&field.sensors),
            _ => None,
        }
    }

    fn agree(&mut self, configurations: Configurations) {
        self.configurations = configurations;
    }

    fn patience(&self) -> Option<Duration> {
        (self.has_plant && self.connected)
            .then(|| PLANT_PATIENCE.max(self.agreement.schedule.period() * 3))
    }

    fn stale_after(&self) -> Option<Duration> {
        let is_compared = self.has_plant && self.has_own_modules;
        is_compared.then(|| self.agreement.schedule.period() * STALE_PERIODS)
    }
}
