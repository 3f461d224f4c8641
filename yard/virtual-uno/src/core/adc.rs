//! Corrections of simavr's ADC: the time of a conversion, and its result.
//!
//! simavr asks for the input in the middle of each conversion, when the chip samples it. [`set_right`] then sets the
//! voltage, and the time until the conversion ends. A conversion takes 13 clocks of the ADC, the first one 25 (data
//! sheet, table 24-1). simavr multiplies these clocks by 2 or 14 and drops all but 8 bits of the product. The result
//! has 1024 steps of the reference (data sheet, 24.7); simavr has 1023.
//!
//! AVCC and AREF are at 5 V. There is no temperature sensor and no noise, and free running is the only trigger.

use super::chip::Chip;
use simavr_ffi as simavr;

/// Inputs that are pins of the board.
pub(super) const ADC_CHANNELS: usize = 6;

/// Voltage of AVCC, of AREF, and of a digital output that is high.
pub(crate) const SUPPLY_MILLIVOLTS: u16 = 5000;

/// The internal reference in millivolts, and the bits of ADMUX that choose it (data sheet, table 24-3).
const BANDGAP_MILLIVOLTS: u16 = 1100;
const REFS: u8 = 0b1100_0000;

/// Largest result of a conversion.
const LARGEST: u32 = 1023;

// Registers by their address in the data space (data sheet, register summary).
const ADCSRA: u16 = 0x7A;
const ADMUX: u16 = 0x7C;

/// Sets the input and the end of the running conversion. simavr calls this when the sample is taken.
pub(super) fn set_right(chip: Chip, millivolts: &[u16; ADC_CHANNELS]) {
    let reference = match chip.read(ADMUX) & REFS {
        REFS => BANDGAP_MILLIVOLTS,
        _ => SUPPLY_MILLIVOLTS,
    };
    let reference = u32::from(reference);
    let adc: *mut simavr::avr_adc_t = chip.peripheral(ADCSRA);
    // SAFETY: ADCSRA is the ADC's, and no reference to the ADC is alive.
    let adc = unsafe { &mut *adc };
    // From here on simavr waits 11 times this number of cycles.
    adc.current_prescale = 1_u8 << (chip.read(ADCSRA) & 0b111).max(1);
    for (value, &input) in adc.adc_values.iter_mut().zip(millivolts) {
        let result = (u32::from(input) * 1024 / reference).min(LARGEST);
        // The smallest voltage that simavr converts to this result.
        *value = (result * reference).div_ceil(LARGEST) as u16;
    }
}
