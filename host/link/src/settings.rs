//! The machine's settings: reads all, and changes them without an intermediate contradiction.
//!
//! Names, ranges and defaults are those of the firmware's own table ([`control::settings`]). The firmware refuses a
//! value that contradicts the others. So the order of changes matters, and [`steps`] finds one.

use super::{ConsoleLine, Link, LinkError, Mode, Status};
pub use control::settings::{Contradiction, Setting, Settings};
use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use thiserror::Error;

/// Why settings could not be read or changed.
#[derive(Debug, Error)]
#[expect(missing_docs, reason = "the messages say what each means")]
pub enum SettingsError {
    #[error(transparent)]
    Link(#[from] LinkError),
    #[error("{0}. This command needs all settings of this program, within its own ranges")]
    Other(String),
    #[error("the machine is at work, where its settings cannot all be changed: hold it first, by its switch or `hold`")]
    AtWork,
    #[error("{0}; nothing was sent")]
    Contradiction(String),
    #[error("{0}. The machine does not know it either, and nothing was sent")]
    NotKnown(String),
    #[error("{0}. Some settings may be set and not saved: `revert` takes them back")]
    NotSaved(LinkError),
    #[error(
        "{setting} was set to {wanted} and is {found}: see to the cable and the supply, and try again. Nothing was saved, \
         and `revert` brings the saved settings back"
    )]
    NotTaken { setting: String, wanted: u16, found: u16 },
}

/// A setting's name.
pub fn name(setting: Setting) -> String {
    setting.text().to_string()
}

/// A setting's help for the operator.
pub fn help(setting: Setting) -> String {
    setting.help().to_string()
}

/// The help for the operator of all settings, by their names.
pub fn helps() -> BTreeMap<String, String> {
    Setting::all().map(|setting| (name(setting), help(setting))).collect()
}

/// A setting's unit; empty for a count.
pub fn unit(setting: Setting) -> String {
    setting.unit().to_string().trim_start().to_owned()
}

/// A setting's range, with its unit and default.
pub fn range(setting: Setting) -> String {
    if setting.is_switched() {
        return format!("true or false, default {}", setting.default() == 1);
    }
    // The console writes the unit behind a number, with its blank.
    format!("{} to {}{}, default {}", setting.least(), setting.greatest(), setting.unit(), setting.default())
}

/// Which settings contradict each other, and what would be right.
pub fn explain(contradiction: Contradiction) -> String {
    match contradiction {
        Contradiction::PulsesEqual => {
            "servo_in_us and servo_out_us are equal, and the tool would not move: let them differ".to_owned()
        }
        Contradiction::SecondBeamAstray => {
            "a second beam stands 72 mm or more behind the first and ahead of the tool, and beam_to_tool_mm is 1000 at most: \
             change second_beam_mm or beam_to_tool_mm"
                .to_owned()
        }
        Contradiction::EncoderTooCoarse => {
            "a wheel has to give 900 ticks a metre or more, or a failing encoder is found too late: ticks_per_m, and the value from ticks_per_rev and wheel_mm, must reach that; ticks_per_rev is four times the encoder's lines: if it is, take more lines or a smaller wheel"
                .to_owned()
        }
        Contradiction::BeamTooNear { needed_mm } => format!(
            "margin_mm, stem_zone_mm, lead_out_ms, beam_response_ms and top_speed_mm_s together need a beam_to_tool_mm of {needed_mm} or \
             more: raise it, or lower one of them"
        ),
    }
}

/// A lower top speed is a multiple of this, mm/s. That leaves some room for a longer lead.
pub const SPEED_STEP_MM_S: u16 = 50;

/// The highest top speed that does not contradict the other settings, in mm/s: theirs, or a lower one.
///
/// # Errors
/// What is contradicted at the lowest top speed too.
pub fn allowed_top_speed(settings: &Settings) -> Result<u16, Contradiction> {
    let mut slower = settings.clone();
    loop {
        let mm_s = slower.get(Setting::TopSpeedMmS);
        let Some(contradiction) = slower.contradiction() else { return Ok(mm_s) };
        if slower.set(Setting::TopSpeedMmS, (mm_s - 1) / SPEED_STEP_MM_S * SPEED_STEP_MM_S).is_err() {
            return Err(contradiction);
        }
    }
}

/// The speed up to which a tool with a second beam works, in mm/s: at a higher one it stays out, because a plant that only
/// this beam sees would reach it too soon. `None` without a second beam.
pub fn working_speed(settings: &Settings) -> Option<u16> {
    let [beam_to_tool_mm, second_beam_mm, margin_mm, zone_mm, lead_out_ms, response_ms] = [
        Setting::BeamToToolMm,
        Setting::SecondBeamMm,
        Setting::MarginMm,
        Setting::StemZoneMm,
        Setting::LeadOutMs,
        Setting::BeamResponseMs,
    ]
    .map(|setting| u32::from(settings.get(setting)));
    // As in the firmware's contradiction of a beam that is too near.
    let room_mm = beam_to_tool_mm.saturating_sub(second_beam_mm.max(margin_mm + zone_mm / 2) + 1);
    let mm_s = 1000 * room_mm / (lead_out_ms + lead_out_ms / 8 + response_ms + 1);
    (second_beam_mm > 0).then_some(mm_s.try_into().unwrap_or(u16::MAX))
}

/// Reads all settings in use.
///
/// # Errors
/// If the console fails, or the firmware lacks a setting of this program or has a value outside of its range.
pub fn read(link: &mut Link) -> Result<Settings, SettingsError> {
    let lines = read_lines(link)?;
    let shown = Shown::by(&lines);
    match other_version(link.version(), &lines) {
        Some(other) if !shown.missing.is_empty() => Err(SettingsError::Other(other)),
        _ => Ok(shown.settings),
    }
}

/// Reads all settings in use, also those of another version.
///
/// # Errors
/// If the console fails.
pub fn read_shown(link: &mut Link) -> Result<Shown, LinkError> {
    Ok(Shown::by(&read_lines(link)?))
}

/// The lines that show all settings in use.
///
/// # Errors
/// If the console fails.
pub fn read_lines(link: &mut Link) -> Result<Vec<String>, LinkError> {
    link.ask_surely("get")
}

/// The settings of a machine, whose firmware may have another version.
#[derive(Clone, Debug, Default)]
pub struct Shown {
    /// The settings of this program. Those that are missing have their defaults here.
    pub settings: Settings,
    /// Settings of this program that the machine does not have, or whose value is outside of this program's range.
    pub missing: Vec<Setting>,
    /// The machine's own ranges of the settings that are not missing.
    pub ranges: Vec<(Setting, RangeInclusive<u16>)>,
    /// Settings, or values of settings, that only the machine's version has.
    pub others: Vec<OtherSetting>,
}

/// A setting of another version.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OtherSetting {
    /// Its name.
    pub name: String,
    /// Its value.
    pub value: u16,
    /// Its valid values.
    pub range: RangeInclusive<u16>,
    /// Whether it is a switch.
    pub is_switched: bool,
    /// Its unit; empty for a count.
    pub unit: String,
}

impl Shown {
    /// The settings that the answer to `get` shows.
    pub fn by(lines: &[String]) -> Self {
        let mut shown = Self { missing: Setting::all().collect(), ..Self::default() };
        for line in lines {
            if let Some((setting, value)) = self::shown(line)
                && shown.settings.set(setting, value).is_ok()
            {
                shown.missing.retain(|missing| *missing != setting);
                if let ConsoleLine::Setting { least, greatest, .. } = ConsoleLine::parse(line) {
                    shown.ranges.push((setting, least..=greatest));
                }
            } else if let ConsoleLine::Setting { name, value, unit, least, greatest, is_switched, .. } =
                ConsoleLine::parse(line)
            {
                shown.others.push(OtherSetting { name, value, range: least..=greatest, is_switched, unit });
            }
        }
        shown
    }

    /// The machine's own setting of this name, if the machine takes the value.
    ///
    /// # Errors
    /// If it does not.
    pub fn takes(&self, foreign: &Foreign) -> Result<&OtherSetting, SettingsError> {
        let is_it = |own: &&OtherSetting| own.name == foreign.name && own.range.contains(&foreign.value);
        self.others.iter().find(is_it).ok_or_else(|| SettingsError::NotKnown(foreign.problem.clone()))
    }

    /// The setting that replaced this one, with its value, if the machine has it.
    pub fn replacement(&self, foreign: &Foreign) -> Option<(Setting, u16)> {
        foreign.replaced_by.filter(|(setting, _)| !self.missing.contains(setting))
    }
}

const OWN: &str = env!("CARGO_PKG_VERSION");

/// Says that the machine's firmware has another version than this program, and what to do. `None` if it has this version
/// and its settings. `lines` are the answer to `get`.
pub fn other_version(version: &str, lines: &[String]) -> Option<String> {
    let Shown { missing, others, .. } = Shown::by(lines);
    let others: Vec<String> = others.into_iter().map(|other| other.name).collect();
    // Without lines, nothing is known of its settings.
    let missing = missing.into_iter().filter(|_| !lines.is_empty()).map(name);
    let missing: Vec<String> = missing.filter(|name| !others.contains(name)).collect();
    let mut said = match numbers(version).cmp(&numbers(OWN)) {
        Ordering::Greater => {
            format!("the firmware {version} is newer than this program, {OWN}: take the `weeder` of that version")
        }
        Ordering::Less => {
            format!(
                "the firmware {version} is older than this program, {OWN}: save its settings by `weeder settings pull FILE.toml`, then `weeder flash` brings this version"
            )
        }
        Ordering::Equal if others.is_empty() && missing.is_empty() => return None,
        Ordering::Equal => format!("the firmware {version} has other settings than this program of the same number"),
    };
    for (names, what) in [(others, "only the firmware knows"), (missing, "the firmware lacks")] {
        if !names.is_empty() {
            said += &format!("; {what} {}", names.join(", "));
        }
    }
    Some(said)
}

/// The numbers of a version, without its commit.
fn numbers(version: &str) -> Vec<u32> {
    let number = version.split(' ').next().unwrap_or_default();
    number.split(['.', '-']).map_while(|number| number.parse().ok()).collect()
}

/// The setting in a line `name=value ...`. `None` if the line shows no setting.
pub fn shown(line: &str) -> Option<(Setting, u16)> {
    let (name, rest) = line.split_once('=')?;
    let setting = Setting::find(name.as_bytes())?;
    let value = match rest.split([' ', ',']).next()? {
        "on" if setting.is_switched() => 1,
        "off" if setting.is_switched() => 0,
        number => number.parse().ok()?,
    };
    Some((setting, value))
}

/// The settings to send, in order, so that no intermediate state contradicts itself.
///
/// A change that widens the valid range of others can always go first. Only the two pulse widths can block each other,
/// if they are exchanged. Then one of them first takes a neighbouring value.
pub fn steps(from: &Settings, to: &Settings) -> Vec<(Setting, u16)> {
    let mut now = from.clone();
    let mut steps = Vec::new();
    loop {
        let mut rest = Setting::all().filter(|&setting| now.get(setting) != to.get(setting)).peekable();
        let Some(&first) = rest.peek() else { return steps };
        let can_go = |&setting: &Setting| {
            let mut next = now.clone();
            // Values of settings are in their ranges.
            let _ = next.set(setting, to.get(setting));
            next.contradiction().is_none() || now.contradiction().is_some()
        };
        let (setting, value) = match rest.find(can_go) {
            Some(setting) => (setting, to.get(setting)),
            // Both pulses wait for each other.
            None => (first, beside(first, &now, to)),
        };
        // Values of settings are in their ranges.
        let _ = now.change(setting, value);
        steps.push((setting, value));
    }
}

/// Another wheel has no calibration yet: the firmware resets it by itself ([`Settings::change`]).
pub fn follow_wheel(before: &Settings, after: &mut Settings) {
    if is_another_wheel(before, after) {
        let _ = after.set(Setting::TicksPerM, 0);
    }
}

fn is_another_wheel(one: &Settings, other: &Settings) -> bool {
    Setting::all().any(|setting| setting.is_of_the_wheel() && one.get(setting) != other.get(setting))
}

/// A pulse width near the target of `setting` that differs from the present and target values of both pulses.
fn beside(setting: Setting, now: &Settings, to: &Settings) -> u16 {
    let taken = [now, to].map(|settings| [settings.get(Setting::ServoInUs), settings.get(Setting::ServoOutUs)]);
    let wanted = to.get(setting);
    (setting.least()..=setting.greatest())
        .filter(|pulse| !taken.as_flattened().contains(pulse))
        .min_by_key(|pulse| pulse.abs_diff(wanted))
        .unwrap_or(wanted)
}

/// A setting of a file that this program does not know, or whose value is outside of this program's range.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Foreign {
    /// Its name.
    pub name: String,
    /// Its value.
    pub value: u16,
    /// What would be right for this program, with the file's line.
    pub problem: String,
    /// This program's setting that replaced it, with the converted value.
    pub replaced_by: Option<(Setting, u16)>,
}

/// Sets some settings, leaves the others unchanged, and reads all back. `save` saves them. Returns the changed settings.
///
/// Sends nothing if the result would contradict itself, if it has another wheel with the board's calibration, or if the machine is at
/// work. Settings that only the machine's
/// version has, or whose values only it has, are sent as they are, and the machine checks them.
///
/// # Errors
/// These two cases; a setting or a value that the machine does not have; errors of the console; and a value that was not
/// accepted.
pub fn push(
    link: &mut Link,
    wanted: &[(Setting, u16)],
    foreign: &[Foreign],
    save: bool,
) -> Result<Vec<String>, SettingsError> {
    let shown = read_shown(link)?;
    let (before, mut after) = (&shown.settings, shown.settings.clone());
    let mut foreign = foreign.to_vec();
    for &(setting, value) in wanted {
        let name = name(setting);
        if shown.missing.contains(&setting) {
            foreign.push(Foreign { problem: format!("{name} {value} is wanted"), name, value, replaced_by: None });
        } else {
            // Values of settings are in their ranges.
            let _ = after.set(setting, value);
        }
    }
    let mut changed = Vec::new();
    for foreign in &foreign {
        if let Some((setting, value)) = shown.replacement(foreign) {
            let _ = after.set(setting, value);
            continue;
        }
        let own = shown.takes(foreign)?;
        if own.value != foreign.value {
            let value = match foreign.value {
                value if !own.is_switched => value.to_string(),
                value => if value == 0 { "off" } else { "on" }.to_owned(),
            };
            changed.push((foreign.name.clone(), format!("set {} {value}", foreign.name)));
        }
    }
    let wants_calibration = wanted.iter().any(|&(setting, _)| setting == Setting::TicksPerM);
    if !wants_calibration && !shown.missing.contains(&Setting::TicksPerM) {
        follow_wheel(before, &mut after);
    }
    // A pulled file in which the wheel was edited.
    let ticks_per_m = after.get(Setting::TicksPerM);
    if wants_calibration
        && ticks_per_m > 0
        && ticks_per_m == before.get(Setting::TicksPerM)
        && is_another_wheel(before, &after)
    {
        return Err(SettingsError::Contradiction(format!(
            "ticks_per_m {ticks_per_m} was measured with the wheel before: write 0, and calibrate the new one"
        )));
    }
    let is_beyond = |(setting, own): &&(Setting, RangeInclusive<u16>)| !own.contains(&after.get(*setting));
    if let Some((setting, own)) = shown.ranges.iter().find(is_beyond) {
        let problem = format!("the machine takes {} from {} to {}", name(*setting), own.start(), own.end());
        return Err(SettingsError::Contradiction(problem));
    }
    if let Some(contradiction) = after.contradiction().filter(|_| shown.missing.is_empty()) {
        return Err(SettingsError::Contradiction(explain(contradiction)));
    }
    let steps = steps(before, &after);
    let needs_hold = save || !changed.is_empty() || steps.iter().any(|(setting, _)| setting.is_hold_only());
    if needs_hold && status(link)?.mode == Mode::Work {
        return Err(SettingsError::AtWork);
    }
    let commands = steps.iter().map(|&(setting, value)| format!("set {} {value}", name(setting)));
    for (sent, command) in commands.chain(changed.iter().map(|(_, command)| command.clone())).enumerate() {
        // A command without an answer may have been carried out.
        let failed = |error| match error {
            error @ LinkError::Refused { .. } if sent == 0 => SettingsError::Link(error),
            error => SettingsError::NotSaved(error),
        };
        link.ask(&command).map_err(failed)?;
    }
    let is_sent = !(steps.is_empty() && changed.is_empty());
    let found = read_shown(link).map_err(if is_sent { SettingsError::NotSaved } else { SettingsError::Link })?;
    let differs = |&setting: &Setting| {
        ![&found, &shown].iter().any(|shown| shown.missing.contains(&setting))
            // A wheel of another version may have reset its calibration.
            && (changed.is_empty() || setting != Setting::TicksPerM)
            && found.settings.get(setting) != after.get(setting)
    };
    if let Some(setting) = Setting::all().find(differs) {
        let (wanted, found) = (after.get(setting), found.settings.get(setting));
        return Err(SettingsError::NotTaken { setting: name(setting), wanted, found });
    }
    if save {
        link.ask("save").map_err(SettingsError::NotSaved)?;
    }
    let set = Setting::all().filter(|&setting| before.get(setting) != after.get(setting)).map(name);
    Ok(set.chain(changed.into_iter().map(|(name, _)| name)).collect())
}

/// Asks for the machine's status.
///
/// # Errors
/// If the console fails, or the firmware has another status than this program.
pub fn status(link: &mut Link) -> Result<Status, LinkError> {
    let mut lines = link.ask("status")?;
    let found = |lines: &[String]| lines.iter().find_map(|line| Status::parse(line));
    if found(&lines).is_none() {
        // Noise has damaged it, or it is another firmware.
        lines = link.ask("status")?;
    }
    found(&lines).ok_or_else(|| LinkError::NotTheWeeder(lines.join(" ")))
}

#[cfg(test)]
mod tests;
