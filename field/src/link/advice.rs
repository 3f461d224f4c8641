//! What to do about an alarm or a warning, in a sentence for the operator.

use control::alarm::{Alarm, Warning};

/// What to look at when an alarm is latched, and before it is cleared.
pub fn alarm(alarm: Alarm) -> &'static str {
    match alarm {
        Alarm::BeamBlocked => "take away what hangs in the beam, align it, or raise max_width_mm",
        Alarm::BeamFlickers => "clean the beam's lenses and see to its plug and wires",
        Alarm::BeamEdgesLost => "see to the beam's wires and its supply: its signal chatters",
        Alarm::EncoderSilent => "see to the encoder's plug, its supply and the ground wheel",
        Alarm::EncoderChannelDead => "one encoder wire is broken: see to those at D2 and D3",
        Alarm::EncoderJumps => "see to the encoder's wires and screen: both channels change at once",
        Alarm::TooFast => "walk slower, or raise top_speed_mm_s",
        Alarm::RolledBackTooFar => "roll forward: the ground under the tool has been forgotten",
        Alarm::ScheduleFull => {
            "more stands between beam and tool than can be kept: see merge_gap_ticks and the beam's height"
        }
        Alarm::ToolStuck => "free the tool, and see to the servo's supply and the end switch",
        Alarm::SettingsLost => "the defaults are in use: set or push the settings, then save",
        Alarm::SettingsContradict => "set the settings right with each other, then save",
        Alarm::StackLow => "clear it; when it comes again, report it with the output of status",
    }
}

/// What to do about a warning.
pub fn warning(warning: Warning) -> &'static str {
    match warning {
        Warning::LateCommand => "the tool left late: keep the speed steady, or raise lead_out_ms",
        Warning::NoPlants => "no plant for a long way: see that the beam is low enough and not blind",
    }
}
