//! The equipment of a remote I/O, as its process drives it.

use std::time::Duration;

use understudy_bus::{FieldDriver, Look};
use understudy_cluster::FieldDevice;
use understudy_field::{Device, Look as DeviceLook};
use understudy_wire::{Frame, Image, Moment};

/// A device behind a remote I/O, in place of a simulated plant.
pub(crate) struct Equipment(Device);

impl Equipment {
    pub(crate) fn start(
        device: FieldDevice,
        fail_safe: Image,
        period: Duration,
        real_time: bool,
    ) -> std::io::Result<Self> {
        Device::start(device, fail_safe, period, real_time).map(Self)
    }

    /// Of one of two remote I/Os of a program.
    pub(crate) fn start_in_pair(
        device: FieldDevice,
        period: Duration,
        real_time: bool,
    ) -> std::io::Result<Self> {
        Device::start_in_pair(device, period, real_time).map(Self)
    }
}

impl FieldDriver for Equipment {
    fn drive(&mut self, _moment: Moment, outputs: &Image, age: Duration) -> Option<Frame> {
        self.0.drive(outputs, age);
        None
    }

    fn connect(&mut self, connects: bool) {
        self.0.connect(connects);
    }

    fn end_with(&mut self, outputs: &Image) {
        self.0.end_with(outputs);
    }

    fn sense<'frame>(&mut self, _frame: &'frame Frame) -> Option<&'frame Image> {
        None
    }

    fn look(&mut self) -> Option<Look> {
        self.0.look().map(|look| match look {
            DeviceLook::Sensors(sensors) => Look::Sensors(sensors),
            DeviceLook::Lost(reason) => Look::Lost(reason),
        })
    }

    fn contested(&mut self) -> Option<bool> {
        self.0.contested()
    }
}
