//! What encoder and beam show when they fail.
//!
//! Neither sensor says that it is broken; it shows in what they say together. A machine that rolls makes progress, so edges
//! of the encoder that lead nowhere come from one live channel, and plants that pass a machine at rest come from a dead
//! encoder. A machine has a mass, so an encoder that falls silent without having become slow has failed, and one that is as
//! fast again behind a gap as it was before has lost what lies between. A canopy has so many leaves and no more, so a beam that
//! flickers sees dust. These monitors count; what a fault means for the tool is decided by the
//! [`weeder`](crate::weeder).
//!
//! What small faults lose adds up until it has rolled by: [`EncoderMonitor`] holds it against what the tool may be astray by.

use crate::{
    alarm::Alarm,
    units::{Coarse, Instant, Position},
};

/// The time in which edges are counted.
const PERIOD: u16 = Coarse::steps_in_ms(500);

/// Turns of the wheel to and fro in a period, without progress, that no tremble gives. One channel alone has each of its edges look
/// like one, and shows so many from 0.6 km/h on; an engine's vibration of 50 Hz, which makes 50 of them, does not.
const DEAD_CHANNEL_TURNS: u8 = 80;

/// Without progress for so long, the machine stands: slower than 0.05 km/h.
const STANDS: u16 = Coarse::steps_in_ms(150);

/// Turns to and fro without progress, in slow rolling, from which on the distance is unknown. A machine that stops rolls back a
/// little, and on again: those are two.
const FALTERS: u8 = 3;

/// Times that the beam may break while the machine stands: leaves move in the wind, but plants do not pass.
const BREAKS: u8 = 3;

/// The time of a progress in steps of 256 us: all that tells slow rolling from standing fits into a byte.
type Short = u8;

/// When the speed meter begins to take silence for slowness, and leads shrink: from here on until it is clear what the silence
/// is, a tool that is out stays out.
const QUIET: Short = (crate::measure::speed::SPACING >> 2) as Short;

/// A machine rolls steadily where a progress takes no longer than this, 15.4 ms: from 0.5 km/h on with ticks of 0.5 mm or finer.
/// Coarser ones need four ticks in this time, and are not known to fall silent at less.
///
/// Below it, nothing tells a silence from a stop: a machine stops within a progress.
const STEADY: Short = 59;

/// A machine that brakes takes longer for each progress than for the one before, and soon stops. So it rolls steadily only where
/// twice the last progress is no more than so much above the one before, 15.6 ms. Who brakes with 3.3 m/s2, 3 on the ground and a
/// tenth for the wheel's slip, exceeds that in the last progress but one before the standstill: with `x` of them to roll and ticks of
/// 0.5 mm it takes `sqrt(x + 1) - sqrt(x)` times 35.6 ms, and `x` below 1 gives 18.2 ms. From 1 on there is another progress,
/// within 2.42 times this one: `sqrt(x) - sqrt(x - 1)` is at most so many times `sqrt(x + 1) - sqrt(x)`.
const BRAKES: Short = 61;

/// Slower than four ticks in this time, 32.8 ms, a wheel may tremble to and fro while it rolls: below 0.5 km/h with the coarsest
/// encoder ([`TICKS_PER_M_LEAST`](crate::settings::TICKS_PER_M_LEAST)).
const SLOW: Short = 128;

/// What a turn of the loop at either end may add to a time: 1 ms, or the turn and a step where it is longer.
const TURN: Short = 4;

const fn grace(turn: Short) -> u16 {
    if turn < TURN { TURN as u16 } else { turn as u16 + 1 }
}

/// Silences in steady rolling that are an alarm, where none is farther behind the other than so many times the progress, 10 m. A
/// sound encoder has none; one may be a wheel that a stone caught. Each costs the ground from beam to tool.
const SILENCES: u8 = 3;
const SILENCES_WITHIN: u16 = 5000;

/// What is lost is told in quarters of a progress, which are ticks where the encoder is no finer than 0.4 mm.
const PROGRESS: u8 = 4;

/// Lost with half a pulse of a channel: where one does not come, the other channel counts a tick back and on again instead, and
/// the wheel seems to turn round twice.
const TURNED_ROUND: u8 = 2;

/// One that may be lost is paid for by so many times the progress, 32 quarters: who loses three in a hundred goes on.
const PAID_BY: u8 = 8;

/// More than this unpaid, 25 mm or half of the usual margin, is an alarm.
const DEBT: u8 = 48;

/// A time in shorter form, or the longest that there is.
#[cfg_attr(target_arch = "avr", inline(never))]
const fn shortened(time: u16) -> Short {
    if time < 1 << 10 { (time >> 2) as Short } else { Short::MAX }
}

/// Whether progress that takes `time` is more than unsteady beside one that takes `steady`.
const fn is_gap(time: Short, steady: Short, turn: Short) -> bool {
    time as u16 > (steady + steady / 4) as u16 + grace(turn)
}

/// Whether no machine can have braked so hard that progress takes `time` behind one that took `steady`.
const fn is_silence(time: Short, steady: Short, turn: Short) -> bool {
    time as u16 > (2 * steady + steady / 2) as u16 + 2 * grace(turn)
}

/// Watches the encoder.
#[derive(Clone, Debug)]
pub struct EncoderMonitor {
    /// Where the machine last made progress, and when: lower halves are enough.
    anchor: u16,
    progress_at: Coarse,
    /// How long that progress took, and the one before it.
    took: Short,
    took_before: Short,
    /// Whether it was made backwards.
    backwards: bool,
    /// Whether the machine stands since, whether it became quiet, and whether it fell silent too suddenly.
    stands: bool,
    quiet: bool,
    silent: bool,
    /// The last reading.
    last: u16,
    read_at: Coarse,
    /// Times that the wheel seemed to turn round since the period began, without progress.
    turns: u8,
    /// Times that the beam broke since the machine stands.
    breaks: u8,
    period_since: Coarse,
    /// What may be lost and has not been paid for.
    debt: u8,
    /// Silences, and progress since the last one, modulo 137 m.
    silences: u8,
    since_silence: u16,
}

impl EncoderMonitor {
    /// A monitor that nobody has read.
    pub const NONE: Self = Self {
        anchor: 0,
        progress_at: Coarse::ZERO,
        took: 0,
        took_before: 0,
        backwards: false,
        stands: false,
        quiet: false,
        silent: false,
        last: 0,
        read_at: Coarse::ZERO,
        turns: 0,
        breaks: 0,
        period_since: Coarse::ZERO,
        debt: 0,
        silences: 0,
        since_silence: 0,
    };

    /// The machine wakes up, and stands at `position`.
    pub const fn init(&mut self, now: Instant, position: Position) {
        let (now, place) = (now.coarse(), position.count() as u16);
        (self.anchor, self.last) = (place, place);
        (self.progress_at, self.read_at, self.period_since) = (now, now, now);
        (self.took, self.took_before, self.stands) = (Short::MAX, Short::MAX, true);
    }

    /// Takes a reading, with the ticks that came by jumps and are not believed; returns the fault that it shows.
    ///
    /// `progress` is a distance of some two millimetres, so that it means the same for every encoder, and four ticks at least. That
    /// is a whole cycle of both channels, over which it does not matter that an encoder spaces its edges unevenly, and more
    /// than a wheel makes that trembles on an edge, or one dead channel.
    #[cfg_attr(target_arch = "avr", inline(never))]
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn read(&mut self, now: Instant, position: Position, doubted: u8, progress: u8) -> Option<Alarm> {
        let now = now.coarse();
        let place = position.count() as u16;
        if now.since(self.period_since) >= PERIOD {
            self.period_since = now;
            self.turns = 0;
            if self.stands {
                self.debt = 0;
            }
        }
        let step = place.wrapping_sub(self.last).cast_signed();
        let turn = shortened(now.since(self.read_at));
        (self.last, self.read_at) = (place, now);
        let moved = place.wrapping_sub(self.anchor).cast_signed();
        let time = now.since(self.progress_at);
        let short = shortened(time);
        let mut lost = doubted;
        let mut alarm = Alarm::EncoderJumps;
        if moved.unsigned_abs() >= progress.into() {
            let (before, gap) = (self.took_before, self.took);
            // Where the machine stood, the clock may have run round; else it may have come there as early as the turn began.
            self.took = if self.stands { Short::MAX } else { short - turn };
            // Where it stood without having fallen silent, it has stopped, and there was no gap.
            self.took_before = if self.stands && !self.silent { Short::MAX } else { gap };
            (self.anchor, self.progress_at) = (place, now);
            self.backwards = moved < 0;
            (self.stands, self.quiet, self.silent) = (false, false, false);
            (self.turns, self.breaks) = (0, 0);
            self.since_silence = self.since_silence.wrapping_add(1);
            if (self.since_silence as u8).is_multiple_of(PAID_BY) {
                self.debt -= u8::from(self.debt > 0);
            }
            // As fast again behind the gap as before it, the machine has not been slow in between.
            let steady = before.max(self.took);
            if steady <= STEADY && is_gap(gap, steady, turn) {
                alarm = Alarm::EncoderSilent;
                if is_silence(gap, steady, turn) {
                    // The ground is forgotten already.
                    self.silences = if self.since_silence > SILENCES_WITHIN { 1 } else { self.silences + 1 };
                    self.since_silence = 0;
                    if self.silences >= SILENCES {
                        lost += DEBT + 1;
                    }
                } else {
                    lost += PROGRESS;
                }
            }
        } else {
            let steady = self.took <= STEADY && 2 * u16::from(self.took) <= u16::from(self.took_before) + BRAKES as u16;
            self.quiet = steady && short >= QUIET;
            self.silent |= steady && is_silence(short, self.took, turn);
            self.stands |= time >= STANDS;
            if step != 0 && (step < 0) != self.backwards {
                self.backwards = !self.backwards;
                self.turns = self.turns.wrapping_add(1);
                // No rolling wheel turns back for a tick or two and rolls on: pulses of a channel do not come.
                if !self.silent && !self.stands && self.took <= SLOW {
                    alarm = Alarm::EncoderChannelDead;
                    lost += TURNED_ROUND;
                    if steady {
                        (self.anchor, self.progress_at) = (place, now);
                    } else {
                        self.silent = self.turns >= FALTERS;
                    }
                }
            }
            if self.turns > DEAD_CHANNEL_TURNS {
                return Some(Alarm::EncoderChannelDead);
            }
        }
        self.debt += lost;
        if self.debt <= DEBT {
            return None;
        }
        (self.debt, self.silences) = (0, 0);
        Some(alarm)
    }

    /// The beam broke; returns the fault that this shows.
    pub fn beam_broke(&mut self) -> Option<Alarm> {
        if !self.stands {
            return None;
        }
        // Behind the alarm nobody counts on before the machine has rolled.
        self.breaks += u8::from(self.breaks < BREAKS);
        (self.breaks >= BREAKS).then_some(Alarm::EncoderSilent)
    }

    /// Whether the machine stands, or rolls slower than 0.05 km/h.
    pub const fn stands(&self) -> bool {
        self.stands
    }

    /// Whether the encoder has just become quiet, and nobody knows yet whether the machine brakes or the encoder has died.
    pub const fn is_quiet(&self) -> bool {
        self.quiet
    }

    /// Whether the encoder fell silent from one moment to the next: nobody knows how far the machine has rolled since.
    pub const fn is_silent(&self) -> bool {
        self.silent
    }

    /// Whether the machine may roll although the encoder says that it stands: it fell silent, or the beam has been broken since.
    pub const fn is_doubtful(&self) -> bool {
        self.silent || self.breaks > 0
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
    pub const NONE: Self = Self { edges: 0, since: Coarse::ZERO };

    /// The machine wakes up.
    pub const fn init(&mut self, now: Instant) {
        self.since = now.coarse();
    }

    /// The beam's level changed; returns the fault that this shows.
    pub fn edge(&mut self, now: Instant) -> Option<Alarm> {
        if now.coarse().since(self.since) >= FLICKER_PERIOD {
            (self.edges, self.since) = (0, now.coarse());
        }
        self.edges += u8::from(self.edges <= FLICKER_EDGES);
        (self.edges > FLICKER_EDGES).then_some(Alarm::BeamFlickers)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::Interval;

    #[test]
    fn a_turn_at_either_end_of_a_time_is_allowed_for() {
        assert_eq!([0, 3, 4, 5, 200].map(grace), [4, 4, 5, 6, 201]);
    }

    #[test]
    fn a_time_too_long_for_the_short_form_is_the_longest() {
        assert_eq!([0, 4, 1020, 1023, 1024, u16::MAX].map(shortened), [0, 1, 255, 255, 255, 255]);
    }

    #[test]
    fn a_gap_is_a_quarter_longer_than_steady_progress_and_a_silence_one_and_a_half_times_longer() {
        for (steady, turn, gap, silence) in [(40, 0, 40 + 10 + 4, 80 + 20 + 8), (59, 9, 59 + 14 + 10, 118 + 29 + 20)] {
            assert_eq!([gap, gap + 1].map(|time| is_gap(time, steady, turn)), [false, true]);
            assert_eq!([silence, silence + 1].map(|time| is_silence(time, steady, turn)), [false, true]);
        }
    }

    /// Whether an edge to and one fro, so many milliseconds apart, are a dead channel within so many edges.
    fn is_dead_channel(edge_ms: u32, edges: u32) -> bool {
        let mut monitor = awake();
        (1..=edge_ms * edges).any(|ms| {
            let position = Position::new((ms / edge_ms % 2) as i32);
            monitor.read(at(ms), position, 0, 4) == Some(Alarm::EncoderChannelDead)
        })
    }

    #[test]
    fn edges_that_lead_nowhere_are_a_dead_channel_where_they_come_faster_than_any_tremble() {
        assert!(!is_dead_channel(5, 81));
        assert!(is_dead_channel(5, 82));
        assert!(!is_dead_channel(7, 1000), "71 in half a second");
    }

    /// A monitor of a machine that stands.
    fn awake() -> EncoderMonitor {
        let mut monitor = EncoderMonitor::NONE;
        monitor.init(at(0), Position::new(0));
        monitor
    }

    fn at(ms: u32) -> Instant {
        Instant::new(Interval::from_ms(ms).steps())
    }

    /// The first alarm within a second of an encoder that shows a position at each millisecond, and when it comes.
    fn first_alarm(position: impl Fn(u32) -> u32) -> Option<(u32, Alarm)> {
        let mut monitor = awake();
        (1..1000).find_map(|ms| Some((ms, monitor.read(at(ms), Position::new(position(ms) as i32), 0, 4)?)))
    }

    #[test]
    fn a_rolling_wheel_is_quiet_when_no_progress_came_for_a_hundredth_of_a_second_until_it_comes() {
        let mut monitor = awake();
        for ms in 0..100 {
            let position = if ms < 60 { ms.min(40) } else { ms - 20 };
            monitor.read(at(ms), Position::new(position as i32), 0, 4);
            assert_eq!(monitor.is_quiet(), (50..64).contains(&ms), "{ms} ms");
        }
    }

    #[test]
    fn ticks_that_may_be_lost_in_gaps_between_steady_ones_add_up_to_an_alarm() {
        // 4 ticks in 4 ms three times over, and then in 7 ms: a progress may be lost each time, and half a tick is paid for. Debt
        // is beyond 48 ticks at the 14th.
        let gaps = |ms: u32| 16 * (ms / 19) + (ms % 19).min(12) + (ms % 19).saturating_sub(15);
        assert_eq!(first_alarm(gaps), Some((14 * 19 + 4, Alarm::EncoderSilent)));
        assert_eq!(first_alarm(|ms| ms), None);
    }

    #[test]
    fn a_rolling_wheel_that_seems_to_turn_round_for_a_tick_time_and_again_has_a_dead_channel() {
        // A tick back every 12 ms.
        let alarm = first_alarm(|ms| 10 * (ms / 12) + if ms % 12 == 11 { 9 } else { ms % 12 });
        assert!(matches!(alarm, Some((144..180, Alarm::EncoderChannelDead))), "{alarm:?}");
    }

    #[test]
    fn a_beam_flickers_that_changes_more_than_forty_times_in_a_tenth_of_a_second() {
        let first_alarm = |every_ms: u32| {
            let mut monitor = BeamMonitor::NONE;
            (1..200).find(|edge| monitor.edge(at(every_ms * (edge - 1))) == Some(Alarm::BeamFlickers))
        };
        assert_eq!(first_alarm(2), Some(41));
        assert_eq!(first_alarm(3), None, "34 in a tenth of a second");
    }
}
