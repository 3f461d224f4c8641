//! The errors of a link: what went wrong, and what to do.

use control::say::command::LINE_LENGTH;
use std::io;
use thiserror::Error;

/// Why there is no link, or no good answer.
#[derive(Debug, Error)]
pub enum LinkError {
    /// The system has no list of its serial ports.
    #[cfg(not(target_arch = "wasm32"))]
    #[error("the serial ports cannot be listed: name the Uno's by --port")]
    NoList(#[source] serialport::Error),
    /// No port looks like an Uno.
    #[error(
        "there is no Uno at any USB port{}: plug it in with a cable that carries data, or name its port by --port",
        others(.0)
    )]
    NoUno(Vec<String>),
    /// Several do.
    #[error("there are several Unos: choose one by --port, of {}", .0.join(", "))]
    SeveralUnos(Vec<String>),
    /// A row's board is not there.
    #[error(
        "the board with the serial number {0} is not plugged in: plug it in, or name the row's board again with `weeder rows name`"
    )]
    Unplugged(String),
    /// Several boards match the row.
    #[error(
        "{} are both of the serial number {number}: name the rows again with `weeder rows name`, which then knows them by their ports",
        .ports.join(" and ")
    )]
    Twins {
        /// The serial number.
        number: String,
        /// Their ports.
        ports: Vec<String>,
    },
    /// There is no such port.
    #[error("there is no port {0}: plug the Uno in, or leave --port out to have it found")]
    Absent(String),
    /// Another program has the port open.
    #[error("{0} is in use: close the serial monitor, or the other program that has it open")]
    Busy(String),
    /// The user may not open the port.
    #[error(
        "{0} may not be opened: add yourself to the port's group (on Debian and Ubuntu `sudo usermod -aG dialout $USER`) \
         and log in again"
    )]
    Forbidden(String),
    /// The port cannot be opened for another reason.
    #[cfg(not(target_arch = "wasm32"))]
    #[error("{port} cannot be opened as a serial port")]
    NotOpened {
        /// Its name.
        port: String,
        /// The system's error.
        source: serialport::Error,
    },
    /// The port went away.
    #[error("the port is gone: plug the Uno in again")]
    Gone(#[source] io::Error),
    /// The firmware did not finish its answer.
    #[error(
        "the answer to `{command}` has no end: press the Uno's reset, and check that the weeder's firmware is on it \
         (`weeder flash`); it sent {received:?}"
    )]
    Silent {
        /// The command.
        command: String,
        /// The end of the received text.
        received: String,
    },
    /// The received bytes are not text.
    #[error("the port sends no text: check that nothing else is wired to D0 and D1, and flash the Uno again")]
    Noise,
    /// Something else answers.
    #[error("it is not the weeder's firmware that answers, but {0:?}: put it on the Uno by `weeder flash`")]
    NotTheWeeder(String),
    /// The firmware restarted before it had answered.
    #[error("the Uno was reset while it was asked `{0}`: see to its supply, then try again")]
    Restarted(String),
    /// The firmware refused.
    #[error("the firmware answers `{command}` with `{answer}`")]
    Refused {
        /// The command.
        command: String,
        /// The line that begins with `error:`.
        answer: String,
    },
    /// This cannot be typed into the console.
    #[error("{0:?} is no command: it has to be one line of at most {LINE_LENGTH} printable ASCII characters")]
    NoCommand(String),
}

/// The other ports, for the message that none of them is an Uno's.
fn others(ports: &[String]) -> String {
    if ports.is_empty() { String::new() } else { format!(" (there is {})", ports.join(", ")) }
}
