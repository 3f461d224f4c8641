//! An EEPROM with a write time, which survives a reset.

use control::memory::{ERASED, Memory, SIZE};
use std::{cell::RefCell, rc::Rc};

/// Bytes of the whole chip.
pub const CHIP_SIZE: usize = 2 * SIZE;

/// Calls of `is_ready` until a byte is written: once a turn, for some milliseconds.
const PATIENCE: u8 = 3;

#[derive(Clone, Debug)]
struct Chip {
    bytes: [u8; CHIP_SIZE],
    /// The byte that is being written, its address, and the calls left.
    under_way: Option<(usize, u8)>,
    patience: u8,
}

impl Chip {
    fn finish(&mut self) {
        if let Some((address, byte)) = self.under_way.take() {
            self.bytes[address] = byte;
        }
    }
}

/// The chip.
#[derive(Clone, Debug)]
pub struct Eeprom(Rc<RefCell<Chip>>);

/// Half of the chip: for the settings, or for the examples.
#[derive(Clone, Debug)]
pub struct Half {
    chip: Rc<RefCell<Chip>>,
    begin: usize,
}

impl Eeprom {
    /// An erased half.
    pub fn new() -> Self {
        Self(Rc::new(RefCell::new(Chip { bytes: [ERASED; CHIP_SIZE], under_way: None, patience: 0 })))
    }

    /// Both halves.
    pub fn halves(&self) -> [Half; 2] {
        [0, SIZE].map(|begin| Half { chip: Rc::clone(&self.0), begin })
    }

    /// Resets the machine. A write in progress is completed. If the power fails, it leaves the byte `torn` instead.
    pub fn reset(&mut self, torn: Option<u8>) {
        let mut chip = self.0.borrow_mut();
        if let (Some(torn), Some((_, byte))) = (torn, &mut chip.under_way) {
            *byte = torn;
        }
        chip.finish();
    }

    /// The bytes of the examples, with the one that is being written.
    pub fn examples(&self) -> [u8; SIZE] {
        let mut chip = self.0.borrow().clone();
        chip.finish();
        std::array::from_fn(|index| chip.bytes[SIZE + index])
    }

    /// Changes a byte, as a failing cell would.
    pub fn spoil(&mut self, address: usize, byte: u8) {
        self.0.borrow_mut().bytes[address] = byte;
    }
}

impl Memory for Half {
    fn read(&self, address: u16) -> u8 {
        let chip = self.chip.borrow();
        assert!(chip.under_way.is_none(), "a byte is read while one is being written");
        chip.bytes[self.begin + usize::from(address)]
    }

    fn is_ready(&self) -> bool {
        let mut chip = self.chip.borrow_mut();
        chip.patience = chip.patience.saturating_sub(1);
        if chip.patience == 0 {
            chip.finish();
        }
        chip.under_way.is_none()
    }

    fn write(&mut self, address: u16, byte: u8) {
        let mut chip = self.chip.borrow_mut();
        assert!(chip.under_way.is_none(), "a byte is written while another is being written");
        chip.under_way = Some((self.begin + usize::from(address), byte));
        chip.patience = PATIENCE;
    }
}
