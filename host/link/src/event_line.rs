//! What a line of the firmware means: an event, or the status.
//!
//! Lines are `name key=value key=value`. Keys that are not known here are passed over, so that a newer firmware may say
//! more; a line that lacks one of its keys, or has a value that is none, is no such line.

use control::alarm::{Alarm, Warning};
use control::ground::class::Class;

/// Something that the machine told by itself, as [`control::operate::event::Event`] was written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EventLine {
    /// An object was seen in full and classified.
    Detection {
        /// What it was taken for.
        class: Class,
        /// Where the beam broke, in ticks.
        position: i32,
        /// Votes for the class.
        votes: u8,
        /// Distance since the last plant's leading edge, in ticks.
        spacing: i32,
        /// The paper's Y, in ticks.
        delay: i32,
        /// The paper's Z, in ticks: canopy and both margins.
        hold: i32,
        /// The paper's R, in ticks.
        actuation: i32,
    },
    /// The tool was told to swing.
    Swing {
        /// Out of the row, or back into it.
        out: bool,
        /// The machine's position at the command, in ticks.
        position: i32,
    },
    /// Ground is kept free on which a plant was due and none was seen.
    Guarded {
        /// The middle of it, in ticks.
        position: i32,
    },
    /// A plant has passed both beams.
    Slip {
        /// The slip by the last of them in thousandths, above 0 where the wheel turns farther than the machine rolls.
        permille: i32,
    },
    /// The machine went from one state to another.
    State(Mode),
    /// A fault was latched.
    Alarm {
        /// Which.
        alarm: Alarm,
        /// The machine's position, in ticks.
        position: i32,
    },
    /// Something that the operator should know of.
    Warning(Warning),
    /// What came of timing the servo.
    Calibrated {
        /// By what it was timed.
        by: Timed,
        /// Whether the leads that follow from it are in use.
        is_set: bool,
    },
    /// Points of a plotter's curves.
    Plot,
}

/// By what the servo was timed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Timed {
    /// By the end switch.
    EndSwitch {
        /// The longest that the tool took to be out, in milliseconds.
        out_ms: u16,
        /// The shortest until it began to come back.
        in_ms: u16,
    },
    /// By the operator, who has seen it swing.
    Eye,
    /// In vain: the end switch did not follow.
    None,
}

/// What the machine is doing, without the reason for an alarm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mode {
    /// The tool stays out.
    #[default]
    Hold,
    /// The tool weeds.
    Work,
    /// A fault is latched.
    Alarm,
}

impl Mode {
    /// As the console calls it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Hold => "hold",
            Self::Work => "work",
            Self::Alarm => "alarm",
        }
    }

    fn find(word: &str) -> Option<Self> {
        [Self::Hold, Self::Work, Self::Alarm].into_iter().find(|mode| mode.name() == word)
    }
}

/// The first line that the machine answers to `status`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Status {
    /// What it is doing.
    pub mode: Mode,
    /// The latched alarm.
    pub alarm: Option<Alarm>,
    /// Whether the tool is to be out of the row.
    pub tool_out: bool,
    /// Why, where the machine works.
    pub reason: Option<String>,
    /// The encoder's count.
    pub position: i32,
    /// Speed over the ground, negative backwards.
    pub speed_mm_s: i32,
    /// Windows at the tool or ahead of it.
    pub windows: u32,
    /// How far the machine has to roll until ground that the beam has seen reaches the tool.
    pub unseen_mm: i32,
    /// The wheel's slip in thousandths, above 0 where it turns farther than the machine rolls; none where nothing has told it.
    pub slip_permille: Option<i32>,
}

/// The words `key=value` of a line, by their keys.
pub struct Values<'a>(pub &'a str);

impl<'a> Values<'a> {
    /// The text of a key; none where the line does not have it.
    pub fn text(&self, key: &str) -> Option<&'a str> {
        self.0.split(' ').find_map(|word| word.strip_prefix(key)?.strip_prefix('='))
    }

    /// As [`text`](Self::text), as a number; none where it is not one.
    pub fn number<T: std::str::FromStr>(&self, key: &str) -> Option<T> {
        self.text(key)?.parse().ok()
    }

    /// The name of the alarm in a status line; a log of 0.1 has it behind another key.
    pub fn alarm(&self) -> Option<&'a str> {
        self.text("name").or_else(|| self.text("alarm"))
    }

    fn out(&self) -> Option<bool> {
        match self.text("tool")? {
            "out" => Some(true),
            "in" => Some(false),
            _ => None,
        }
    }
}

impl EventLine {
    /// Reads an event's line; none where it is not one.
    pub fn parse(line: &str) -> Option<Self> {
        if is_plot(line) {
            return Some(Self::Plot);
        }
        let (name, rest) = line.split_once(' ')?;
        let values = Values(rest);
        let object = |class| {
            Some(Self::Detection {
                class,
                position: values.number("pos")?,
                votes: values.number("votes")?,
                spacing: values.number("spacing")?,
                delay: values.number("delay")?,
                hold: values.number("hold")?,
                actuation: values.number("actuation")?,
            })
        };
        match name {
            "plant" => object(Class::Plant),
            "weed" => object(Class::Weed),
            "unknown" => object(Class::Unknown),
            "swing" => Some(Self::Swing { out: values.out()?, position: values.number("pos")? }),
            "guarded" => Some(Self::Guarded { position: values.number("pos")? }),
            "slip" => Some(Self::Slip { permille: values.number("permille")? }),
            "state" => Some(Self::State(Mode::find(values.text("is")?)?)),
            "alarm" => Some(Self::Alarm {
                alarm: Alarm::find(values.text("name")?.as_bytes())?,
                position: values.number("pos")?,
            }),
            "warning" => Warning::find(values.text("name")?.as_bytes()).map(Self::Warning),
            "calibrated" => {
                let by = match values.text("by") {
                    None => {
                        Timed::EndSwitch { out_ms: values.number("lead_out_ms")?, in_ms: values.number("lead_in_ms")? }
                    }
                    Some("eye,") => Timed::Eye,
                    Some("none,") => Timed::None,
                    Some(_) => return None,
                };
                Some(Self::Calibrated { by, is_set: values.text("set") == Some("yes") })
            }
            _ => None,
        }
    }
}

/// Whether a line is points of curves, `label:value,label:value`, or one as Teleplot wants it.
fn is_plot(line: &str) -> bool {
    let point = |point: &str| {
        point.split_once(':').is_some_and(|(label, value)| !label.is_empty() && value.parse::<i32>().is_ok())
    };
    line.strip_prefix('>').unwrap_or(line).split(',').all(point)
}

impl Status {
    /// Reads a status line; none where it is not one.
    pub fn parse(line: &str) -> Option<Self> {
        let values = Values(line);
        Some(Self {
            mode: Mode::find(values.text("state")?)?,
            alarm: values.alarm().and_then(|name| Alarm::find(name.as_bytes())),
            tool_out: values.out()?,
            reason: values.text("for").map(str::to_owned),
            position: values.number("pos")?,
            speed_mm_s: values.number("speed_mm_s")?,
            windows: values.number("windows")?,
            unseen_mm: values.number("unseen_mm")?,
            slip_permille: values.number("slip_permille"),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use control::ground::class::Vote;
    use control::ground::keep_out::Plan;
    use control::operate::calibration::{Outcome, SwingTimes};
    use control::operate::event::Event;
    use control::operate::state::State;
    use control::say::line::Line;
    use control::say::write_event;
    use control::units::{Position, Ticks};

    /// The event as the firmware writes it.
    fn line(event: Event) -> String {
        let mut line = Line::new();
        write_event(&event, &mut line);
        line.map(char::from).collect::<String>().trim_end().to_owned()
    }

    #[test]
    fn every_event_is_read_as_the_firmware_writes_it() {
        let plan = Plan { delay: Ticks(668), hold: Ticks(477) };
        for (class, votes) in [(Class::Plant, 3), (Class::Weed, 2), (Class::Unknown, 0)] {
            let vote = Vote { class, votes };
            let event = Event::Detection { vote, leading: Position::new(-70_000), spacing: Ticks(1146), plan };
            let expected = EventLine::Detection {
                class,
                position: -70_000,
                votes,
                spacing: 1146,
                delay: 668,
                hold: 477,
                actuation: 1145,
            };
            assert_eq!(EventLine::parse(&line(event)), Some(expected));
        }
        let guarded = Event::Guarded(Position::new(-3));
        assert_eq!(EventLine::parse(&line(guarded)), Some(EventLine::Guarded { position: -3 }));
        let slip = Event::Slip { permille: -52 };
        assert_eq!(EventLine::parse(&line(slip)), Some(EventLine::Slip { permille: -52 }));
        let swing = Event::Swing { out: true, position: Position::new(12) };
        assert_eq!(EventLine::parse(&line(swing)), Some(EventLine::Swing { out: true, position: 12 }));
        assert_eq!(EventLine::parse(&line(Event::State(State::Work))), Some(EventLine::State(Mode::Work)));
        for alarm in (0..).map_while(Alarm::from_index) {
            let event = Event::Alarm { alarm, position: Position::new(1) };
            let (first, second) = alarm.code();
            let told = line(event);
            let named = format!("alarm code={first}-{second} name={} pos=1", alarm.text());
            assert_eq!((EventLine::parse(&told), &told), (Some(EventLine::Alarm { alarm, position: 1 }), &named));
            let old = format!("alarm name={} code={first}{second} pos=1", alarm.text());
            assert_eq!(EventLine::parse(&old), Some(EventLine::Alarm { alarm, position: 1 }), "a log of 0.1");
            assert_eq!(EventLine::parse(&line(Event::State(State::Alarm(alarm)))), Some(EventLine::State(Mode::Alarm)));
        }
        let measured = Outcome::Measured(SwingTimes { out_ms: 150, in_ms: 40 });
        let by_the_switch = Timed::EndSwitch { out_ms: 150, in_ms: 40 };
        for (outcome, fits, by) in [
            (measured, true, by_the_switch),
            (measured, false, by_the_switch),
            (Outcome::Shown, false, Timed::Eye),
            (Outcome::Failed, false, Timed::None),
        ] {
            let calibrated = Event::Calibrated { outcome, fits };
            assert_eq!(EventLine::parse(&line(calibrated)), Some(EventLine::Calibrated { by, is_set: fits }));
        }
        let warning = Event::Warning(Warning::NoPlants);
        assert_eq!(EventLine::parse(&line(warning)), Some(EventLine::Warning(Warning::NoPlants)));
    }

    #[test]
    fn points_of_curves_are_no_answer() {
        for line in ["speed_mm_s:-3,tool_deg:45,beam_broken:0,windows:2", ">tool_deg:0"] {
            assert_eq!(EventLine::parse(line), Some(EventLine::Plot), "{line}");
        }
        for line in ["error: 7", "error: no such command", ":", "a:b,c:1"] {
            assert_eq!(EventLine::parse(line), None, "{line}");
        }
    }

    #[test]
    fn a_line_that_is_no_event_is_none() {
        for line in [
            "",
            "ok",
            "plant",
            "plant pos=1 votes=3",
            "swing tool=up pos=1",
            "swing tool=out pos=99999999999",
            "state=work tool=in pos=1",
            "alarm code=1-1 name=boredom pos=1",
            "warning name=",
            "pos=1 swing tool=out",
            "plant pos=1 votes=300 spacing=1 delay=1 hold=1 actuation=1",
        ] {
            assert_eq!(EventLine::parse(line), None, "{line}");
        }
    }

    #[test]
    fn a_status_is_read_with_and_without_its_alarm() {
        let rest = "tool=out pos=-5 speed_mm_s=-3 windows=2 unseen_mm=400";
        let expected = Status {
            mode: Mode::Alarm,
            alarm: Some(Alarm::BeamBlocked),
            tool_out: true,
            reason: None,
            position: -5,
            speed_mm_s: -3,
            windows: 2,
            unseen_mm: 400,
            slip_permille: None,
        };
        // As it is, and as a log of 0.1 has it.
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
