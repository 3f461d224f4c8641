//! The front door: edges, readings and commands go in, the tool's place and the lamp come out.
//!
//! One [`Controller::step`] a turn of the main loop: measure the speed, roll the watched ground on, ask the schedule
//! whether the tool may be in the row. Beam edges come before the step that has rolled past them. Nothing in here waits,
//! and nothing remembers a time at which something ought to happen: the answer is worked out anew each time, from where
//! the machine is and how fast it rolls.

use crate::{
    alarm::Alarm,
    classifier::{Class, Classifier, Full, Vote},
    event::Event,
    features::{self, Features},
    object::{Object, Watch},
    schedule::{Plan, Schedule},
    servo::{self, HalfMicros},
    settings::{Setting, Settings},
    speed::SpeedMeter,
    switch::Switch,
    taught,
    units::{Instant, Position, Ticks, TicksPerSecond},
};
use heapless::Vec;

/// Objects remembered, so that they can be looked at and labelled.
const OBJECTS: usize = 16;

/// Events that wait to be told. They are short-lived: a plant gives three in half a second.
const EVENTS: usize = 6;

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
    /// Encoder ticks known to be lost since power-up.
    pub lost: u16,
}

/// What the machine is to do after a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Orders {
    /// The servo's pulse width.
    pub pulse: HalfMicros,
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
    /// The setting changes where the tool is, and the machine is at work.
    NotInHold,
    /// The value lies outside the setting's range.
    OutOfRange,
    /// There is no object to label yet, or the last one has its label.
    NothingToLabel,
    /// All places for examples are taken.
    ExamplesFull,
    /// No example from the field has this number.
    NoSuchExample,
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
pub struct Controller<C> {
    classifier: C,
    settings: Settings,
    geometry: Geometry,
    leads: Leads,
    readings: Readings,
    switch: Switch,
    meter: SpeedMeter,
    watch: Watch,
    schedule: Schedule,
    state: State,
    tool_out: bool,
    /// The last plant's leading edge, or where watching began.
    last_plant: Position,
    /// The last objects, the oldest first.
    objects: Vec<Judged, OBJECTS>,
    events: Vec<Event, EVENTS>,
    events_on: bool,
    events_missed: u16,
}

impl<C: Classifier> Controller<C> {
    /// A controller for a machine that just woke up: in HOLD, with the tool out, and with no ground known.
    pub fn new(classifier: C, readings: Readings, beam_broken: bool) -> Self {
        let settings = Settings::new();
        Self {
            classifier,
            geometry: Geometry::of(&settings),
            settings,
            leads: Leads::default(),
            readings,
            switch: Switch::new(readings.switch_on),
            meter: SpeedMeter::new(readings.position, readings.now),
            watch: Watch::start(readings.position, beam_broken),
            schedule: Schedule::new(readings.position),
            state: State::Hold,
            tool_out: true,
            last_plant: readings.position,
            objects: Vec::new(),
            events: Vec::new(),
            events_on: false,
            events_missed: 0,
        }
    }

    /// Takes an edge of the beam, with the position at which it came.
    pub fn beam_edge(&mut self, position: Position, broken: bool) {
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
        self.readings = readings;
        if let Some(speed) = self.meter.read(readings.now, readings.position) {
            self.leads = Leads::at(speed, &self.settings);
        }
        match self.switch.read(readings.now, readings.switch_on) {
            // An alarm wants to be cleared first, if by nothing else then by the switch going off.
            Some(true) if self.state == State::Hold => self.enter(State::Work),
            Some(false) => self.enter(State::Hold),
            _ => {}
        }
        let ground = readings.position - self.leads.response;
        if let Some(object) = self.watch.roll_to(ground, self.geometry.merge_gap) {
            self.judge(object);
        }
        if let Some(leading) = self.watch.open()
            && self.watch.is_broken()
            && self.watch.frontier() - leading > self.geometry.max_width
        {
            self.raise(Alarm::BeamBlocked);
        }
        let tool = self.tool();
        self.schedule.forget_behind(tool);
        let out = self.state != State::Work || self.must_be_out(tool);
        if out != self.tool_out {
            self.tool_out = out;
            self.tell(Event::Swing { out, position: readings.position });
        }
        let pulse = if out { Setting::ServoOutUs } else { Setting::ServoInUs };
        Orders { pulse: servo::from_us(self.settings.get(pulse)), gap_ms: self.settings.get(Setting::ServoGapMs) as u8 }
    }

    /// Goes to work; with `now`, at once and over ground that the beam has not seen.
    ///
    /// # Errors
    /// [`Refusal::AlarmLatched`] while an alarm is.
    pub fn start(&mut self, now: bool) -> Result<(), Refusal> {
        if let State::Alarm(_) = self.state {
            return Err(Refusal::AlarmLatched);
        }
        if now {
            // A margin behind the tool as well, so that it does not stand on the border of what is known.
            self.schedule.trust_from(self.tool() - self.geometry.margin);
        }
        self.enter(State::Work);
        Ok(())
    }

    /// Takes the tool out of the row. A latched alarm stays.
    pub fn hold(&mut self) {
        if self.state == State::Work {
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
    /// [`Refusal::NotInHold`] and [`Refusal::OutOfRange`]; nothing is changed then.
    pub fn set(&mut self, setting: Setting, value: u16) -> Result<(), Refusal> {
        if setting.description().hold_only && self.state == State::Work {
            return Err(Refusal::NotInHold);
        }
        self.settings.set(setting, value).map_err(|_| Refusal::OutOfRange)?;
        self.geometry = Geometry::of(&self.settings);
        self.leads = Leads::at(self.meter.speed(), &self.settings);
        Ok(())
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

    /// What tells plants from weeds, to carry on with what it writes.
    pub fn classifier_mut(&mut self) -> &mut C {
        &mut self.classifier
    }

    /// The settings in use.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// What the machine is doing.
    pub fn state(&self) -> State {
        self.state
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

    /// Turns the telling of events on or off.
    pub fn tell_events(&mut self, on: bool) {
        self.events_on = on;
        self.events.clear();
    }

    /// The next event to be told.
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
        let margin = self.geometry.margin;
        self.schedule.is_closed(tool + near, tool + far, margin)
            || self.watch.open().is_some_and(|leading| (tool + far.max(near)) - leading >= -margin)
            || self.outruns_the_beam(tool)
    }

    /// Whether the machine is so fast that a plant just behind the beam would be reached before the tool is out.
    fn outruns_the_beam(&self, tool: Position) -> bool {
        let out = self.leads.out;
        // Slowing down by an eighth is what it takes to be trusted again.
        let lead = if self.tool_out { out + Ticks(out.0 / 8) } else { out };
        (tool + lead) - self.watch.frontier() >= -self.geometry.margin
    }

    /// Classifies a complete object and schedules it unless it is a weed.
    fn judge(&mut self, object: Object) {
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

    fn enter(&mut self, state: State) {
        if state != self.state {
            self.state = state;
            self.tell(Event::State(state));
        }
    }

    fn tell(&mut self, event: Event) {
        if self.events_on && self.events.push(event).is_err() {
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
        }
    }
}

impl Leads {
    fn at(speed: TicksPerSecond, settings: &Settings) -> Self {
        let out_ms = settings.get(Setting::LeadOutMs);
        Self {
            out: speed.distance_in_ms(out_ms),
            back: speed.distance_in_ms(settings.get(Setting::LeadInMs).min(out_ms)),
            response: speed.distance_in_ms(settings.get(Setting::BeamResponseMs)),
        }
    }
}
