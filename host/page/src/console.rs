//! The console for the page: the meaning of lines, the order of changed settings, and the next step of setting up a
//! machine.

use link::settings::{Setting, Settings, explain, follow_wheel, name, steps, unit};
use link::{ConsoleLine, Field, Values};
use serde::Deserialize;
use serde_json::{Map, Value, json};
use set_up::{SetUp, Step, Task};
use std::cell::RefCell;
use std::collections::BTreeMap;

/// The meaning of a line, in the form of `page/src/link/console_line.ts`: its name, its fields, and `isEvent` if it is
/// an event.
pub fn read(line: &str) -> Value {
    let said = ConsoleLine::parse(line);
    let (name, fields) = said.fields();
    let fields = fields.into_iter().filter_map(|(field, value)| {
        let value = match value {
            Field::Missing => return None,
            Field::Number(number) => number.into(),
            Field::Numbers(numbers) => numbers.into(),
            Field::Flag(flag) => flag.into(),
            Field::Word(word) => word.into(),
        };
        Some((camel_case(field), value))
    });
    let mut meaning: Map<String, Value> =
        [("is".to_owned(), camel_case(name).into())].into_iter().chain(fields).collect();
    if let ConsoleLine::Event(_) = said {
        meaning.insert("isEvent".to_owned(), true.into());
    }
    // A newer firmware's alarm has its name too.
    if let (ConsoleLine::Status(_), Some(alarm)) = (said, Values(line).text("name")) {
        meaning.insert("alarm".to_owned(), alarm.into());
    }
    meaning.into()
}

/// Converts a Rust name of a field or variant to TypeScript's form.
fn camel_case(name: &str) -> String {
    let word = |(number, word): (usize, &str)| {
        let (first, rest) = word.split_at(1);
        if number == 0 { first.to_ascii_lowercase() + rest } else { first.to_ascii_uppercase() + rest }
    };
    name.split('_').enumerate().map(word).collect()
}

/// The firmware of these sources: its version without the commit (build.mjs has it), and its settings' names.
pub fn firmware() -> Value {
    json!({ "version": env!("CARGO_PKG_VERSION"), "settings": Setting::all().map(name).collect::<Vec<_>>() })
}

/// All present settings, and the ones to change, by name.
#[derive(Deserialize)]
pub struct Change {
    from: BTreeMap<String, u16>,
    to: BTreeMap<String, u16>,
}

impl Change {
    /// The values to send as `[name, value]`, in an order without contradictions on the way; or the contradiction of
    /// the result. Settings and values that this version does not know come last: the firmware may know them.
    pub fn steps(&self) -> Value {
        let (from, _) = settings(Settings::new(), &self.from);
        let (mut to, unknown) = settings(from.clone(), &self.to);
        if !self.to.contains_key(&name(Setting::TicksPerM)) {
            follow_wheel(&from, &mut to);
        }
        if let Some(contradiction) = to.contradiction() {
            return json!({ "contradiction": explain(contradiction), "steps": [] });
        }
        let known = steps(&from, &to).into_iter().map(|(setting, value)| (name(setting), value));
        json!({ "steps": known.chain(unknown).collect::<Vec<_>>() })
    }
}

/// Settings with some values set, and the values that could not be.
fn settings(mut settings: Settings, values: &BTreeMap<String, u16>) -> (Settings, Vec<(String, u16)>) {
    let mut unknown = Vec::new();
    for (name, &value) in values {
        let is_set = Setting::find(name.as_bytes()).is_some_and(|setting| settings.set(setting, value).is_ok());
        if !is_set {
            unknown.push((name.clone(), value));
        }
    }
    (settings, unknown)
}

thread_local! {
    static SET_UP: RefCell<SetUp> = RefCell::default();
}

/// New lines of a session, and the present settings by name. A typed line begins with `> `.
#[derive(Deserialize)]
pub struct Heard {
    lines: Vec<String>,
    settings: BTreeMap<String, u16>,
}

impl Heard {
    /// The steps, and the results of all lines so far, in the form of `page/src/panel/set_up.ts`.
    pub fn advice(&self) -> Value {
        let (settings, _) = settings(Settings::new(), &self.settings);
        let set_up = SET_UP.with_borrow_mut(|set_up| {
            set_up.settings.clone_from(&settings);
            self.lines.iter().for_each(|line| set_up.take_line(line));
            set_up.clone()
        });
        let manual = set_up::steps().into_iter().map(|step| {
            let tasks: Vec<String> = step.tasks.iter().map(task).collect();
            let (is_shown, open) = (step.is_shown(), set_up.open(&step.tasks, &settings));
            json!({ "title": step.title, "how": step.how, "tasks": tasks, "isShown": is_shown, "open": open })
        });
        let margin = set_up.margin(&settings);
        let missing = margin.as_ref().err().map_or(&[][..], Vec::as_slice);
        json!({
            "steps": manual.collect::<Vec<_>>(),
            "next": set_up.next(&settings).map(|step| step.to_string()),
            "missing": missing.iter().map(Step::to_string).collect::<Vec<_>>(),
            "marginMm": margin.as_ref().ok().map(|margin| margin.least_mm()),
            "warning": set_up.warning(&settings),
        })
    }
}

/// The simulated machine's value for a task; empty for a measurement.
fn task(task: &Task) -> String {
    match task {
        Task::Fit(part, value) => format!("{part} = {value}"),
        Task::Set(setting, value) => format!("{} = {value} {}", name(*setting), unit(*setting)),
        Task::TimeServo => "calibrate servo".to_owned(),
        Task::MeasureWheel(length_mm) => format!("calibrate {length_mm}"),
        Task::SetMargin => "margin_mm".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use expect_test::expect_file;
    use link::{ANSWERS, EVENTS, LineDescription, Mode, STATUS, ValueDescription};

    /// A field with its TypeScript type, in the result of [`read`].
    fn field(value: &ValueDescription) -> Option<String> {
        let (name, rust) = value.field?;
        let (name, rust) = (camel_case(name), rust.replace(' ', ""));
        let optional = rust.strip_prefix("Option<").and_then(|rust| rust.strip_suffix('>'));
        let kind = match optional.unwrap_or(&rust) {
            "i32" | "u32" | "u16" | "u8" => "number",
            "[u8;COUNT]" => "readonly number[]",
            "bool" => "boolean",
            known @ ("Mode" | "Class") => known,
            "Alarm" | "Warning" | "String" => "string",
            other => panic!("say what {other} is in TypeScript"),
        };
        Some(format!("{name}{}: {kind}", if optional.is_some() { "?" } else { "" }))
    }

    /// A line with its fields, as Biome formats it.
    fn shape(line: &LineDescription) -> String {
        let fields: Vec<String> = line.values.iter().filter_map(field).collect();
        let name = camel_case(line.name);
        let in_a_line = format!("    {name}: {{ {} }};\n", fields.join("; "));
        match in_a_line.trim_end().len() {
            _ if fields.is_empty() => format!("    {name}: object;\n"),
            ..=120 => in_a_line,
            _ => format!("    {name}: {{\n        {};\n    }};\n", fields.join(";\n        ")),
        }
    }

    #[test]
    fn the_page_s_types_of_lines_are_the_tables_of_lines() {
        let plot = LineDescription { name: "Plot", meaning: "", beginning: "", values: &[] };
        const IS_ALARM: &[ValueDescription] = &[ValueDescription {
            key: "",
            kind: "",
            field: Some(("is_alarm", "bool")),
            meaning: "whether it is an alarm",
        }];
        let newer = LineDescription { name: "Newer", values: IS_ALARM, ..plot };
        let other = LineDescription { name: "Other", ..plot };
        let shapes = |lines: Vec<LineDescription>| lines.iter().map(shape).collect::<String>();
        let modes = [Mode::Hold, Mode::Work, Mode::Alarm].map(|mode| format!("\"{}\"", mode.name())).join(" | ");
        expect_file!["../../../page/src/link/console_line.ts"].assert_eq(&format!(
            "// What a line of the machine says. The tables of control/src/say/line_tables.rs and\n\
             // host/link/src/console_line.rs have the meaning and the unit of each field.\n\
             // `UPDATE_EXPECT=1 cargo test -p page lines` writes this file.\n\n\
             export type Mode = {modes};\n\
             type Class = \"plant\" | \"weed\" | \"unknown\";\n\n\
             interface Events {{\n{}}}\n\n\
             interface Answers {{\n{}}}\n\n\
             type Named<Lines> = {{ [Name in keyof Lines]: {{ readonly is: Name }} & Readonly<Lines[Name]> }}[keyof Lines];\n\n\
             /** What the machine tells by itself. */\n\
             export type EventLine = Named<Events> & {{ readonly isEvent: true }};\n\
             export type ConsoleLine = EventLine | Named<Answers>;\n\
             export type Line<Name extends ConsoleLine[\"is\"]> = Extract<ConsoleLine, {{ readonly is: Name }}>;\n\
             export type Setting = Line<\"setting\">;\n",
            shapes([EVENTS, &[plot, newer]].concat()),
            shapes([STATUS, ANSWERS, &[other]].concat()),
        ));
    }

    #[test]
    fn an_alarm_of_a_newer_firmware_has_its_name() {
        let line = "state=alarm code=9-9 name=boredom tool=out pos=1 speed_mm_s=-2 windows=3 unseen_mm=4";
        let status = json!({
            "is": "status", "mode": "alarm", "alarm": "boredom", "toolOut": true, "position": 1, "speedMmS": -2, "zones": 3,
            "unseenMm": 4,
        });
        assert_eq!(read(line), status);
    }

    #[test]
    fn what_a_newer_firmware_may_know_is_sent_last() {
        let from = Setting::all().map(|setting| (name(setting), setting.default())).collect();
        let to = [("a_new_one".to_owned(), 3), ("margin_mm".to_owned(), 60)].into();
        let answer = Change { from, to }.steps();
        assert_eq!(answer["steps"], json!([["margin_mm", 60], ["a_new_one", 3]]));
    }
}
