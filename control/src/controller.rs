//! The front door: edges, readings and commands go in, the tool's place and the lamp come out.
//!
//! One [`Controller::step`] a turn of the main loop: measure the speed, roll the watched ground on, ask the schedule
//! whether the tool may be in the row. Beam edges come before the step that has rolled past them. Nothing in here waits,
//! and nothing remembers a time at which something ought to happen: the answer is worked out anew each time, from where
//! the machine is and how fast it rolls.

mod bench;

use self::bench::Bench;
use crate::{
    alarm::{Alarm, Warning},
    calibration::{Distance, Unfit},
    classifier::{Class, Classifier, Full, Vote},
    console::Plot,
    event::Event,
    features::{self, Features},
    lamp,
    memory::Memory,
    monitor::{BeamMonitor, EncoderMonitor},
    object::{Object, Watch},
    reset::Cause,
    saved::SavedSettings,
    schedule::{Plan, Schedule},
    servo::{self, HalfMicros},
    settings::{Contradiction, Setting, Settings},
    speed::SpeedMeter,
    switch::Switch,
    taught,
    text::words,
    units::{Coarse, Instant, Interval, Position, Ticks, TicksPerSecond},
};
use heapless::Vec;

/// Objects remembered, so that they can be looked at and labelled.
const OBJECTS: usize = 16;

/// Events that wait to be told. They are short-lived: a plant gives three in half a second.
const EVENTS: usize = 6;

/// Time between two points of a plotter's curves.
const PLOT_PERIOD: u16 = Coarse::steps_in_ms(50);

/// What the end switch may take longer than the lead: a servo frame, the contacts' bouncing, and some patience.
const END_SWITCH_GRACE_MS: u32 = 100;

/// Free bytes of stack below which the machine does not work on: two interrupts' worth.
const STACK_RESERVE: u16 = 48;

/// What the machine is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// The tool stays out, whatever comes.
    Hold,
    /// The tool weeds between the plants.
    Work,
    /// A fault keeps the tool out until it is cleared.
    Alarm(Alarm),
}

/// What the main loop reads from the machine for a step.
#[derive(Clone, Copy, Debug)]
pub struct Readings {
    /// The time of the reading.
    pub now: Instant,
    /// The encoder's position.
    pub position: Position,
    /// Whether the work switch is at work.
    pub switch_on: bool,
    /// Encoder ticks known to be lost since power-up, modulo 65,536.
    pub lost: u16,
    /// Times that both of the encoder's channels had changed at once, modulo 65,536.
    pub jumps: u16,
    /// Whether the end switch, if there is one, says that the tool is out.
    pub end_switch_on: bool,
    /// Bytes of the stack that were never used.
    pub stack_free: u16,
}

impl Readings {
    /// Readings of a machine with its switches off and nothing wrong.
    pub const fn new(now: Instant, position: Position) -> Self {
        Self { now, position, switch_on: false, lost: 0, jumps: 0, end_switch_on: false, stack_free: u16::MAX }
    }
}

/// How the machine woke up.
#[derive(Clone, Copy, Debug)]
pub struct WakeUp {
    /// The first readings.
    pub readings: Readings,
    /// Whether something is in the beam.
    pub beam_broken: bool,
    /// Why the machine was reset.
    pub cause: Cause,
}

/// What the machine is to do after a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Orders {
    /// The servo's pulse width.
    pub pulse: HalfMicros,
    /// The pulse width that has the tool out, for an emergency in which nobody can be asked.
    pub pulse_out: HalfMicros,
    /// The shortest gap between servo pulses in milliseconds; 0 for fixed frames.
    pub gap_ms: u8,
}

/// Distances that follow from the settings, in ticks of the present wheel.
#[derive(Clone, Copy, Debug)]
struct Geometry {
    beam_to_tool: Ticks,
    margin: Ticks,
    max_width: Ticks,
    merge_gap: Ticks,
    /// As ticks a second.
    top_speed: Ticks,
    /// Zero for none.
    no_plant: Ticks,
}

/// Distances rolled at the present speed while something answers; negative when rolling backwards.
#[derive(Clone, Copy, Debug, Default)]
struct Leads {
    /// While the tool swings out.
    out: Ticks,
    /// Before the tool begins to come back: never longer than `out`.
    back: Ticks,
    /// While the beam's sensor answers.
    response: Ticks,
}

/// A command that the present state does not allow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// An alarm is latched.
    AlarmLatched,
    /// The setting changes where the tool is, or is to be saved, and the machine is at work.
    NotInHold,
    /// The value lies outside the setting's range.
    OutOfRange,
    /// The settings would contradict each other.
    Contradiction(Contradiction),
    /// There is no object to label yet, or the last one has its label.
    NothingToLabel,
    /// All places for examples are taken.
    ExamplesFull,
    /// No example from the field has this number.
    NoSuchExample,
    /// No settings are saved that could be taken back.
    NothingSaved,
    /// What was rolled tells nothing of the wheel.
    Unfit(Unfit),
    /// A row is not played at such a speed.
    TestSpeed {
        /// The highest speed at which it is, in mm/s.
        fastest: u16,
    },
}

words! {
    /// Why the tool is out of the row while the machine works.
    pub enum Reason {
        /// A plant is there, or comes up.
        Plant = "plant",
        /// The beam has not seen the ground.
        UnseenGround = "unseen_ground",
        /// A plant just behind the beam would be reached before the tool is out.
        TooFast = "too_fast",
        /// The beam broke and the encoder says that the machine stands.
        EncoderDoubtful = "encoder_doubtful",
    }
}

/// An object as it was judged: what its features follow from, in less room than they take.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Judged {
    speed_class_mm_s: i16,
    spacing_mm: i16,
    width_mm: i16,
    /// What it was taken for.
    pub vote: Vote,
    /// What the operator said that it is, one of [`label`](crate::classifier::label).
    pub label: Option<u8>,
}

impl Judged {
    /// Its features.
    pub fn features(&self) -> Features {
        Features::describe(self.speed_class_mm_s, self.spacing_mm, self.width_mm)
    }
}

/// The machine's decisions and all that they rest on.
#[derive(Clone, Debug)]
pub struct Controller<C, M> {
    classifier: C,
    settings: Settings,
    saved: SavedSettings<M>,
    geometry: Geometry,
    leads: Leads,
    cause: Cause,
    readings: Readings,
    switch: Switch,
    end_switch: Switch,
    encoder: EncoderMonitor,
    beam: BeamMonitor,
    beam_broken: bool,
    bench: Bench,
    distance: Distance,
    meter: SpeedMeter,
    watch: Watch,
    schedule: Schedule,
    state: State,
    tool_out: bool,
    /// When the tool was last told to swing.
    told_at: Instant,
    /// Whether the ground for which the tool was told to leave the row is yet to come.
    awaits_ground: bool,
    /// Times that it came sooner than the tool could be out.
    late: u16,
    /// Lines that were not understood, or came with a hole in them.
    mistakes: u16,
    /// Where the last object ended, or work began, and whether the operator was warned since.
    last_seen: Position,
    warned: bool,
    /// The last plant's leading edge, or where watching began.
    last_plant: Position,
    /// The last objects, the oldest first.
    objects: Vec<Judged, OBJECTS>,
    events: Vec<Event, EVENTS>,
    events_on: bool,
    events_missed: u16,
    plot: Plot,
    plotted_at: Coarse,
}

impl<C: Classifier, M: Memory> Controller<C, M> {
    /// A controller for a machine that just woke up: in HOLD, with the tool out, and with no ground known. Where the memory
    /// holds no settings, or some that cannot be right, that is an alarm.
    pub fn new(classifier: C, memory: M, wake_up: WakeUp) -> Self {
        let WakeUp { readings, beam_broken, cause } = wake_up;
        let Readings { now, position, jumps, .. } = readings;
        let mut saved = SavedSettings::new(memory);
        let loaded = saved.load();
        let fault = match &loaded {
            None => Some(Alarm::SettingsLost),
            Some(settings) => settings.contradiction().map(|_| Alarm::SettingsContradict),
        };
        let settings = loaded.unwrap_or_default();
        Self {
            classifier,
            geometry: Geometry::of(&settings),
            settings,
            saved,
            leads: Leads::default(),
            cause,
            readings,
            switch: Switch::new(readings.switch_on),
            end_switch: Switch::new(readings.end_switch_on),
            encoder: EncoderMonitor::new(now, position, jumps),
            beam: BeamMonitor::new(now),
            beam_broken,
            bench: Bench::Idle,
            distance: Distance::default(),
            meter: SpeedMeter::new(position, now),
            watch: Watch::start(position, beam_broken),
            schedule: Schedule::new(position),
            state: fault.map_or(State::Hold, State::Alarm),
            tool_out: true,
            told_at: now,
            awaits_ground: false,
            late: 0,
            mistakes: 0,
            last_seen: position,
            warned: false,
            last_plant: position,
            objects: Vec::new(),
            events: Vec::new(),
            events_on: false,
            events_missed: 0,
            plot: Plot::Off,
            plotted_at: now.coarse(),
        }
    }

    /// Takes an edge of the beam, with the position at which it came.
    pub fn beam_edge(&mut self, position: Position, broken: bool) {
        self.beam_broken = broken;
        if !matches!(self.bench, Bench::Row(_)) {
            self.take_edge(position, broken);
        }
    }

    fn take_edge(&mut self, position: Position, broken: bool) {
        let now = self.readings.now;
        if let Some(alarm) = self.beam.edge(now) {
            self.raise(alarm);
        }
        if broken
            && self.is_working()
            && let Some(alarm) = self.encoder.beam_broke()
        {
            self.raise(alarm);
        }
        let ground = position - self.leads.response;
        if let Some(object) = self.watch.edge(ground, broken, self.geometry.merge_gap) {
            self.judge(object);
        }
    }

    /// Edges of the beam were lost: what stood there is not known, and neither is the beam's level, which is now `broken`.
    pub fn beam_edges_lost(&mut self, broken: bool) {
        self.watch = Watch::start(self.watch.frontier(), broken);
        self.raise(Alarm::BeamEdgesLost);
    }

    /// Takes the machine's readings and decides where the tool is to be.
    #[inline(never)]
    pub fn step(&mut self, readings: Readings) -> Orders {
        let tool_was_at = self.tool();
        let readings = self.try_on(readings);
        self.readings = readings;
        if let Some(speed) = self.meter.read(readings.now, readings.position) {
            self.leads = Leads::at(speed, &self.settings);
        }
        match self.switch.read(readings.now, readings.switch_on) {
            // An alarm wants to be cleared first, if by nothing else then by the switch going off.
            Some(true) if matches!(self.state, State::Hold) => self.go_to_work(),
            Some(false) => self.enter(State::Hold),
            _ => {}
        }
        let ground = readings.position - self.leads.response;
        if let Some(object) = self.watch.roll_to(ground, self.geometry.merge_gap) {
            self.judge(object);
        }
        if let Some(alarm) = self.fault(tool_was_at) {
            self.raise(alarm);
        }
        let tool = self.tool();
        self.schedule.forget_behind(tool);
        let out = match &self.bench {
            Bench::Swings(swings) => swings.tool_out(),
            _ => !self.is_working() || self.must_be_out(tool),
        };
        if out != self.tool_out {
            self.tool_out = out;
            self.told_at = readings.now;
            self.awaits_ground = out && self.is_working();
            self.tell(Event::Swing { out, position: readings.position });
        }
        self.warn(tool);
        self.orders()
    }

    /// What the machine is to do as of the last step.
    pub fn orders(&self) -> Orders {
        let pulse = if self.tool_out { Setting::ServoOutUs } else { Setting::ServoInUs };
        let pulse_of = |setting| servo::from_us(self.settings.get(setting));
        Orders {
            pulse: if let Bench::ByHand(pulse) = self.bench { pulse } else { pulse_of(pulse) },
            pulse_out: pulse_of(Setting::ServoOutUs),
            gap_ms: self.settings.get(Setting::ServoGapMs) as u8,
        }
    }

    /// Goes to work; with `now`, at once and over ground that the beam has not seen.
    ///
    /// # Errors
    /// [`Refusal::AlarmLatched`] while an alarm is.
    pub fn start(&mut self, now: bool) -> Result<(), Refusal> {
        if let State::Alarm(_) = self.state {
            return Err(Refusal::AlarmLatched);
        }
        if let Some(contradiction) = self.settings.contradiction() {
            return Err(Refusal::Contradiction(contradiction));
        }
        if now {
            // A margin behind the tool as well, so that it does not stand on the border of what is known.
            self.schedule.trust_from(self.tool() - self.geometry.margin);
        }
        self.go_to_work();
        Ok(())
    }

    /// Takes the tool out of the row. A latched alarm stays.
    pub fn hold(&mut self) {
        if !matches!(self.state, State::Alarm(_)) {
            self.enter(State::Hold);
        }
    }

    /// Clears an alarm; the machine is in HOLD afterwards.
    pub fn clear(&mut self) {
        if let State::Alarm(_) = self.state {
            self.enter(State::Hold);
        }
    }

    /// Sets a setting.
    ///
    /// # Errors
    /// [`Refusal::NotInHold`], [`Refusal::OutOfRange`], and [`Refusal::Contradiction`] where there was none before; nothing
    /// is changed then.
    pub fn set(&mut self, setting: Setting, value: u16) -> Result<(), Refusal> {
        if setting.description().hold_only && self.is_working() {
            return Err(Refusal::NotInHold);
        }
        let before = self.settings.get(setting);
        // Settings that contradict each other already are mended one at a time.
        let contradicted = self.settings.contradiction().is_some();
        self.settings.set(setting, value).map_err(|_| Refusal::OutOfRange)?;
        if !contradicted && let Some(contradiction) = self.settings.contradiction() {
            // What was set before is within its range.
            let _ = self.settings.set(setting, before);
            return Err(Refusal::Contradiction(contradiction));
        }
        // Another wheel is one that has not been measured.
        if matches!(setting, Setting::WheelMm | Setting::TicksPerRev) {
            let _ = self.settings.set(Setting::TicksPerM, 0);
        }
        self.follow_settings();
        Ok(())
    }

    /// Takes all settings back that a new machine has; [`save`](Self::save) makes it last.
    ///
    /// # Errors
    /// [`Refusal::NotInHold`].
    pub fn take_defaults(&mut self) -> Result<(), Refusal> {
        if self.is_working() {
            return Err(Refusal::NotInHold);
        }
        self.settings = Settings::new();
        self.follow_settings();
        Ok(())
    }

    /// Takes all settings back that are saved.
    ///
    /// # Errors
    /// [`Refusal::NotInHold`] and [`Refusal::NothingSaved`].
    pub fn take_saved(&mut self) -> Result<(), Refusal> {
        if self.is_working() {
            return Err(Refusal::NotInHold);
        }
        self.settings = self.saved.load().ok_or(Refusal::NothingSaved)?;
        self.follow_settings();
        Ok(())
    }

    /// Works out what follows from the settings.
    fn follow_settings(&mut self) {
        self.geometry = Geometry::of(&self.settings);
        self.leads = Leads::at(self.meter.speed(), &self.settings);
    }

    /// The value of a setting that is saved, if any is.
    pub fn saved(&self, setting: Setting) -> Option<u16> {
        self.saved.value(setting)
    }

    /// Begins to save the settings, which [`carry_on`](Self::carry_on) finishes.
    ///
    /// # Errors
    /// [`Refusal::NotInHold`] and [`Refusal::Contradiction`].
    pub fn save(&mut self) -> Result<(), Refusal> {
        if self.is_working() {
            return Err(Refusal::NotInHold);
        }
        if let Some(contradiction) = self.settings.contradiction() {
            return Err(Refusal::Contradiction(contradiction));
        }
        self.saved.save();
        Ok(())
    }

    /// Carries on with what is being kept for good, settings and examples, without waiting; whether all has been written.
    pub fn carry_on(&mut self) -> bool {
        self.saved.carry_on(&self.settings) && self.classifier.carry_on()
    }

    /// Labels the last object and teaches it to the classifier.
    ///
    /// # Errors
    /// [`Refusal::NothingToLabel`] and [`Refusal::ExamplesFull`].
    pub fn label(&mut self, label: u8) -> Result<(), Refusal> {
        let unlabelled = self.objects.last_mut().filter(|object| object.label.is_none());
        let object = unlabelled.ok_or(Refusal::NothingToLabel)?;
        self.classifier.teach(&object.features(), label).map_err(|Full| Refusal::ExamplesFull)?;
        object.label = Some(label);
        Ok(())
    }

    /// Forgets an example from the field.
    ///
    /// # Errors
    /// [`Refusal::NoSuchExample`].
    pub fn forget(&mut self, number: u8) -> Result<(), Refusal> {
        if self.classifier.forget(number) { Ok(()) } else { Err(Refusal::NoSuchExample) }
    }

    /// Forgets all examples from the field.
    pub fn forget_all(&mut self) {
        for number in 0..taught::CAPACITY {
            self.classifier.forget(number);
        }
    }

    /// The last objects, the oldest first.
    pub fn objects(&self) -> &[Judged] {
        &self.objects
    }

    /// What tells plants from weeds.
    pub fn classifier(&self) -> &C {
        &self.classifier
    }

    /// The settings in use.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// What the machine is doing.
    pub fn state(&self) -> State {
        self.state
    }

    /// Why the machine was reset.
    pub fn cause(&self) -> Cause {
        self.cause
    }

    /// Whether the tool is to be out of the row.
    pub fn tool_out(&self) -> bool {
        self.tool_out
    }

    /// The last readings.
    pub fn readings(&self) -> &Readings {
        &self.readings
    }

    /// The machine's speed in millimetres a second, negative backwards.
    pub fn speed_mm_s(&self) -> i16 {
        self.settings.wheel().millimetres(Ticks(self.meter.speed().0))
    }

    /// Windows at the tool or ahead of it, the one still being seen included.
    pub fn windows(&self) -> u8 {
        self.schedule.ahead(self.tool(), self.geometry.margin) + u8::from(self.watch.open().is_some())
    }

    /// How far the machine has to roll until ground that the beam has seen reaches the tool, in millimetres.
    pub fn unseen_mm(&self) -> i16 {
        let unseen = self.schedule.known_from() - self.tool();
        self.settings.wheel().millimetres(unseen.max(Ticks::ZERO))
    }

    /// Why the tool is out of the row although the machine works.
    pub fn reason(&self) -> Option<Reason> {
        let tool = self.tool();
        if !self.is_working() || !self.tool_out {
            None
        } else if self.encoder.is_doubtful() || self.encoder.is_quiet() {
            Some(Reason::EncoderDoubtful)
        } else if self.schedule.known_from().is_ahead_of(tool) {
            Some(Reason::UnseenGround)
        } else if self.outruns_the_beam(tool) {
            Some(Reason::TooFast)
        } else {
            Some(Reason::Plant)
        }
    }

    /// Times that closed ground reached the tool sooner than it could be out.
    pub fn late(&self) -> u16 {
        self.late
    }

    /// Lines that were not understood.
    pub fn mistakes(&self) -> u16 {
        self.mistakes
    }

    /// Counts a line that was not understood.
    pub fn count_mistake(&mut self) {
        self.mistakes = self.mistakes.saturating_add(1);
    }

    /// Whether the machine has worked for a long way without seeing a plant.
    pub fn sees_no_plants(&self) -> bool {
        self.warned
    }

    /// Turns the telling of events on or off.
    pub fn tell_events(&mut self, on: bool) {
        self.events_on = on;
        self.events.clear();
    }

    /// Draws curves for a plotter, or no longer.
    pub fn set_plot(&mut self, plot: Plot) {
        self.plot = plot;
    }

    /// The curves of which the next points are due, which are due 20 times a second.
    pub fn next_plot(&mut self) -> Option<Plot> {
        if self.plot == Plot::Off || self.readings.now.coarse().since(self.plotted_at) < PLOT_PERIOD {
            return None;
        }
        self.plotted_at = self.readings.now.coarse();
        Some(self.plot)
    }

    /// Whether the beam is broken.
    pub fn beam_is_broken(&self) -> bool {
        self.beam_broken
    }

    /// Whether the status LED shines: while the servo is being timed, it marks the commands.
    pub fn lamp_is_lit(&self) -> bool {
        match self.bench {
            Bench::Swings(_) => self.tool_out,
            _ => lamp::is_lit(self.state, self.readings.now),
        }
    }

    /// The next event to be told.
    #[inline(never)]
    pub fn next_event(&mut self) -> Option<Event> {
        (!self.events.is_empty()).then(|| self.events.remove(0))
    }

    /// Events that found no room to wait in.
    pub fn events_missed(&self) -> u16 {
        self.events_missed
    }

    /// The ground that the tool works on.
    fn tool(&self) -> Position {
        self.readings.position - self.geometry.beam_to_tool
    }

    /// Whether closed ground comes up before the tool could be out of the row, or in its place again.
    fn must_be_out(&self, tool: Position) -> bool {
        let Leads { out, back, .. } = self.leads;
        let one = Ticks(if out < Ticks::ZERO { -1 } else { 1 });
        // The stretch of ground that must be open for the tool to be in the row when this decision shows.
        let (near, far) = if self.tool_out {
            // Coming back pays only if the tool can stay for as long as its stroke takes, the difference of the leads.
            // That also keeps it out for the window that it left for, should the speed falter. The tick on either side
            // is for an encoder that trembles on an edge.
            (back - one, out + (out - back) + one)
        } else {
            // A window once left stays left while the measured speed wavers by less than a quarter.
            (back + Ticks(back.0 / 4), out)
        };
        self.encoder.is_doubtful()
            || self.tool_out && self.encoder.is_quiet()
            || self.is_closed(tool + near, tool + far)
            || self.outruns_the_beam(tool)
    }

    /// Whether the machine is so fast that a plant just behind the beam would be reached before the tool is out.
    fn outruns_the_beam(&self, tool: Position) -> bool {
        let out = self.leads.out;
        // Slowing down by an eighth is what it takes to be trusted again.
        let lead = if self.tool_out { out + Ticks(out.0 / 8) } else { out };
        (tool + lead) - self.watch.frontier() >= -self.geometry.margin
    }

    /// The fault that the readings show, if any; the tool was at `tool_was_at` before them.
    #[inline(never)]
    fn fault(&mut self, tool_was_at: Position) -> Option<Alarm> {
        let Readings { now, position, jumps, end_switch_on, stack_free, .. } = self.readings;
        let working = self.is_working();
        match self.encoder.read(now, position, jumps) {
            // A machine at rest may tremble.
            Some(Alarm::EncoderChannelDead) if !working => {}
            None => {}
            fault => return fault,
        }
        if let Some(leading) = self.watch.open()
            && self.watch.is_broken()
            && self.watch.frontier() - leading > self.geometry.max_width
        {
            return Some(Alarm::BeamBlocked);
        }
        if working && Ticks(self.meter.speed().0.abs()) > self.geometry.top_speed {
            return Some(Alarm::TooFast);
        }
        let forgotten = |tool| self.schedule.has_forgotten() && self.schedule.known_from().is_ahead_of(tool);
        if working && forgotten(self.tool()) && !forgotten(tool_was_at) {
            return Some(Alarm::RolledBackTooFar);
        }
        self.end_switch.read(now, end_switch_on);
        let swing = Interval::from_ms(u32::from(self.settings.get(Setting::LeadOutMs)) + END_SWITCH_GRACE_MS);
        if self.settings.get(Setting::EndSwitch) != 0
            && !self.bench.moves_the_tool()
            && self.end_switch.is_on() != self.tool_out
            && now - self.told_at > swing
        {
            return Some(Alarm::ToolStuck);
        }
        (stack_free < STACK_RESERVE).then_some(Alarm::StackLow)
    }

    /// Tells what the operator should know, once.
    fn warn(&mut self, tool: Position) {
        if !self.is_working() {
            return;
        }
        if self.awaits_ground && self.is_closed(tool, tool) {
            self.awaits_ground = false;
            // An eighth of the lead is what the speed may waver by.
            let lead_ms = u32::from(self.settings.get(Setting::LeadOutMs));
            if self.readings.now - self.told_at < Interval::from_ms(lead_ms - lead_ms / 8) {
                self.late = self.late.saturating_add(1);
                self.tell(Event::Warning(Warning::LateCommand));
            }
        }
        let no_plant = self.geometry.no_plant;
        if !self.warned && no_plant > Ticks::ZERO && self.watch.frontier() - self.last_seen > no_plant {
            self.warned = true;
            self.tell(Event::Warning(Warning::NoPlants));
        }
    }

    /// Whether any of the ground between two places is closed: unknown, or within the margin of a canopy, the one that is
    /// still being seen included.
    fn is_closed(&self, one: Position, other: Position) -> bool {
        let margin = self.geometry.margin;
        let far = if one.is_ahead_of(other) { one } else { other };
        self.schedule.is_closed(one, other, margin) || self.watch.open().is_some_and(|leading| far - leading >= -margin)
    }

    /// Classifies a complete object and schedules it unless it is a weed.
    fn judge(&mut self, object: Object) {
        (self.last_seen, self.warned) = (object.trailing, false);
        let wheel = self.settings.wheel();
        let spacing = object.leading - self.last_plant;
        let speed_class_mm_s = features::speed_class(self.speed_mm_s());
        let (spacing_mm, width_mm) = (wheel.millimetres(spacing), wheel.millimetres(object.width()));
        let features = Features::describe(speed_class_mm_s, spacing_mm, width_mm);
        // What is left of an object whose beginning was not seen may be as narrow as a weed.
        let vote = if object.cut {
            Vote { class: Class::Unknown, votes: 0 }
        } else {
            self.classifier.classify(&features, self.settings.get(Setting::K) as u8)
        };
        let (distance_mm, margin_mm) = (self.settings.get(Setting::BeamToToolMm), self.settings.get(Setting::MarginMm));
        let plan = Plan::new(wheel, distance_mm, margin_mm, object.width());
        if self.objects.is_full() {
            self.objects.remove(0);
        }
        // There is room, as was just seen to.
        let _ = self.objects.push(Judged { speed_class_mm_s, spacing_mm, width_mm, vote, label: None });
        self.tell(Event::Object { vote, leading: object.leading, spacing, plan });
        if vote.class == Class::Weed {
            return;
        }
        self.last_plant = object.leading;
        if self.schedule.push(object, self.tool(), self.geometry.margin).is_err() {
            self.raise(Alarm::ScheduleFull);
        }
    }

    /// Latches an alarm. The schedule can no longer be trusted: all ground behind the beam becomes unknown.
    fn raise(&mut self, alarm: Alarm) {
        let frontier = self.watch.frontier();
        self.watch = Watch::start(frontier, self.watch.is_broken());
        self.schedule = Schedule::new(frontier);
        if let State::Alarm(_) = self.state {
            return;
        }
        self.tell(Event::Alarm { alarm, position: self.readings.position });
        self.enter(State::Alarm(alarm));
    }

    fn is_working(&self) -> bool {
        matches!(self.state, State::Work)
    }

    fn go_to_work(&mut self) {
        if self.settings.contradiction().is_some() {
            self.raise(Alarm::SettingsContradict);
            return;
        }
        (self.last_seen, self.warned) = (self.watch.frontier(), false);
        self.enter(State::Work);
    }

    fn enter(&mut self, state: State) {
        // What moves the tool by hand ends by `hold` as well, and by the switch going off.
        self.bench.interrupted(state);
        if state != self.state {
            self.state = state;
            self.tell(Event::State(state));
        }
    }

    fn tell(&mut self, event: Event) {
        if self.events_on {
            self.announce(event);
        }
    }

    /// Tells an event that the operator waits for, whether or not events are told.
    fn announce(&mut self, event: Event) {
        if self.events.push(event).is_err() {
            self.events_missed = self.events_missed.saturating_add(1);
        }
    }
}

impl Geometry {
    fn of(settings: &Settings) -> Self {
        Self {
            beam_to_tool: settings.ticks(Setting::BeamToToolMm),
            margin: settings.ticks(Setting::MarginMm),
            max_width: settings.ticks(Setting::MaxWidthMm),
            merge_gap: Ticks(i32::from(settings.get(Setting::MergeGapTicks))),
            top_speed: settings.ticks(Setting::TopSpeedMmS),
            no_plant: Ticks(settings.wheel().ticks(1000).0 * i32::from(settings.get(Setting::NoPlantM))),
        }
    }
}

impl Leads {
    fn at(speed: TicksPerSecond, settings: &Settings) -> Self {
        let out_ms = settings.get(Setting::LeadOutMs);
        // A lead is longer by what a command takes to the pin in the mean: half a tick, half a turn of the loop, half a pulse.
        // Without a lead the paper's schedule stands as it is.
        let lead = |milliseconds: u16| speed.distance_in_ms(milliseconds + u16::from(milliseconds > 0));
        Self {
            out: lead(out_ms),
            back: lead(settings.get(Setting::LeadInMs).min(out_ms)),
            response: speed.distance_in_ms(settings.get(Setting::BeamResponseMs)),
        }
    }
}
