//! The errors of a link: what went wrong, and what to do.

use control::say::command::LINE_LENGTH;
use std::io;
use std::path::PathBuf;
use thiserror::Error;

/// Why there is no link, or no good answer.
#[derive(Debug, Error)]
#[expect(missing_docs, reason = "the messages say what each means")]
pub enum LinkError {
    #[cfg(not(target_arch = "wasm32"))]
    #[error("the serial ports cannot be listed: name the Uno's by --port")]
    NoList(#[source] serialport::Error),
    #[error("there is no Uno at any USB port{}: {}", others(.ports), remedy(.without_port))]
    NoUno {
        /// The other ports.
        ports: Vec<String>,
        /// Known devices on the USB bus that have no port.
        without_port: Vec<&'static str>,
    },
    #[error("there are several Unos: choose one by --port, of {}", .0.join(", "))]
    SeveralUnos(Vec<String>),
    #[error(
        "the board with the serial number {0} is not plugged in: plug it in, or name the row's board again with `weeder rows name`"
    )]
    Unplugged(String),
    #[error(
        "{} are both of the serial number {number}: name the rows again with `weeder rows name`, which then knows them by their ports",
        .ports.join(" and ")
    )]
    Twins { number: String, ports: Vec<String> },
    #[error("there is no port {0}: plug the Uno in, or leave --port out to have it found")]
    Absent(String),
    #[error("{0} is in use: close the serial monitor, or the other program that has it open")]
    Busy(String),
    #[error("{0} is being flashed by another program: wait until that has ended")]
    Flashed(String),
    #[error("{} cannot be locked, so another program could write to the same Uno", .path.display())]
    NotClaimed { path: PathBuf, source: io::Error },
    #[error(
        "{0} may not be opened: add yourself to the port's group (on Debian and Ubuntu `sudo usermod -aG dialout $USER`) \
         and log in again"
    )]
    Forbidden(String),
    #[cfg(not(target_arch = "wasm32"))]
    #[error("{port} cannot be opened as a serial port")]
    NotOpened { port: String, source: serialport::Error },
    #[error("the port is gone: plug the Uno in again")]
    Gone(#[source] io::Error),
    #[error("{}", silent(.command, .received))]
    Silent {
        command: String,
        /// The end of what came.
        received: String,
    },
    #[error("no answer to `{command}` for {seconds} s: see to the Uno's cable and supply")]
    Unanswered { command: String, seconds: u64 },
    #[error("this port sends no text: choose another; on an Uno check that D0 and D1 are free, and flash it again")]
    Noise,
    #[error("it is not the weeder's firmware that answers, but {0:?}: choose another port, or flash this one")]
    NotTheWeeder(String),
    #[error("the Uno was reset while it was asked `{0}`: see to its supply, then try again")]
    Restarted(String),
    #[error(
        "no two answers to `{0}` are the same: the line is noisy, so take a shorter cable, away from motors, and try again"
    )]
    Unsteady(String),
    #[error("the firmware answers `{command}` with `{answer}`")]
    Refused {
        command: String,
        /// The line that begins with `error:`.
        answer: String,
    },
    #[error("{0:?} is no command: it has to be one line of at most {LINE_LENGTH} printable ASCII characters")]
    NoCommand(String),
}

impl LinkError {
    /// Whether it may be the fault of one answer: the same question may succeed.
    pub(crate) fn is_of_an_answer(&self) -> bool {
        matches!(
            self,
            Self::Silent { .. } | Self::NotTheWeeder(_) | Self::Restarted(_) | Self::Unsteady(_) | Self::Refused { .. }
        )
    }
}

fn silent(command: &str, received: &str) -> String {
    if received.is_empty() && command != "version" {
        return format!("no answer to `{command}`: press the Uno's reset, and see to its cable and supply");
    }
    if received.is_empty() {
        return "nothing answers at this port: choose another, or press the Uno's reset; flash a new board first"
            .to_owned();
    }
    format!("the answer to `{command}` has no end: press the Uno's reset, then try again; it sent {received:?}")
}

/// The other ports, for the message that none of them is an Uno's.
fn others(ports: &[String]) -> String {
    if ports.is_empty() { String::new() } else { format!(" (there is {})", ports.join(", ")) }
}

fn remedy(without_port: &[&str]) -> String {
    const OF_THE_SYSTEM: &str = if cfg!(target_os = "linux") {
        "on Linux, brltty may have taken it: remove the package brltty (`sudo apt remove brltty`), then plug it in again"
    } else {
        "install the driver of its maker, then plug it in again"
    };
    if without_port.is_empty() {
        return "plug it in with a cable that carries data, or name its port by --port".to_owned();
    }
    let (is, has) = if without_port.len() == 1 { ("is", "has") } else { ("are", "have") };
    format!("{} {is} on the USB bus and {has} no port; {OF_THE_SYSTEM}", without_port.join(" and "))
}
