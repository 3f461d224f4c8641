//! Each fault that the decisions know of: what shows it, what does not, and that the tool is out of the row then.

mod common;

use common::{ByWidth, Machine, machine, readings, woken_up};
use control::{
    alarm::{Alarm, Warning},
    measure::{
        readings::{Edge, Readings},
        reset::Cause,
    },
    memory::Volatile,
    operate::{event::Event, refusal::Refusal, saved::SavedSettings, state::State},
    settings::{Setting, Settings},
    units::{Instant, Interval, Position, Ticks},
    weeder::{Controller, Orders, Reason},
};

/// Ticks a metre of the default wheel.
const TICKS_A_METRE: f64 = 1909.86;

/// A turn of the main loop.
const TURN_US: u64 = 500;

/// A machine with its clock and its place.
struct Drive {
    machine: Machine,
    time_us: u64,
    place: f64,
    /// What every reading has besides time and place.
    readings: Readings,
    /// What came from the beam since the last turn.
    edges: Vec<Edge>,
}

impl Drive {
    /// At work, with the tool in the row, at 1.8 km/h.
    fn at_work() -> Self {
        let mut drive =
            Self { machine: machine(), time_us: 0, place: 0.0, readings: readings(0, 0), edges: Vec::new() };
        drive.machine.start(false).unwrap();
        drive.machine.tell_events(true);
        drive.roll(0.5, 1.0);
        assert!(drive.tool_is_in());
        drive.events();
        drive
    }

    /// In HOLD, at rest.
    fn in_hold() -> Self {
        Self { machine: machine(), time_us: 0, place: 0.0, readings: readings(0, 0), edges: Vec::new() }
    }

    fn tool_is_in(&self) -> bool {
        !self.machine.tool_out()
    }

    /// A turn of the loop, with the encoder at a count.
    fn turn_at(&mut self, count: i32) -> Orders {
        self.time_us += TURN_US;
        let now = readings(self.time_us, count);
        let readings = Readings { now: now.now, position: now.position, ..self.readings };
        self.machine.turn(readings, self.edges.drain(..))
    }

    /// Rolls so many metres at a speed, or stands for so many seconds at none.
    fn roll(&mut self, speed_m_s: f64, metres_or_seconds: f64) {
        let seconds = if speed_m_s == 0.0 { metres_or_seconds } else { metres_or_seconds / speed_m_s.abs() };
        for _ in 0..(seconds * 1e6) as u64 / TURN_US {
            self.place += speed_m_s * TICKS_A_METRE * TURN_US as f64 / 1e6;
            self.turn_at(self.place.floor() as i32);
        }
    }

    /// Comes to rest as a machine does, with 3 m/s2.
    fn brake(&mut self, speed_m_s: f64) {
        self.brake_by(speed_m_s, 3.0);
    }

    fn brake_by(&mut self, speed_m_s: f64, braking_m_s2: f64) {
        let mut speed = speed_m_s;
        while speed > 0.0 {
            speed = (speed - braking_m_s2 * TURN_US as f64 / 1e6).max(0.0);
            self.place += speed * TICKS_A_METRE * TURN_US as f64 / 1e6;
            self.turn_at(self.place.floor() as i32);
        }
    }

    /// Gains a speed from rest.
    fn speed_up(&mut self, speed_m_s: f64, acceleration_m_s2: f64) {
        let mut speed = 0.0;
        while speed < speed_m_s {
            speed += acceleration_m_s2 * TURN_US as f64 / 1e6;
            self.place += speed * TICKS_A_METRE * TURN_US as f64 / 1e6;
            self.turn_at(self.place.floor() as i32);
        }
    }

    fn beam(&mut self, broken: bool) {
        self.edges.push(Edge::Seen {
            position: Position::new(self.place.floor() as i32),
            broken,
            second_broken: false,
        });
    }

    /// A plant of 150 mm passes the beam.
    fn pass_a_plant(&mut self, speed_m_s: f64) {
        self.pass(speed_m_s, 0.15);
    }

    /// Something as wide as this passes the beam, in metres.
    fn pass(&mut self, speed_m_s: f64, width_m: f64) {
        self.beam(true);
        self.roll(speed_m_s, width_m);
        self.beam(false);
    }

    /// Stalks of 20 mm pass the beam, which this machine takes for weeds, until an alarm or so many of them; how many did.
    fn pass_stalks(&mut self, most: u32) -> u32 {
        (1..=most)
            .find(|_| {
                self.pass(0.5, 0.02);
                self.roll(0.5, 0.2);
                self.alarm().is_some()
            })
            .unwrap_or(most)
    }

    fn alarm(&self) -> Option<Alarm> {
        match self.machine.state() {
            State::Alarm(alarm) => {
                assert!(self.machine.tool_out(), "an alarm with the tool in the row");
                Some(alarm)
            }
            _ => None,
        }
    }

    fn events(&mut self) -> Vec<Event> {
        std::iter::from_fn(|| self.machine.next_event()).collect()
    }
}

/// How long the encoder may be silent at a speed until that is sudden, in seconds: the time of ten ticks, and three turns.
fn sudden_s(speed_m_s: f64) -> f64 {
    10.0 / (speed_m_s * TICKS_A_METRE) + 0.004
}

#[test]
fn a_row_of_stalks_that_are_taken_for_weeds_is_an_alarm_at_the_fifth() {
    let mut drive = Drive::at_work();
    assert_eq!((drive.pass_stalks(20), drive.alarm()), (5, Some(Alarm::CropUnknown)));
    drive.machine.clear();
    drive.machine.start(false).unwrap();
    assert_eq!((drive.pass_stalks(20), drive.alarm()), (5, Some(Alarm::CropUnknown)), "it is counted anew");
}

#[test]
fn so_many_stalks_as_are_set_are_an_alarm_and_none_where_that_is_zero() {
    for (misfit_after, stalks) in [(1, 1), (2, 2), (100, 100), (0, 300)] {
        let mut drive = Drive::at_work();
        drive.machine.set(Setting::MisfitAfter, misfit_after).unwrap();
        assert_eq!(drive.pass_stalks(300), stalks);
        assert_eq!(drive.alarm().is_some(), misfit_after != 0);
    }
}

#[test]
fn weeds_with_a_plant_between_them_are_no_alarm_and_neither_are_those_in_hold() {
    let mut drive = Drive::at_work();
    for _ in 0..10 {
        assert_eq!((drive.pass_stalks(4), drive.alarm()), (4, None));
        drive.pass_a_plant(0.5);
        drive.roll(0.5, 0.2);
    }
    drive.machine.hold();
    assert_eq!((drive.pass_stalks(20), drive.alarm()), (20, None));
    drive.machine.start(false).unwrap();
    assert_eq!(drive.pass_stalks(20), 5, "what was seen in hold does not count");
}

#[test]
fn what_is_narrower_than_the_least_width_is_counted_as_dust_and_is_neither_a_plant_nor_a_misfit() {
    let mut drive = Drive::at_work();
    for (setting, value) in [(Setting::MinWidthMm, 25), (Setting::NoPlantM, 2)] {
        drive.machine.set(setting, value).unwrap();
    }
    assert_eq!((drive.pass_stalks(10), drive.alarm()), (10, None));
    assert_eq!((drive.machine.dust(), drive.machine.objects().len()), (10, 0));
    assert_eq!(drive.events(), [Event::Warning(Warning::NoPlants)], "nobody has seen a plant");
    drive.pass(0.5, 0.03);
    drive.roll(0.5, 0.1);
    assert_eq!((drive.machine.dust(), drive.machine.objects().len()), (10, 1));
    drive.pass(0.5, 0.0252);
    drive.roll(0.5, 0.1);
    assert_eq!((drive.machine.dust(), drive.machine.objects().len()), (10, 2), "as wide as the least is no dust");
}

#[test]
fn the_narrow_rest_of_an_object_is_no_dust() {
    let mut drive = Drive::in_hold();
    drive.machine.set(Setting::MinWidthMm, 100).unwrap();
    drive.edges.push(Edge::Lost { broken: true });
    drive.roll(0.5, 0.02);
    drive.beam(false);
    drive.roll(0.5, 0.1);
    assert_eq!((drive.machine.dust(), drive.machine.objects().len()), (0, 1));
}

#[test]
fn an_encoder_that_falls_silent_from_one_moment_to_the_next_has_the_tool_out_until_it_comes_to_ground_seen_since() {
    for speed_m_s in [0.14, 0.3, 0.7, 1.3] {
        let mut drive = Drive::at_work();
        drive.roll(speed_m_s, 0.5);
        drive.roll(0.0, 5.0 / (speed_m_s * TICKS_A_METRE));
        assert!(drive.tool_is_in(), "{speed_m_s} m/s");
        drive.roll(0.0, sudden_s(speed_m_s));
        assert!(!drive.tool_is_in(), "{speed_m_s} m/s");
        assert_eq!(drive.machine.reason(), Some(Reason::EncoderDoubtful));
        drive.roll(0.0, 10.0);
        assert!(!drive.tool_is_in(), "{speed_m_s} m/s");
        // Nobody knows how far the machine has rolled: the tool stays out over all that was seen, and a margin ahead of it.
        for _ in 0..42 {
            drive.roll(0.5, 0.01);
            assert!(!drive.tool_is_in(), "{speed_m_s} m/s");
        }
        drive.roll(0.5, 0.05);
        assert!(drive.tool_is_in(), "{speed_m_s} m/s");
        assert_eq!(drive.alarm(), None);
    }
}

#[test]
fn what_stood_in_the_beam_when_the_encoder_fell_silent_is_a_plant_however_narrow_its_rest() {
    let mut drive = Drive::at_work();
    drive.beam(true);
    drive.roll(0.7, 0.1);
    drive.roll(0.0, 0.1);
    drive.roll(0.7, 0.01);
    drive.beam(false);
    drive.events();
    drive.roll(0.7, 0.05);
    let told = drive.events().into_iter().find_map(|event| match event {
        Event::Object { vote, .. } => Some(vote.class),
        _ => None,
    });
    assert_eq!(told, Some(control::ground::class::Class::Unknown));
    assert_eq!(drive.machine.windows(), 1);
}

#[test]
fn the_third_silence_within_ten_metres_of_the_one_before_is_an_alarm() {
    for (between_m, alarm) in [(0.5, Some(Alarm::EncoderSilent)), (9.0, Some(Alarm::EncoderSilent)), (12.0, None)] {
        let mut drive = Drive::at_work();
        for silence in 1..=3 {
            drive.roll(0.7, between_m);
            drive.roll(0.0, 0.1);
            drive.roll(0.7, 0.05);
            assert_eq!(drive.alarm(), alarm.filter(|_| silence == 3), "silence {silence}, {between_m} m apart");
        }
    }
}

#[test]
fn stops_are_never_an_alarm_however_many_and_however_hard() {
    let mut drive = Drive::at_work();
    for stop in 0..30 {
        drive.roll(0.3 + f64::from(stop) / 30.0, 0.3);
        drive.brake_by(0.3 + f64::from(stop) / 30.0, 8.0);
        drive.roll(0.0, 0.5);
        drive.speed_up(0.7, 2.0);
    }
    assert_eq!(drive.alarm(), None);
}

#[test]
fn a_hard_stop_is_no_silence_whatever_the_encoder() {
    // From 16,000 ticks a metre to 40. Progress of an encoder finer than 0.4 mm may be a little shorter.
    let machines =
        [(2400, 400, 2.9), (10_000, 200, 2.4), (5000, 300, 2.9), (4000, 530, 2.3), (1000, 400, 2.9), (100, 800, 2.9)];
    for (ticks_per_rev, wheel_mm, braking_m_s2) in machines {
        let mut machine = machine();
        machine.set(Setting::WheelMm, wheel_mm).unwrap();
        machine.set(Setting::TicksPerRev, ticks_per_rev).unwrap();
        let a_metre = f64::from(ticks_per_rev) * 1000.0 / (std::f64::consts::PI * f64::from(wheel_mm));
        let (mut time_us, mut place_m) = (0, 0.0);
        let mut turn = |speed_m_s: f64, place_m: &mut f64| {
            time_us += 250;
            *place_m += speed_m_s * 0.000_25;
            machine.turn(readings(time_us, (*place_m * a_metre).floor() as i32), []);
            machine.encoder_is_silent()
        };
        let mut silent = 0;
        for stop in 0..400 {
            let mut speed_m_s = 0.2 + f64::from(stop) * 0.003;
            place_m += 0.000_013;
            // From standstill with 2 m/s2, some way, and to a stop.
            let from = (0..(speed_m_s / 0.0005) as u32).any(|step| turn(f64::from(step) * 0.0005, &mut place_m));
            let rolling = (0..1600).any(|_| turn(speed_m_s, &mut place_m));
            let mut braking = false;
            while speed_m_s > 0.0 {
                speed_m_s -= braking_m_s2 * 0.000_25;
                braking |= turn(speed_m_s.max(0.0), &mut place_m);
            }
            let standing = (0..1200).any(|_| turn(0.0, &mut place_m));
            silent += u32::from(from || rolling || braking || standing);
        }
        assert_eq!(silent, 0, "{ticks_per_rev} ticks a turn of {wheel_mm} mm");
    }
}

#[test]
fn a_fine_encoder_that_falls_silent_is_noticed_as_soon() {
    let mut machine = machine();
    machine.set(Setting::TicksPerM, 20_000).unwrap();
    for speed_m_s in [0.3, 0.7, 1.3] {
        let mut place = 0.0;
        let base = machine.readings().position.count();
        let base_us = u64::from(machine.readings().now.steps()) * 4;
        for turn in 1..4000 {
            place += speed_m_s * 20_000.0 * 0.000_25;
            machine.turn(readings(base_us + turn * 250, base + place as i32), []);
            assert!(!machine.encoder_is_silent() || turn < 200);
        }
        let now_us = u64::from(machine.readings().now.steps()) * 4;
        for turn in 1..200 {
            machine.turn(readings(now_us + turn * 250, base + place as i32), []);
        }
        assert!(machine.encoder_is_silent(), "{speed_m_s} m/s");
    }
}

#[test]
fn an_encoder_that_dies_at_any_place_never_brings_the_tool_back() {
    // All along a plant's approach, its window and what follows.
    for died_after in (0..900).step_by(7) {
        let mut drive = Drive::at_work();
        drive.roll(0.78, 0.5);
        drive.pass_a_plant(0.78);
        drive.roll(0.78, f64::from(died_after) / 1000.0);
        let was_out = !drive.tool_is_in();
        for millisecond in 0..300 {
            drive.roll(0.0, 0.001);
            assert!(!was_out || !drive.tool_is_in(), "back {millisecond} ms after it died, {died_after} mm on");
            assert!(millisecond < 31 || !drive.tool_is_in(), "in the row, {died_after} mm on");
        }
    }
}

#[test]
fn a_machine_that_brakes_keeps_its_tool_in_the_row() {
    for speed_m_s in [0.3, 0.7, 1.3] {
        let mut drive = Drive::at_work();
        drive.roll(speed_m_s, 0.5);
        drive.brake(speed_m_s);
        drive.roll(0.0, 5.0);
        assert!(drive.tool_is_in(), "{speed_m_s} m/s");
    }
}

#[test]
fn an_encoder_that_dies_at_rest_has_the_tool_out_at_the_first_plant_and_is_an_alarm_at_the_third() {
    let mut drive = Drive::at_work();
    drive.brake(0.5);
    drive.roll(0.0, 0.2);
    assert!(drive.tool_is_in(), "the machine may just stand");
    for plant in 1..=3 {
        drive.beam(true);
        drive.roll(0.0, 0.3);
        assert!(!drive.tool_is_in(), "plant {plant}");
        drive.beam(false);
        drive.roll(0.0, 0.7);
        assert_eq!(drive.alarm(), (plant == 3).then_some(Alarm::EncoderSilent), "plant {plant}");
    }
}

#[test]
fn leaves_that_move_while_the_machine_stands_keep_the_tool_out_until_it_rolls_on() {
    let mut drive = Drive::at_work();
    for _ in 0..5 {
        drive.brake(0.5);
        drive.roll(0.0, 0.2);
        drive.beam(true);
        drive.beam(false);
        drive.roll(0.0, 0.1);
        assert_eq!(drive.machine.reason(), Some(Reason::EncoderDoubtful));
        drive.roll(0.5, 0.5);
        assert!(drive.tool_is_in());
    }
    assert_eq!(drive.alarm(), None);
}

#[test]
fn plants_that_pass_a_rolling_machine_raise_no_doubt_in_the_encoder() {
    for speed_m_s in [0.02, 0.5, 1.3] {
        let mut drive = Drive::at_work();
        for _ in 0..6 {
            drive.roll(speed_m_s, 0.35);
            drive.pass_a_plant(speed_m_s);
            assert_ne!(drive.machine.reason(), Some(Reason::EncoderDoubtful), "{speed_m_s} m/s");
        }
        assert_eq!(drive.alarm(), None, "{speed_m_s} m/s");
    }
}

/// Has the encoder go to and fro between two counts, so many edges a second, for two seconds.
fn tremble(drive: &mut Drive, edges_a_second: u64) {
    let count = drive.place.floor() as i32;
    for turn in 0..2_000_000 / TURN_US {
        let edges = turn * TURN_US * edges_a_second / 1_000_000;
        drive.turn_at(count + (edges % 2) as i32);
    }
}

#[test]
fn edges_without_progress_are_an_alarm_at_work() {
    // One channel of two at 1 and at 2.5 km/h.
    for edges_a_second in [265, 663] {
        let mut drive = Drive::at_work();
        tremble(&mut drive, edges_a_second);
        assert_eq!(drive.alarm(), Some(Alarm::EncoderChannelDead), "{edges_a_second}");
        let mut drive = Drive::in_hold();
        tremble(&mut drive, edges_a_second);
        assert_eq!(drive.alarm(), None);
    }
}

#[test]
fn a_wheel_that_trembles_on_an_edge_with_the_engine_is_no_alarm() {
    let mut drive = Drive::at_work();
    tremble(&mut drive, 100);
    assert_eq!(drive.alarm(), None);
}

#[test]
fn jumps_are_an_alarm_by_the_way_on_which_they_come() {
    // From one side of the count's wrap to the other. Each brings two ticks that are not believed.
    for (metres_between, alarm) in [(0.02, Some(Alarm::EncoderJumps)), (0.05, None)] {
        for speed_m_s in [0.3, 1.2] {
            let mut wake_up = woken_up(Cause::PowerOn);
            wake_up.readings.jumps = u16::MAX - 10;
            let mut machine = Controller::new(ByWidth, Volatile::new(), wake_up);
            machine.clear();
            let mut drive = Drive { machine, time_us: 0, place: 0.0, readings: wake_up.readings, edges: Vec::new() };
            for _ in 0..200 {
                drive.readings.jumps = drive.readings.jumps.wrapping_add(1);
                drive.place += 2.0;
                drive.roll(speed_m_s, metres_between);
            }
            assert_eq!(drive.alarm(), alarm, "a jump every {metres_between} m at {speed_m_s} m/s");
        }
    }
}

#[test]
fn jumps_at_rest_move_nothing_and_are_an_alarm_where_there_are_many() {
    for (every_ms, alarm) in [(4, Some(Alarm::EncoderJumps)), (40, None)] {
        let mut drive = Drive::in_hold();
        for jump in 1..=200 {
            drive.readings.jumps += 1;
            drive.place += 2.0;
            drive.roll(0.0, f64::from(every_ms) / 1000.0);
            assert_eq!(drive.machine.readings().position.count(), 0, "jump {jump}");
        }
        assert_eq!(drive.alarm(), alarm, "a jump every {every_ms} ms");
    }
}

#[test]
fn the_jumps_of_a_wheel_so_fast_that_an_edge_can_be_missed_are_believed() {
    for (speed_m_s, believed) in [(7.0, false), (15.0, true)] {
        let mut drive = Drive::in_hold();
        drive.roll(speed_m_s, 3.0);
        let before = drive.machine.readings().position;
        let (place, jumps) = (drive.place, 5);
        for _ in 0..jumps {
            drive.readings.jumps += 1;
            drive.roll(speed_m_s, 0.1);
        }
        let counted = drive.place.floor() as i32 - place.floor() as i32;
        let doubted = if believed { 0 } else { 2 * jumps };
        assert_eq!(drive.machine.readings().position - before, Ticks(counted - doubted), "{speed_m_s} m/s");
    }
}

#[test]
fn working_faster_than_the_limit_is_an_alarm_in_both_directions() {
    for (speed_m_s, alarm) in [(1.35, None), (1.45, Some(Alarm::TooFast)), (-1.35, None), (-1.45, Some(Alarm::TooFast))]
    {
        let mut drive = Drive::at_work();
        drive.roll(speed_m_s, 0.8);
        assert_eq!(drive.alarm(), alarm, "{speed_m_s} m/s");
    }
    let mut drive = Drive::in_hold();
    drive.roll(5.0, 2.0);
    assert_eq!(drive.alarm(), None, "on the way to the field");
}

#[test]
fn a_beam_that_flickers_is_an_alarm_and_a_ragged_canopy_is_none() {
    let mut drive = Drive::at_work();
    for _ in 0..60 {
        drive.beam(true);
        drive.roll(0.5, 0.0005);
        drive.beam(false);
        drive.roll(0.5, 0.0005);
    }
    assert_eq!(drive.alarm(), Some(Alarm::BeamFlickers));
    // At 5 km/h, a clear stretch every 14 mm.
    let mut drive = Drive::at_work();
    drive.roll(1.39, 0.3);
    for _ in 0..10 {
        drive.beam(true);
        drive.roll(1.39, 0.008);
        drive.beam(false);
        drive.roll(1.39, 0.006);
    }
    assert_eq!(drive.alarm(), None);
}

#[test]
fn a_long_way_without_a_plant_is_a_warning_once() {
    let mut drive = Drive::at_work();
    drive.machine.set(Setting::NoPlantM, 3).unwrap();
    let warned = |drive: &mut Drive| {
        let events = drive.events();
        events.iter().filter(|event| **event == Event::Warning(Warning::NoPlants)).count()
    };
    drive.roll(0.5, 1.9);
    assert!(!drive.machine.sees_no_plants());
    drive.roll(0.5, 0.2);
    assert!(drive.machine.sees_no_plants());
    assert_eq!(warned(&mut drive), 1);
    drive.roll(0.5, 5.0);
    assert_eq!((warned(&mut drive), drive.machine.state()), (0, State::Work), "once is enough");
    drive.pass_a_plant(0.5);
    drive.roll(0.5, 0.2);
    assert!(!drive.machine.sees_no_plants(), "a plant ends it");
    drive.roll(0.5, 3.0);
    assert_eq!(warned(&mut drive), 1);

    let mut never = Drive::at_work();
    never.machine.set(Setting::NoPlantM, 0).unwrap();
    never.roll(1.3, 150.0);
    assert!(!never.machine.sees_no_plants());
}

#[test]
fn a_jump_in_speed_just_before_a_window_is_counted_as_late_and_the_tool_leaves_at_once() {
    // The plant's margin is 350 mm behind the beam's place; the lead at 0.3 m/s is 54 mm, at 1.3 m/s 234 mm.
    for (jumps, late) in [(false, 0), (true, 1)] {
        let mut drive = Drive::at_work();
        drive.roll(0.3, 0.5);
        drive.pass_a_plant(0.3);
        drive.roll(0.3, 0.1);
        assert!(drive.tool_is_in());
        drive.events();
        drive.roll(if jumps { 1.3 } else { 0.3 }, 0.12);
        assert!(!drive.tool_is_in());
        assert_eq!(drive.machine.late(), late);
        let told = drive.events().contains(&Event::Warning(Warning::LateCommand));
        assert_eq!(told, jumps);
        assert_eq!(drive.machine.state(), State::Work);
    }
}

#[test]
fn a_command_is_late_where_the_speed_rises_by_more_than_an_eighth_while_the_tool_swings() {
    for (rises_by, late) in [(1.1, 0), (1.2, 1)] {
        let mut drive = Drive::at_work();
        drive.roll(0.5, 0.5);
        drive.pass_a_plant(0.5);
        while drive.tool_is_in() {
            drive.roll(0.5, 0.001);
        }
        drive.roll(0.5 * rises_by, 0.2);
        assert_eq!(drive.machine.late(), late, "{rises_by}");
    }
}

#[test]
fn in_paper_mode_no_command_is_late() {
    let mut drive = Drive::at_work();
    drive.machine.set(Setting::LeadInMs, 0).unwrap();
    drive.machine.set(Setting::LeadOutMs, 0).unwrap();
    drive.pass_a_plant(0.7);
    drive.roll(0.7, 1.0);
    assert_eq!(drive.machine.late(), 0);
}

#[test]
fn rolling_back_to_forgotten_ground_is_an_alarm() {
    let mut drive = Drive::at_work();
    for _ in 0..20 {
        drive.pass_a_plant(0.5);
        drive.roll(0.5, 0.35);
    }
    // The 16 canopies that are remembered go back 8 m; the oldest of them was not the first.
    drive.roll(-0.5, 6.0);
    assert_eq!(drive.alarm(), None);
    drive.roll(-0.5, 3.0);
    assert_eq!(drive.alarm(), Some(Alarm::RolledBackTooFar));
}

#[test]
fn rolling_back_to_ground_that_was_never_seen_has_the_tool_out_and_is_no_alarm() {
    let mut drive = Drive::at_work();
    drive.roll(-0.5, 2.0);
    assert_eq!((drive.alarm(), drive.machine.reason()), (None, Some(Reason::UnseenGround)));
    drive.roll(0.5, 2.0);
    assert!(drive.tool_is_in());
}

#[test]
fn a_tool_that_does_not_follow_is_an_alarm_where_an_end_switch_tells() {
    // The switch never closes, though the tool is to be out.
    let mut drive = Drive::in_hold();
    drive.roll(0.0, 1.0);
    assert_eq!(drive.alarm(), None, "without a switch nobody knows");
    drive.machine.set(Setting::EndSwitch, 1).unwrap();
    drive.roll(0.0, 0.1);
    assert_eq!(drive.alarm(), Some(Alarm::ToolStuck));

    // The switch stays closed, though the tool is to be in the row.
    let mut drive = Drive::at_work();
    drive.machine.set(Setting::EndSwitch, 1).unwrap();
    drive.roll(0.5, 1.0);
    assert_eq!(drive.alarm(), None, "open, and the tool is in the row");
    drive.pass_a_plant(0.5);
    drive.roll(0.5, 0.4);
    assert_eq!(drive.alarm(), Some(Alarm::ToolStuck), "it should have closed");

    let mut drive = Drive::at_work();
    drive.machine.set(Setting::EndSwitch, 1).unwrap();
    drive.readings.end_switch_on = true;
    drive.roll(0.5, 0.05);
    assert_eq!(drive.alarm(), Some(Alarm::ToolStuck), "closed, and the tool is told to be in the row");
}

#[test]
fn a_tool_that_follows_within_its_time_is_no_alarm() {
    let mut drive = Drive::at_work();
    drive.machine.set(Setting::EndSwitch, 1).unwrap();
    let mut is_out = [drive.machine.tool_out(); 360];
    for turn in 0..40_000 {
        if turn % 2_000 == 500 {
            drive.beam(true);
        }
        if turn % 2_000 == 1_000 {
            drive.beam(false);
        }
        // 180 ms behind the command, and the contacts bounce.
        let place = turn % is_out.len();
        drive.readings.end_switch_on = is_out[place] ^ (turn % 50 == 0);
        drive.roll(0.5, 0.5 * TURN_US as f64 / 1e6);
        is_out[place] = drive.machine.tool_out();
    }
    assert_eq!(drive.alarm(), None);
}

#[test]
fn a_stack_that_is_nearly_used_up_is_an_alarm() {
    let mut drive = Drive::at_work();
    drive.readings.stack_free = 48;
    drive.roll(0.5, 0.1);
    assert_eq!(drive.alarm(), None);
    drive.readings.stack_free = 47;
    drive.roll(0.5, 0.1);
    assert_eq!(drive.alarm(), Some(Alarm::StackLow));
}

#[test]
fn saved_settings_are_in_use_after_a_restart() {
    let mut settings = Settings::new();
    settings.set(Setting::K, 7).unwrap();
    let machine = Controller::new(ByWidth, saved(&settings), woken_up(Cause::PowerOn));
    assert_eq!((machine.state(), machine.settings()), (State::Hold, &settings));
}

/// A memory with these settings, right or not.
fn saved(settings: &Settings) -> Volatile {
    let mut saved = SavedSettings::new(Volatile::new());
    saved.save(settings);
    while !saved.carry_on() {}
    saved.into_memory()
}

#[test]
fn a_test_row_that_contradicting_settings_refuse_leaves_what_stands_in_the_beam() {
    let mut settings = Settings::new();
    settings.set(Setting::ServoInUs, 2000).unwrap();
    let mut machine = Controller::new(ByWidth, saved(&settings), woken_up(Cause::PowerOn));
    machine.clear();
    machine.turn(readings(0, 0), []);
    machine.turn(readings(1000, 0), [Edge::Seen { position: Position::new(0), broken: true, second_broken: false }]);
    assert_eq!(machine.windows(), 1);
    assert_eq!(machine.test_row(500), Err(Refusal::PulsesEqual));
    assert_eq!(machine.windows(), 1);
}

#[test]
fn saved_settings_that_contradict_each_other_are_an_alarm_and_do_not_start() {
    let mut settings = Settings::new();
    settings.set(Setting::ServoInUs, 2000).unwrap();
    settings.set(Setting::BeamToToolMm, 200).unwrap();
    let mut machine = Controller::new(ByWidth, saved(&settings), woken_up(Cause::PowerOn));
    assert_eq!(machine.state(), State::Alarm(Alarm::SettingsContradict));
    machine.clear();
    assert_eq!(machine.start(false), Err(Refusal::PulsesEqual));
    assert_eq!(machine.save(), Err(Refusal::PulsesEqual));
    // The switch does not start it either.
    for millisecond in 0..100 {
        machine.turn(Readings { switch_on: true, ..readings(millisecond * 1000, 0) }, []);
    }
    assert_eq!(machine.state(), State::Alarm(Alarm::SettingsContradict));
    machine.clear();
    // They can be mended one at a time.
    machine.set(Setting::ServoInUs, 1500).unwrap();
    assert_eq!((machine.start(false), machine.needed_mm()), (Err(Refusal::BeamTooNear), 336));
    machine.set(Setting::BeamToToolMm, 400).unwrap();
    assert_eq!(machine.start(false), Ok(()));
}

#[test]
fn nothing_happens_where_time_and_place_wrap() {
    // Both counters pass their end in the middle of a row.
    let ticks_before = 3000;
    let steps_before = 1_000_000;
    let moved = |now: Readings| Readings {
        now: Instant::new(0_u32.wrapping_sub(steps_before)) + Interval::from_steps(now.now.steps()),
        position: Position::new(i32::MAX - ticks_before) + Ticks(now.position.count()),
        ..now
    };
    let swings = |wraps: bool| {
        let place = |now: Readings| if wraps { moved(now) } else { now };
        let mut wake_up = woken_up(Cause::PowerOn);
        wake_up.readings = place(readings(0, 0));
        let mut machine = Controller::new(ByWidth, Volatile::new(), wake_up);
        machine.clear();
        machine.start(false).unwrap();
        let (mut swings, mut was_out) = (Vec::new(), true);
        for turn in 0..24_000_u64 {
            let count = (turn as f64 * 0.53) as i32;
            let broken = count % 1000 >= 700 && count > 1000;
            let now = place(readings(turn * TURN_US, count));
            let is_edge = count > 1000 && broken != ((count - 1) % 1000 >= 700 && count - 1 > 1000);
            machine.turn(now, is_edge.then_some(Edge::Seen { position: now.position, broken, second_broken: false }));
            if machine.tool_out() != was_out {
                was_out = !was_out;
                swings.push((turn, was_out));
            }
        }
        assert_eq!(machine.state(), State::Work);
        swings
    };
    let plain = swings(false);
    assert!(plain.len() > 15, "{plain:?}");
    assert_eq!(swings(true), plain);
}
