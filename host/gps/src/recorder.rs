//! The receiver's part of a log while it is written: its lines, and marks for its faults.
//!
//! [`Recorder::take`] makes lines of the log from received bytes. Sentences with a position or time are logged
//! unchanged, and so is every damaged one. Other sentences and bytes are left out. A reader of the log can derive the
//! same marks again, except that no sentence is of use. The recorder opens no port: the caller reports a connected or lost port by [`Recorder::found`] and
//! [`Recorder::lost`].

use crate::antenna::Antenna;
use crate::receiver::Receiver;
use crate::sentence::{Finder, Line};
use link::session::Happening;
use logbook::follower::{Distance, tick_mm};
use logbook::log::Kind;

/// A receiver that is silent for this long is lost, in ms. Every receiver sends a line within five seconds.
const SILENCE_MS: u64 = 5_000;

/// A receiver whose bytes have no RMC or GGA for this long is of no use, in ms.
const USELESS_MS: u64 = 5_000;

/// Why a receiver's lines are of no use.
const NO_POSITION: &str = "no line has RMC or GGA of NMEA 0183: turn these sentences on in the receiver";
const NO_SENTENCE: &str = "no line is NMEA 0183: check --gps-baud and the cable, and turn NMEA on in the receiver";
const NO_CHECKSUM: &str = "the lines of NMEA 0183 have no checksum: turn it on in the receiver";

/// Why the lines up to this sentence are of no use. `why` is the reason before it.
pub(crate) fn useless(why: &'static str, line: &Line, sentence: &str) -> &'static str {
    match line {
        Line::Damaged if why == NO_POSITION || sentence.contains('*') => why,
        Line::Damaged => NO_CHECKSUM,
        _ => NO_POSITION,
    }
}

/// Lines of the log: their kind and text.
pub type Lines = Vec<(Kind, String)>;

/// The receiver's part of a log.
#[derive(Debug, Default)]
pub struct Recorder {
    receiver: Receiver,
    sentences: Finder,
    /// Time of the last input. `None` if its silence was reported.
    heard_ms: Option<u64>,
    /// Since when there was no RMC or GGA. `None` if that was reported.
    useless_since_ms: Option<u64>,
    /// Why no line since then is of use.
    useless: &'static str,
    tick_mm: f64,
    distance: Distance,
}

impl Recorder {
    /// A recorder before any input, and the first line of the log: the antenna's offsets.
    pub fn new(antenna: &Antenna) -> (Self, Lines) {
        let recorder = Self { receiver: Receiver::new(antenna.error_m()), ..Self::default() };
        (recorder, vec![(Kind::Antenna, antenna.to_string())])
    }

    /// The machine's side of the record.
    pub fn happened(&mut self, time_ms: u64, happening: &Happening) {
        match happening {
            Happening::Connected { settings, .. } | Happening::Settings(settings, _) => {
                let tick_mm = tick_mm(settings);
                if matches!(happening, Happening::Connected { .. }) || tick_mm != self.tick_mm {
                    self.wheel_lost();
                }
                self.tick_mm = tick_mm;
            }
            Happening::Lost(_) => self.wheel_lost(),
            Happening::Status(status, _) => {
                if !self.distance.take(status.position, self.tick_mm) {
                    self.receiver.wheel_lost();
                }
                let rolled_m = self.distance.at(status.position, self.tick_mm).unwrap_or_default() / 1000.0;
                self.receiver.rolled(time_ms as f64, rolled_m, f64::from(status.speed_mm_s));
            }
            _ => {}
        }
    }

    fn wheel_lost(&mut self) {
        self.distance = Distance::default();
        self.receiver.wheel_lost();
    }

    /// The receiver is there: the name of its port, or that it sends again.
    pub fn found(&mut self, time_ms: u64, text: &str) -> Lines {
        self.sentences = Finder::default();
        (self.heard_ms, self.useless_since_ms, self.useless) = (Some(time_ms), Some(time_ms), NO_SENTENCE);
        vec![(Kind::GpsFound, text.to_owned())]
    }

    /// It is gone; why.
    pub fn lost(&mut self, why: &str) -> Lines {
        self.heard_ms = None;
        self.receiver.silent();
        [(Kind::GpsLost, why.to_owned())].into_iter().chain(self.marks()).collect()
    }

    /// Takes received bytes, or none.
    pub fn take(&mut self, time_ms: u64, bytes: &[u8]) -> Lines {
        let mut lines = Lines::new();
        if !bytes.is_empty() && self.heard_ms.replace(time_ms).is_none() {
            lines = self.found(time_ms, "the receiver sends again");
        }
        for &byte in bytes {
            let Some(sentence) = self.sentences.take(byte) else { continue };
            let line = Line::parse(&sentence);
            self.useless = useless(self.useless, &line, &sentence);
            let kind = match line {
                Line::Other => continue,
                Line::Damaged => Kind::GpsDamaged,
                Line::Report(_) => {
                    (self.useless_since_ms, self.useless) = (Some(time_ms), NO_SENTENCE);
                    Kind::Gps
                }
            };
            self.receiver.take(time_ms as f64, &sentence);
            lines.push((kind, sentence));
            lines.extend(self.marks());
        }
        let is_past =
            |since_ms: Option<u64>, limit_ms| since_ms.is_some_and(|ms| time_ms.saturating_sub(ms) > limit_ms);
        if !bytes.is_empty() && is_past(self.useless_since_ms, USELESS_MS) {
            self.useless_since_ms = None;
            lines.push((Kind::GpsMark, self.useless.to_owned()));
        }
        if is_past(self.heard_ms, SILENCE_MS) {
            lines.extend(self.lost("the receiver is silent"));
        }
        lines
    }

    /// The counts, if the record ends here.
    pub fn counts(&self) -> crate::receiver::Counts {
        let mut receiver = self.receiver.clone();
        receiver.end();
        receiver.counts
    }

    fn marks(&mut self) -> impl Iterator<Item = (Kind, String)> {
        self.receiver.fixes.clear();
        self.receiver.marks.drain(..).map(|mark| (Kind::GpsMark, mark.to_string()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GGA: &str = "$GPGGA,092750.000,5321.6802,N,00630.3372,W,1,8,1.03,61.7,M,55.2,M,,*76";

    fn connected() -> Recorder {
        let (mut recorder, _) = Recorder::new(&Antenna::default());
        recorder.found(0, "a port");
        recorder
    }

    fn kinds(lines: &Lines) -> Vec<Kind> {
        lines.iter().map(|(kind, _)| *kind).collect()
    }

    #[test]
    fn lines_are_kept_however_they_come_in_pieces_and_damaged_ones_too() {
        let stream = format!("80.1,M*12\r\n{GGA}\r\n$GPGSV,3,1,09*00\r\n{}\r\n{GGA}\r\n", GGA.replace("5321", "5322"));
        for length in 1..60 {
            let mut recorder = connected();
            let lines: Lines = stream.as_bytes().chunks(length).flat_map(|piece| recorder.take(10, piece)).collect();
            assert_eq!(kinds(&lines), [Kind::Gps, Kind::GpsDamaged, Kind::GpsDamaged, Kind::Gps], "{length}");
            assert_eq!(lines[0].1, GGA);
            assert_eq!(recorder.counts().fixes, 1, "the last fix counts");
        }
    }

    #[test]
    fn bytes_without_a_position_are_reported_once_after_5_s() {
        let without_checksum = GGA.replace("*76", "\r\n");
        let with_others = format!("$GPGSV,1,1,00*79\r\n{without_checksum}");
        for (bytes, advice) in [
            (&b"\x80x\xFF\n"[..], "--gps-baud"),
            (&b"$GPGSV,1,1,00*79\r\n"[..], "RMC or GGA"),
            (without_checksum.as_bytes(), "no checksum"),
            (with_others.as_bytes(), "RMC or GGA"),
        ] {
            let mut recorder = connected();
            let mut lines: Lines = (0..200).flat_map(|tenth| recorder.take(100 * tenth, bytes)).collect();
            lines.retain(|(kind, _)| *kind != Kind::GpsDamaged);
            assert_eq!(kinds(&lines), [Kind::GpsMark], "{lines:?}");
            assert!(lines[0].1.contains(advice), "{lines:?}");
        }
    }

    #[test]
    fn a_receiver_that_falls_silent_is_lost_once_and_so_is_its_fix() {
        let mut recorder = connected();
        recorder.take(100, format!("{GGA}\r\n").as_bytes());
        let later: Vec<Lines> = (1..10).map(|second| recorder.take(1000 * second, b"")).collect();
        let told: Lines = later.into_iter().flatten().collect();
        assert_eq!(kinds(&told), [Kind::GpsLost, Kind::GpsMark, Kind::GpsMark], "{told:?}");
        assert_eq!(told[2].1, "no fix");
        assert_eq!(kinds(&recorder.lost("unplugged")), [Kind::GpsLost]);
    }

    #[test]
    fn a_returned_receiver_is_found_without_losing_its_first_bytes() {
        let mut recorder = connected();
        recorder.take(100, format!("{GGA}\r\n").as_bytes());
        assert_eq!(recorder.take(6000, b"")[0].0, Kind::GpsLost);
        assert_eq!(kinds(&recorder.take(8000, &GGA.as_bytes()[..5])), [Kind::GpsFound]);
        assert_eq!(recorder.take(8100, format!("{}\r\n", &GGA[5..]).as_bytes())[0], (Kind::Gps, GGA.to_owned()));
    }

    #[test]
    fn the_antenna_s_line_in_a_record_is_read_again() {
        let default = Antenna::default();
        for antenna in [
            default,
            Antenna { beam_ahead_mm: -250.5, beam_right_mm: 30.0, delay_ms: 80.0, ..default },
            Antenna { tool_ahead_mm: Some(-700.0), tool_right_mm: Some(-5.0), error_mm: Some(20.0), ..default },
        ] {
            let (_, lines) = Recorder::new(&antenna);
            assert_eq!(Antenna::parse(&lines[0].1), Some(antenna));
        }
        assert_eq!(Antenna::parse("beam_ahead_mm=nan beam_right_mm=0 delay_ms=0"), None);
    }
}
