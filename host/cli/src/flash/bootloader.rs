//! Asks a board which bootloader it has and which chip: two commands of STK500 version 1 (Atmel's application note AVR061).
//!
//! A command ends with a space. Its answer begins with 0x14 and ends with 0x10. A bootloader listens for a second or two
//! after a reset. avrdude writes; this only says why it could not.

use anyhow::Result;
use link::Claim;
use std::io::{ErrorKind, Read, Write};
use std::time::{Duration, Instant};

pub type Signature = [u8; 3];

/// That of the Uno's chip.
pub const ATMEGA328P: Signature = [0x1E, 0x95, 0x0F];

/// Those of chips on similar boards.
const OTHERS: [(Signature, &str); 6] = [
    ([0x1E, 0x95, 0x14], "ATmega328"),
    ([0x1E, 0x95, 0x16], "ATmega328PB"),
    ([0x1E, 0x94, 0x06], "ATmega168"),
    ([0x1E, 0x94, 0x0B], "ATmega168P"),
    ([0x1E, 0x95, 0x87], "ATmega32U4 (Leonardo, Micro)"),
    ([0x1E, 0x98, 0x01], "ATmega2560 (Mega)"),
];

/// The name of a chip, or its signature.
pub fn chip(signature: Signature) -> String {
    let name = OTHERS.iter().find(|(known, _)| *known == signature).map(|(_, name)| (*name).to_owned());
    name.unwrap_or_else(|| signature.map(|byte| format!("{byte:02X}")).join(" "))
}

const GET_SYNC: [u8; 2] = [0x30, 0x20];
const READ_SIGNATURE: [u8; 2] = [0x75, 0x20];
const IN_SYNC: u8 = 0x14;
const OK: u8 = 0x10;

/// Time between two calls, and their number: the old bootloader first blinks for a second.
const CALL: Duration = Duration::from_millis(150);
const CALLS: usize = 12;

/// What answers at a port.
#[derive(Debug, PartialEq, Eq)]
pub enum Heard {
    Bootloader(Signature),
    /// Another program or device, that sends text.
    Text(String),
    Nothing,
}

/// Resets the board at a port, and listens to what answers at `baud`. Fails if the port cannot be opened, or goes away.
pub fn heard(claim: &Claim, port: &str, baud: u32) -> Result<Heard> {
    Ok(asked(&mut link::open_to_flash(claim, port, baud)?)?)
}

fn asked(port: &mut (impl Read + Write)) -> std::io::Result<Heard> {
    let mut all = Vec::new();
    for _ in 0..CALLS {
        port.write_all(&GET_SYNC)?;
        let answer = listen(port)?;
        if answer.ends_with(&[IN_SYNC, OK]) {
            // Answers to earlier calls may still come.
            listen(port)?;
            port.write_all(&READ_SIGNATURE)?;
            if let [IN_SYNC, first, second, third, OK] = *listen(port)? {
                return Ok(Heard::Bootloader([first, second, third]));
            }
        }
        all.extend(answer);
    }
    let text: String =
        all.iter().map(|&byte| if matches!(byte, b' '..=b'~') { char::from(byte) } else { ' ' }).collect();
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    // At another rate, a text has few characters that are one.
    let is_text = text.len() > 8 && 4 * text.len() > 3 * all.len();
    Ok(if is_text { Heard::Text(text.chars().take(60).collect()) } else { Heard::Nothing })
}

/// All bytes that come in the time of a call. Reads are bounded, because a device may send without end.
fn listen(port: &mut impl Read) -> std::io::Result<Vec<u8>> {
    let (until, mut heard) = (Instant::now() + CALL, Vec::new());
    let mut bytes = [0; 64];
    while Instant::now() < until {
        match port.read(&mut bytes) {
            Ok(0) => return Err(ErrorKind::UnexpectedEof.into()),
            Ok(count) => heard.extend_from_slice(&bytes[..count]),
            Err(error)
                if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted) => {}
            Err(error) => return Err(error),
        }
        if heard.len() > 1000 {
            break;
        }
    }
    Ok(heard)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::VecDeque;

    /// A device: what it answers to a write.
    struct Device<F>(F, VecDeque<u8>);

    impl<F: FnMut(&[u8]) -> Vec<u8>> Write for Device<F> {
        fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
            self.1.extend((self.0)(bytes));
            Ok(bytes.len())
        }

        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }

    impl<F> Read for Device<F> {
        fn read(&mut self, bytes: &mut [u8]) -> std::io::Result<usize> {
            if self.1.is_empty() { Err(ErrorKind::TimedOut.into()) } else { self.1.read(bytes) }
        }
    }

    fn answered(answers: impl FnMut(&[u8]) -> Vec<u8>) -> Heard {
        asked(&mut Device(answers, VecDeque::new())).unwrap()
    }

    #[test]
    fn a_bootloader_tells_its_chip_after_the_calls_that_it_slept_through() {
        let mut calls = 0;
        let heard = answered(|bytes| {
            calls += 1;
            match bytes {
                _ if calls < 5 => Vec::new(),
                [0x30, 0x20] => vec![0x14, 0x10],
                _ => vec![0x14, 0x1E, 0x95, 0x16, 0x10],
            }
        });
        assert_eq!(heard, Heard::Bootloader([0x1E, 0x95, 0x16]));
        assert_eq!([[0x1E, 0x95, 0x16], [0x1E, 0x00, 0xFF]].map(chip), ["ATmega328PB", "1E 00 FF"]);
    }

    #[test]
    fn another_device_is_told_by_its_text_and_noise_is_nothing() {
        let receiver = answered(|_| b"$GPGGA,092750.000,5321.6802,N\r\n".to_vec());
        assert!(matches!(&receiver, Heard::Text(text) if text.starts_with("$GPGGA,092750.000")), "{receiver:?}");
        assert_eq!(answered(|_| vec![0x80, 0x14, 0xF0, b'a', 0xFE, 0x02]), Heard::Nothing);
        assert_eq!(answered(|_| Vec::new()), Heard::Nothing);
    }
}
