//! The tables of lines with `key=value` words: the events, and the answer to `status`.
//!
//! The firmware writes these lines, and the host tools read them. The page's types and the manual are made from the tables too.

/// Passes both tables to a macro.
///
/// A row of the events has the name, the meaning, the [`Event`](crate::operate::event::Event), and its line: the beginning, then a
/// row for each value. A value has its part of the line, with its key; its kind; an expression of the event; and the field that the
/// host reads it into. In the line, `#` stands for a number, and `@` for a word. Keys tell rows with the same beginning apart.
///
/// `status` has the name that its expressions give the [`Controller`](crate::weeder::Controller). A row has the line's name, its
/// meaning, and its values in groups. A group behind `if` is in the line if its pattern matches. Its fields are optional.
///
/// `say::lines` writes the kinds, and the host's crate `link` reads them:
///
/// | kind | the value |
/// | --- | --- |
/// | `number` | a whole number, -2147483648 to 2147483647 |
/// | `count` | a whole number, 0 to 65535 |
/// | `optional` | a whole number, -32768 to 32767, or `none` |
/// | `led` | an alarm's code as the lamp blinks it: two numbers with a dash between them; its name follows |
/// | `class` | a detection's class, in a word; it comes first in its line and has no key |
/// | `place` | the tool's command, `out` or `in` |
/// | `state` | the machine's state, in a word |
/// | `alarm`, `warning`, `reason`, `cause` | its name |
/// | `answer` | `yes` or `no` |
#[macro_export]
macro_rules! line_tables {
    ($make:ident) => {
        $make! {
            events {
                Detection "a detection was seen in full and classified",
                Event::Detection { vote, leading, spacing, plan } => "" {
                    "@" class(vote.class) => class: Class, "its class";
                    " pos=#" number(leading.count()) => position: i32, "its leading edge, in encoder ticks";
                    " votes=#" count(vote.votes) => votes: u8, "how many of the `k` nearest examples voted for its class";
                    " spacing=#" number(spacing.0) => spacing: i32, "ticks since the last plant's leading edge";
                    " delay=#" number(plan.delay.0) => delay: i32,
                        "ticks from the leading edge until the tool leaves the row (Y of the paper)";
                    " hold=#" number(plan.hold.0) => hold: i32, "ticks for which the tool stays out (Z)";
                    " actuation=#" number(plan.actuation().0) => actuation: i32, "ticks until the tool comes back (R)";
                }
                Guarded "ground is kept on which a plant was expected and none was seen",
                Event::Guarded(place) => "guarded" {
                    " pos=#" number(place.count()) => position: i32, "the middle of that ground, in encoder ticks";
                }
                Swing "the tool was commanded in or out",
                Event::Swing { out, position } => "swing" {
                    " tool=@" place(*out) => out: bool, "where it is to be";
                    " pos=#" number(position.count()) => position: i32,
                        "the machine's position at the command, in encoder ticks";
                }
                Slip "a plant passed both beams and told the wheel's slip",
                Event::Slip { permille } => "slip" {
                    " permille=#" number(*permille) => permille: i32,
                        "in thousandths, above 0 where the wheel turns farther than the machine rolls";
                }
                State "the state changed",
                Event::State(state) => "state" {
                    " is=@" state(*state) => mode: Mode, "the new one";
                }
                Warning "something that the operator should know of",
                Event::Warning(warning) => "warning" {
                    " name=@" warning(*warning) => warning: Warning, "which warning";
                }
                Alarm "an alarm was latched, and the tool is out",
                Event::Alarm { alarm, position } => "alarm" {
                    " code=#-#" led(*alarm), "how the lamp shows it";
                    " name=@" alarm(*alarm) => alarm: Alarm, "which alarm";
                    " pos=#" number(position.count()) => position: i32, "the machine's position, in encoder ticks";
                }
                CalibratedBySwitch "the end switch timed the servo",
                Event::Calibrated { outcome: Outcome::Measured(SwingTimes { out_ms, in_ms }), fits } => "calibrated" {
                    " lead_out_ms=#" count(*out_ms) => out_ms: u16, "the longest time until the tool was out, in ms";
                    " lead_in_ms=#" count(*in_ms) => in_ms: u16, "the shortest time until it began to come back, in ms";
                    " set=@" answer(*fits) => is_set: bool, "whether the leads are set to these times";
                }
                CalibratedByEye "the servo was shown without an end switch: set the leads that you saw",
                Event::Calibrated { outcome: Outcome::Shown, .. } => "calibrated by=eye" {}
                    ", set lead_out_ms and lead_in_ms to what you saw"
                NotCalibrated "the end switch did not follow the servo",
                Event::Calibrated { outcome: Outcome::Failed, .. } => "calibrated by=none" {}
                    ", the end switch did not follow"
            }
            status machine {
                Status "the first line of the answer to `status`" {
                    "state=@" state(machine.state()) => mode: Mode, "the machine's state";
                } if State::Alarm(alarm) = machine.state() => {
                    " code=#-#" led(alarm), "in an alarm: how the lamp shows it";
                    " name=@" alarm(alarm) => alarm: Option<Alarm>, "in an alarm: which one";
                } {
                    " tool=@" place(machine.tool_out()) => tool_out: bool, "where the tool is to be";
                } if Some(reason) = machine.reason() => {
                    " for=@" reason(reason) => reason: Option<String>,
                        "at work: why the tool is out (`plant`, `unseen_ground`, `too_fast`, `encoder_doubtful`)";
                } {
                    " pos=#" number(machine.position().count()) => position: i32,
                        "the machine's position, in encoder ticks";
                    " speed_mm_s=#" number(machine.speed_mm_s()) => speed_mm_s: i32,
                        "the machine's speed in mm/s, negative backwards";
                    " windows=#" count(machine.zones()) => zones: u32, "keep-out zones at the tool or ahead of it";
                    " unseen_mm=#" number(machine.unseen_mm()) => unseen_mm: i32,
                        "distance until the tool has left unseen ground and its margin, in mm";
                } if true = machine.has_second_beam() => {
                    " slip_permille=@" optional(machine.slip_permille()) => slip_permille: Option<i32>,
                        "with a second beam: the wheel's slip in thousandths, as the event has it, or `none`";
                };
                Counts "the second line of the answer to `status`, with what was counted since the reset" {
                    "lost=#" count(machine.readings().lost) => lost: u16, "encoder steps without a direction";
                    " jumps=#" count(machine.readings().jumps) => jumps: u16,
                        "changes of both channels at once, which are not counted";
                    " late=#" count(machine.late()) => late: u16, "commands to the tool that came too late";
                    " missed=#" count(machine.events_missed()) => missed: u16,
                        "events that were dropped, because too many waited for the line";
                    " mistakes=#" count(machine.command_errors()) => command_errors: u16, "console lines that are no command";
                    " dust=#" count(machine.dust()) => dust: u16, "detections narrower than `min_width_mm`";
                    " stack_free=#" count(machine.readings().stack_free) => stack_free: u16,
                        "bytes of stack that were never used";
                    " reset=@" cause(machine.cause()) => cause: String, "cause of the last reset";
                } if true = machine.was_working() => {
                    " was=@" state(State::Work) => was: Option<Mode>,
                        "`work` if the reset ended work, until `start`, `hold` or `clear`";
                } if Some(warning) = machine.present_warning() => {
                    " warning=@" warning(warning) => warning: Option<Warning>, "the present warning";
                };
            }
        }
    };
}
