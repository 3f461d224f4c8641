//! Writes with avrdude: passes its messages on, and ends it if its port is gone or it falls silent.

use super::bootloader::Signature;
use anyhow::{Context, Result, ensure};
use std::collections::HashSet;
use std::fs;
use std::io::{self, BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::thread;
use std::time::{Duration, Instant};

/// Longest silence. avrdude waits 5 s for an answer, and then says so.
const SILENCE: Duration = Duration::from_secs(12);

/// Time that avrdude has to end by itself once its port is gone.
const GRACE: Duration = Duration::from_secs(2);

/// Time between two looks at the port.
const LOOK: Duration = Duration::from_millis(100);

const GET_IT: &str = if cfg!(windows) {
    "put avrdude.exe and avrdude.conf from https://github.com/avrdudes/avrdude/releases beside weeder.exe"
} else if cfg!(target_os = "macos") {
    "`brew install avrdude` installs it"
} else {
    "`sudo apt install avrdude`, your system's package avrdude, or ./setup.sh installs it"
};

/// Writing cannot reach the bootloader.
const WHOLE: &str = "The bootloader is not changed";

/// Writes and verifies an Intel HEX file. Returns whether avrdude succeeded, and the chip's signature, if avrdude has
/// printed it. Fails if avrdude is not installed, falls silent, or loses the port.
pub fn write(image: &Path, port: &str, baud: u32) -> Result<(bool, Option<Signature>)> {
    // A link may stay when its port goes. On Windows a port is no file.
    let device: Option<PathBuf> = if cfg!(windows) { None } else { fs::canonicalize(port).ok() };
    let mut avrdude = Command::new("avrdude")
        // Each page is erased before it is written: a bootloader cannot erase the chip.
        .args(["-c", "arduino", "-p", "atmega328p", "-D", "-b", &baud.to_string(), "-P", port])
        .arg("-U")
        .arg(format!("flash:w:{}:i", image.display()))
        .stderr(Stdio::piped())
        .spawn()
        .with_context(|| format!("avrdude cannot be started: {GET_IT}, or flash in the page"))?;
    let (heard, alive) = mpsc::channel();
    let words = avrdude.stderr.take();
    let reader = thread::spawn(move || pass_on(BufReader::new(words?), io::stderr(), &heard));
    let (mut last_word, mut gone_at) = (Instant::now(), None);
    let succeeded = loop {
        match alive.recv_timeout(LOOK) {
            Ok(()) => last_word = Instant::now(),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => thread::sleep(LOOK),
        }
        if let Some(status) = avrdude.try_wait().context("avrdude cannot be waited for")? {
            break status.success();
        }
        if gone_at.is_none() && device.as_ref().is_some_and(|device| !device.exists()) {
            gone_at = Some(Instant::now());
        }
        let is_silent = last_word.elapsed() > SILENCE;
        if is_silent || gone_at.is_some_and(|at| at.elapsed() > GRACE) {
            // It may have ended at this moment.
            let _ = avrdude.kill();
            avrdude.wait().context("avrdude cannot be waited for")?;
            ensure!(
                gone_at.is_some() || !is_silent,
                "avrdude fell silent and was ended: plug the Uno out and in, and flash it again. {WHOLE}"
            );
            break false;
        }
    };
    // Also if it is there again: avrdude had the one that is gone.
    let is_gone = gone_at.is_some() || device.is_some_and(|device| !device.exists());
    ensure!(succeeded || !is_gone, "{port} is gone while the Uno was written: plug it in, and flash it again. {WHOLE}");
    Ok((succeeded, reader.join().ok().flatten()))
}

/// How avrdude's messages begin.
const MESSAGE: &[u8] = b"avrdude";

/// Passes on avrdude's messages, each once over all tries, and its progress at once, until the input ends. Reports each
/// byte to `heard`. Returns the signature in the messages.
fn pass_on(from: impl BufRead, mut to: impl Write, heard: &Sender<()>) -> Option<Signature> {
    // The messages that were passed on, without their numbers.
    let mut said = HashSet::new();
    let (mut line, mut passed, mut signature) = (Vec::new(), 0, None);
    let bytes = from.bytes().filter(|byte| !matches!(byte, Err(error) if error.kind() == io::ErrorKind::Interrupted));
    for byte in bytes.map(Result::ok).chain([None]) {
        // The receiver has ended if avrdude has.
        let _ = heard.send(());
        line.extend(byte);
        let ends = matches!(byte, None | Some(b'\n' | b'\r'));
        let is_shown = match line.starts_with(MESSAGE) {
            true => {
                ends && said.insert(line.iter().filter(|byte| !byte.is_ascii_hexdigit()).copied().collect::<Vec<_>>())
            }
            // It may become a message.
            false => ends || !MESSAGE.starts_with(&line),
        };
        if is_shown {
            // If the output is closed, no message can be shown. avrdude goes on.
            let _ = to.write_all(&line[passed..]).and_then(|()| to.flush());
            passed = line.len();
        }
        if ends {
            signature = signature.or_else(|| signature_in(&String::from_utf8_lossy(&line)));
            line.clear();
            passed = 0;
        }
        if byte.is_none() {
            break;
        }
    }
    signature
}

/// The chip's signature in one of avrdude's lines: `signature = 0x1e9516`, or `1E 95 16` in later versions.
fn signature_in(line: &str) -> Option<Signature> {
    let (_, behind) = line.split_once("ignature = ")?;
    let digits: String = behind.trim_start_matches("0x").chars().filter(|digit| *digit != ' ').take(6).collect();
    let number = (digits.len() == 6).then(|| u32::from_str_radix(&digits, 16).ok())??;
    let [_, signature @ ..] = number.to_be_bytes();
    Some(signature)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_repeated_message_is_printed_once_and_progress_at_once() {
        let mut words = String::from("avrdude: ser_open(): no modem lines\n\n");
        for attempt in 1..=10 {
            words += &format!("avrdude: stk500_getsync() attempt {attempt} of 10: not in sync: resp=0x{attempt:02x}\n");
        }
        words += "Writing | #### | 10%\rWriting | ######## | 20%\navrdude done.  Thank you.";
        let mut said = Vec::new();
        assert_eq!(pass_on(words.as_bytes(), &mut said, &mpsc::channel().0), None);
        let said = String::from_utf8(said).unwrap();
        assert_eq!(said.matches("not in sync").count(), 1, "{said}");
        assert!(said.starts_with("avrdude: ser_open(): no modem lines\n\navrdude: stk500_getsync() attempt 1 of 10"));
        assert!(said.ends_with("Writing | #### | 10%\rWriting | ######## | 20%\navrdude done.  Thank you."), "{said}");
    }

    #[test]
    fn the_signature_is_read_from_the_messages_of_each_version() {
        for line in [
            "avrdude: Device signature = 0x1e9516 (probably m328pb)",
            "avrdude: device signature = 0x1e9516 (probably m328pb)",
            "Device signature = 1E 95 16 (ATmega328PB)",
        ] {
            assert_eq!(signature_in(line), Some([0x1E, 0x95, 0x16]), "{line}");
        }
        assert_eq!(signature_in("avrdude error: expected signature for ATmega328P is 1E 95 0F"), None);
        assert_eq!(signature_in("avrdude: device signature = 0x1e"), None);
    }
}
