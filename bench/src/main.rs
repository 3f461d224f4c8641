//! The benchmark on the chip: runs the tasks of `Task::ALL`, and shows each call on D13.
//!
//! It runs the firmware's own search of examples in flash, in the firmware's own profile. Then it repeats the queries with the
//! plain search of the crate `knn`, and counts different answers. It prints nothing: `cargo bench-uno` reads the pin and the
//! variables.

#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

#[path = "../../src/examples.rs"]
mod examples;

use avr_progmem::progmem;
use control::ground::{
    examples::{RADIUS, scale},
    features::{self, Features, SPEED_CLASSES_MM_S},
};
use core::{arch::asm, hint::black_box};
use examples::{BuiltIn, InFlash, Row, rows};
use knn::{Answer, ClassifyError, Example, Examples, MAX_K, Nearest, Neighbour, classify};
use knn_bench::{CLASSES, K, QUERIES, Random, Task};

progmem! {
    static progmem RANDOM_8: [Row; 8] = rows(&knn_bench::examples());
    static progmem RANDOM_16: [Row; 16] = rows(&knn_bench::examples());
    static progmem RANDOM_32: [Row; 32] = rows(&knn_bench::examples());
    static progmem RANDOM_64: [Row; 64] = rows(&knn_bench::examples());
    static progmem RANDOM_128: [Row; 128] = rows(&knn_bench::examples());
}

/// The stack pointer at the first call. The stack below it is the classifier's.
#[unsafe(no_mangle)]
static mut STACK_POINTER: u16 = 0;

/// The number of answers that differ from the plain search; 0xFFFF until all are compared.
#[unsafe(no_mangle)]
static mut DIFFERENT_ANSWERS: u16 = u16::MAX;

type Query = [u8; features::COUNT];
type Result = core::result::Result<Answer<CLASSES>, ClassifyError>;

#[avr_device::entry]
fn main() -> ! {
    // SAFETY: bit 5 of DDRB makes D13 an output, and no other code uses it.
    unsafe { asm!("sbi 0x04, 5") };
    // SAFETY: no interrupt is on, so no other code accesses the variable; SP is at 0x3D and 0x3E.
    unsafe { asm!("in {0:l}, 0x3d", "in {0:h}, 0x3e", out(reg_pair) STACK_POINTER) };
    let found: &mut Nearest<CLASSES> = &mut Nearest::<CLASSES, _>::new([Neighbour::NONE; MAX_K as usize]);
    for task in Task::ALL {
        match task {
            Task::Quantise => {
                for object in objects() {
                    measured(|| black_box(scale().quantise(black_box(object.values()))));
                }
            }
            Task::Classify(count) => {
                for query in queries() {
                    let _ = black_box(measured_search(found, &random(count), &query));
                }
            }
            Task::ClassifyObjects => {
                for object in objects() {
                    let _ = black_box(measured_search(found, &BuiltIn::table(), &scale().quantise(object.values())));
                }
            }
        }
    }
    let mut different = 0;
    for task in Task::ALL {
        match task {
            Task::Quantise => {}
            Task::Classify(count) => {
                for query in queries() {
                    different +=
                        u16::from(search(found, &random(count), &query) != plain_search(&random(count), &query));
                }
            }
            Task::ClassifyObjects => {
                for object in objects() {
                    let query = scale().quantise(object.values());
                    different +=
                        u16::from(search(found, &BuiltIn::table(), &query) != plain_search(&BuiltIn::table(), &query));
                }
            }
        }
    }
    // SAFETY: as above.
    unsafe { (&raw mut DIFFERENT_ANSWERS).write_volatile(different) };
    loop {
        core::hint::spin_loop();
    }
}

/// Shows the call's duration on D13: the pin is high for the call's cycles and the two of `sbi`.
#[inline(always)]
fn measured<T>(task: impl FnOnce() -> T) -> T {
    // SAFETY: bit 5 of PORTB is D13, and no other code uses it.
    unsafe { asm!("sbi 0x05, 5") };
    let result = task();
    // SAFETY: as above.
    unsafe { asm!("cbi 0x05, 5") };
    result
}

fn measured_search(found: &mut Nearest<CLASSES>, examples: &InFlash, query: &Query) -> Result {
    measured(|| search(found, examples, query))
}

/// As the firmware searches: with places that are kept.
#[inline(never)]
fn search(found: &mut Nearest<CLASSES>, examples: &InFlash, query: &Query) -> Result {
    found.begin(black_box(K))?;
    examples.join(0..examples.len(), query, found);
    found.answer(RADIUS)
}

#[inline(never)]
fn plain_search(examples: &InFlash, query: &Query) -> Result {
    classify(&OneByOne(examples), query, black_box(K), RADIUS)
}

/// Returns examples one by one, for the crate's plain search.
struct OneByOne<'a>(&'a InFlash);

impl Examples<{ features::COUNT }> for OneByOne<'_> {
    fn len(&self) -> usize {
        self.0.len()
    }

    fn example(&self, index: usize) -> Option<Example<{ features::COUNT }>> {
        self.0.example(index)
    }
}

/// Random examples: 8, 16, 32, 64 or 128.
fn random(count: u8) -> InFlash {
    match count {
        8 => InFlash::new(&RANDOM_8),
        16 => InFlash::new(&RANDOM_16),
        32 => InFlash::new(&RANDOM_32),
        64 => InFlash::new(&RANDOM_64),
        _ => InFlash::new(&RANDOM_128),
    }
}

/// Random queries.
fn queries() -> impl Iterator<Item = Query> {
    let mut random = Random::new(0x0123_4567);
    (0..QUERIES).map(move |_| random.features())
}

/// Detections along a row: plants and tall weeds, half each, at the paper's four speeds.
fn objects() -> impl Iterator<Item = Features> {
    let mut random = Random::new(0x0123_4567);
    (0..QUERIES).map(move |_| {
        let mut between = |lowest: i16, highest: i16| {
            lowest + (i32::from(random.byte()) * i32::from(highest - lowest + 1) / 256) as i16
        };
        let speed = SPEED_CLASSES_MM_S[usize::from(between(0, 3) as u8) % SPEED_CLASSES_MM_S.len()];
        match between(0, 1) {
            0 => Features::describe(speed, between(60, 700), between(12, 20)),
            _ => Features::describe(speed, between(480, 620), between(100, 180)),
        }
    })
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    loop {
        core::hint::spin_loop();
    }
}
