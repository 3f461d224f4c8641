//! What encoder and beam show when they fail.
//!
//! Neither sensor says that it is broken; it shows in what they say together. A machine that rolls makes progress, so edges
//! of the encoder that lead nowhere come from one live channel, and plants that pass a machine at rest come from a dead
//! encoder. A canopy has so many leaves and no more, so a beam that flickers sees dust. These monitors count; what a fault
//! means for the tool is decided by the [`controller`](crate::controller).

use crate::{
    alarm::Alarm,
    units::{Coarse, Instant, Position, Ticks},
};

/// A step farther than this is progress: a wheel that trembles on an edge moves by one, and one dead channel by one.
const PROGRESS: Ticks = Ticks(2);

/// The time in which edges are counted.
const PERIOD: u16 = Coarse::steps_in_ms(500);

/// Edges without progress in a period that no tremble gives: one channel alone shows them from 0.6 km/h on, and an
/// engine's vibration of 50 Hz, which makes 50 of them, does not.
const DEAD_CHANNEL_EDGES: u8 = 80;

/// Jumps of two ticks in a period. At 10 km/h the edges stand 188 us apart, and the interrupt answers in 20: there are none.
const JUMPS: u16 = 20;

/// Without progress for so long, the machine stands: slower than 0.05 km/h.
const STANDS: u16 = Coarse::steps_in_ms(100);

/// Times that the beam may break while the machine stands: leaves move in the wind, but plants do not pass.
const BREAKS: u8 = 3;

/// A machine that made its last progress within [`ROLLS`], at 0.8 km/h or faster with an encoder of 0.5 mm, and makes none for
/// this long, has either braked with more than 10 m/s2 or lost its encoder. At 2.5 km/h it rolls 21 mm in that time, less
/// than the margin.
const SUDDEN: u16 = Coarse::steps_in_ms(30);
const ROLLS: u16 = Coarse::steps_in_ms(7);

/// When the speed meter begins to take silence for slowness, and leads shrink: from here on until it is clear what the silence
/// is, a tool that is out stays out.
const QUIET: u16 = crate::speed::SPACING;

/// Watches the encoder.
#[derive(Clone, Debug)]
pub struct EncoderMonitor {
    /// Where the machine last made progress, when, and whether it rolled then.
    anchor: Position,
    progress_at: Coarse,
    rolled: bool,
    /// Whether it stands since, whether it became quiet, and whether it fell silent too suddenly.
    stands: bool,
    quiet: bool,
    fell_silent: bool,
    last: Position,
    /// Edges since the period began, all of them without progress.
    edges: u8,
    /// Times that the beam broke since the machine stands.
    breaks: u8,
    period_since: Coarse,
    /// The count of jumps when the period began.
    jumps: u16,
}

impl EncoderMonitor {
    /// A monitor for a machine that stands at `position`.
    pub const fn new(now: Instant, position: Position, jumps: u16) -> Self {
        Self {
            anchor: position,
            progress_at: now.coarse(),
            rolled: false,
            stands: false,
            quiet: false,
            fell_silent: false,
            last: position,
            edges: 0,
            breaks: 0,
            period_since: now.coarse(),
            jumps,
        }
    }

    /// Takes a reading, with the count of jumps since power-up; returns the fault that it shows.
    #[inline(never)]
    pub fn read(&mut self, now: Instant, position: Position, jumps: u16) -> Option<Alarm> {
        let now = now.coarse();
        if now.since(self.period_since) >= PERIOD {
            self.period_since = now;
            self.edges = 0;
            self.jumps = jumps;
        }
        let moved = position - self.anchor;
        let since_progress = now.since(self.progress_at);
        if moved > PROGRESS || moved < -PROGRESS {
            self.anchor = position;
            self.progress_at = now;
            self.rolled = !self.stands && since_progress <= ROLLS;
            (self.stands, self.quiet, self.fell_silent) = (false, false, false);
            self.edges = 0;
            self.breaks = 0;
        } else if since_progress >= QUIET {
            self.quiet = self.rolled;
            self.fell_silent |= self.rolled && since_progress >= SUDDEN;
            self.stands |= since_progress >= STANDS;
        }
        if position != self.last {
            self.edges = self.edges.saturating_add(1);
        }
        self.last = position;
        if jumps.wrapping_sub(self.jumps) > JUMPS {
            return Some(Alarm::EncoderJumps);
        }
        (self.edges > DEAD_CHANNEL_EDGES).then_some(Alarm::EncoderChannelDead)
    }

    /// The beam broke; returns the fault that this shows.
    pub fn beam_broke(&mut self) -> Option<Alarm> {
        if !self.stands {
            return None;
        }
        self.breaks = self.breaks.saturating_add(1);
        (self.breaks >= BREAKS).then_some(Alarm::EncoderSilent)
    }

    /// Whether the encoder has just become quiet, and nobody knows yet whether the machine brakes or the encoder has died.
    pub const fn is_quiet(&self) -> bool {
        self.quiet
    }

    /// Whether the machine may roll although the encoder says that it stands: it fell silent from one moment to the next, or
    /// the beam has been broken since.
    pub const fn is_doubtful(&self) -> bool {
        self.fell_silent || self.breaks > 0
    }
}

/// The time in which the beam's edges are counted.
const FLICKER_PERIOD: u16 = Coarse::steps_in_ms(100);

/// Edges in that time that no canopy makes: at 10 km/h a clear stretch every 14 mm.
const FLICKER_EDGES: u8 = 40;

/// Watches the beam.
#[derive(Clone, Debug)]
pub struct BeamMonitor {
    edges: u8,
    since: Coarse,
}

impl BeamMonitor {
    /// A monitor that has seen no edge.
    pub const fn new(now: Instant) -> Self {
        Self { edges: 0, since: now.coarse() }
    }

    /// The beam's level changed; returns the fault that this shows.
    pub fn edge(&mut self, now: Instant) -> Option<Alarm> {
        if now.coarse().since(self.since) >= FLICKER_PERIOD {
            *self = Self::new(now);
        }
        self.edges = self.edges.saturating_add(1);
        (self.edges > FLICKER_EDGES).then_some(Alarm::BeamFlickers)
    }
}
