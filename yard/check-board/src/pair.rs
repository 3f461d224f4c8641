//! Two virtual Unos that replace the boards, wired to each other.
//!
//! Both run in lock step, [`STEP`] cycles at a time. The tester's clock is the reference. The weeder's clock is faster
//! or slower by a known share. An edge from the tester reaches the weeder at its cycle. An edge from the weeder reaches
//! the tester always [`STEP`] cycles late, so widths and distances are right. Tests of the check use a wrong [`Wiring`]
//! on purpose.

use crate::plan::INPUTS;
use crate::second::SecondUno;
use anyhow::Result;
use either::{
    Either::{self, Left, Right},
    for_both,
};
use field::wiring;
use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use tester_core::pins::Line;
use uno::{CYCLES_PER_SECOND, Pin, PinChange, Uno};

/// Cycles between two checks of the wires: 1 us.
pub const STEP: u64 = 16;

/// Steps between two checks of the reset, which is pulled for milliseconds.
const STEPS_TO_RESET: u64 = 64;

/// The difference of the clocks in parts per million: the weeder's is faster by 0.3 %.
pub const CLOCK_PPM: i64 = 3000;

/// The tester's pins, as in `yard/tester/src/lines.rs`. Those of its lines are in the order of [`Line::ALL`].
const TESTER_LINES: [Pin; 6] = [Pin::A0, Pin::A1, Pin::A2, Pin::A3, Pin::A4, Pin::A5];
const TESTER_RESET: Pin = Pin::D7;
const TESTER_LED: Pin = Pin::D6;
const TESTER_SERVO: Pin = Pin::D8;

/// A line from the tester, the weeder's pin at its other end, and whether it is inverted.
pub type InputWire = (Line, Pin, bool);

/// Changes an edge from the weeder: returns the new edge, or `None` if it is lost. Cycles are the tester's.
pub type Edge = Box<dyn FnMut(PinChange) -> Option<PinChange>>;

/// Changes the content of an EEPROM.
pub type Spoil = Box<dyn FnMut(&mut [u8])>;

/// The wires, right or wrong.
pub struct Wiring {
    /// The lines from the tester.
    pub inputs: Vec<InputWire>,
    /// Whether the reset is wired.
    pub has_reset: bool,
    /// Whether the servo's and the LED's lines are.
    pub outputs: Vec<Pin>,
    /// How much faster the weeder's clock is, in parts per million.
    pub clock_ppm: i64,
    /// Changes the edges from the weeder.
    pub from_weeder: Edge,
    /// Changes the edges to the weeder. Cycles are the tester's.
    pub to_weeder: Edge,
    /// Changes the weeder's EEPROM when its reset is pulled. The weeder then starts as at power-up.
    pub eeprom_at_reset: Option<Spoil>,
}

impl Wiring {
    /// The correct wiring.
    pub fn right() -> Self {
        Self {
            inputs: INPUTS.map(|(line, pin)| (line, pin, false)).to_vec(),
            has_reset: true,
            outputs: vec![wiring::SERVO, wiring::LED],
            clock_ppm: CLOCK_PPM,
            from_weeder: Box::new(Some),
            to_weeder: Box::new(Some),
            eeprom_at_reset: None,
        }
    }
}

/// The weeder's virtual Uno, of this project's simulator or of another one.
type WeederUno = Either<Uno, SecondUno>;

/// The two boards. Its methods fail if one of them stops.
pub struct Pair {
    tester: Uno,
    weeder: WeederUno,
    weeder_elf: PathBuf,
    wiring: Wiring,
    /// The tester's and the weeder's cycle at the last moment that both share.
    shared: (u64, u64),
    steps: u64,
    is_reset_pulled: bool,
    resets: u32,
    from_tester: VecDeque<u8>,
    from_weeder: VecDeque<u8>,
}

impl Pair {
    /// Powers both up, with an erased EEPROM. `second` is the program of another simulator that runs the weeder.
    ///
    /// # Errors
    /// If an ELF cannot be run, or the other simulator.
    pub fn power_up(tester: &Path, weeder_elf: &Path, second: Option<&Path>, wiring: Wiring) -> Result<Self> {
        let tester = Uno::boot(tester)?;
        let weeder = match second {
            Some(program) => Right(SecondUno::power_up(program, weeder_elf)?),
            None => Left(Uno::boot(weeder_elf)?.wired(&wiring::WIRES)),
        };
        Ok(Self {
            shared: (tester.cycle(), for_both!(&weeder, uno => uno.cycle())),
            tester,
            weeder,
            weeder_elf: weeder_elf.to_owned(),
            wiring,
            steps: 0,
            is_reset_pulled: false,
            resets: 0,
            from_tester: VecDeque::new(),
            from_weeder: VecDeque::new(),
        })
    }

    fn cycles(&self) -> (u64, u64) {
        (self.tester.cycle(), for_both!(&self.weeder, uno => uno.cycle()))
    }

    fn weeder_cycle(&self, tester_cycle: u64) -> u64 {
        let since = tester_cycle.saturating_sub(self.shared.0) as i64;
        self.shared.1 + (since + since * self.wiring.clock_ppm / 1_000_000) as u64
    }

    fn tester_cycle(&self, weeder_cycle: u64) -> u64 {
        let since = weeder_cycle.saturating_sub(self.shared.1) as i64;
        self.shared.0 + (since * 1_000_000 / (1_000_000 + self.wiring.clock_ppm)) as u64
    }

    /// Lets the tester's clock run by this number of cycles, and the weeder's for the same time.
    pub fn run_for(&mut self, cycles: u64) -> Result<()> {
        let end = self.tester.cycle() + cycles;
        while self.tester.cycle() < end {
            self.step()?;
        }
        self.from_tester.extend(self.tester.received_bytes().into_iter().map(|received| received.byte));
        self.from_weeder.extend(match &mut self.weeder {
            Left(uno) => uno.received_bytes().into_iter().map(|received| received.byte).collect(),
            Right(uno) => uno.received(),
        });
        Ok(())
    }

    fn step(&mut self) -> Result<()> {
        let until = self.tester.cycle() + STEP;
        self.tester.run_until(until)?;
        for change in self.tester.take_changes() {
            self.carry_to_weeder(change);
        }
        if self.steps.is_multiple_of(STEPS_TO_RESET) {
            self.check_reset()?;
        }
        self.steps += 1;
        if self.is_reset_pulled {
            return Ok(());
        }
        let until = self.weeder_cycle(until);
        for_both!(&mut self.weeder, uno => uno.run_until(until)?);
        self.carry_to_tester();
        Ok(())
    }

    /// While the reset is pulled, the weeder's clock stands still, and both are counted from there on.
    fn check_reset(&mut self) -> Result<()> {
        if self.is_reset_pulled {
            self.shared = self.cycles();
        }
        let pulled = self.wiring.has_reset && self.tester.output(TESTER_RESET) == Some(false);
        if pulled && !self.is_reset_pulled {
            self.resets += 1;
            if let (Some(corrupt), Left(weeder)) = (&mut self.wiring.eeprom_at_reset, &mut self.weeder) {
                let mut eeprom = weeder.eeprom();
                corrupt(&mut eeprom);
                *weeder = Uno::boot_with_eeprom(&self.weeder_elf, &eeprom)?.wired(&wiring::WIRES);
            }
            self.shared = self.cycles();
            self.reset_weeder()?;
            self.carry_to_tester();
        }
        self.is_reset_pulled = pulled;
        Ok(())
    }

    /// Resets a board, as opening its port does by the modem line DTR.
    pub fn reset(&mut self, side: Side) -> Result<()> {
        self.resets += 1;
        match side {
            Side::Tester => self.tester.reset(),
            Side::Weeder => self.reset_weeder()?,
        }
        Ok(())
    }

    fn reset_weeder(&mut self) -> Result<()> {
        match &mut self.weeder {
            Left(uno) => uno.reset(),
            Right(uno) => uno.reset()?,
        }
        Ok(())
    }

    /// The duration so far with real boards, in seconds. At each reset the bootloader waits for `bootloader_s`.
    pub fn duration_s(&self, bootloader_s: f64) -> f64 {
        self.tester.cycle() as f64 / CYCLES_PER_SECOND as f64 + f64::from(self.resets) * bootloader_s
    }

    /// The tester.
    pub fn tester(&self) -> &Uno {
        &self.tester
    }

    /// Bytes that were typed into a board's port and have not reached it.
    pub fn bytes_pending(&self, side: Side) -> usize {
        match side {
            Side::Tester => self.tester.bytes_pending(),
            Side::Weeder => for_both!(&self.weeder, uno => uno.bytes_pending()),
        }
    }

    /// Types bytes into a board's port.
    pub fn send(&mut self, side: Side, bytes: &[u8]) {
        match side {
            Side::Tester => self.tester.send(bytes),
            Side::Weeder => for_both!(&mut self.weeder, uno => uno.send(bytes)),
        }
    }

    /// Unread output of a board.
    pub fn received(&mut self, side: Side) -> &mut VecDeque<u8> {
        match side {
            Side::Tester => &mut self.from_tester,
            Side::Weeder => &mut self.from_weeder,
        }
    }

    fn carry_to_weeder(&mut self, change: PinChange) {
        let Some(number) = TESTER_LINES.iter().position(|&pin| pin == change.pin) else { return };
        let Some(change) = (self.wiring.to_weeder)(change) else { return };
        let cycle = self.weeder_cycle(change.cycle);
        let wires = self.wiring.inputs.iter().filter(|wire| wire.0 == Line::ALL[number]);
        let changes = wires.map(|&(_, pin, inverted)| PinChange { cycle, pin, high: change.high != inverted });
        for_both!(&mut self.weeder, uno => uno.drive(changes));
    }

    fn carry_to_tester(&mut self) {
        for change in for_both!(&mut self.weeder, uno => uno.take_changes()) {
            if !self.wiring.outputs.contains(&change.pin) {
                continue;
            }
            let pin = if change.pin == wiring::SERVO { TESTER_SERVO } else { TESTER_LED };
            let change = PinChange { cycle: self.tester_cycle(change.cycle) + STEP, pin, ..change };
            self.tester.drive((self.wiring.from_weeder)(change));
        }
    }
}

/// Which board a port is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The tester.
    Tester,
    /// The weeder.
    Weeder,
}
