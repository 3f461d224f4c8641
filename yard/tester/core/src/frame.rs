//! Frames: a message with its number and a CRC, between two zero bytes.
//!
//! A frame holds a number, a message in postcard's format, and a CRC-16 over both. COBS keeps zero bytes out of it. A receiver that
//! has lost synchronisation waits for the next zero byte. A frame with a wrong CRC is dropped. The numbers increase by one, so a
//! gap shows a missing frame.

use crc::{CRC_16_IBM_SDLC, Crc, NoTable};
use heapless::Vec;
use serde::{Deserialize, Serialize};

/// The longest frame before COBS, in bytes.
pub const CONTENT_BYTES: usize = 64;

/// The longest frame on the line, in bytes: COBS adds one in front, and a zero byte ends it.
pub const FRAME_BYTES: usize = CONTENT_BYTES + 2;

/// Bytes of the CRC.
const CRC_BYTES: usize = 2;

/// Bit by bit: a table would take 512 bytes of the chip's SRAM.
const CRC: Crc<u16, NoTable> = Crc::<u16, NoTable>::new(&CRC_16_IBM_SDLC);

/// A frame on the line, its zero byte included.
pub type Frame = Vec<u8, FRAME_BYTES>;

/// The frame of a message with this number; `None` if the message is too long.
pub fn encode(number: u8, message: &impl Serialize) -> Option<Frame> {
    let mut content = [0; CONTENT_BYTES];
    content[0] = number;
    let length = 1 + postcard::to_slice(message, &mut content[1..CONTENT_BYTES - CRC_BYTES]).ok()?.len();
    let crc = CRC.checksum(&content[..length]);
    content[length..length + CRC_BYTES].copy_from_slice(&crc.to_le_bytes());
    let mut frame = Frame::new();
    frame.resize(FRAME_BYTES, 0).ok()?;
    let encoded = cobs::try_encode(&content[..length + CRC_BYTES], &mut frame).ok()?;
    frame.truncate(encoded + 1);
    Some(frame)
}

/// Collects bytes into frames.
#[derive(Debug, Default)]
pub struct Receiver {
    bytes: Vec<u8, FRAME_BYTES>,
    /// Whether more bytes came than a frame has, since the last zero byte.
    is_too_long: bool,
}

impl Receiver {
    /// A receiver at the beginning of a frame.
    pub const fn new() -> Self {
        Self { bytes: Vec::new(), is_too_long: false }
    }

    /// Takes a byte. Returns number and message of the frame that it completes; `None` if noise has damaged it.
    pub fn take<Message: for<'a> Deserialize<'a>>(&mut self, byte: u8) -> Option<(u8, Message)> {
        if byte != 0 {
            self.is_too_long |= self.bytes.push(byte).is_err();
            return None;
        }
        let message = if self.is_too_long { None } else { decode(&mut self.bytes) };
        *self = Self::new();
        message
    }
}

fn decode<Message: for<'a> Deserialize<'a>>(bytes: &mut [u8]) -> Option<(u8, Message)> {
    let length = cobs::decode_in_place(bytes).ok()?;
    let (content, crc) = bytes[..length].split_last_chunk::<CRC_BYTES>()?;
    let (number, message) = content.split_first()?;
    if CRC.checksum(content) != u16::from_le_bytes(*crc) {
        return None;
    }
    Some((*number, postcard::from_bytes(message).ok()?))
}
