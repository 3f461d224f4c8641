//! The console for the page: what a line says, and in which order settings can be sent.

use control::ground::class::Class;
use link::settings::{Setting, Settings, explain, name, steps};
use link::{ConsoleLine, EventLine, SettingValue, Status, Timed, Values};
use serde::Deserialize;
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// What a line says, as `page/src/link/grammar.ts` has it.
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
            json!({ "is": "example", "fromField": from_field, "number": number, "label": class(label) })
        }
        ConsoleLine::Event(event) => read_event(&event, line),
        ConsoleLine::Other => json!({ "is": "other" }),
    }
}

fn read_event(event: &EventLine, line: &str) -> Value {
    match *event {
        EventLine::Detection { class: taken_for, position, votes, spacing, delay, hold, .. } => json!({
            "is": "object",
            "seen": {
                "class": class(taken_for),
                "position": position,
                "votes": votes,
                "spacing": spacing,
                "delay": delay,
                "hold": hold,
            },
        }),
        EventLine::Swing { out, .. } => json!({ "is": "swing", "out": out }),
        EventLine::Slip { permille } => json!({ "is": "slip", "permille": permille }),
        EventLine::Guarded { .. } => json!({ "is": "guarded" }),
        EventLine::State(mode) => json!({ "is": "state", "mode": mode.name() }),
        EventLine::Alarm { .. } => json!({ "is": "alarm", "name": Values(line).alarm() }),
        EventLine::Warning(_) => json!({ "is": "warning", "name": Values(line).text("name") }),
        EventLine::Calibrated { by, is_set } => {
            let by = match by {
                Timed::EndSwitch { .. } => "end switch",
                Timed::Eye => "eye",
                Timed::None => "none",
            };
            json!({ "is": "calibrated", "by": by, "isSet": is_set })
        }
        EventLine::Plot => json!({ "is": "plot" }),
    }
}

/// The status; the alarm's name from the line, so that one which is new has it too.
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

/// The firmware of these sources: its version, with the commit where a release is built (`control/src/say/version.rs`), and its settings'
/// names.
pub fn firmware() -> Value {
    let number = env!("CARGO_PKG_VERSION");
    let version = match option_env!("WEEDER_COMMIT") {
        Some(commit) if !commit.is_empty() => format!("{number} ({commit})"),
        _ => number.to_owned(),
    };
    json!({ "version": version, "settings": Setting::all().map(name).collect::<Vec<_>>() })
}

fn class(class: Class) -> &'static str {
    match class {
        Class::Plant => "plant",
        Class::Weed => "weed",
        Class::Unknown => "unknown",
    }
}

/// All settings as they are, and some as they are to be, by their names.
#[derive(Deserialize)]
pub struct Change {
    from: BTreeMap<String, u16>,
    to: BTreeMap<String, u16>,
}

impl Change {
    /// The values to send, `[name, value]` one after the other, with no contradiction on the way; or what contradicts what in the
    /// end. Settings and values that this version does not know go last: the firmware may know them.
    pub fn steps(&self) -> Value {
        let (from, _) = settings(Settings::new(), &self.from);
        let (to, unknown) = settings(from.clone(), &self.to);
        let mut to = to;
        let is_another = |setting: Setting| setting.is_of_the_wheel() && from.get(setting) != to.get(setting);
        if Setting::all().any(is_another) && !self.to.contains_key(&name(Setting::TicksPerM)) {
            // Nobody has measured that wheel yet: the firmware forgets the measure by itself.
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

    #[test]
    fn a_line_is_told_to_the_page_with_all_that_is_in_it() {
        for (line, said) in [
            ("ok", json!({ "is": "end" })),
            ("error: no", json!({ "is": "end", "error": "no" })),
            ("alarm code=3-1 name=too_fast pos=7", json!({ "is": "alarm", "name": "too_fast" })),
            (
                "state=alarm code=9-9 name=boredom tool=out pos=1 speed_mm_s=-2 windows=3 unseen_mm=4",
                json!({ "is": "status", "status": {
                    "mode": "alarm", "alarm": "boredom", "toolOut": true, "position": 1, "speedMmS": -2, "windows": 3,
                    "unseenMm": 4,
                } }),
            ),
            (
                "plant pos=-7 votes=3 spacing=1 delay=2 hold=3 actuation=5",
                json!({ "is": "object", "seen": {
                    "class": "plant", "position": -7, "votes": 3, "spacing": 1, "delay": 2, "hold": 3,
                } }),
            ),
            (
                "end_switch=off on or off, default off, not saved",
                json!({ "is": "setting", "setting": {
                    "name": "end_switch", "value": 0, "unit": "", "least": 0, "greatest": 1, "isSwitched": true, "default": 0,
                } }),
            ),
            ("calibrated by=eye, set them", json!({ "is": "calibrated", "by": "eye", "isSet": false })),
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
