//! Parses a line of a receiver: NMEA 0183, by the crate `nmea`.
//!
//! Position, date and quality come from the sentences RMC and GGA, of any satellites. Other sentences are ignored. A
//! line is damaged if it does not have the form of a sentence, or if its checksum is missing or wrong. The content of a
//! damaged line is not used. A sentence with the right checksum and invalid fields means that there is no fix.

use crate::plane::Place;
use chrono::{Datelike, Timelike};
use nmea::ParseResult;
use nmea::sentences::{FixType, rmc::RmcStatusOfFix};
use strum::Display;

/// Milliseconds in a day.
pub const DAY_MS: i64 = 86_400_000;

/// How good a fix is, by the receiver's own word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Display)]
pub enum Quality {
    /// From the satellites alone.
    #[strum(to_string = "satellites")]
    Satellites,
    /// Corrected by signals from a satellite, such as those of SBAS, or from a station.
    #[strum(to_string = "differential")]
    Differential,
    /// By the carrier's phase, before the number of whole waves is certain.
    #[strum(to_string = "float RTK")]
    FloatRtk,
    /// By the carrier's phase.
    #[strum(to_string = "RTK")]
    Rtk,
}

impl Quality {
    /// The usual standard deviation of a fix to the east and to the north under an open sky, in metres.
    pub fn usual_error_m(self) -> f64 {
        match self {
            Self::Satellites => 1.5,
            Self::Differential => 0.7,
            Self::FloatRtk => 0.3,
            Self::Rtk => 0.015,
        }
    }
}

/// The values of a sentence for one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Report {
    /// Milliseconds since midnight, UTC. `None` if the receiver does not know.
    pub time_ms: Option<i64>,
    /// Days since the first of January 1970. `None` if this sentence has no date.
    pub day: Option<i64>,
    /// The position. `None` if there is no fix.
    pub place: Option<Place>,
    /// Its quality. `None` if this sentence does not have it.
    pub quality: Option<Quality>,
}

/// The kinds of line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Line {
    /// A sentence with a position or time.
    Report(Report),
    /// Another sentence.
    Other,
    /// No sentence, or a damaged one.
    Damaged,
}

impl Line {
    /// Parses a line, without its end.
    pub fn parse(line: &str) -> Self {
        let line = line.trim();
        if !has_right_checksum(line) {
            return Self::Damaged;
        }
        let is_of = |kind: &str| line.get(3..6) == Some(kind) && !line.starts_with("$P");
        if !is_of("RMC") && !is_of("GGA") {
            return Self::Other;
        }
        Self::Report(match nmea::parse_str(line) {
            Ok(ParseResult::RMC(said)) => {
                // By NMEA 2.3 and later. Before, only the status says whether there is a fix.
                let of_mode = said.faa_mode.map(|mode| quality(mode.into()));
                let is_valid = said.status_of_fix != RmcStatusOfFix::Invalid && of_mode != Some(None);
                Report {
                    time_ms: said.fix_time.map(milliseconds),
                    day: said.fix_date.map(|date| i64::from(date.num_days_from_ce()) - EPOCH_DAY),
                    place: place(said.lat, said.lon).filter(|_| is_valid),
                    quality: of_mode.flatten(),
                }
            }
            Ok(ParseResult::GGA(said)) => {
                let quality = said.fix_type.and_then(quality);
                Report {
                    time_ms: said.fix_time.map(milliseconds),
                    day: None,
                    place: place(said.latitude, said.longitude).filter(|_| quality.is_some()),
                    quality,
                }
            }
            _ => Report { time_ms: None, day: None, place: None, quality: None },
        })
    }
}

/// The first of January 1970, counted as `chrono` counts days.
const EPOCH_DAY: i64 = 719_163;

fn milliseconds(time: chrono::NaiveTime) -> i64 {
    let whole = i64::from(time.num_seconds_from_midnight()) * 1000;
    (whole + i64::from(time.nanosecond()) / 1_000_000) % DAY_MS
}

fn place(latitude: Option<f64>, longitude: Option<f64>) -> Option<Place> {
    Place::new(latitude?, longitude?)
}

/// The quality of a fix by satellites. `None` for other fixes.
fn quality(fix: FixType) -> Option<Quality> {
    match fix {
        FixType::Gps | FixType::Pps => Some(Quality::Satellites),
        FixType::DGps => Some(Quality::Differential),
        FixType::FloatRtk => Some(Quality::FloatRtk),
        FixType::Rtk => Some(Quality::Rtk),
        FixType::Invalid | FixType::Estimated | FixType::Manual | FixType::Simulation => None,
    }
}

/// The line of a sentence with this text, without its end.
pub fn framed(text: &str) -> String {
    format!("${text}*{:02X}", checksum(text))
}

/// The exclusive or of the text's bytes.
fn checksum(text: &str) -> u8 {
    text.bytes().fold(0, |sum, byte| sum ^ byte)
}

/// Whether a line is `$`, a text, and after `*` its checksum. `nmea` checks this only for sentences that it knows.
fn has_right_checksum(line: &str) -> bool {
    let parts = line.strip_prefix('$').and_then(|line| line.split_once('*'));
    let Some((text, told)) = parts.filter(|(_, told)| told.len() == 2) else { return false };
    let is_text = text.bytes().all(|byte| matches!(byte, b' '..=b'~') && byte != b'$');
    is_text && u8::from_str_radix(told, 16) == Ok(checksum(text))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[track_caller]
    fn report(text: &str) -> Report {
        match Line::parse(&framed(text)) {
            Line::Report(report) => report,
            other => panic!("{other:?}"),
        }
    }

    const GGA: &str = "GNGGA,092750.25,5321.6802,N,00630.3372,W,4,8,1.03,61.7,M,55.2,M,,";
    const RMC: &str = "GPRMC,225446.00,A,4916.45,S,17959.99,E,000.5,054.7,191194,020.3,E,A";

    #[test]
    fn place_time_and_quality_are_read_of_either_sentence() {
        let gga = report(GGA);
        let place = gga.place.expect("there is a fix");
        assert!((place.latitude - 53.361_336_7).abs() < 1e-6 && (place.longitude + 6.505_62).abs() < 1e-6, "{place:?}");
        assert_eq!((gga.time_ms, gga.day, gga.quality), (Some(34_070_250), None, Some(Quality::Rtk)));
        let rmc = report(RMC);
        let place = rmc.place.expect("there is a fix");
        assert!((place.latitude + 49.274_166_7).abs() < 1e-6 && (place.longitude - 179.999_833_3).abs() < 1e-6);
        // The 19th of November 1994.
        assert_eq!((rmc.day, rmc.quality), (Some(9088), Some(Quality::Satellites)));
    }

    #[test]
    fn without_satellites_there_is_no_place() {
        for text in [
            "GPRMC,225446.00,V,,,,,,,191194,,,N",
            "GPRMC,,V,,,,,,,,,,N",
            "GPGGA,,,,,,0,00,99.99,,,,,,",
            // Dead reckoning, set by hand, simulated.
            "GPGGA,092750.25,5321.6802,N,00630.3372,W,6,8,1.03,61.7,M,55.2,M,,",
            "GPRMC,225446.00,A,4916.45,N,12311.12,W,000.5,054.7,191194,020.3,E,E",
            // A right checksum makes no sense of these.
            "GPGGA,092750.25,9521.6802,N,00630.3372,W,1,8,1.03,61.7,M,55.2,M,,",
            "GPGGA,092750.25,53nan,N,00630.3372,W,1,8,1.03,61.7,M,55.2,M,,",
            "GPRMC,nonsense",
        ] {
            assert_eq!(report(text).place, None, "{text}");
        }
    }

    #[test]
    fn other_sentences_are_passed_over_and_other_lines_are_damaged() {
        for text in ["GPGSV,1,1,00", "PUBX,00,1", "AIVDM,1,1,,A,0", "X"] {
            assert_eq!(Line::parse(&framed(text)), Line::Other, "{text}");
        }
        for line in ["", "$", "hello", "$*", "$GPGSV,1,1,00", "$GPGSV,1,1,00*7", "$GPGSV,1,1,00*7B0", "$\u{FFFD}*00"] {
            assert_eq!(Line::parse(line), Line::Damaged, "{line}");
        }
        assert_eq!(Line::parse(&format!("{}\r", framed(GGA))), Line::parse(&framed(GGA)));
    }

    proptest! {
        #[test]
        fn a_sentence_with_a_changed_character_or_without_its_end_is_damaged(
            which in 0..2_usize, at in 0..200_usize, by in 1..127_u8, cut in any::<bool>(),
        ) {
            let whole = framed([GGA, RMC][which]);
            let at = at % whole.len();
            let line = if cut {
                whole[..at].to_owned()
            } else {
                let mut bytes = whole.clone().into_bytes();
                bytes[at] ^= by & 0x7F;
                String::from_utf8(bytes).expect("it stays ASCII")
            };
            // Letters of the checksum may be in lower case.
            prop_assume!(!line.eq_ignore_ascii_case(&whole));
            prop_assert_eq!(Line::parse(&line), Line::Damaged, "{}", line);
        }

        #[test]
        fn any_line_is_read_or_refused(line in ".{0,120}", kind in 0..3_usize) {
            Line::parse(&line);
            let text: String = line.chars().filter(|letter| matches!(letter, ' '..='~') && !"$*".contains(*letter)).collect();
            Line::parse(&framed(&format!("{}{text}", ["GPRMC,", "GPGGA,", "P"][kind])));
        }
    }
}
