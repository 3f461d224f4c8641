//! The station's commands on a board without a chip.

use tester_core::frame::{Receiver, encode};
use tester_core::message::{Command, Done, Record, Refusal, Step};
use tester_core::pins::{AT_REST, Line};
use tester_core::player::{Action, Next, Piece, Player, QUEUE_PIECES};
use tester_core::station::{Board, Station};

/// A board without a chip.
#[derive(Default)]
struct Bare {
    player: Player,
    bursts: Vec<(usize, u16)>,
    reset: bool,
}

impl Board for Bare {
    fn now(&mut self) -> u32 {
        42
    }
    fn player<R>(&mut self, access: impl FnOnce(&mut Player) -> R) -> R {
        access(&mut self.player)
    }
    fn start(&mut self) -> u32 {
        self.player.start();
        42
    }
    fn set(&mut self, mask: u8, levels: u8) {
        self.player.set(mask, levels);
    }
    fn reset(&mut self, pulled: bool) {
        self.reset = pulled;
    }
    fn burst(&mut self, steps: &[Step], _: u16, repeats: u16, _: u8) {
        self.bursts.push((steps.len(), repeats));
    }
    fn check_capture(&mut self, _: u16) {}
}

/// Sends a command, and returns the records that follow.
fn typed(station: &mut Station, board: &mut Bare, number: u8, command: &Command) -> Vec<Record> {
    for byte in encode(number, command).expect("it fits") {
        station.take(byte, board);
    }
    let mut receiver = Receiver::new();
    let frames = std::iter::from_fn(|| station.next_frame()).collect::<Vec<_>>();
    let bytes = frames.iter().flatten();
    bytes.filter_map(|&byte| receiver.take(byte)).map(|found| found.1).collect()
}

fn refusal(records: &[Record]) -> Option<Refusal> {
    records.iter().find_map(|record| match record {
        Record::Done(done) => done.refusal,
        _ => None,
    })
}

fn pieces(count: usize) -> Command {
    Command::Pieces(std::iter::repeat_n(Piece { wait: 1000, count: 2, action: Action::Forward }, count).collect())
}

#[test]
fn a_repeated_command_is_answered_but_not_run_again() {
    let (mut station, mut board) = (Station::new(), Bare::default());
    for _ in 0..3 {
        let records = typed(&mut station, &mut board, 5, &pieces(2));
        assert!(matches!(records[..], [Record::Done(Done { number: 5, room: 62, .. })]), "{records:?}");
    }
    typed(&mut station, &mut board, 6, &pieces(2));
    assert_eq!(board.player.room(), QUEUE_PIECES - 4);
}

#[test]
fn pieces_without_room_are_refused_as_a_whole() {
    let (mut station, mut board) = (Station::new(), Bare::default());
    for number in 0..(QUEUE_PIECES / 4) as u8 {
        assert_eq!(refusal(&typed(&mut station, &mut board, number, &pieces(4))), None);
    }
    assert_eq!(refusal(&typed(&mut station, &mut board, 100, &pieces(1))), Some(Refusal::NoRoom));
    assert_eq!(board.player.room(), 0);
}

#[test]
fn numbers_out_of_their_range_are_refused() {
    let (mut station, mut board) = (Station::new(), Bare::default());
    let steps = std::iter::repeat_n(Step::default(), 24).collect();
    let wrong = [
        Command::Pattern { from: 110, steps },
        Command::Burst { steps: 129, run_up: 0, slower: 0, repeats: 1 },
        Command::Burst { steps: 0, run_up: 0, slower: 0, repeats: 1 },
        Command::Burst { steps: 4, run_up: 0, slower: 0, repeats: 0 },
        Command::CheckCapture { width: 10 },
    ];
    for (number, command) in (0..).zip(wrong) {
        assert_eq!(refusal(&typed(&mut station, &mut board, number, &command)), Some(Refusal::Range), "{command:?}");
    }
    typed(&mut station, &mut board, 9, &Command::Burst { steps: 128, run_up: 0, slower: 0, repeats: 3 });
    assert_eq!(board.bursts, [(128, 3)]);
}

#[test]
fn hello_puts_everything_at_rest() {
    let (mut station, mut board) = (Station::new(), Bare::default());
    typed(&mut station, &mut board, 1, &pieces(2));
    typed(&mut station, &mut board, 2, &Command::Reset { pulled: true });
    typed(&mut station, &mut board, 3, &Command::Lines { mask: Line::Beam.bit(), levels: 0 });
    let started = typed(&mut station, &mut board, 4, &Command::Start);
    assert!(matches!(started[..], [Record::Started(42), Record::Done(Done { refusal: None, .. })]), "{started:?}");
    assert_eq!(refusal(&typed(&mut station, &mut board, 5, &Command::Start)), Some(Refusal::Playing));
    typed(&mut station, &mut board, 5, &Command::Hello);
    assert!(!board.reset && !board.player.is_playing() && board.player.room() == QUEUE_PIECES);
    assert_eq!(board.player.levels(), AT_REST);
}

#[test]
fn records_without_room_leave_a_gap_in_the_numbers() {
    let mut station = Station::new();
    for time in 0..20 {
        station.record(Record::Led { time, lit: true });
    }
    let mut receiver = Receiver::new();
    let mut numbers = Vec::new();
    while let Some(frame) = station.next_frame() {
        for byte in frame {
            numbers.extend(receiver.take::<Record>(byte).map(|found| found.0));
        }
    }
    station.record(Record::Led { time: 20, lit: true });
    let next = station.next_frame().expect("it waits");
    let (number, _) = next.iter().find_map(|&byte| receiver.take::<Record>(byte)).expect("whole");
    assert_eq!((numbers, number), ((0..12).collect(), 20));
}

#[test]
fn a_player_counts_through_the_four_steps_and_back() {
    let mut player = Player::new();
    let (a, b) = (Line::EncoderA.bit(), Line::EncoderB.bit());
    let plan = [
        Piece { wait: 100, count: 4, action: Action::Forward },
        Piece { wait: 50, count: 2, action: Action::Backward },
        Piece { wait: 10, count: 1, action: Action::End },
    ];
    plan.into_iter().for_each(|piece| player.push(piece));
    assert_eq!(player.start(), Next::After(100));
    let mut seen = Vec::new();
    loop {
        let next = player.fire();
        seen.push((player.levels() & (a | b), player.position()));
        if next == Next::Ended {
            break;
        }
    }
    assert_eq!(seen, [(a, 1), (a | b, 2), (b, 3), (0, 4), (b, 3), (a | b, 2), (a | b, 2)]);
}

#[test]
fn a_plan_without_its_next_piece_is_dry_and_a_frozen_line_keeps_its_level() {
    let mut player = Player::new();
    let b = Line::EncoderB.bit();
    let freeze = Piece { wait: 10, count: 1, action: Action::Freeze { mask: b } };
    let roll = Piece { wait: 10, count: 4, action: Action::Forward };
    player.push(freeze);
    player.push(roll);
    player.start();
    assert_eq!(player.fire(), Next::After(10));
    for _ in 0..3 {
        assert_eq!(player.fire(), Next::After(10));
        assert_eq!(player.levels() & b, 0);
    }
    assert_eq!(player.fire(), Next::Dry);
    assert_eq!(player.position(), 4);
}
