//! The serial line of Modbus RTU.
//!
//! The line belongs to one process: a second one would answer for the first. What arrived before it was opened is discarded.

use std::fs::OpenOptions;
use std::io;
use std::os::unix::fs::OpenOptionsExt;
use std::time::Duration;

use nix::libc::{O_NOCTTY, O_NONBLOCK};
use nix::sys::termios::{
    BaudRate, ControlFlags, FlushArg, SetArg, cfmakeraw, cfsetspeed, tcflush, tcgetattr, tcsetattr,
};
use tokio::io::{Join, join};
use tokio::net::unix::pipe::{Receiver, Sender};
use understudy_cluster::{Parity, SerialLine};

/// An open line, for reading and for writing.
pub(crate) type SerialPort = Join<Receiver, Sender>;

/// Opens the line of a device.
///
/// # Errors
/// It is absent, is not a terminal device, or another process uses it.
pub(crate) fn open(line: &SerialLine) -> io::Result<SerialPort> {
    let file = OpenOptions::new()
        .read(true)
        .write(true)
        .custom_flags(O_NONBLOCK | O_NOCTTY)
        .open(&line.path)?;
    if file.try_lock().is_err() {
        return Err(io::Error::other("another process uses the line"));
    }
    let mut settings = tcgetattr(&file)?;
    cfmakeraw(&mut settings);
    cfsetspeed(&mut settings, rate(line.baud)?)?;
    let mut flags = settings.control_flags;
    flags.remove(ControlFlags::PARENB | ControlFlags::PARODD | ControlFlags::CSTOPB);
    flags.insert(ControlFlags::CREAD | ControlFlags::CLOCAL);
    flags.insert(match line.parity {
        Parity::Even => ControlFlags::PARENB,
        Parity::Odd => ControlFlags::PARENB | ControlFlags::PARODD,
        Parity::None => ControlFlags::empty(),
    });
    if line.stop_bits == 2 {
        flags.insert(ControlFlags::CSTOPB);
    }
    settings.control_flags = flags;
    tcsetattr(&file, SetArg::TCSANOW, &settings)?;
    tcflush(&file, FlushArg::TCIOFLUSH)?;
    // A terminal device is read and written as a pipe is.
    let writer = Sender::from_file_unchecked(file.try_clone()?)?;
    Ok(join(Receiver::from_file_unchecked(file)?, writer))
}

/// The silence between two frames: 3.5 characters of 11 bits, and 1.75 ms above 19,200 bits per second.
pub(crate) fn silence(line: &SerialLine) -> Duration {
    match line.baud {
        ..=19_200 => Duration::from_secs(1) * 77 / (2 * line.baud.max(1)),
        _ => Duration::from_micros(1750),
    }
}

fn rate(baud: u32) -> io::Result<BaudRate> {
    Ok(match baud {
        1200 => BaudRate::B1200,
        2400 => BaudRate::B2400,
        4800 => BaudRate::B4800,
        9600 => BaudRate::B9600,
        19_200 => BaudRate::B19200,
        38_400 => BaudRate::B38400,
        57_600 => BaudRate::B57600,
        115_200 => BaudRate::B115200,
        230_400 => BaudRate::B230400,
        460_800 => BaudRate::B460800,
        921_600 => BaudRate::B921600,
        other => {
            let message = format!("no serial line has {other} bits per second");
            return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn silence_is_three_and_a_half_characters() {
        let line = |baud| SerialLine {
            path: "/dev/null".into(),
            baud,
            parity: Parity::Even,
            stop_bits: 1,
        };
        assert_eq!(silence(&line(9600)).as_micros(), 4010);
        assert_eq!(silence(&line(115_200)).as_micros(), 1750);
        assert!(open(&line(9600)).is_err(), "it is not a terminal device");
    }
}
