//! Monitors of encoder and beam: they find a failed sensor.
//!
//! # How it works
//!
//! A failed sensor shows in how the readings fit together:
//!
//! | the monitor sees | fault | reason |
//! | --- | --- | --- |
//! | encoder edges without progress | only one channel works | a rolling machine makes progress |
//! | plants that pass a standing machine | the encoder is dead | wind moves leaves, but no plant passes |
//! | an encoder that falls silent without slowing down | the encoder has failed | a machine has mass |
//! | a gap, and the same speed after it as before | ticks are lost | the machine was not slow in between |
//! | a beam that flickers | dust | a canopy has a limited number of leaves |
//!
//! The monitors count. The [`weeder`](crate::weeder) decides what a fault means for the tool. Small losses add up over
//! a distance. [`EncoderMonitor`] compares them with the position error that the tool may have.
//!
//! # Limits
//!
//! - The monitor finds silences only from a speed on: 0.5 km/h with ticks of 0.5 mm (`STEADY`). Below that, a silence
//!   looks like a stop.
//! - A stop harder than 3.3 m/s2 at the wheel may look like a silence (`BRAKES`). With the least favourable of the
//!   finer encoders, the limit is 2.6 m/s2. The weeder then forgets the ground up to the beam, and raises no alarm.
//! - Very even losses stay unnoticed: a wheel that slips, or an encoder that always misses about five ticks or fewer at
//!   a time. The same holds for an encoder so fine that the loop does not see its single ticks (docs/faults.md).
//! - The constants assume that an engine vibrates with 50 Hz, and that a person brakes with at most 3 m/s2. They assume
//!   that sun breaks the beam for 30 ms at most. No real machine has shown any of this.

use crate::{
    alarm::Alarm,
    units::{Coarse, Position},
};

/// The time over which reversals are counted.
const PERIOD: u16 = Coarse::steps_in_ms(500);

/// Reversals in a period, without progress, that no vibration causes. With one working channel each edge looks like a reversal:
/// this many from 0.6 km/h on. An engine's vibration of 50 Hz causes only 50.
const DEAD_CHANNEL_REVERSALS: u8 = 80;

/// Time without progress after which the machine stands: slower than 0.05 km/h.
const STANDS: u16 = Coarse::steps_in_ms(150);

/// Reversals without progress, while rolling slowly, from which on the distance is unknown. A machine that stops rolls back a
/// little and forward again: two reversals.
const FALTERING_REVERSALS: u8 = 3;

/// Beam breaks while the machine stands. The wind moves leaves, but plants do not pass.
const BREAKS: u8 = 3;

/// The time of a progress in steps of 256 us. All times that separate slow rolling from standing fit a byte.
type Short = u8;

/// Silence after which the speed meter assumes a slower machine and the leads shrink. From here until the silence is explained, a
/// tool that is out stays out.
const QUIET: Short = (crate::measure::speed::SPACING >> 2) as Short;

/// Longest time of a progress in steady rolling, 15.4 ms. With ticks of 0.5 mm this is 0.5 km/h, and with finer ticks
/// at most 0.8 km/h. A coarser encoder needs four ticks in this time.
///
/// The monitor cannot find the silences of a slower machine. At less speed the machine stops within a progress, so a
/// silence looks like a stop.
const STEADY: Short = 59;

/// Tells steady rolling from braking, 15.6 ms. A braking machine takes longer for each progress than for the one
/// before. So rolling is steady only if twice the last progress is at most this much above the one before.
///
/// A machine that brakes with 3.3 m/s2 must not look silent: 3 on the ground, and a tenth for the wheel's slip. With
/// ticks of 0.52 mm a progress is 2.09 mm. The last 2.09 mm before the stop then take 35.6 ms, in seconds
/// `sqrt(2 * 2.09 / 3300)`.
///
/// The machine stops `x` progresses after the last complete one. That one took `sqrt(x + 1) - sqrt(x)` times 35.6 ms.
///
/// | `x` | the encoder | so |
/// | --- | --- | --- |
/// | below 1 | twice the last progress is 18.2 ms or more above the one before | rolling is not steady |
/// | from 1 on | another progress follows, within 2.42 times the last one | `is_silence` is false: it asks for 2.5 times |
///
/// The second row holds because `sqrt(x) - sqrt(x - 1)` is at most 2.42 times `sqrt(x + 1) - sqrt(x)`.
const BRAKES: Short = 61;

/// A wheel that takes longer for four ticks, 32.8 ms, may tremble while it rolls. The coarsest encoder
/// ([`TICKS_PER_M_LEAST`](crate::settings::TICKS_PER_M_LEAST)) has ticks of 1.1 mm. Its wheel then rolls slower than
/// 0.5 km/h.
const SLOW: Short = 128;

/// Error of a time from the turns of the loop at its ends: 1 ms, or a turn and a step if that is longer.
const TURN: Short = 4;

const fn grace(turn: Short) -> u16 {
    if turn < TURN { TURN as u16 } else { turn as u16 + 1 }
}

/// Silences in steady rolling that raise an alarm, if each follows within `SILENCES_WITHIN` progresses (10 m) of the last. A sound
/// encoder has none; a stone that catches the wheel causes one. Each silence makes the ground from beam to tool unknown.
const SILENCES: u8 = 3;
const SILENCES_WITHIN: u16 = 5000;

/// Losses are counted in quarters of a progress: ticks, if the encoder is no finer than 0.4 mm.
const PROGRESS: u8 = 4;

/// Loss for half a missing pulse of one channel: the other channel then counts a tick back and forward again, which looks like two
/// reversals.
const REVERSAL_LOSS: u8 = 2;

/// One loss is cancelled by this many progresses (32 quarters), so losing 3 % is tolerated.
const CANCELLED_BY: u8 = 8;

/// Losses above this raise an alarm: 25 mm, half of the usual margin.
const MOST_LOST: u8 = 48;

/// A time as a [`Short`], or the largest one.
#[cfg_attr(target_arch = "avr", inline(never))]
const fn shortened(time: u16) -> Short {
    if time < 1 << 10 { (time >> 2) as Short } else { Short::MAX }
}

/// Whether a progress of `time` next to one of `steady` is more than uneven rolling.
const fn is_gap(time: Short, steady: Short, turn: Short) -> bool {
    time as u16 > (steady + steady / 4) as u16 + grace(turn)
}

/// Whether braking cannot explain a progress of `time` after one of `steady`.
const fn is_silence(time: Short, steady: Short, turn: Short) -> bool {
    time as u16 > (2 * steady + steady / 2) as u16 + 2 * grace(turn)
}

/// The encoder's monitor.
#[derive(Clone, Debug)]
pub struct EncoderMonitor {
    /// Position and time of the last progress; the lower halves are enough.
    anchor: u16,
    progress_at: Coarse,
    /// Duration of the last progress and of the one before.
    took: Short,
    took_before: Short,
    /// Whether the last progress was backwards.
    backwards: bool,
    /// Since the last progress: whether the machine stands, whether the encoder is quiet, and whether it fell silent too suddenly.
    stands: bool,
    quiet: bool,
    silent: bool,
    /// The last reading.
    last: u16,
    read_at: Coarse,
    /// Reversals in this period without progress.
    reversals: u8,
    /// Beam breaks since the machine stands.
    breaks: u8,
    period_since: Coarse,
    /// Losses not yet cancelled.
    losses: u8,
    /// Silences, and progresses since the last one, modulo 137 m.
    silences: u8,
    since_silence: u16,
}

impl EncoderMonitor {
    /// A monitor before its first reading.
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
        reversals: 0,
        breaks: 0,
        period_since: Coarse::ZERO,
        losses: 0,
        silences: 0,
        since_silence: 0,
    };

    /// Starts with the machine standing at `position`.
    pub const fn init(&mut self, now: Coarse, position: Position) {
        let count = position.count() as u16;
        (self.anchor, self.last) = (count, count);
        (self.progress_at, self.read_at, self.period_since) = (now, now, now);
        (self.took, self.took_before, self.stands) = (Short::MAX, Short::MAX, true);
    }

    /// Takes a reading. `doubted` is the number of ticks from jumps that are probably noise. Returns a fault.
    ///
    /// `progress` is a distance of about two millimetres, and at least four ticks. So it means the same for every encoder. Four
    /// ticks are one cycle of both channels, so uneven edge spacing does not matter. A trembling wheel, or one dead channel, makes
    /// fewer.
    #[cfg_attr(target_arch = "avr", inline(never))]
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn read(&mut self, now: Coarse, position: Position, doubted: u8, progress: u8) -> Option<Alarm> {
        let count = position.count() as u16;
        if now.since(self.period_since) >= PERIOD {
            self.period_since = now;
            self.reversals = 0;
            if self.stands {
                self.losses = 0;
            }
        }
        let step = count.wrapping_sub(self.last).cast_signed();
        let turn = shortened(now.since(self.read_at));
        (self.last, self.read_at) = (count, now);
        let moved = count.wrapping_sub(self.anchor).cast_signed();
        let time = now.since(self.progress_at);
        let short = shortened(time);
        let mut lost = doubted;
        let mut alarm = Alarm::EncoderJumps;
        if moved.unsigned_abs() >= progress.into() {
            let (before, gap) = (self.took_before, self.took);
            // The clock may have wrapped while the machine stood. Otherwise the progress may have ended as early as the turn began.
            self.took = if self.stands { Short::MAX } else { short - turn };
            // A machine that stood without a silence has stopped: that was no gap.
            self.took_before = if self.stands && !self.silent { Short::MAX } else { gap };
            (self.anchor, self.progress_at) = (count, now);
            self.backwards = moved < 0;
            (self.stands, self.quiet, self.silent) = (false, false, false);
            (self.reversals, self.breaks) = (0, 0);
            self.since_silence = self.since_silence.wrapping_add(1);
            if (self.since_silence as u8).is_multiple_of(CANCELLED_BY) {
                self.losses -= u8::from(self.losses > 0);
            }
            // As fast after the gap as before: the machine was not slow in between.
            let steady = before.max(self.took);
            if steady <= STEADY && is_gap(gap, steady, turn) {
                alarm = Alarm::EncoderSilent;
                if is_silence(gap, steady, turn) {
                    // `is_silent` has forgotten this ground already.
                    self.silences = if self.since_silence > SILENCES_WITHIN { 1 } else { self.silences + 1 };
                    self.since_silence = 0;
                    if self.silences >= SILENCES {
                        lost += MOST_LOST + 1;
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
                self.reversals = self.reversals.wrapping_add(1);
                // A rolling wheel does not turn back for a tick or two: one channel's pulses are missing.
                if !self.silent && !self.stands && self.took <= SLOW {
                    alarm = Alarm::EncoderChannelDead;
                    lost += REVERSAL_LOSS;
                    if steady {
                        (self.anchor, self.progress_at) = (count, now);
                    } else {
                        self.silent = self.reversals >= FALTERING_REVERSALS;
                    }
                }
            }
            if self.reversals > DEAD_CHANNEL_REVERSALS {
                return Some(Alarm::EncoderChannelDead);
            }
        }
        self.losses += lost;
        if self.losses <= MOST_LOST {
            return None;
        }
        (self.losses, self.silences) = (0, 0);
        Some(alarm)
    }

    /// Takes a break of the beam. Returns whether it has broken too often for a machine that stands.
    pub fn beam_broke(&mut self) -> bool {
        if !self.stands {
            return false;
        }
        // Saturates: after the alarm, counting ends until the machine rolls.
        self.breaks += u8::from(self.breaks < BREAKS);
        self.breaks >= BREAKS
    }

    /// Whether the machine stands, or rolls slower than 0.05 km/h.
    pub const fn stands(&self) -> bool {
        self.stands
    }

    /// Whether the encoder has just become quiet. It is not yet known whether the machine brakes or the encoder has failed.
    pub const fn is_quiet(&self) -> bool {
        self.quiet
    }

    /// Whether the encoder fell silent at speed. The distance since then is unknown.
    pub const fn is_silent(&self) -> bool {
        self.silent
    }

    /// Whether the machine may be rolling although the encoder stands: it fell silent, or the beam has broken since.
    pub const fn is_doubtful(&self) -> bool {
        self.silent || self.breaks > 0
    }
}

/// The time over which the beam's edges are counted.
const FLICKER_PERIOD: u16 = Coarse::steps_in_ms(100);

/// More edges in that time than any canopy makes: at 10 km/h a clear stretch every 14 mm.
const FLICKER_EDGES: u8 = 40;

/// The longest break that sun on the receiver or a loose wire causes, 30 ms and a turn. A plant is longer, except a stalk of 20 mm
/// or less at 2.5 km/h.
const SHORT_BREAK: u16 = Coarse::steps_in_ms(31);

/// No stalk breaks the beam for so short a time: at 2.5 km/h, 8 ms are 6 mm. Such a break counts as `TINY` short ones.
const TINY_BREAK: u16 = Coarse::steps_in_ms(8);
const TINY: u8 = 4;

/// Consecutive short breaks that are a fault of the beam: more than the stalks of the alarm `crop_unknown`, or as many with a tiny one.
const SHORT_BREAKS: u8 = 8;

/// The beam's monitor. It takes two beams as one.
#[derive(Clone, Debug)]
pub struct BeamMonitor {
    edges: u8,
    since: Coarse,
    /// Consecutive short breaks.
    short: u8,
    /// The time of the last edge that broke the beam, if it is `broken`.
    broke_at: Coarse,
    broken: bool,
}

impl BeamMonitor {
    /// A monitor that has seen no edge.
    pub const NONE: Self = Self { edges: 0, since: Coarse::ZERO, short: 0, broke_at: Coarse::ZERO, broken: false };

    /// Starts counting.
    pub const fn init(&mut self, now: Coarse) {
        self.since = now;
    }

    /// Takes a change of the beam's level. Returns whether it has changed too often.
    pub fn edge(&mut self, now: Coarse, broken: bool) -> bool {
        if now.since(self.since) >= FLICKER_PERIOD {
            (self.edges, self.since) = (0, now);
        }
        self.edges += u8::from(self.edges <= FLICKER_EDGES);
        if broken != self.broken {
            self.broken = broken;
            let lasted = now.since(self.broke_at);
            if broken {
                self.broke_at = now;
            } else if lasted > SHORT_BREAK {
                self.short = 0;
            } else {
                self.short = self.short.saturating_add(if lasted <= TINY_BREAK { TINY } else { 1 });
            }
        }
        self.edges > FLICKER_EDGES
    }

    /// Consecutive short breaks until now; a tiny one counts as `TINY`.
    pub const fn short_breaks(&self) -> u8 {
        self.short
    }

    /// The alarm for detections that fit no crop. They are a fault of the beam if its breaks were short.
    pub fn explain(&self, alarm: Alarm, now: Coarse) -> Alarm {
        let is_of_breaks = match alarm {
            // An object that stays in the beam is no short break.
            Alarm::BeamBlocked => now.since(self.broke_at) <= SHORT_BREAK,
            Alarm::BeamBlind | Alarm::SecondBeamBlind | Alarm::ScheduleFull | Alarm::CropUnknown => true,
            _ => false,
        };
        if is_of_breaks && self.short >= SHORT_BREAKS { Alarm::BeamFlickers } else { alarm }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eight_short_breaks_in_a_row_mean_a_flickering_beam() {
        let explained = |breaks_ms: &[u32]| {
            let (mut monitor, mut ms) = (BeamMonitor::NONE, 1000);
            for length_ms in breaks_ms {
                monitor.edge(Coarse::at_ms(ms), true);
                monitor.edge(Coarse::at_ms(ms + length_ms), false);
                ms += 500;
            }
            monitor.explain(Alarm::CropUnknown, Coarse::at_ms(ms))
        };
        for (breaks_ms, is_fault) in [
            (&[30; 8][..], true),
            (&[30; 7], false),
            (&[32; 20], false),
            (&[8, 8], true),
            (&[9; 7], false),
            (&[30, 30, 30, 30, 8], true),
            (&[30, 30, 30, 8], false),
            (&[8, 8, 40], false),
        ] {
            let alarm = if is_fault { Alarm::BeamFlickers } else { Alarm::CropUnknown };
            assert_eq!(explained(breaks_ms), alarm, "{breaks_ms:?}");
        }
    }

    #[test]
    fn a_time_may_be_off_by_a_turn_or_a_millisecond() {
        assert_eq!([0, 3, 4, 5, 200].map(grace), [4, 4, 5, 6, 201]);
    }

    #[test]
    fn a_time_too_long_for_the_short_form_is_the_longest() {
        assert_eq!([0, 4, 1020, 1023, 1024, u16::MAX].map(shortened), [0, 1, 255, 255, 255, 255]);
    }

    #[test]
    fn gap_and_silence_limits_scale_with_the_steady_progress() {
        for (steady, turn, gap, silence) in [(40, 0, 40 + 10 + 4, 80 + 20 + 8), (59, 9, 59 + 14 + 10, 118 + 29 + 20)] {
            assert_eq!([gap, gap + 1].map(|time| is_gap(time, steady, turn)), [false, true]);
            assert_eq!([silence, silence + 1].map(|time| is_silence(time, steady, turn)), [false, true]);
        }
    }

    /// A monitor of a standing machine.
    fn standing() -> EncoderMonitor {
        let mut monitor = EncoderMonitor::NONE;
        monitor.init(Coarse::at_ms(0), Position::new(0));
        monitor
    }

    /// The first alarm within seven seconds, and its time in ms. `position` gives the encoder's position at each millisecond.
    fn first_alarm(position: impl Fn(u32) -> u32) -> Option<(u32, Alarm)> {
        let mut monitor = standing();
        (1..7000).find_map(|ms| Some((ms, monitor.read(Coarse::at_ms(ms), Position::new(position(ms) as i32), 0, 4)?)))
    }

    #[test]
    fn edges_without_progress_faster_than_vibration_are_a_dead_channel() {
        assert_eq!(first_alarm(|ms| ms / 5 % 2), Some((82 * 5, Alarm::EncoderChannelDead)));
        assert_eq!(first_alarm(|ms| ms / 7 % 2), None, "71 in half a second");
    }

    #[test]
    fn a_rolling_wheel_is_quiet_after_10_ms_without_progress() {
        let mut monitor = standing();
        for ms in 0..100 {
            let position = if ms < 60 { ms.min(40) } else { ms - 20 };
            monitor.read(Coarse::at_ms(ms), Position::new(position as i32), 0, 4);
            assert_eq!(monitor.is_quiet(), (50..64).contains(&ms), "{ms} ms");
        }
    }

    #[test]
    fn possible_losses_in_gaps_add_up_to_an_alarm() {
        // Three times 4 ticks in 4 ms, then 4 ticks in 7 ms: each gap may have lost a progress, and half a tick is cancelled. The
        // sum exceeds 48 at the 14th gap.
        let gaps = |ms: u32| 16 * (ms / 19) + (ms % 19).min(12) + (ms % 19).saturating_sub(15);
        assert_eq!(first_alarm(gaps), Some((14 * 19 + 4, Alarm::EncoderSilent)));
        assert_eq!(first_alarm(|ms| ms), None);
    }

    #[test]
    fn repeated_reversals_of_one_tick_while_rolling_are_a_dead_channel() {
        // A tick back every 12 ms.
        let alarm = first_alarm(|ms| 10 * (ms / 12) + if ms % 12 == 11 { 9 } else { ms % 12 });
        assert!(matches!(alarm, Some((144..180, Alarm::EncoderChannelDead))), "{alarm:?}");
    }

    #[test]
    fn more_than_40_edges_in_a_tenth_of_a_second_are_flicker() {
        let first_alarm = |every_ms: u32| {
            let mut monitor = BeamMonitor::NONE;
            (1..200).find(|edge| monitor.edge(Coarse::at_ms(every_ms * (edge - 1)), edge % 2 == 1))
        };
        assert_eq!(first_alarm(2), Some(41));
        assert_eq!(first_alarm(3), None, "34 in a tenth of a second");
    }
}
