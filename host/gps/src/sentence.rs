//! NMEA 0183: finds the sentences among a receiver's bytes, and reads RMC and GGA.
//!
//! [`Finder`] finds sentences. One begins at a `$` and ends behind its checksum. So binary blocks, tags, other text in
//! front, and any line end may stand between. [`Line::parse`] reads one: position, date and quality come from RMC and
//! GGA, of any satellites. Other sentences are ignored, and so are an RMC and a GGA with a field that cannot be.
//!
//! A sentence is damaged if its checksum is missing or wrong. Its content is not used. Binary is not damage.

use crate::plane::Place;
use strum::Display;

/// Milliseconds in a day.
pub const DAY_MS: i64 = 86_400_000;

/// Metres in a minute of latitude.
const MINUTE_M: f64 = 1852.0;

/// The longest sentence, in bytes. The standard allows 82, and receivers' own sentences are longer.
const LONGEST: usize = 256;

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
    /// Days since the first of January 1970. `None` if this sentence has no date, or one before 2020.
    pub day: Option<i64>,
    /// The position. `None` if there is no fix.
    pub place: Option<Place>,
    /// The position's last digit in metres.
    pub digit_m: f64,
    /// Its quality. `None` if this sentence does not have it.
    pub quality: Option<Quality>,
}

/// The kinds of sentence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Line {
    /// It has a position or time.
    Report(Report),
    /// Another sentence, or one that this module cannot read.
    Other,
    /// No sentence, or a damaged one.
    Damaged,
}

impl Line {
    /// Parses a sentence, from its `$` to its checksum.
    pub fn parse(line: &str) -> Self {
        let Some(text) = checked(line) else { return Self::Damaged };
        let fields = Fields(text.split(',').collect());
        let kind = fields.at(0);
        let report = match kind.get(2..) {
            Some("RMC") if !kind.starts_with('P') => fields.rmc(),
            Some("GGA") if !kind.starts_with('P') => fields.gga(),
            _ => None,
        };
        report.map_or(Self::Other, Self::Report)
    }
}

/// The fields of a sentence. An absent one is empty.
struct Fields<'a>(Vec<&'a str>);

impl<'a> Fields<'a> {
    fn at(&self, index: usize) -> &'a str {
        self.0.get(index).copied().unwrap_or_default()
    }

    /// The values of RMC. `None` if a field cannot be.
    fn rmc(&self) -> Option<Report> {
        let is_valid = match self.at(2) {
            "A" | "D" => true,
            "V" | "" => false,
            _ => return None,
        };
        // By NMEA 2.3 and later. Before, only the status says whether there is a fix.
        let (has_mode, quality) = match self.at(12) {
            "" => (false, None),
            "A" | "P" => (true, Some(Quality::Satellites)),
            "D" => (true, Some(Quality::Differential)),
            "F" => (true, Some(Quality::FloatRtk)),
            "R" => (true, Some(Quality::Rtk)),
            // None, dead reckoning, set by hand, simulated.
            "N" | "E" | "M" | "S" => (true, None),
            _ => return None,
        };
        let report = self.report(3, is_valid && (quality.is_some() || !has_mode), quality)?;
        Some(Report { day: day(self.at(9)), ..report })
    }

    /// The values of GGA. `None` if a field cannot be.
    fn gga(&self) -> Option<Report> {
        let quality = match self.at(6) {
            "1" | "3" => Some(Quality::Satellites),
            // 9 is SBAS in NovAtel's receivers.
            "2" | "9" => Some(Quality::Differential),
            "4" => Some(Quality::Rtk),
            "5" => Some(Quality::FloatRtk),
            "0" | "6" | "7" | "8" | "" => None,
            _ => return None,
        };
        self.report(2, quality.is_some(), quality)
    }

    /// The time in field 1, and the position from the field `first` on, if it is valid.
    fn report(&self, first: usize, is_valid: bool, quality: Option<Quality>) -> Option<Report> {
        let time_ms = match self.at(1) {
            "" => None,
            time => Some(time_of_day_ms(time)?),
        };
        let mut report = Report { time_ms, day: None, place: None, digit_m: 0.0, quality };
        let coordinates = [0, 1, 2, 3].map(|at| self.at(first + at));
        if is_valid && coordinates != [""; 4] {
            let (latitude, north_m) = degrees(coordinates[0], coordinates[1], ["N", "S"])?;
            let (longitude, east_m) = degrees(coordinates[2], coordinates[3], ["E", "W"])?;
            let place = Place::new(latitude, longitude)?;
            // A receiver that does not know its position may send zeros.
            report.place = Some(place).filter(|place| (place.latitude, place.longitude) != (0.0, 0.0));
            report.digit_m = f64::max(north_m, east_m);
        }
        Some(report)
    }
}

/// Two digits of a text that has no other characters.
fn pair(text: &str, at: usize) -> Option<i64> {
    text.get(at..at + 2).filter(|pair| pair.bytes().all(|byte| byte.is_ascii_digit()))?.parse().ok()
}

/// Milliseconds since midnight of `hhmmss`, with or without a fraction.
fn time_of_day_ms(text: &str) -> Option<i64> {
    let (whole, fraction) = text.split_once('.').unwrap_or((text, ""));
    let (hours, minutes, seconds) = (pair(whole, 0)?, pair(whole, 2)?, pair(whole, 4)?);
    let is_one = whole.len() == 6 && hours < 24 && minutes < 60 && seconds <= 60 && is_digits(fraction);
    let milliseconds: i64 = format!("{fraction:0<3}").get(..3)?.parse().ok()?;
    is_one.then_some(((hours * 60 + minutes) * 60 + seconds) * 1000 + milliseconds).map(|time_ms| time_ms % DAY_MS)
}

/// Days since 1970 of `ddmmyy`. `None` if it is no date, or if it is before 2020: a receiver does not know yet, or has
/// counted its weeks wrong.
fn day(text: &str) -> Option<i64> {
    let (day, month, year) = (pair(text, 0)?, pair(text, 2)?, pair(text, 4)?);
    let date = chrono::NaiveDate::from_ymd_opt(2000 + year as i32, month as u32, day as u32)?;
    (text.len() == 6 && (20..80).contains(&year)).then(|| i64::from(date.to_epoch_days()))
}

/// Degrees of `dddmm.mmmm` and its hemisphere, and how many metres the last digit is.
fn degrees(text: &str, hemisphere: &str, [positive, negative]: [&str; 2]) -> Option<(f64, f64)> {
    let (whole, fraction) = text.split_once('.').unwrap_or((text, ""));
    let (degrees, _) = whole.split_at_checked(whole.len().checked_sub(2)?)?;
    if degrees.is_empty() || !is_digits(whole) || !is_digits(fraction) {
        return None;
    }
    let minutes: f64 = text[degrees.len()..].parse().ok().filter(|&minutes| minutes < 60.0)?;
    let value = degrees.parse::<f64>().ok()? + minutes / 60.0;
    let digit_m = MINUTE_M / 10_f64.powi(i32::try_from(fraction.len()).ok()?);
    match hemisphere {
        it if it == positive => Some((value, digit_m)),
        it if it == negative => Some((-value, digit_m)),
        _ => None,
    }
}

fn is_digits(text: &str) -> bool {
    text.bytes().all(|byte| byte.is_ascii_digit())
}

/// Finds the sentences in a receiver's bytes.
#[derive(Clone, Debug, Default)]
pub struct Finder {
    /// The text since the last `$`.
    text: Option<String>,
}

impl Finder {
    /// Takes a byte. Returns the sentence that ends with it or before it, from its `$` on. It may be damaged.
    pub fn take(&mut self, byte: u8) -> Option<String> {
        let ended = match byte {
            // Some receivers fill with it.
            0 => None,
            b'$' => self.text.replace("$".to_owned()),
            b' '..=b'~' => {
                let text = self.text.as_mut()?;
                text.push(char::from(byte));
                let has_checksum = text.len().checked_sub(3).is_some_and(|star| text.as_bytes()[star] == b'*');
                if has_checksum || text.len() == LONGEST { self.text.take() } else { None }
            }
            _ => self.text.take(),
        };
        // A `$` among binary begins no sentence.
        ended.filter(|text| checked(text).is_some() || has_address(text))
    }

    /// All sentences in these bytes, of which the last may not have its line end.
    pub fn all(bytes: &[u8]) -> Vec<String> {
        let mut finder = Self::default();
        bytes.iter().chain(b"\n").filter_map(|&byte| finder.take(byte)).collect()
    }
}

/// Whether a text begins as a sentence does: `$`, five capital letters or digits, and a comma.
fn has_address(text: &str) -> bool {
    let is_address = |address: &[u8]| address.iter().all(|byte| byte.is_ascii_uppercase() || byte.is_ascii_digit());
    matches!(text.as_bytes(), [b'$', address @ ..] if address.get(..5).is_some_and(is_address) && address.get(5) == Some(&b','))
}

/// The line of a sentence with this text, without its end.
pub fn framed(text: &str) -> String {
    format!("${text}*{:02X}", checksum(text))
}

/// The exclusive or of the text's bytes.
fn checksum(text: &str) -> u8 {
    text.bytes().fold(0, |sum, byte| sum ^ byte)
}

/// The text of a line that is `$`, a text, and after `*` its checksum.
fn checked(line: &str) -> Option<&str> {
    let (text, told) = line.strip_prefix('$')?.split_once('*')?;
    let is_text = text.bytes().all(|byte| matches!(byte, b' '..=b'~') && byte != b'$');
    (is_text && told.len() == 2 && u8::from_str_radix(told, 16) == Ok(checksum(text))).then_some(text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use chrono::Timelike;
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
    fn without_satellites_there_is_no_place() {
        for text in [
            "GPRMC,225446.00,V,,,,,,,191194,,,N",
            "GPRMC,,V,,,,,,,,,,N",
            "GPGGA,,,,,,0,00,99.99,,,,,,",
            // Dead reckoning, set by hand, simulated.
            "GPGGA,092750.25,5321.6802,N,00630.3372,W,6,8,1.03,61.7,M,55.2,M,,",
            "GPRMC,225446.00,A,4916.45,N,12311.12,W,000.5,054.7,191194,020.3,E,E",
            "GPRMC,225446.00,A,4916.45,N,12311.12,W,000.5,054.7,191194,,E,E",
            "GPRMC,225446.00,A,0000.0000,N,00000.0000,E,000.5,054.7,191194,,,A",
            "GNRMC,000000.25,A,0000.0,N,00000.0,E,1.35,90.0,140626,,,R",
            "GNGGA,000000.25,0000.0,N,00000.0,E,4,18,0.6,42.0,M,46.0,M,1.0,0001",
        ] {
            assert_eq!(report(text).place, None, "{text}");
        }
    }

    #[test]
    fn a_quality_is_in_its_own_field_and_a_date_that_cannot_be_is_none() {
        for (text, quality, day) in [
            (GGA, Some(Quality::Rtk), None),
            // A date before 2020 is none.
            (RMC, Some(Quality::Satellites), None),
            ("GNRMC,101500,A,5130.0,N,00006.0,E,1.35,90.0,140626,,E,R", Some(Quality::Rtk), Some(20_618)),
            ("GNRMC,101500,A,5130.0,N,00006.0,E,1.35,90.0,000000,,,F", Some(Quality::FloatRtk), None),
            ("GNRMC,101500,A,5130.0,N,00006.0,E,1.35,90.0,140699", None, None),
            ("GNGGA,101500,5130.0,N,00006.0,E,9,18,0.6,42.0,M,46.0,M,,", Some(Quality::Differential), None),
        ] {
            let report = report(text);
            assert_eq!((report.quality, report.day, report.place.is_some()), (quality, day, true), "{text}");
        }
    }

    #[test]
    fn only_lines_without_a_valid_frame_count_as_damaged() {
        for text in [
            "GPGSV,1,1,00",
            "PUBX,00,1",
            "AIVDM,1,1,,A,0",
            "X",
            "GPRMC,nonsense",
            "GPGGA,092750.25,9521.6802,N,00630.3372,W,1,8,1.03,61.7,M,55.2,M,,",
            "GPGGA,092750.25,53nan,N,00630.3372,W,1,8,1.03,61.7,M,55.2,M,,",
            "GPGGA,092750.25,5321.6802,N,00630.3372,W,X,8,1.03,61.7,M,55.2,M,,",
            "GPGGA,252750.25,5321.6802,N,00630.3372,W,1,8,1.03,61.7,M,55.2,M,,",
        ] {
            assert_eq!(Line::parse(&framed(text)), Line::Other, "{text}");
        }
        for line in ["", "$", "hello", "$*", "$GPGSV,1,1,00", "$GPGSV,1,1,00*7", "$GPGSV,1,1,00*7B0", "$\u{FFFD}*00"] {
            assert_eq!(Line::parse(line), Line::Damaged, "{line}");
        }
    }

    /// The values that the crate `nmea` reads of a sentence.
    fn by_another(line: &str) -> (Option<f64>, Option<f64>, Option<i64>) {
        let ms = |time: chrono::NaiveTime| {
            i64::from(time.num_seconds_from_midnight()) * 1000 + i64::from(time.nanosecond()) / 1_000_000
        };
        match nmea::parse_str(line) {
            Ok(nmea::ParseResult::RMC(it)) => (it.lat, it.lon, it.fix_time.map(ms)),
            Ok(nmea::ParseResult::GGA(it)) => (it.latitude, it.longitude, it.fix_time.map(ms)),
            other => panic!("{other:?}"),
        }
    }

    /// What receivers and programs put between sentences.
    fn between() -> impl Strategy<Value = Vec<u8>> {
        let binary = prop::collection::vec(any::<u8>(), 0..40).prop_map(|mut bytes| {
            // A `$` in a binary block in front of a sentence only makes it begin later.
            bytes.push(0xB5);
            bytes
        });
        let text = prop::sample::select(vec![
            "",
            "\\s:GP0001*5F\\",
            "10:15:00.2 ",
            "gps: ",
            "\0\0",
            "$",
            "$GPXXX,",
            "\u{feff}",
        ]);
        prop_oneof![binary, text.prop_map(|text| text.as_bytes().to_vec())]
    }

    proptest! {
        #[test]
        fn sentences_are_found_among_anything(
            pieces in prop::collection::vec((between(), 0..3_usize, prop::sample::select(vec!["\r\n", "\r", "\n", "", "\0"])), 1..20),
        ) {
            let sentences = [framed(GGA), framed(RMC), framed("GPGSV,1,1,00")];
            let mut bytes = Vec::new();
            for (between, which, end) in &pieces {
                bytes.extend(between);
                bytes.extend(sentences[*which].bytes());
                bytes.extend(end.bytes());
            }
            let found: Vec<String> =
                Finder::all(&bytes).into_iter().filter(|text| Line::parse(text) != Line::Damaged).collect();
            let sent: Vec<String> = pieces.iter().map(|(_, which, _)| sentences[*which].clone()).collect();
            prop_assert_eq!(found, sent);
        }

        #[test]
        fn binary_is_neither_a_fix_nor_damage(bytes in prop::collection::vec(any::<u8>(), 0..4000)) {
            prop_assert_eq!(Finder::all(&bytes), Vec::<String>::new());
        }

        // More minutes, rounded to one digit, would be 60.0, which is refused.
        #[test]
        fn values_are_those_that_another_parser_reads(
            latitude in 0..90_u32, longitude in 0..180_u32, minutes in 0.0..59.94_f64, digits in 1..8_usize,
            ns in prop::sample::select(vec!['N', 'S']), ew in prop::sample::select(vec!['E', 'W']), second in 0..86_400_u32,
        ) {
            let (hour, minute, second) = (second / 3600, second / 60 % 60, second % 60);
            let clock = format!("{hour:02}{minute:02}{second:02}.25");
            let minutes = format!("{minutes:0width$.digits$}", width = digits + 3);
            let place = format!("{latitude:02}{minutes},{ns},{longitude:03}{minutes},{ew}");
            for text in [
                format!("GNRMC,{clock},A,{place},1.35,90.0,140626,,,R"),
                format!("GNGGA,{clock},{place},4,18,0.6,42.0,M,46.0,M,1.0,0001"),
            ] {
                let (north, east, time_ms) = by_another(&framed(&text));
                // A receiver that does not know its position may send zeros: that is no fix.
                prop_assume!((north, east) != (Some(0.0), Some(0.0)));
                let report = report(&text);
                prop_assert_eq!(report.time_ms, time_ms);
                let place = report.place.expect("there is a fix");
                prop_assert!((place.latitude - north.unwrap()).abs() < 1e-9 && (place.longitude - east.unwrap()).abs() < 1e-9);
                prop_assert!((report.digit_m - 1852.0 * 0.1_f64.powi(digits as i32)).abs() < 1e-6);
            }
        }

        #[test]
        fn a_sentence_with_a_changed_character_or_without_its_end_is_not_used(
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
            prop_assert!(Finder::all(line.as_bytes()).iter().all(|text| Line::parse(text) == Line::Damaged), "{}", line);
        }

        #[test]
        fn any_line_is_read_or_refused(line in ".{0,120}", kind in 0..3_usize) {
            Line::parse(&line);
            let text: String = line.chars().filter(|letter| matches!(letter, ' '..='~') && !"$*".contains(*letter)).collect();
            Line::parse(&framed(&format!("{}{text}", ["GPRMC,", "GPGGA,", "P"][kind])));
        }
    }
}
