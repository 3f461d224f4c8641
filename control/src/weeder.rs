//! The front door: edges, readings and commands go in, the tool's place and the lamp come out.
//!
//! One [`Controller::turn`] a turn of the main loop: take the edges of the beam that the machine has rolled past, measure the
//! speed, roll the watched ground on, ask the schedule whether the tool may be in the row. Nothing in here waits,
//! and nothing remembers a time at which something ought to happen: the answer is worked out anew each time, from where
//! the machine is and how fast it rolls.

mod bench;
mod commands;
mod faults;
mod shown;

use crate::{
    alarm::{Alarm, Warning},
    ground::{
        Ground,
        class::{Classifier, Vote},
        detection::Detection,
        features,
        keep_out::ScheduleFull,
        second_beam::Blind,
        slip::News,
    },
    measure::{
        readings::{Edge, Readings, Startup},
        reset::Cause,
        sensors::Sensors,
    },
    memory::Memory,
    operate::{
        bench::Bench,
        calibration::Distance,
        configuration::Configuration,
        detections::{Classified, Detections},
        event::{Event, Events},
        example_entry::ExampleEntry,
        limits::Limits,
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

/// What the machine is to do after a turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Orders {
    /// The servo's pulse width.
    pub pulse: HalfMicros,
    /// The pulse width that has the tool out, for an emergency in which nobody can be asked.
    pub pulse_out: HalfMicros,
    /// The shortest gap between servo pulses in milliseconds; 0 for fixed frames.
    pub gap_ms: u8,
    /// Whether a detection was classified, or another speed or other settings were followed: that is enough for a turn of the loop.
    pub turn_spent: bool,
}

/// The machine's decisions and all that they rest on.
#[derive(Clone, Debug)]
pub struct Controller<C, M> {
    classifier: C,
    configuration: Configuration<M>,
    ground: Ground,
    limits: Limits,
    cause: Cause,
    sensors: Sensors,
    bench: Bench,
    distance: Distance,
    state: State,
    tool: Tool,
    /// Whether the speed is another than the one by which the ground leads.
    leads_are_old: bool,
    /// Whether this turn has done what takes long.
    turn_spent: bool,
    /// Whether the machine waits for the watchdog to reset it.
    tests_watchdog: bool,
    /// Lines that were not understood, or came with a hole in them.
    mistakes: u16,
    /// Detections that were narrower than any plant or weed.
    dust: u16,
    /// The detection that is being classified, if one is.
    classifying: Detection,
    is_classifying: bool,
    /// Whether that is what the second beam has seen, and the first may have told already.
    is_of_second: bool,
    plant_timeout: PlantTimeout,
    unknown_run: UnknownRun,
    told: ExampleEntry,
    detections: Detections,
    events: Events,
    telemetry: Telemetry,
}

/// A controller before the machine has woken up: nothing but zeros and what it is made of, so that a `static` can hold it
/// without a copy in flash, and it is woken up where it lies.
#[derive(Debug)]
pub struct Uninit<C, M>(Controller<C, M>);

impl<C: Classifier, M: Memory> Uninit<C, M> {
    /// A controller with a classifier and a memory of which nobody has read anything.
    pub const fn new(classifier: C, memory: M) -> Self {
        Self(Controller {
            classifier,
            ground: Ground::NONE,
            limits: Limits::NONE,
            configuration: Configuration::new(memory),
            cause: Cause::PowerOn,
            sensors: Sensors::NONE,
            bench: Bench::Idle,
            distance: Distance::NONE,
            state: State::Hold,
            tool: Tool::NONE,
            leads_are_old: false,
            turn_spent: false,
            tests_watchdog: false,
            mistakes: 0,
            dust: 0,
            classifying: Detection::NONE,
            is_classifying: false,
            is_of_second: false,
            plant_timeout: PlantTimeout::since(Position::new(0)),
            unknown_run: UnknownRun::NONE,
            told: ExampleEntry::NONE,
            detections: Detections::NONE,
            events: Events::NONE,
            telemetry: Telemetry::NONE,
        })
    }

    /// Wakes the machine up: in HOLD, with the tool out, and with no ground known. Where the memory holds no settings, or some
    /// that cannot be right, that is an alarm.
    pub fn init(&mut self, startup: Startup) -> &mut Controller<C, M> {
        let Startup { readings: Readings { now, position, .. }, beam_broken, cause } = startup;
        let controller = &mut self.0;
        controller.classifier.init();
        controller.state = controller.configuration.load().map_or(State::Hold, State::Alarm);
        controller.follow_settings();
        controller.ground.begin(controller.configuration.settings(), position, beam_broken);
        controller.cause = cause;
        controller.sensors.init(startup);
        controller.tool.init(now);
        controller.plant_timeout = PlantTimeout::since(position);
        controller.telemetry.init(now);
        controller
    }
}

impl<C: Classifier, M: Memory> Controller<C, M> {
    /// A controller for a machine that just woke up, see [`Uninit::init`].
    pub fn new(classifier: C, memory: M, startup: Startup) -> Self {
        let mut uninit = Uninit::new(classifier, memory);
        uninit.init(startup);
        uninit.0
    }

    /// A turn of the loop: takes what came from the beam since the last one, in its order, then the machine's readings, and decides
    /// where the tool is to be. No edge is farther than the readings of the next turn.
    #[inline(always)]
    pub fn turn(&mut self, readings: Readings, edges: impl IntoIterator<Item = Edge>) -> Orders {
        edges.into_iter().for_each(|edge| self.take_edge(edge));
        self.step(readings)
    }

    /// The first part of a [`turn`](Self::turn), for a test that looks in between.
    #[inline(always)]
    pub fn take_edge(&mut self, edge: Edge) {
        match edge {
            Edge::Seen { position, broken, second_broken } => {
                if let Some(alarm) = self.sensors.beam.edge(self.sensors.readings.now) {
                    self.raise(alarm);
                }
                let is_of_second = self.ground.has_second_beam() && second_broken != self.ground.second_is_broken();
                if !is_of_second || broken != self.sensors.beam_broken {
                    self.beam_edge(position, broken);
                }
                if is_of_second {
                    self.match_second_beam(self.sensors.odometer.place(position), second_broken);
                }
            }
            Edge::Lost { broken } => self.beam_edges_lost(broken),
        }
    }

    /// Takes an edge of the beam, with the position at which it came.
    fn beam_edge(&mut self, position: Position, broken: bool) {
        self.sensors.beam_broken = broken;
        if broken
            && self.is_working()
            && let Some(alarm) = self.sensors.encoder.beam_broke()
        {
            self.raise(alarm);
        }
        if let Some(detection) = self.ground.edge(self.sensors.odometer.place(position), broken) {
            self.see(detection);
        }
    }

    /// The second beam is broken or not, with the machine at a position.
    #[cfg_attr(target_arch = "avr", inline(never))]
    fn match_second_beam(&mut self, position: Position, broken: bool) {
        let seen = self.ground.match_second_beam(position, broken);
        if let Some(blind) = self.ground.blind() {
            return self.raise(if blind == Blind::First { Alarm::BeamBlind } else { Alarm::SecondBeamBlind });
        }
        if let Some(detection) = seen {
            self.classify(detection, true);
        }
        self.events.add(match self.ground.take_news() {
            News::None => return,
            News::Told => Event::Slip { permille: self.ground.slip_permille().unwrap_or(0) },
            News::Lost => Event::Warning(Warning::SlipUnknown),
        });
    }

    /// The first beam has seen a detection in full.
    fn see(&mut self, detection: Detection) {
        self.ground.await_detection(detection);
        self.classify(detection, false);
    }

    /// Edges of the beam were lost: what stood there is not known, and neither is the beam's level, which is now `broken`.
    fn beam_edges_lost(&mut self, broken: bool) {
        self.sensors.beam_broken = broken;
        self.ground.lose_edges(broken);
        self.raise(Alarm::BeamEdgesLost);
    }

    /// The last part of a [`turn`](Self::turn), for a test that looks in between.
    pub fn step(&mut self, readings: Readings) -> Orders {
        self.sensors.readings = readings;
        let doubted = self.sensors.odometer.read(readings.position, readings.jumps, self.believes_jumps());
        let position = self.sensors.odometer.place(readings.position);
        self.sensors.readings.position = position;
        self.leads_are_old |= self.sensors.meter.read(readings.now, position).is_some();
        match self.sensors.switch.read(readings.now, readings.switch_on) {
            // An alarm wants to be cleared first, if by nothing else then by the switch going off.
            Some(true) if matches!(self.state, State::Hold) => self.go_to_work(),
            Some(false) => self.enter(State::Hold),
            _ => {}
        }
        if let Some(detection) = self.ground.roll_to(position) {
            self.see(detection);
        }
        if self.ground.has_second_beam() {
            self.match_second_beam(position, self.ground.second_is_broken());
        }
        match self.ground.guard() {
            Some(Ok(due)) => self.events.add(Event::Guarded(self.ground.position_of(due, position))),
            Some(Err(ScheduleFull)) => self.raise(Alarm::ScheduleFull),
            None => {}
        }
        // Each of these takes a good part of what a turn may take: a turn does one of them.
        if !self.turn_spent {
            if self.configuration.has_changed() {
                self.follow_settings();
            } else if self.ground.is_to_be_corrected() {
                self.ground.correct(self.configuration.settings());
                self.turn_spent = true;
            } else if self.leads_are_old {
                self.ground.lead(self.configuration.settings(), self.sensors.meter.speed());
                (self.leads_are_old, self.turn_spent) = (false, true);
            } else if self.is_classifying {
                // The last of them, as one detection may come after the other.
                self.go_on_classifying();
            }
        }
        if let Some(alarm) = self.fault(doubted) {
            self.raise(alarm);
        }
        let out = self.try_out().unwrap_or(!self.is_working() || self.must_be_out());
        if out != self.tool.is_out() {
            self.tool.send(out, out && self.is_working() && !self.sensors.encoder.is_doubtful());
            self.events.add(Event::Swing { out, position });
        }
        let orders = self.orders();
        self.tool.order(orders.pulse, readings.now);
        self.warn();
        self.turn_spent = false;
        orders
    }

    /// What the machine is to do as of the last turn.
    pub fn orders(&self) -> Orders {
        let pulse = if self.tool.is_out() { Setting::ServoOutUs } else { Setting::ServoInUs };
        let pulse_of = |setting| servo::from_us(self.configuration.get(setting));
        Orders {
            pulse: self.bench.pulse().unwrap_or_else(|| pulse_of(pulse)),
            pulse_out: pulse_of(Setting::ServoOutUs),
            gap_ms: self.configuration.get(Setting::ServoGapMs) as u8,
            turn_spent: self.turn_spent,
        }
    }

    /// Whether the encoder's silence or the ground keeps the tool out of the row.
    fn must_be_out(&self) -> bool {
        let out = self.tool.is_out();
        self.sensors.encoder.is_doubtful() || out && self.sensors.encoder.is_quiet() || self.ground.must_be_out(out)
    }

    /// Begins to classify a complete detection, which takes some turns more. What is dust is only counted.
    fn classify(&mut self, detection: Detection, is_of_second: bool) {
        self.turn_spent = true;
        let width_mm = self.ground.millimetres(self.ground.ticks(detection.width()));
        if !detection.cut && (width_mm as u16) < self.configuration.get(Setting::MinWidthMm) {
            count(&mut self.dust);
            return;
        }
        // The one before it, a few millimetres off, is not classified yet. Like all of which nobody knows what it is, it is kept.
        if self.is_classifying {
            self.decide(Some(Vote::UNKNOWN));
        }
        self.is_of_second = is_of_second;
        let position = self.sensors.readings.position;
        let spacing_mm = self.ground.millimetres(self.ground.spacing(&detection));
        let speed_class_mm_s = features::speed_class(self.speed_mm_s());
        self.plant_timeout = PlantTimeout::since(position);
        let classified = Classified { speed_class_mm_s, spacing_mm, width_mm, vote: Vote::UNKNOWN, label: None };
        self.detections.remember(classified);
        self.ground.await_class(detection);
        (self.classifying, self.is_classifying) = (detection, true);
        // What is left of a detection whose beginning was not seen may be as narrow as a weed.
        let vote = if detection.cut {
            Some(Vote::UNKNOWN)
        } else {
            self.classifier.begin(&classified.features(), self.configuration.get(Setting::K) as u8)
        };
        self.decide(vote);
    }

    /// Classifies on.
    #[cfg_attr(target_arch = "avr", inline(never))]
    fn go_on_classifying(&mut self) {
        self.turn_spent = true;
        let vote = self.classifier.go_on();
        self.decide(vote);
    }

    /// Tells of the detection that is being classified, once there is a vote, and keeps it unless it is a weed.
    #[cfg_attr(target_arch = "avr", inline(never))]
    fn decide(&mut self, vote: Option<Vote>) {
        let (Some(vote), Some(classified)) = (vote, self.detections.newest()) else { return };
        classified.vote = vote;
        let (detection, width_mm) = (self.classifying, classified.width_mm);
        self.is_classifying = false;
        let leading = self.ground.position_of(detection.leading, self.sensors.readings.position);
        let (spacing, plan) = (self.ground.spacing(&detection), self.ground.plan(&detection));
        self.events.add(Event::Detection { vote, leading, spacing, plan });
        if self.ground.classified(detection, vote.class).is_err() {
            self.raise(Alarm::ScheduleFull);
        }
        // What is told twice counts once.
        self.count_misfit(vote.class, if self.is_of_second { 0 } else { width_mm });
    }

    /// Latches an alarm. What was seen can no longer be trusted.
    fn raise(&mut self, alarm: Alarm) {
        self.ground.forget();
        let nobody_asks = alarm.is_of_a_sensor() && self.bench.needs_no_sensor();
        if nobody_asks || matches!(self.state, State::Alarm(_)) {
            return;
        }
        self.events.add(Event::Alarm { alarm, position: self.sensors.readings.position });
        self.enter(State::Alarm(alarm));
    }

    fn is_working(&self) -> bool {
        matches!(self.state, State::Work)
    }

    fn go_to_work(&mut self) {
        if self.configuration.expect_no_contradiction().is_err() {
            self.raise(Alarm::SettingsContradict);
            return;
        }
        self.plant_timeout = PlantTimeout::since(self.sensors.readings.position);
        self.unknown_run = UnknownRun::NONE;
        self.enter(State::Work);
    }

    fn enter(&mut self, state: State) {
        // What is tried ends by `hold` as well, and by the switch going off.
        self.bench = Bench::Idle;
        if state != self.state {
            self.state = state;
            self.events.add(Event::State(state));
        }
    }
}
