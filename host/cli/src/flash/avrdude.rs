//! Writes with avrdude: passes its messages on, and ends it if its port is gone, it falls silent, or Ctrl-C is pressed.
//!
//! A part of a firmware never runs: as in the page, its first page is written last, and stops the chip until then.
//! avrdude keeps the order of its options -U, and writes only the pages that a file has.

use super::bootloader::Signature;
use crate::ctrl_c;
use anyhow::{Context, Result, ensure};
use std::collections::HashSet;
use std::fs;
use std::io::{self, BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::Ordering;
use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::thread;
use std::time::{Duration, Instant};
use uno::hex;

/// Longest silence. avrdude waits 5 s for an answer, and then says so.
const SILENCE: Duration = Duration::from_secs(12);

/// Time that avrdude has to end by itself once its port is gone.
const GRACE: Duration = Duration::from_secs(2);

const LOOK: Duration = Duration::from_millis(100);

const GET_IT: &str = if cfg!(windows) {
    "put avrdude.exe and avrdude.conf from https://github.com/avrdudes/avrdude/releases beside weeder.exe"
} else if cfg!(target_os = "macos") {
    "`brew install avrdude` installs it"
} else {
    "`sudo apt install avrdude`, your system's package avrdude, or ./setup.sh installs it"
};

/// Why an interruption does no harm.
const HALF: &str = "Half a firmware does not run, and the bootloader is still there";

const NO_ROOM: &str = "there is no room for a temporary file";

/// Bytes of a page of flash (data sheet, table 27-13).
const PAGE: usize = 128;

/// The names and texts of the files that avrdude writes, in this order. The first one is a first page that jumps to
/// itself (rjmp .-2): the bootloader starts at address 0.
fn files(flash: &[u8]) -> [(&'static str, String); 3] {
    let mut standstill = [0xFF_u8; PAGE];
    standstill[1] = 0xCF;
    // Whole pages, and two at least: avrdude keeps what a page had, and not every version takes an empty file.
    let mut image = flash.to_vec();
    image.resize(flash.len().next_multiple_of(PAGE).max(2 * PAGE), 0xFF);
    let first = hex::text(&image[..PAGE]);
    let rest = hex::text(&image).split_off(first.len() - hex::text(&[]).len());
    [("standstill.hex", hex::text(&standstill)), ("rest.hex", rest), ("first.hex", first)]
}

/// Writes and verifies a firmware, so that a part of it never runs. Returns whether avrdude succeeded, and the chip's
/// signature, if avrdude has printed it. Fails if avrdude is not installed, falls silent, loses the port, or is
/// interrupted.
pub fn write(flash: &[u8], port: &str, baud: u32) -> Result<(bool, Option<Signature>)> {
    // A link may stay when its port goes. On Windows a port is no file.
    let device: Option<PathBuf> = if cfg!(windows) { None } else { fs::canonicalize(port).ok() };
    // Files beside the ELF belong to the user.
    let folder = tempfile::tempdir().context(NO_ROOM)?;
    let mut command = Command::new("avrdude");
    // Each page is erased before it is written: a bootloader cannot erase the chip.
    command.args(["-c", "arduino", "-p", "atmega328p", "-D", "-b", &baud.to_string(), "-P"]);
    // Started in the folder, it needs no path: on Windows it opens none with letters of another code page.
    command.arg(device.as_deref().unwrap_or(Path::new(port))).current_dir(folder.path());
    for (name, text) in files(flash) {
        fs::write(folder.path().join(name), text).context(NO_ROOM)?;
        command.args(["-U", &format!("flash:w:{name}:i")]);
    }
    let stop = ctrl_c()?;
    let started = command.stderr(Stdio::piped()).spawn();
    let mut avrdude = started.with_context(|| format!("avrdude cannot be started: {GET_IT}, or flash in the page"))?;
    let ((heard, alive), (bytes, words)) = (mpsc::channel(), mpsc::channel());
    let said = BufReader::new(avrdude.stderr.take().context("avrdude has no messages")?);
    // In a thread beside the printing one: avrdude is not silent where the terminal takes nothing.
    thread::spawn(move || listen(said, &heard, &bytes));
    let printer = thread::spawn(move || pass_on(words, io::stderr()));
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
        let is_stopped = stop.load(Ordering::Relaxed);
        if is_silent || is_stopped || gone_at.is_some_and(|at| at.elapsed() > GRACE) {
            // It may have ended at this moment.
            let _ = avrdude.kill();
            avrdude.wait().context("avrdude cannot be waited for")?;
            ensure!(
                gone_at.is_some() || is_stopped || !is_silent,
                "avrdude fell silent and was ended: plug the Uno out and in, and flash it again. {HALF}"
            );
            break false;
        }
    };
    ensure!(succeeded || !stop.load(Ordering::Relaxed), "interrupted: flash it again. {HALF}");
    // Also if it is there again: avrdude had the one that is gone.
    let is_gone = gone_at.is_some() || device.is_some_and(|device| !device.exists());
    ensure!(succeeded || !is_gone, "{port} is gone while the Uno was written: plug it in, and flash it again. {HALF}");
    Ok((succeeded, printer.join().ok().flatten()))
}

const MESSAGE: &[u8] = b"avrdude";

/// Reports each byte of avrdude's output, and hands it on, until it ends.
fn listen(from: impl BufRead, heard: &Sender<()>, bytes: &Sender<u8>) {
    let is_byte = |byte: &io::Result<u8>| !matches!(byte, Err(error) if error.kind() == io::ErrorKind::Interrupted);
    for byte in from.bytes().filter(is_byte).map_while(Result::ok) {
        // Who waits for it may have ended with avrdude.
        let _ = heard.send(());
        if bytes.send(byte).is_err() {
            break;
        }
    }
}

/// Passes on avrdude's messages, each once over all tries, and its progress at once, until they end. Returns the
/// signature in the messages.
fn pass_on(from: impl IntoIterator<Item = u8>, mut to: impl Write) -> Option<Signature> {
    // The messages that were passed on, without their numbers.
    let mut said = HashSet::new();
    let (mut line, mut passed, mut signature) = (Vec::new(), 0, None);
    for byte in from.into_iter().map(Some).chain([None]) {
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
    fn the_first_page_stops_the_chip_until_the_others_are_written() {
        let firmware: Vec<u8> = (0..1000_u16).map(|byte| byte as u8).collect();
        let [standstill, rest, first] = files(&firmware).map(|(_, text)| text);
        assert!(standstill.starts_with(":10000000FFCFFFFF") && rest.starts_with(":1000800080818283"));
        assert_eq!(standstill.len(), first.len());
        let whole = hex::text(&[&firmware[..], &[0xFF; 24]].concat());
        assert_eq!(first.replace(&hex::text(&[]), "") + &rest, whole);
        let [_, (_, rest), _] = files(&[0]);
        assert!(rest.starts_with(":10008000FFFF"), "it is not empty");
    }

    #[test]
    fn a_repeated_message_is_printed_once_and_progress_at_once() {
        let mut words = String::from("avrdude: ser_open(): no modem lines\n\n");
        for attempt in 1..=10 {
            words += &format!("avrdude: stk500_getsync() attempt {attempt} of 10: not in sync: resp=0x{attempt:02x}\n");
        }
        words += "Writing | #### | 10%\rWriting | ######## | 20%\navrdude done.  Thank you.";
        let mut said = Vec::new();
        assert_eq!(pass_on(words.bytes(), &mut said), None);
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
