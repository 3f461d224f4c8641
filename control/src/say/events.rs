//! Writes the lines of events from the [table of events](crate::event_table).

use super::{
    line::Line,
    line_tables::line,
    names,
    texts::{self, Text},
};
use crate::{
    event_table,
    operate::{
        calibration::{Outcome, SwingTimes},
        event::Event,
    },
};

macro_rules! write_event {
    ($($Event:ident $meaning:literal, $pattern:pat => $beginning:literal { $($values:tt)* } $($tail:literal)?)*) => {
        /// Builds the line of an event.
        #[inline(never)]
        pub fn write_event(event: &Event, line: &mut Line) {
            match *event {
                $($pattern => line!(write(line) $beginning " " $($values)* $($tail)?),)*
            }
            line.say(texts::END);
        }
    };
}

event_table!(write_event);
