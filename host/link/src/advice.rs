//! Short advice to the operator for each alarm and warning. A test compares it with docs/faults.md.

use control::alarm::{Alarm, Warning};

/// An alarm's name as used everywhere: the digits that the LED blinks, and the word, such as `3-1 too_fast`.
pub fn name(alarm: Alarm) -> String {
    let (first, second) = alarm.code();
    format!("{first}-{second} {}", alarm.text())
}

/// What a restart at work means, by its cause.
pub fn restarted(cause: &str) -> String {
    format!("restarted ({cause}) while at work: not weeded from here")
}

/// What to check after an alarm, before it is cleared.
pub fn alarm(alarm: Alarm) -> &'static str {
    match alarm {
        Alarm::BeamBlocked => "clear, clean and align the beam, or raise `max_width_mm`",
        Alarm::BeamFlickers => "clean and shade the beam; see to its plug and wires",
        Alarm::BeamEdgesLost => "see to the beam's wires and supply: it chatters",
        Alarm::BeamBlind => "see to the first beam's wire at D8, its lens and aim",
        Alarm::SecondBeamBlind => "see to the second beam: wire at D10, lens, aim",
        Alarm::EncoderSilent => "see to the encoder's coupling, the beam; hold in wind",
        Alarm::EncoderChannelDead => "see to the wires at D2 and D3 and their pull-ups",
        Alarm::EncoderJumps => "see to the encoder's screen, ground and pull-ups",
        Alarm::TooFast => "drive slower, or beam farther ahead and raise the limit",
        Alarm::RolledBackTooFar => "roll forward to where you stopped, then `clear`",
        Alarm::ScheduleFull => "clean the beam, set it nearer, raise `merge_gap_mm`",
        Alarm::CropUnknown => "crop? teach it; weeds? `misfit_after`; else as 1-2",
        Alarm::ToolStuck => "stop; look for a stone, a dead servo, a loose switch",
        Alarm::SettingsLost => "check `get`, set what differs, `save`, `clear`",
        Alarm::SettingsContradict => "`clear`; `start` says which; change one, `save`",
        Alarm::StackLow => "tell the developers what you did; a reset clears it",
    }
}

/// What to do after a warning.
pub fn warning(warning: Warning) -> &'static str {
    match warning {
        Warning::LateCommand => "drive evenly, look at the plant, or raise `lead_out_ms`",
        Warning::NoPlants => "see whether the beam is as high as the canopy, and clean",
        Warning::SettingsOlder => "compare `get` with your notes, set what differs, `save`",
        Warning::SlipUnknown => "plants too near for these beams: a smaller `second_beam_mm`, or a wider margin",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_alarm_and_its_advice_fit_on_a_line_of_80_characters() {
        for alarm in (0..).map_while(Alarm::from_index) {
            let line = format!("alarm {}: {}", name(alarm), super::alarm(alarm));
            assert!(line.len() <= 80, "{line}");
        }
    }
}
