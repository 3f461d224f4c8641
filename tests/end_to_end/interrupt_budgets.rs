//! The budgets of interrupts and critical sections, and the encoder at the rate that follows from them.
//!
//! At most two counts of the encoder may come between two reads. A read waits for the longest of the other handlers,
//! and for the critical section that the loop may enter directly after it. So each has a budget in cycles, including
//! entry and return.

use crate::common::{ask, encoder_steps, number, run_for_ms, started, status};
use field::wiring;
use uno::{CYCLES_PER_SECOND, PinChange};
use uno::{InterruptStatistics, Uno};

/// Vector, name and budget in cycles; the encoder's two last.
const BUDGETS: [(u8, &str, u64); 6] = [
    (3, "PCINT0, the beams", 53),
    (16, "TIMER0_OVF, clock and heartbeat", 42),
    (18, "USART_RX", 51),
    (19, "USART_UDRE", 44),
    (1, "INT0, the encoder", 83),
    (2, "INT1, the encoder", 83),
];

/// Budget of a stretch with interrupts off outside the handlers, in cycles.
const CRITICAL_SECTION: u64 = 25;

/// Rolls for two seconds at a rate of counts, forward and then back, with continuous console questions and a flickering
/// beam.
pub fn roll(uno: &mut Uno, counts_per_second: u64) -> String {
    const MILLISECONDS: u64 = 2000;
    ask(uno, "events on");
    ask(uno, "start now");
    let begin = uno.cycle() + 1000;
    let counts = counts_per_second * MILLISECONDS / 1000;
    let steps = (0..counts).map(|number| if number < counts * 3 / 4 { 1 } else { -1 });
    // The fraction of a cycle is carried on, so that every phase between encoder and loop comes up.
    uno.drive(encoder_steps((0..).map(|number| begin + number * CYCLES_PER_SECOND / counts_per_second).zip(steps)));
    uno.drive((0..MILLISECONDS).map(|edge| PinChange {
        cycle: begin + edge * (CYCLES_PER_SECOND / 1000) + edge % 7 * 111,
        pin: wiring::BEAM,
        high: edge % 2 == 1,
    }));
    let mut received = String::new();
    let mut asked = 0;
    while uno.cycle() < begin + MILLISECONDS * (CYCLES_PER_SECOND / 1000) {
        // Each answer asks for the next, so that the line is never idle and never overrun.
        if received.lines().filter(|line| *line == "ok").count() == asked {
            uno.send(b"help\n");
            asked += 1;
        }
        run_for_ms(uno, 5);
        received += &uno.received();
    }
    // Its line carries a hundred times as many, but the encoder leaves the loop little time.
    assert!(received.len() as u64 > MILLISECONDS / 8, "the console streamed: {} bytes", received.len());
    run_for_ms(uno, 500);
    uno.received();
    let status = status(uno);
    assert_eq!(number(&status, "pos"), counts as i64 / 2, "{status}");
    assert_eq!(number(&status, "lost"), 0, "{status}");
    assert_eq!(uno.resets(), []);
    status
}

#[test]
fn no_interrupt_and_no_critical_section_exceeds_its_budget() {
    let mut uno = started();
    uno.measure_interrupts();
    roll(&mut uno, 150_000);
    let InterruptStatistics { handlers, longest_off, longest_critical_section } =
        uno.interrupt_statistics().expect("they were measured");
    for (vector, name, budget) in BUDGETS {
        let handler = handlers.get(&vector).expect("it ran");
        println!("{name}: {} to {} of {budget} cycles, {} times", handler.fewest, handler.most, handler.count);
        assert!(handler.most <= budget, "{name} took {} cycles", handler.most);
    }
    println!("critical section: {longest_critical_section} of {CRITICAL_SECTION} cycles; off: {longest_off}");
    assert!(*longest_critical_section <= CRITICAL_SECTION, "{longest_critical_section} cycles");
    assert_eq!(handlers.len(), BUDGETS.len(), "every interrupt has a budget: {handlers:?}");
}

#[test]
fn no_count_is_lost_at_250_000_a_second() {
    let mut uno = started();
    let status = roll(&mut uno, 250_000);
    // If every read were in time, the resolved jumps would not be tested.
    assert!(number(&status, "jumps") > 0, "{status}");
}
