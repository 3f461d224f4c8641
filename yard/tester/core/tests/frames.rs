//! Frames over a line with noise.

use proptest::prelude::*;
use tester_core::frame::{Receiver, encode};
use tester_core::message::{Command, PIECES, Record, STEPS, Step};
use tester_core::player::{Action, Piece};

fn received(bytes: &[u8]) -> Vec<(u8, Command)> {
    let mut receiver = Receiver::new();
    bytes.iter().filter_map(|&byte| receiver.take(byte)).collect()
}

#[test]
fn the_longest_messages_fit_a_frame() {
    let levels = Action::Levels { mask: u8::MAX, levels: u8::MAX };
    let piece = Piece { wait: u32::MAX, count: u8::MAX, action: levels };
    let step = Step { delay: u8::MAX, toggle: u8::MAX };
    let pieces = Command::Pieces(std::iter::repeat_n(piece, PIECES).collect());
    let pattern = Command::Pattern { from: u8::MAX, steps: std::iter::repeat_n(step, STEPS).collect() };
    for command in [pieces, pattern] {
        let frame = encode(255, &command).expect("it fits");
        assert_eq!(received(&frame), [(255, command)]);
    }
    assert!(encode(255, &Record::Pulse { start: u32::MAX, width: u32::MAX }).is_some());
}

#[test]
fn a_receiver_finds_the_next_frame_after_noise() {
    let frame = encode(7, &Command::Start).expect("it fits");
    let noise = [1, 2, 3, 0, 0, 9];
    let bytes = [&noise[..], &[0], &frame, &[5; 200], &[0], &frame].concat();
    let found = received(&bytes);
    assert_eq!(found.len(), 2, "{found:?}");
}

proptest! {
    #[test]
    fn a_frame_with_a_wrong_bit_is_never_another_frame(place in 0_usize..16, bit in 0_u8..8, number: u8, width: u16) {
        let sent = Command::CheckCapture { width };
        let mut frame = encode(number, &sent).expect("it fits");
        let place = place % frame.len();
        frame[place] ^= 1 << bit;
        for found in received(&frame) {
            prop_assert_eq!(found, (number, sent.clone()));
        }
    }
}
