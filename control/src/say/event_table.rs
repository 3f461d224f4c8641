//! The table of events: for the firmware that writes them, the host tools that read them, the page's types, and the manual.

/// Passes the table of events to a macro.
///
/// A row has the event's name, its meaning, the [`Event`](crate::operate::event::Event), and its line: the beginning, then
/// `key=value` words. A value has a kind, an expression of the event, and the field that the host reads it into. Keys tell rows
/// with the same beginning apart.
///
/// `say::events` and `say::names` write the kinds, and the host's crate `link` reads them:
///
/// | kind | the value |
/// | --- | --- |
/// | `number` | a whole number, -2147483648 to 2147483647 |
/// | `count` | a whole number, 0 to 65535 |
/// | `led` | an alarm's code as the lamp blinks it: two numbers with a dash between them |
/// | `class` | a detection's class, in a word; it comes first in its line and has no key |
/// | `place` | the tool's command, `out` or `in` |
/// | `state` | the machine's state, in a word |
/// | `alarm`, `warning` | its name |
/// | `answer` | `yes` or `no` |
#[macro_export]
macro_rules! event_table {
    ($make:ident) => {
        $make! {
            Detection "a detection was seen in full and classified",
            Event::Detection { vote, leading, spacing, plan } => "" {
                "" = class(vote.class) => class: Class, "what it was taken for";
                "pos" = number(leading.count()) => position: i32, "its leading edge, in encoder ticks";
                "votes" = count(vote.votes) => votes: u8, "how many of the `k` nearest examples voted for its class";
                "spacing" = number(spacing.0) => spacing: i32, "ticks since the last plant's leading edge";
                "delay" = number(plan.delay.0) => delay: i32,
                    "ticks from the leading edge until the tool leaves the row (Y of the paper)";
                "hold" = number(plan.hold.0) => hold: i32, "ticks for which the tool stays out (Z)";
                "actuation" = number(plan.actuation().0) => actuation: i32, "ticks until the tool comes back (R)";
            }
            Guarded "ground is kept on which a plant was expected and none was seen",
            Event::Guarded(place) => "guarded" {
                "pos" = number(place.count()) => position: i32, "the middle of that ground, in encoder ticks";
            }
            Swing "the tool was commanded in or out",
            Event::Swing { out, position } => "swing" {
                "tool" = place(out) => out: bool, "where it is to be";
                "pos" = number(position.count()) => position: i32, "the machine's position at the command, in encoder ticks";
            }
            Slip "a plant passed both beams and told the wheel's slip",
            Event::Slip { permille } => "slip" {
                "permille" = number(permille) => permille: i32,
                    "in thousandths, above 0 where the wheel turns farther than the machine rolls";
            }
            State "the state changed",
            Event::State(state) => "state" {
                "is" = state(state) => mode: Mode, "the new one";
            }
            Warning "something that the operator should know of",
            Event::Warning(warning) => "warning" {
                "name" = warning(warning) => warning: Warning, "which warning";
            }
            Alarm "an alarm was latched, and the tool is out",
            Event::Alarm { alarm, position } => "alarm" {
                "code" = led(alarm), "how the lamp shows it";
                "name" = alarm(alarm) => alarm: Alarm, "which alarm";
                "pos" = number(position.count()) => position: i32, "the machine's position, in encoder ticks";
            }
            CalibratedBySwitch "the end switch timed the servo",
            Event::Calibrated { outcome: Outcome::Measured(SwingTimes { out_ms, in_ms }), fits } => "calibrated" {
                "lead_out_ms" = count(out_ms) => out_ms: u16, "the longest time until the tool was out, in ms";
                "lead_in_ms" = count(in_ms) => in_ms: u16, "the shortest time until it began to come back, in ms";
                "set" = answer(fits) => is_set: bool, "whether the leads are set to these times";
            }
            CalibratedByEye "the servo was shown without an end switch: set the leads that you saw",
            Event::Calibrated { outcome: Outcome::Shown, .. } => "calibrated by=eye" {}
                ", set lead_out_ms and lead_in_ms to what you saw"
            NotCalibrated "the end switch did not follow the servo",
            Event::Calibrated { outcome: Outcome::Failed, .. } => "calibrated by=none" {}
                ", the end switch did not follow"
        }
    };
}

/// Expands an event's line: `write(line)` into the statements that write it, and `texts(line)` into their texts.
///
/// Values are taken one by one. The text before the next word grows with their keys, until that word ends it.
macro_rules! event_line {
    // Words and numbers: the growing text, finished texts, statements.
    (@ [$($grown:tt)*] [$($done:tt)*] {$($does:tt)*} $to:ident($line:ident)
        "" = $kind:ident($value:expr) $(=> $field:ident: $Type:ty)?, $meaning:literal; $($rest:tt)*
    ) => {
        event_line!(@ [] [$($done)*] { $($does)* $line.say(names::$kind($value)); } $to($line) $($rest)*)
    };
    (@ [$($grown:tt)*] [$($done:tt)*] {$($does:tt)*} $to:ident($line:ident)
        $key:tt = number($value:expr) $(=> $field:ident: $Type:ty)?, $meaning:literal; $($rest:tt)*
    ) => {
        event_line!(@ [$($grown)* " " $key "=#"] [$($done)*] { $($does)* $line.number($value.into()); } $to($line) $($rest)*)
    };
    (@ [$($grown:tt)*] [$($done:tt)*] {$($does:tt)*} $to:ident($line:ident)
        $key:tt = count($value:expr) $(=> $field:ident: $Type:ty)?, $meaning:literal; $($rest:tt)*
    ) => {
        event_line!(@ [$($grown)* " " $key "=#"] [$($done)*] { $($does)* $line.counted($value.into()); } $to($line) $($rest)*)
    };
    (@ [$($grown:tt)*] [$($done:tt)*] {$($does:tt)*} $to:ident($line:ident)
        $key:tt = led($value:expr) $(=> $field:ident: $Type:ty)?, $meaning:literal; $($rest:tt)*
    ) => {
        event_line!(@ [$($grown)* " " $key "=#-#"] [$($done)*]
            { $($does)* $line.led($value); }
            $to($line) $($rest)*)
    };
    (@ [$($grown:tt)*] [$($done:tt)*] {$($does:tt)*} $to:ident($line:ident)
        $key:tt = $word:ident($value:expr) $(=> $field:ident: $Type:ty)?, $meaning:literal; $($rest:tt)*
    ) => {
        event_line!(@ [] [$($done)* concat!($($grown,)* " ", $key, "="),]
            { $($does)* $line.say(const { Text::of_event(concat!($($grown,)* " ", $key, "=")) }); $line.say(names::$word($value)); }
            $to($line) $($rest)*)
    };
    // The tail.
    (@ [$($grown:tt)*] $done:tt $does:tt $to:ident($line:ident) $tail:literal) => {
        event_line!(@ [$($grown)* $tail] $done $does $to($line))
    };
    // The end.
    (@ [] $done:tt {$($does:tt)*} write($line:ident)) => {{ $($does)* }};
    (@ [$($grown:tt)+] $done:tt {$($does:tt)*} write($line:ident)) => {{
        $($does)*
        $line.say(const { Text::of_event(concat!($($grown),+)) });
    }};
    (@ [] [$($done:tt)*] $does:tt texts($line:ident)) => { &[$($done)*] };
    (@ [$($grown:tt)+] [$($done:tt)*] $does:tt texts($line:ident)) => { &[$($done)* concat!($($grown),+)] };
    // The beginning.
    ($to:ident($line:ident) $beginning:literal $($values:tt)*) => {
        event_line!(@ [$beginning] [] {} $to($line) $($values)*)
    };
}
pub(crate) use event_line;
