//! Intel HEX, the file format of the Arduino tools.

use crate::file_error::FileError;
use crate::memory::FLASH_BYTES;
use ihex::{Reader, Record};
use std::ops::Range;
use std::path::Path;

/// Bytes of data in a line, as in the files of most tools.
const LINE_BYTES: usize = 16;

/// Flash contents from address 0 as Intel HEX.
///
/// # Panics
/// If `flash` is longer than the ATmega328P's.
pub fn text(flash: &[u8]) -> String {
    assert!(flash.len() <= FLASH_BYTES, "the ATmega328P holds {FLASH_BYTES} bytes");
    let lines = flash.chunks(LINE_BYTES).zip((0..).step_by(LINE_BYTES));
    let mut records: Vec<Record> =
        lines.map(|(bytes, offset)| Record::Data { offset, value: bytes.to_vec() }).collect();
    records.push(Record::EndOfFile);
    let text = ihex::create_object_file_representation(&records).expect("short lines and one end make a file");
    text + "\n"
}

/// The flash of a firmware's Intel HEX file, from address 0 to its last byte.
pub(crate) fn flash(path: &Path, content: &[u8]) -> Result<Vec<u8>, FileError> {
    let wrong = |problem: String| FileError::new(path, problem);
    let filled = filled(&String::from_utf8_lossy(content));
    let (Range { end, .. }, mut flash) =
        filled.map_err(|reason| wrong(format!("is no whole Intel HEX file: {reason}")))?;
    if end == 0 || end > FLASH_BYTES {
        return Err(wrong(format!("fills {end} bytes of flash: the ATmega328P has {FLASH_BYTES}")));
    }
    flash.truncate(end);
    Ok(flash)
}

/// From the lowest to the highest address that a file fills, and the flash with those of its bytes that are in flash.
/// Fails with the reason if a record is wrong, or the file ends without its end record.
pub(crate) fn filled(text: &str) -> Result<(Range<usize>, Vec<u8>), String> {
    let (mut base, mut first, mut end) = (0, usize::MAX, 0);
    let mut flash = vec![0xFF; FLASH_BYTES];
    for record in Reader::new(text) {
        match record.map_err(|error| error.to_string())? {
            Record::Data { offset, value } => {
                let start = base + usize::from(offset);
                let behind = start + value.len();
                (first, end) = (first.min(start), end.max(behind));
                if let Some(place) = flash.get_mut(start..behind) {
                    place.copy_from_slice(&value);
                }
            }
            Record::ExtendedSegmentAddress(segment) => base = usize::from(segment) << 4,
            Record::ExtendedLinearAddress(upper) => base = usize::from(upper) << 16,
            // Start addresses are for Intel's processors.
            Record::StartSegmentAddress { .. } | Record::StartLinearAddress(_) => {}
            Record::EndOfFile => return Ok((first..end, flash)),
        }
    }
    Err("it has no end record (:00000001FF)".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_a_hex_file_or_another_chips_is_refused() {
        let read = |text: &str| flash(Path::new("x.hex"), text.as_bytes()).map_err(|error| error.to_string());
        let firmware: Vec<u8> = (0..1000_u16).map(|byte| byte as u8).collect();
        let whole = text(&firmware);
        assert_eq!(read(&whole), Ok(firmware));
        let mega = ":020000040001F9\n:0100000000FF\n:00000001FF\n";
        let (cut_at_a_line, _) = whole.trim_end().rsplit_once('\n').unwrap();
        for (text, why) in [
            (&whole[..whole.len() / 2 + 5], "no whole Intel HEX"),
            (cut_at_a_line, "no whole Intel HEX file: it has no end record"),
            (mega, "fills 65537 bytes"),
            (":", ""),
        ] {
            let error = read(text).unwrap_err();
            assert!(error.contains(why), "{error}");
        }
    }
}
