//! Parses the firmware's lines with `key=value` words: events, and the answer to `status`.
//!
//! Lines are `name key=value key=value`. Unknown keys are ignored, so that a newer firmware may add more. An event
//! that lacks a key, or has a value that is not known here, is [`EventLine::Newer`].

mod field;
pub(crate) mod kind;
mod values;

pub use self::field::{Field, Fields};
pub use self::values::Values;
use self::values::behind;
use control::alarm::{Alarm, Warning};
use control::ground::class::Class;
use control::operate::calibration::{Outcome, SwingTimes};
use control::operate::event::Event;
use control::operate::state::State;
use strum::{EnumString, IntoStaticStr};

/// A line, as the [tables](control::line_tables) describe it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LineDescription {
    /// Its name.
    pub name: &'static str,
    /// What it says.
    pub meaning: &'static str,
    /// Its beginning. Empty if a value comes first.
    pub beginning: &'static str,
    /// Its values, in their order.
    pub values: &'static [ValueDescription],
}

/// A value in a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ValueDescription {
    /// The text before `=`. Empty for a value without a key.
    pub key: &'static str,
    /// The kind of its value, by its name in the table. Empty for a value without a key.
    pub kind: &'static str,
    /// The field of [`EventLine`], [`Status`], [`Counts`] or [`ConsoleLine`](crate::ConsoleLine) for this value, and its type. `None` if another value has the same content.
    pub field: Option<(&'static str, &'static str)>,
    /// What it tells.
    pub meaning: &'static str,
}

/// Makes all of the lines from the tables: their types, descriptions and parsers.
macro_rules! read_lines {
    (
        events {$(
            $Event:ident $meaning:literal, $pattern:pat => $beginning:literal {
                $($part:literal $kind:ident($value:expr) $(=> $field:ident: $Type:ty)?, $about:literal;)*
            } $($tail:literal)?
        )*}
        status $machine:ident {$(
            $Line:ident $says:literal $($(if $condition:pat = $from:expr =>)? {
                $($word:literal $of:ident($state:expr) $(=> $to:ident: $To:ty)?, $tells:literal;)*
            })*;
        )*}
    ) => {
        /// An event that the machine reported, as [`Event`] was written.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum EventLine {
            $(
                #[doc = $meaning]
                $Event {
                    $($(
                        #[doc = $about]
                        $field: $Type,
                    )?)*
                },
            )*
            /// Points of a plotter's curves.
            Plot,
            /// An event that only a newer firmware has, or a value of one. The line says what it is.
            Newer {
                /// Whether it is an alarm.
                is_alarm: bool,
            },
        }

        /// All events, in the order of the table.
        pub const EVENTS: &[LineDescription] = &[$(LineDescription {
            name: stringify!($Event),
            meaning: $meaning,
            beginning: $beginning,
            values: &[$(ValueDescription {
                key: key($part),
                kind: stringify!($kind),
                field: [$(Some((stringify!($field), stringify!($Type))),)? None][0],
                meaning: $about,
            }),*],
        }),*];

        impl EventLine {
            /// Parses an event's line. `None` if it is no event.
            pub fn parse(line: &str) -> Option<Self> {
                if is_plot(line) {
                    return Some(Self::Plot);
                }
                $(
                    let read = |values: Values<'_>| {
                        let _ = &values;
                        Some(Self::$Event { $($($field: kind::$kind(values.text(key($part))?)?,)?)* })
                    };
                    if let Some(event) = behind(line, $beginning).and_then(read) {
                        return Some(event);
                    }
                )*
                is_event(line).then(|| Self::Newer { is_alarm: line.starts_with("alarm ") })
            }

            /// The event's name in [`EVENTS`], or `Plot` or `Newer`, and its fields by name.
            pub fn fields(&self) -> Fields {
                match *self {
                    $(Self::$Event { $($($field,)?)* } => {
                        (stringify!($Event), vec![$($((stringify!($field), $field.into()),)?)*])
                    })*
                    Self::Plot => ("Plot", Vec::new()),
                    Self::Newer { is_alarm } => ("Newer", vec![("is_alarm", is_alarm.into())]),
                }
            }
        }

        impl From<&Event> for EventLine {
            fn from(event: &Event) -> Self {
                match event {
                    $($pattern => Self::$Event { $($($field: $value.into(),)?)* },)*
                }
            }
        }

        $(
            #[doc = $says]
            #[derive(Clone, Debug, Default, PartialEq, Eq)]
            pub struct $Line {
                $($($(
                    #[doc = $tells]
                    pub $to: $To,
                )?)*)*
            }

            impl $Line {
                /// Parses the line. `None` if it is another.
                pub fn parse(line: &str) -> Option<Self> {
                    // Version 0.1 had another key for the alarm's name.
                    let line = line.replace(" alarm=", " name=");
                    let values = Values(&line);
                    Some(Self { $($($($to: Take::take(values.text(key($word)).and_then(kind::$of))?,)?)*)* })
                }

                /// Its name in [`STATUS`], and its fields by name.
                pub fn fields(&self) -> Fields {
                    (stringify!($Line), vec![$($($((stringify!($to), self.$to.clone().into()),)?)*)*])
                }
            }
        )*

        /// The lines of the answer to `status`.
        pub const STATUS: &[LineDescription] = &[$(LineDescription {
            name: stringify!($Line),
            meaning: $says,
            beginning: "",
            values: &[$($(ValueDescription {
                key: key($word),
                kind: stringify!($of),
                field: [$(Some((stringify!($to), stringify!($To))),)? None][0],
                meaning: $tells,
            }),*),*],
        }),*];

        /// Each line's name, keys and fields, from the machine itself.
        #[cfg(test)]
        fn fields_of_status($machine: &tests::Machine) -> Vec<(Vec<&'static str>, Fields)> {
            vec![$({
                let (mut keys, mut fields) = (Vec::new(), Vec::new());
                $($(if let $condition = $from)? {
                    $(keys.push(key($word)); $(fields.push((stringify!($to), Field::from($state)));)?)*
                })*
                (keys, (stringify!($Line), fields))
            }),*]
        }
    };
}

control::line_tables!(read_lines);

/// The key in a value's part of its line. Empty if it has none.
const fn key(part: &'static str) -> &'static str {
    let (bytes, mut start, mut end) = (part.as_bytes(), 0, 0);
    while end < bytes.len() && bytes[end] != b'=' {
        start += (bytes[end] == b' ') as usize;
        end += 1;
    }
    if end == bytes.len() { "" } else { part.split_at(end).0.split_at(start).1 }
}

/// Fills a field of the status with its value, if there is one. An optional field may be missing, or have a value that only a newer
/// firmware knows.
trait Take<T>: Sized {
    fn take(value: Option<T>) -> Option<Self>;
}

impl<T> Take<T> for T {
    fn take(value: Option<T>) -> Option<T> {
        value
    }
}

impl<T> Take<T> for Option<T> {
    fn take(value: Option<T>) -> Option<Self> {
        Some(value)
    }
}

/// The machine's state, without the reason for an alarm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, EnumString, IntoStaticStr)]
#[strum(serialize_all = "snake_case")]
pub enum Mode {
    /// The tool stays out.
    #[default]
    Hold,
    /// The tool weeds.
    Work,
    /// A fault is latched.
    Alarm,
}

impl From<State> for Mode {
    fn from(state: State) -> Self {
        match state {
            State::Hold => Self::Hold,
            State::Work => Self::Work,
            State::Alarm(_) => Self::Alarm,
        }
    }
}

impl Mode {
    /// Its name on the console.
    pub fn name(self) -> &'static str {
        self.into()
    }
}

pub(super) fn is_of_a_name(character: char) -> bool {
    character.is_ascii_alphanumeric() || character == '_'
}

pub(super) fn is_name(word: &str) -> bool {
    !word.is_empty() && word.chars().all(is_of_a_name)
}

/// Whether a line has the form of an event: its name, then a value with its key. No line of an answer has.
fn is_event(line: &str) -> bool {
    let is_value = |word: &str| word.split_once('=').is_some_and(|(key, value)| is_name(key) && !value.is_empty());
    let mut words = line.split(' ');
    line.bytes().all(|byte| matches!(byte, b' '..=b'~'))
        && words.next().is_some_and(is_name)
        && words.next().is_some_and(is_value)
}

/// Whether a line is plotter data: `label:value,label:value`, or Teleplot's format.
fn is_plot(line: &str) -> bool {
    let point = |point: &str| {
        point.split_once(':').is_some_and(|(label, value)| !label.is_empty() && value.parse::<i32>().is_ok())
    };
    line.strip_prefix('>').unwrap_or(line).split(',').all(point)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ConsoleLine;
    use crate::settings::Setting;
    use control::ground::class::Vote;
    use control::ground::examples::EXAMPLES;
    use control::ground::keep_out::Plan;
    use control::ground::nearest::Nearest;
    use control::measure::{readings::Readings, reset::Cause};
    use control::memory::Volatile;
    use control::operate::tool::Reason;
    use control::say::line::Line;
    use control::say::write_event;
    use control::units::{Instant, Position, Ticks};
    use rand::{RngExt, SeedableRng, seq::IteratorRandom};
    use rand_chacha::ChaCha8Rng;
    use rig::{Beams, ByExamples, Rig};
    use std::collections::{BTreeMap, BTreeSet};

    pub(super) type Machine = Rig<ByExamples>;

    fn line(event: Event) -> String {
        let mut line = Line::new();
        write_event(&event, &mut line);
        line.map(char::from).collect::<String>().trim_end().to_owned()
    }

    fn any(chance: &mut ChaCha8Rng) -> Event {
        let position = Position::new(chance.random());
        let alarm = (0..).map_while(Alarm::from_index).choose(chance).expect("there are alarms");
        match chance.random_range(0..9) {
            0 | 1 => {
                let class = [Class::Plant, Class::Weed, Class::Unknown][chance.random_range(0..3)];
                let [delay, hold, spacing] = [0; 3].map(|_| Ticks(chance.random_range(-(1 << 29)..1 << 29)));
                let vote = Vote { class, votes: chance.random() };
                Event::Detection { vote, leading: position, spacing, plan: Plan { delay, hold } }
            }
            2 => Event::Guarded(position),
            3 => Event::Slip { permille: chance.random() },
            4 => Event::Swing { out: chance.random(), position },
            5 => Event::State([State::Hold, State::Work, State::Alarm(alarm)][chance.random_range(0..3)]),
            6 => Event::Alarm { alarm, position },
            7 => Event::Warning((0..).map_while(Warning::from_index).choose(chance).expect("there are warnings")),
            _ => {
                let times = SwingTimes { out_ms: chance.random(), in_ms: chance.random() };
                let outcomes = [Outcome::Measured(times), Outcome::Shown, Outcome::Failed];
                Event::Calibrated { outcome: outcomes[chance.random_range(0..3)], fits: chance.random() }
            }
        }
    }

    #[test]
    fn every_event_is_read_as_the_firmware_writes_it() {
        let mut chance = ChaCha8Rng::seed_from_u64(27);
        let mut met = BTreeMap::new();
        for _ in 0..20_000 {
            let event = any(&mut chance);
            let line = line(event);
            let read = EventLine::parse(&line);
            assert_eq!(read, Some(EventLine::from(&event)), "{line}");
            let (name, fields) = read.expect("it is an event").fields();
            // The description must match the line.
            let described = EVENTS.iter().find(|described| described.name == name).expect("it is described");
            let keys: Vec<&str> =
                line.split([' ', ',']).filter_map(|word| word.split_once('=')).map(|(key, _)| key).collect();
            let wanted = described.beginning.split(' ').filter_map(|word| Some(word.split_once('=')?.0));
            let wanted = wanted.chain(described.values.iter().map(|value| value.key).filter(|key| !key.is_empty()));
            assert_eq!(keys, wanted.collect::<Vec<_>>(), "{line}");
            let of_fields: Vec<&str> = described.values.iter().filter_map(|value| Some(value.field?.0)).collect();
            assert_eq!(fields.iter().map(|&(field, _)| field).collect::<Vec<_>>(), of_fields);
            met.entry(name).or_insert(line);
        }
        assert_eq!(met.len(), EVENTS.len(), "{met:#?}");
    }

    impl From<State> for Field {
        fn from(state: State) -> Self {
            Mode::from(state).into()
        }
    }

    impl From<Reason> for Field {
        fn from(reason: Reason) -> Self {
            reason.text().to_string().into()
        }
    }

    impl From<Cause> for Field {
        fn from(cause: Cause) -> Self {
            cause.text().to_string().into()
        }
    }

    /// Rolls over plants, with noise, and with commands between.
    fn roll(rig: &mut Rig<ByExamples>, chance: &mut ChaCha8Rng) {
        let second_beam = rig.settings().ticks(Setting::SecondBeamMm).0;
        let sees = |count: i32| count.rem_euclid(900) < 200;
        let step = chance.random_range(-1..4);
        for _ in 0..chance.random_range(0..2000) {
            let count = rig.readings.position.count();
            let beams = Beams { broken: sees(count), second_broken: second_beam > 0 && sees(count - second_beam) };
            rig.see(beams);
            rig.at(count.wrapping_add(step)).turn_after(2000);
        }
        let commands =
            ["start now", "start", "hold", "clear", "nonsense", "set second_beam_mm 100", "set no_plant_m 1"];
        rig.ask(commands[chance.random_range(0..commands.len())]);
        match chance.random_range(0..8) {
            0 => rig.readings.position = Position::new(chance.random()),
            1 => (rig.readings.lost, rig.readings.jumps) = (chance.random(), chance.random()),
            2 => rig.readings.stack_free = chance.random(),
            3 => rig.readings.switch_on = chance.random(),
            _ => {}
        }
        rig.turn_after(2000);
    }

    #[test]
    fn every_status_is_read_as_the_firmware_writes_it() {
        let mut chance = ChaCha8Rng::seed_from_u64(28);
        let mut met = BTreeSet::new();
        for _ in 0..100 {
            let cause = (0..).map_while(Cause::from_index).choose(&mut chance).expect("there are causes");
            let classifier = Nearest::new(&EXAMPLES[..], Volatile::new());
            let readings = Readings::new(Instant::ZERO, Position::new(0));
            let mut rig =
                Rig::wake_from(classifier, Volatile::new(), readings, Beams::default(), cause, chance.random());
            for _ in 0..50 {
                roll(&mut rig, &mut chance);
                let lines = rig.ask("status");
                for (line, (keys, (name, fields))) in lines.iter().zip(fields_of_status(&rig)) {
                    let written: Vec<&str> = line.split(' ').filter_map(|word| Some(word.split_once('=')?.0)).collect();
                    assert_eq!(written, keys, "{line}");
                    let (read_name, mut read) = ConsoleLine::parse(line).fields();
                    read.retain(|(_, field)| *field != Field::Missing);
                    met.extend(read.iter().map(|&(field, _)| (name, field)));
                    let fields = fields.into_iter().filter(|(_, field)| *field != Field::Missing).collect();
                    assert_eq!((read_name, read), (name, fields), "{line}");
                }
            }
        }
        let described =
            STATUS.iter().flat_map(|line| line.values.iter().filter_map(|value| Some((line.name, value.field?.0))));
        assert_eq!(met, described.collect());
    }

    #[test]
    fn lines_of_other_versions_and_curves_are_events_and_nothing_else_is() {
        let too_fast = Some(EventLine::Alarm { alarm: Alarm::TooFast, position: 1 });
        let newer = |is_alarm| Some(EventLine::Newer { is_alarm });
        for (line, meant) in [
            ("alarm code=3-1 name=too_fast pos=1", too_fast),
            // In the format of version 0.1.
            ("alarm name=too_fast code=31 pos=1", too_fast),
            // A newer firmware may say more.
            ("guarded pos=-70000 for=plant", Some(EventLine::Guarded { position: -70_000 })),
            ("calibrated by=eye, as seen", Some(EventLine::CalibratedByEye {})),
            ("speed_mm_s:-3,tool_deg:45,beam_broken:0,windows:2", Some(EventLine::Plot)),
            (">tool_deg:0", Some(EventLine::Plot)),
            ("error: 7", None),
            ("error: no such command", None),
            (":", None),
            ("a:b,c:1", None),
            ("", None),
            ("ok", None),
            ("plant", None),
            ("tilt deg=4 of=5, rising", newer(false)),
            ("tilt d\u{fffd}g=4", None),
            ("plant pos=1 votes=3", newer(false)),
            ("swing tool=up pos=1", newer(false)),
            ("swing tool=out pos=99999999999", newer(false)),
            ("state=work tool=in pos=1", None),
            ("alarm code=1-1 name=boredom pos=1", newer(true)),
            ("warning name=", None),
            ("calibrated by=hand", newer(false)),
            ("calibrated lead_out_ms=150 set=yes", newer(false)),
            ("guardedpos=1", None),
            ("pos=1 swing tool=out", None),
            ("plant pos=1 votes=300 spacing=1 delay=1 hold=1 actuation=1", newer(false)),
        ] {
            assert_eq!(EventLine::parse(line), meant, "{line}");
        }
    }

    #[test]
    fn a_status_is_read_with_and_without_its_alarm() {
        let rest = "tool=out pos=-5 speed_mm_s=-3 windows=2 unseen_mm=400";
        let expected = Status {
            mode: Mode::Alarm,
            alarm: Some(Alarm::BeamBlocked),
            tool_out: true,
            position: -5,
            speed_mm_s: -3,
            zones: 2,
            unseen_mm: 400,
            ..Status::default()
        };
        // In the present format, and in that of version 0.1.
        for alarm in ["code=1-1 name=beam_blocked", "alarm=beam_blocked"] {
            assert_eq!(Status::parse(&format!("state=alarm {alarm} {rest}")).as_ref(), Some(&expected));
        }
        let slips = |told: &str| {
            let line = format!("state=hold tool=out pos=1 speed_mm_s=2 windows=1 unseen_mm=0 slip_permille={told}");
            Status::parse(&line).and_then(|status| status.slip_permille)
        };
        assert_eq!((slips("none"), slips("-52")), (None, Some(-52)));
        let working = Status::parse("state=work tool=out for=plant pos=1 speed_mm_s=2 windows=1 unseen_mm=0 new=1");
        assert_eq!(working.and_then(|status| status.reason).as_deref(), Some("plant"));
        assert_eq!(Status::parse("state=idle tool=out pos=1 speed_mm_s=2 windows=1 unseen_mm=0"), None);
        assert_eq!(Status::parse("lost=0 jumps=0 late=0"), None);
    }
}
