//! The controller: beam edges, readings and commands go in, a servo pulse width comes out.
//!
//! The main loop calls [`Controller::turn`] once a turn. The controller takes the new beam edges, measures the speed, and advances
//! the ground. It then asks the ground whether the tool may be in the row. No call waits. No call stores a time for a later action:
//! each turn decides from the position and the speed of that turn.

mod commands;
mod faults;
mod manual_tests;
mod shown;

use crate::{
    alarm::{Alarm, Warning},
    ground::{
        Ground, Unclassified,
        class::{Classifier, Vote},
        detection::Detection,
        features,
        keep_out::ScheduleFull,
        second_beam::Blind,
        slip::SlipChange,
    },
    measure::{
        readings::{Edge, Readings, Startup},
        reset::Cause,
        sensors::Sensors,
    },
    memory::Memory,
    operate::{
        calibration::Distance,
        configuration::Configuration,
        detections::{Classified, Detections},
        event::{Event, Events},
        example_entry::ExampleEntry,
        limits::Limits,
        manual_test::ManualTest,
        plant_timeout::PlantTimeout,
        plot::Telemetry,
        servo::{self, HalfMicros},
        state::State,
        tool::Tool,
        unknown_run::UnknownRun,
    },
    settings::Setting,
    units::{Position, count},
};

/// The output of a turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Orders {
    /// The servo's pulse width.
    pub pulse: HalfMicros,
    /// The pulse width for "tool out", for an interrupt that finds the loop stopped.
    pub pulse_out: HalfMicros,
    /// The shortest gap between servo pulses in milliseconds; 0 for fixed frames.
    pub gap_ms: u8,
}

/// The machine's decisions and their state.
#[derive(Clone, Debug)]
pub struct Controller<C, M> {
    classifier: C,
    configuration: Configuration<M>,
    ground: Ground,
    limits: Limits,
    cause: Cause,
    /// Whether the reset ended work that the operator has not started again or left.
    was_working: bool,
    sensors: Sensors,
    manual_test: ManualTest,
    distance: Distance,
    state: State,
    tool: Tool,
    /// Whether the machine waits for a watchdog reset: `test watchdog`.
    tests_watchdog: bool,
    /// Console lines with an error, or with lost bytes.
    command_errors: u16,
    /// Detections narrower than `min_width_mm`: dust.
    dust: u16,
    /// Whether this turn has begun to classify a detection.
    has_begun: bool,
    plant_timeout: PlantTimeout,
    unknown_run: UnknownRun,
    told: ExampleEntry,
    detections: Detections,
    events: Events,
    telemetry: Telemetry,
}

/// A controller before [`init`](Self::init). It is all zeros apart from its parts, so a `static` holds it without a copy in flash.
/// `init` works in place.
#[derive(Debug)]
pub struct Uninit<C, M>(Controller<C, M>);

impl<C: Classifier, M: Memory> Uninit<C, M> {
    /// A controller with a classifier and a memory that have not been read yet.
    pub const fn new(classifier: C, memory: M) -> Self {
        Self(Controller {
            classifier,
            ground: Ground::NONE,
            limits: Limits::NONE,
            configuration: Configuration::new(memory),
            cause: Cause::PowerOn,
            was_working: false,
            sensors: Sensors::NONE,
            manual_test: ManualTest::Idle,
            distance: Distance::NONE,
            state: State::Hold,
            tool: Tool::NONE,
            tests_watchdog: false,
            command_errors: 0,
            dust: 0,
            has_begun: false,
            plant_timeout: PlantTimeout::since(Position::new(0)),
            unknown_run: UnknownRun::NONE,
            told: ExampleEntry::NONE,
            detections: Detections::NONE,
            events: Events::NONE,
            telemetry: Telemetry::NONE,
        })
    }

    /// The first readings: the caller writes them in place, before [`init`](Self::init).
    pub const fn readings(&mut self) -> &mut Readings {
        &mut self.0.sensors.readings
    }

    /// Starts in HOLD, with the tool out and no known ground. Raises an alarm if the memory holds no settings, or invalid ones.
    pub fn init(&mut self, beam_broken: bool, cause: Cause, was_working: bool) -> &mut Controller<C, M> {
        let controller = &mut self.0;
        let Readings { now, position, .. } = controller.sensors.readings;
        controller.state = controller.configuration.load().map_or(State::Hold, State::Alarm);
        controller.follow_settings();
        controller.ground.begin(position, beam_broken);
        controller.cause = cause;
        controller.was_working = was_working && cause != Cause::PowerOn;
        if controller.configuration.has_spoiled_copy() {
            controller.events.announce(Event::Warning(Warning::SettingsOlder));
        }
        controller.sensors.init(beam_broken, controller.ground.geometry().scale);
        controller.tool.init(now.slow());
        controller.restart_plant_timeout();
        controller.telemetry.init(controller.sensors.now);
        controller
    }
}

impl<C: Classifier, M: Memory> Controller<C, M> {
    /// A controller right after power-up, see [`Uninit::init`].
    pub fn new(classifier: C, memory: M, startup: Startup) -> Self {
        let mut uninit = Uninit::new(classifier, memory);
        *uninit.readings() = startup.readings;
        uninit.init(startup.beam_broken, startup.cause, startup.was_working);
        uninit.0
    }

    /// Runs one turn of the loop. Takes the beam edges since the last turn in their order, then the readings, and returns the
    /// orders. No edge may have a later position than the next turn's readings.
    #[inline(always)]
    pub fn turn(&mut self, readings: Readings, edges: impl IntoIterator<Item = Edge>) -> Orders {
        *self.next_readings() = readings;
        edges.into_iter().for_each(|edge| self.take_edge(edge));
        self.step()
    }

    /// The readings of the next turn, for a caller that writes them in place. Then follow the edges, each by
    /// [`take_edge`](Self::take_edge), and [`step`](Self::step).
    #[inline(always)]
    pub const fn next_readings(&mut self) -> &mut Readings {
        &mut self.sensors.readings
    }

    /// Takes an edge of a beam.
    #[inline(always)]
    pub fn take_edge(&mut self, edge: Edge) {
        match edge {
            Edge::Seen { position, broken, second_broken } => self.see_levels(position, broken, second_broken),
            Edge::Lost { broken, second_broken } => self.beam_edges_lost(broken, second_broken),
        }
    }

    /// Takes the beams' levels at a position. One of them may be new.
    #[cfg_attr(target_arch = "avr", inline(never))]
    #[cfg_attr(not(target_arch = "avr"), inline)]
    fn see_levels(&mut self, position: Position, broken: bool, second_broken: bool) {
        let second_broken = second_broken && self.ground.has_second_beam();
        self.sensors.follow_clock();
        if self.sensors.beam.edge(self.sensors.now, broken || second_broken) {
            self.forget_and_raise(Alarm::BeamFlickers);
        }
        let is_of_second = second_broken != self.ground.second_is_broken();
        if !is_of_second || broken != self.sensors.beam_broken {
            self.beam_edge(position, broken);
        }
        if is_of_second {
            self.match_second_beam(self.sensors.odometer.place(position), second_broken);
        }
    }

    /// Takes an edge of the first beam, and the position at which it came.
    fn beam_edge(&mut self, position: Position, broken: bool) {
        let was_broken = core::mem::replace(&mut self.sensors.beam_broken, broken);
        // A spike too short to be read gives no new level.
        if broken && !was_broken && self.is_working() && self.sensors.encoder.beam_broke() {
            let flickers = self.sensors.beam.short_breaks() > 1;
            self.forget_and_raise(if flickers { Alarm::BeamFlickers } else { Alarm::EncoderSilent });
        }
        if let Some(detection) = self.ground.edge(self.sensors.odometer.place(position), broken) {
            self.see(detection);
        }
    }

    /// Passes the second beam's level at this position to the ground.
    #[cfg_attr(target_arch = "avr", inline(never))]
    fn match_second_beam(&mut self, position: Position, broken: bool) {
        let seen = self.ground.match_second_beam(position, broken);
        if let Some(blind) = self.ground.blind() {
            return self.forget_and_raise(if blind == Blind::First {
                Alarm::BeamBlind
            } else {
                Alarm::SecondBeamBlind
            });
        }
        if let Some(detection) = seen {
            self.classify(detection, true);
        }
        self.events.add(match self.ground.take_slip_change() {
            SlipChange::None => return,
            SlipChange::Measured => Event::Slip { permille: self.ground.slip_permille().unwrap_or(0) },
            SlipChange::Lost => Event::Warning(Warning::SlipUnknown),
        });
    }

    /// Takes a complete detection of the first beam.
    fn see(&mut self, detection: Detection) {
        self.ground.await_detection(detection);
        self.classify(detection, false);
    }

    /// Edges of the beams were lost. The ground that they covered is unknown. The beams' levels are now these.
    fn beam_edges_lost(&mut self, broken: bool, second_broken: bool) {
        self.sensors.beam_broken = broken;
        self.ground.lose_edges(broken, second_broken);
        self.forget_and_raise(Alarm::BeamEdgesLost);
    }

    /// The last part of a turn, after the edges.
    pub fn step(&mut self) -> Orders {
        self.sensors.follow_clock();
        let Readings { position, jumps, switch_on, .. } = self.sensors.readings;
        let doubted = self.sensors.odometer.read(position, jumps, self.believes_jumps());
        let position = self.sensors.odometer.place(position);
        self.sensors.position = position;
        if self.sensors.meter.read(self.sensors.now, self.ground.geometry().scale.wrap(position)) {
            self.ground.outdate_leads();
        }
        match self.sensors.switch.read(self.sensors.now, switch_on) {
            // The operator clears an alarm first: with `clear`, or by turning the switch off.
            Some(true) if matches!(self.state, State::Hold) => {
                self.begin_ground();
                self.go_to_work();
            }
            Some(false) => self.enter(State::Hold),
            _ => {}
        }
        if let Some(detection) = self.ground.roll_to(position) {
            self.see(detection);
        }
        if self.ground.has_second_beam() {
            self.match_second_beam(position, self.ground.second_is_broken());
        }
        match self.ground.guard_missed_plant() {
            Some(Ok(due)) => self.events.add(Event::Guarded(self.ground.position_of(due, position))),
            Some(Err(ScheduleFull)) => self.forget_and_raise(Alarm::ScheduleFull),
            None => {}
        }
        if let Some(alarm) = self.fault(doubted) {
            self.forget_and_raise(alarm);
        }
        let out = self.try_out().unwrap_or(!self.is_working() || self.must_be_out());
        if out != self.tool.is_out() {
            self.count_unfollowed();
            self.tool.send(out, out && self.is_working() && !self.sensors.encoder.is_doubtful());
            self.events.add(Event::Swing { out, position });
        }
        let orders = self.orders();
        self.tool.order(orders.pulse, self.sensors.readings.now.slow());
        self.report_warnings();
        orders
    }

    /// The orders after the last turn.
    pub fn orders(&self) -> Orders {
        Orders {
            pulse: self.pulse(),
            pulse_out: servo::from_us(self.configuration.get(Setting::ServoOutUs)),
            gap_ms: self.configuration.get(Setting::ServoGapMs) as u8,
        }
    }

    /// The servo's pulse width after the last turn.
    #[cfg_attr(target_arch = "avr", inline(never))]
    pub fn pulse(&self) -> HalfMicros {
        let setting = if self.tool.is_out() { Setting::ServoOutUs } else { Setting::ServoInUs };
        self.manual_test.pulse().unwrap_or_else(|| servo::from_us(self.configuration.get(setting)))
    }

    /// Whether the ground or a silent encoder keeps the tool out of the row.
    fn must_be_out(&self) -> bool {
        let out = self.tool.is_out();
        self.sensors.encoder.is_doubtful() || out && self.sensors.encoder.is_quiet() || self.ground.must_be_out(out)
    }

    /// Starts to classify a complete detection. Classification takes several turns. Dust is only counted.
    fn classify(&mut self, detection: Detection, is_of_second: bool) {
        let width_mm = self.ground.geometry().millimetres(detection.width());
        if !detection.cut && (width_mm as u16) < self.configuration.get(Setting::MinWidthMm) {
            count(&mut self.dust);
            return;
        }
        // The previous detection, a few millimetres back, is still being classified. Unclassified detections count as plants.
        self.decide(Some(Vote::UNKNOWN));
        let spacing_mm = self.ground.geometry().millimetres(self.ground.spacing(&detection));
        let speed_class_mm_s = features::speed_class(self.speed_mm_s());
        self.restart_plant_timeout();
        let classified = Classified { speed_class_mm_s, spacing_mm, width_mm, vote: Vote::UNKNOWN, label: None };
        self.detections.remember(classified);
        self.ground.await_class(detection, is_of_second);
        self.has_begun = true;
        // A detection without a seen beginning may be the rest of a plant, as narrow as a weed. It stays unknown.
        let vote = if detection.cut {
            Some(Vote::UNKNOWN)
        } else {
            self.classifier.begin(&classified.features(), self.configuration.get(Setting::K) as u8)
        };
        self.decide(vote);
    }

    /// Runs one of the calculations that take a large part of a turn, if one is due: of settings, slip, leads or a class. Returns
    /// whether it ran one. The loop calls this once a turn, and has no time for the console then.
    #[cfg_attr(target_arch = "avr", inline(never))]
    pub fn catch_up(&mut self) -> bool {
        if core::mem::take(&mut self.has_begun) {
            // That was one.
        } else if self.configuration.has_changed() {
            self.follow_settings();
        } else if self.ground.catch_up(
            self.configuration.settings(),
            self.sensors.meter.speed(),
            self.sensors.meter.expected(),
        ) {
            // The slip or the leads.
        } else if self.ground.unclassified().is_some() {
            // Last, because one detection can follow right after another.
            let vote = self.classifier.go_on();
            self.decide(vote);
        } else {
            return false;
        }
        true
    }

    /// Once there is a vote: reports the detection, and keeps its ground unless it is a weed.
    #[cfg_attr(target_arch = "avr", inline(never))]
    fn decide(&mut self, vote: Option<Vote>) {
        let (Some(vote), Some(Unclassified { detection, of_second, .. }), Some(classified)) =
            (vote, self.ground.unclassified(), self.detections.newest())
        else {
            return;
        };
        classified.vote = vote;
        let width_mm = if *of_second { 0 } else { classified.width_mm };
        let leading = self.ground.position_of(detection.leading, self.sensors.position);
        let (spacing, plan) =
            (self.ground.geometry().scale.ticks(self.ground.spacing(detection)), self.ground.plan(detection));
        self.events.add(Event::Detection { vote, leading, spacing, plan });
        if self.ground.classified(vote.class).is_err() {
            self.forget_and_raise(Alarm::ScheduleFull);
        }
        // The first beam may have reported the same detection: the two count once.
        self.count_misfit(vote.class, width_mm);
    }

    /// Forgets the ground, because its detections are no longer trustworthy. Then latches the alarm, unless a dry run needs no
    /// sensor, or another alarm is latched.
    fn forget_and_raise(&mut self, alarm: Alarm) {
        self.ground.forget();
        let is_ignored = alarm.is_of_a_sensor() && self.manual_test.needs_no_sensor();
        if is_ignored || matches!(self.state, State::Alarm(_)) {
            return;
        }
        let alarm = self.sensors.beam.explain(alarm, self.sensors.now);
        self.events.add(Event::Alarm { alarm, position: self.sensors.position });
        self.enter(State::Alarm(alarm));
    }

    #[cfg_attr(target_arch = "avr", inline(never))]
    fn restart_plant_timeout(&mut self) {
        self.plant_timeout = PlantTimeout::since(self.sensors.position);
    }

    fn is_working(&self) -> bool {
        matches!(self.state, State::Work)
    }

    /// Forgets the ground before work begins. In HOLD the machine may have been turned, lifted or reversed to another row, and nothing
    /// tells. Ground behind the frontier would count as known, and its plants would not be seen.
    pub(super) fn begin_ground(&mut self) {
        if !self.is_working() {
            self.ground.begin(self.sensors.position, self.sensors.beam_broken);
        }
    }

    fn go_to_work(&mut self) {
        if self.configuration.expect_no_contradiction().is_err() {
            self.forget_and_raise(Alarm::SettingsContradict);
            return;
        }
        self.restart_plant_timeout();
        self.unknown_run = UnknownRun::NONE;
        self.enter(State::Work);
    }

    fn enter(&mut self, state: State) {
        // `hold` and the switch also end a manual test.
        self.manual_test = ManualTest::Idle;
        self.was_working &= matches!(state, State::Alarm(_));
        self.tool.forget_swings();
        if state != self.state {
            self.state = state;
            self.events.add(Event::State(state));
        }
    }
}
