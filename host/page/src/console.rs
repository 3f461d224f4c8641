//! The console for the page: the meaning of lines, and the order of changed settings.

use control::say::names;
use link::settings::{Setting, Settings, explain, name, steps};
use link::{ConsoleLine, EventLine, Field, SettingValue, Status, Values};
use serde::Deserialize;
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// The meaning of a line, in the form of `page/src/link/grammar.ts`.
pub fn read(line: &str) -> Value {
    match ConsoleLine::parse(line) {
        ConsoleLine::Greeting { version, cause } => json!({ "is": "greeting", "version": version, "cause": cause }),
        ConsoleLine::Version(version) => json!({ "is": "version", "version": version }),
        ConsoleLine::Done => json!({ "is": "end" }),
        ConsoleLine::Refused(error) => json!({ "is": "end", "error": error }),
        ConsoleLine::Status(status) => json!({ "is": "status", "status": shown_status(&status, line) }),
        ConsoleLine::Setting(setting) => json!({ "is": "setting", "setting": shown_setting(&setting) }),
        ConsoleLine::Help { name, help } => json!({ "is": "help", "name": name, "help": help }),
        ConsoleLine::Example { from_field, number, label, .. } => {
            json!({ "is": "example", "fromField": from_field, "number": number, "label": names::class(label).to_string() })
        }
        ConsoleLine::Event(event) => read_event(&event),
        ConsoleLine::Other => json!({ "is": "other" }),
    }
}

/// An event: its name and its fields.
fn read_event(event: &EventLine) -> Value {
    let Some((name, fields)) = event.fields() else { return json!({ "is": "plot" }) };
    let fields = fields.into_iter().map(|(field, value)| {
        let value = match value {
            Field::Number(number) => number.into(),
            Field::Flag(flag) => flag.into(),
            Field::Word(word) => word.into(),
        };
        (camel_case(field), value)
    });
    Value::Object([("is".to_owned(), camel_case(name).into())].into_iter().chain(fields).collect())
}

/// Converts a Rust name of a field or variant to TypeScript's form.
fn camel_case(name: &str) -> String {
    let mut camel = String::new();
    let mut begins = false;
    for character in name.chars() {
        match character {
            '_' => begins = true,
            _ if camel.is_empty() => camel.push(character.to_ascii_lowercase()),
            _ if std::mem::take(&mut begins) => camel.push(character.to_ascii_uppercase()),
            _ => camel.push(character),
        }
    }
    camel
}

/// The status. The alarm's name comes from the line, so that a newer alarm has its name too.
fn shown_status(status: &Status, line: &str) -> Value {
    let mut shown = json!({
        "mode": status.mode.name(),
        "toolOut": status.tool_out,
        "position": status.position,
        "speedMmS": status.speed_mm_s,
        "windows": status.windows,
        "unseenMm": status.unseen_mm,
    });
    for (key, text) in [("alarm", Values(line).alarm()), ("reason", status.reason.as_deref())] {
        if let Some(text) = text {
            shown[key] = text.into();
        }
    }
    shown
}

fn shown_setting(setting: &SettingValue) -> Value {
    let (least, greatest) = setting.range.unwrap_or((0, 1));
    let mut shown = json!({
        "name": setting.name,
        "value": setting.value,
        "unit": setting.unit,
        "least": least,
        "greatest": greatest,
        "isSwitched": setting.range.is_none(),
        "default": setting.default,
    });
    if let Some(saved) = setting.saved {
        shown["saved"] = saved.into();
    }
    shown
}

/// The firmware of these sources: its version, and its settings' names. A release's version includes the commit
/// (`control/src/say/version.rs`).
pub fn firmware() -> Value {
    let number = env!("CARGO_PKG_VERSION");
    let version = match option_env!("WEEDER_COMMIT") {
        Some(commit) if !commit.is_empty() => format!("{number} ({commit})"),
        _ => number.to_owned(),
    };
    json!({ "version": version, "settings": Setting::all().map(name).collect::<Vec<_>>() })
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
        let (to, unknown) = settings(from.clone(), &self.to);
        let mut to = to;
        let is_another = |setting: Setting| setting.is_of_the_wheel() && from.get(setting) != to.get(setting);
        if Setting::all().any(is_another) && !self.to.contains_key(&name(Setting::TicksPerM)) {
            // The new wheel has no measured value yet: the firmware resets it by itself.
            let _ = to.set(Setting::TicksPerM, 0);
        }
        if let Some(contradiction) = to.contradiction() {
            return json!({ "contradiction": explain(contradiction), "steps": [] });
        }
        let known = steps(&from, &to).into_iter().map(|(setting, value)| (name(setting), value));
        json!({ "steps": known.chain(unknown).collect::<Vec<_>>() })
    }
}

/// Settings with some values set, and the values that could not be.
pub fn settings(mut settings: Settings, values: &BTreeMap<String, u16>) -> (Settings, Vec<(String, u16)>) {
    let mut unknown = Vec::new();
    for (name, &value) in values {
        let is_set = Setting::find(name.as_bytes()).is_some_and(|setting| settings.set(setting, value).is_ok());
        if !is_set {
            unknown.push((name.clone(), value));
        }
    }
    (settings, unknown)
}

#[cfg(test)]
mod tests {
    use super::*;
    use expect_test::expect_file;
    use link::{EVENTS, Mode, ValueDescription};

    /// A comment, unless the text is empty.
    fn comment(indent: &str, meaning: &str) -> String {
        let mut letters = meaning.chars();
        let first = letters.next().map_or(String::new(), |first| first.to_uppercase().to_string());
        format!("{indent}/** {first}{}. */\n", letters.as_str())
    }

    /// The TypeScript type of a field in the result of [`read`].
    fn type_of(rust: &str) -> &str {
        match rust {
            "i32" | "u16" | "u8" => "number",
            "bool" => "boolean",
            "Mode" => "Mode",
            "Class" => "\"plant\" | \"weed\" | \"unknown\"",
            "Alarm" | "Warning" => "string",
            _ => panic!("say what {rust} is in TypeScript"),
        }
    }

    #[test]
    fn the_page_s_types_of_events_are_the_table_of_events() {
        let field = |value: &ValueDescription| {
            let (name, rust) = value.field?;
            let about = comment("    ", value.meaning);
            Some(format!("{about}    readonly {}: {};\n", camel_case(name), type_of(rust)))
        };
        let shapes = EVENTS.iter().map(|event| {
            let fields: String = event.values.iter().filter_map(field).collect();
            let (about, is) = (comment("", event.meaning), camel_case(event.name));
            format!("{about}export interface {} {{\n    readonly is: \"{is}\";\n{fields}}}\n\n", event.name)
        });
        let shapes: String = shapes.collect();
        let modes = [Mode::Hold, Mode::Work, Mode::Alarm].map(|mode| format!("\"{}\"", mode.name())).join(" | ");
        let list = |line: fn(&str) -> String| EVENTS.iter().map(|event| line(event.name)).collect::<String>();
        let [types, names] =
            [list(|name| format!("\n    | {name}")), list(|name| format!("    \"{}\",\n", camel_case(name)))];
        expect_file!["../../../page/src/link/events.ts"].assert_eq(&format!(
            "// What the machine tells by itself: the table of events in control/src/say/event_table.rs, as types.\n\
             // `UPDATE_EXPECT=1 cargo test -p page events` writes this file.\n\n\
             /** What the machine is doing. */\n\
             export type Mode = {modes};\n\n\
             {shapes}/** Points of a plotter's curves. */\n\
             export interface Plot {{\n    readonly is: \"plot\";\n}}\n\n\
             /** What the machine tells by itself. */\n\
             export type Told ={types}\n    | Plot;\n\n\
             /** What each of them is. */\n\
             export const TOLD: readonly Told[\"is\"][] = [\n{names}    \"plot\",\n];\n"
        ));
    }

    #[test]
    fn a_line_is_told_to_the_page_with_all_that_is_in_it() {
        for (line, said) in [
            ("ok", json!({ "is": "end" })),
            ("error: no", json!({ "is": "end", "error": "no" })),
            ("alarm code=3-1 name=too_fast pos=7", json!({ "is": "alarm", "alarm": "too_fast", "position": 7 })),
            (
                "state=alarm code=9-9 name=boredom tool=out pos=1 speed_mm_s=-2 windows=3 unseen_mm=4",
                json!({ "is": "status", "status": {
                    "mode": "alarm", "alarm": "boredom", "toolOut": true, "position": 1, "speedMmS": -2, "windows": 3,
                    "unseenMm": 4,
                } }),
            ),
            (
                "plant pos=-7 votes=3 spacing=1 delay=2 hold=3 actuation=5",
                json!({
                    "is": "detection", "class": "plant", "position": -7, "votes": 3, "spacing": 1, "delay": 2, "hold": 3,
                    "actuation": 5,
                }),
            ),
            (
                "end_switch=off on or off, default off, not saved",
                json!({ "is": "setting", "setting": {
                    "name": "end_switch", "value": 0, "unit": "", "least": 0, "greatest": 1, "isSwitched": true, "default": 0,
                } }),
            ),
            ("calibrated by=eye, set them", json!({ "is": "calibratedByEye" })),
            (
                "calibrated lead_out_ms=150 lead_in_ms=40 set=yes",
                json!({ "is": "calibratedBySwitch", "outMs": 150, "inMs": 40, "isSet": true }),
            ),
        ] {
            assert_eq!(read(line), said, "{line}");
        }
    }

    /// The answer to a change from the defaults.
    fn steps_to(to: &[(&str, u16)]) -> Value {
        let from = Setting::all().map(|setting| (name(setting), setting.description().default)).collect();
        Change { from, to: to.iter().map(|&(name, value)| (name.to_owned(), value)).collect() }.steps()
    }

    #[test]
    fn settings_go_in_an_order_that_the_firmware_takes() {
        let swapped = steps_to(&[("beam_to_tool_mm", 2000), ("lead_out_ms", 500), ("margin_mm", 200)]);
        assert_eq!(swapped["steps"][0], json!(["beam_to_tool_mm", 2000]), "{swapped}");
        assert_eq!(swapped["steps"].as_array().map(Vec::len), Some(3), "{swapped}");
    }

    #[test]
    fn a_contradiction_is_said_before_anything_is_sent() {
        let answer = steps_to(&[("beam_to_tool_mm", 100)]);
        assert!(answer["contradiction"].as_str().is_some_and(|why| why.contains("raise it")), "{answer}");
        assert_eq!(answer["steps"], json!([]));
    }

    #[test]
    fn what_a_newer_firmware_may_know_is_sent_last() {
        let answer = steps_to(&[("a_new_one", 3), ("margin_mm", 60)]);
        assert_eq!(answer["steps"], json!([["margin_mm", 60], ["a_new_one", 3]]));
    }
}
