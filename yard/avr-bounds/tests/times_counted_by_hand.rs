//! Proofs of small assembly programs. Their times can be counted by hand.

mod assembled;

use assembled::{assembled_for, assert_refused, proved, try_to_prove, try_to_prove_with};
use avr_bounds::{Bounds, Budgets, Input, LoopBound, LoopBounds, Program, prove};

#[test]
fn a_handler_s_time_is_its_longest_path_with_response_and_return() {
    let bounds = proved(
        "start:
            sei
        1:  rjmp 1b
        handler:
            push r24
            in r24, 0x3f
            out 0x1e, r24
            sbic 0x09, 2
            rjmp 2f
            lds r24, 0x0100
            inc r24
            sts 0x0100, r24
        2:
            in r24, 0x1e
            out 0x3f, r24
            pop r24
            reti",
    );
    // Response 4, jmp 3; push 2, in, out; sbic skips the jump 2; lds 2, inc 1, sts 2; in, out, pop 2, reti 4.
    assert_eq!(bounds.handlers.len(), 1, "the vectors that lead to the reset are not used");
    assert_eq!(bounds.handlers[0].longest.cycles, Some(4 + 3 + 4 + 2 + 5 + 8));
    assert_eq!(bounds.handlers[0].function, "handler");
    assert_eq!(bounds.handlers[0].stack_bytes, 3);
}

#[test]
fn a_handler_that_never_returns_counts_for_the_stack_only() {
    let bounds = proved(
        "start:\n sei\n1: rjmp 1b\nhandler:\n sbrc r2, 0\n jmp stalled\n reti\nstalled:\n push r2\n push r3\n rcall waits\nwaits:\n rjmp waits",
    );
    // Response 4, jmp 3, sbrc over two words 3, reti 4.
    assert_eq!(bounds.handlers[0].longest.cycles, Some(14));
    assert_eq!(bounds.handlers[0].stack_bytes, 2 + 2 + 2);
}

#[test]
fn a_nested_critical_section_ends_with_the_outer_one() {
    let bounds = proved(
        "start:
            sei
        1:  in r18, 0x3f
            cli
            rcall inner
            out 0x3f, r18
            nop
            rcall inner
            rjmp 1b
        inner:
            in r19, 0x3f
            cli
            nop
            out 0x3f, r19
            ret",
    );
    // rcall 3, in, cli, nop, out, ret 4, out.
    assert_eq!(bounds.critical_section.cycles, Some(3 + 4 + 4 + 1));
    // `cli` in front of it, `nop` behind it.
    assert_eq!(bounds.closed.cycles, Some(1 + 12 + 1));
}

#[test]
fn an_instruction_between_two_critical_sections_lets_nothing_in() {
    let apart = proved("start:\n sei\n1: cli\n nop\n sei\n nop\n cli\n nop\n sei\n rjmp 1b");
    assert_eq!((apart.critical_section.cycles, apart.closed.cycles), (Some(2), Some(1 + 2 + 2)));
    // The instruction after the first `sei` is the second `cli`. So a waiting interrupt sees both sections as one.
    let joined = proved("start:\n sei\n1: nop\n cli\n nop\n sei\n cli\n nop\n sei\n rjmp 1b");
    assert_eq!((joined.critical_section.cycles, joined.closed.cycles), (Some(2), Some(1 + 2 + 1 + 2 + 2)));
}

#[test]
fn a_path_that_waits_for_the_reset_is_no_critical_section() {
    let bounds =
        proved("start:\n sei\n1: sbrc r2, 0\n rcall gives_up\n cli\n sei\n rjmp 1b\ngives_up:\n cli\n2: wdr\n rjmp 2b");
    assert_eq!(bounds.critical_section.cycles, Some(1));
}

/// INT0's input: one handler reads PIND, and it can count two edges between two reads.
const INPUT: fn() -> Input = || Input { vectors: [1].into(), port: 0x29, edges_between_looks: 2, clock_hz: 16_000_000 };

#[test]
fn an_edge_waits_for_a_handler_a_critical_section_and_the_read() {
    let program = "start:
            sei
        1:  nop
            cli
            nop
            nop
            sei
            rjmp 1b
        handler:
            push r2
            in r2, 0x09
            pop r2
            reti
        other:
            push r3
            pop r3
            reti";
    let edges = try_to_prove(program, Some(&INPUT())).expect("it has bounds").edges.expect("they were asked for");
    // Synchroniser 3; the other handler 4 + 3 + 4 + 4; cli, nop, nop, sei, rjmp 2; response 4, jmp 3, push 2, in 1.
    assert_eq!(edges.wait_cycles, 3 + 15 + 6 + 10);
    assert_eq!(edges.never_lost_per_s, 2 * 16_000_000 / 34);
}

#[test]
fn a_handler_that_does_not_read_the_port_gives_no_bound_for_an_edge() {
    let main = "start:\n sei\n1: rjmp 1b\n";
    let refused = |handler: &str| {
        try_to_prove(&format!("{main}{handler}"), Some(&INPUT())).expect_err("it has no bound").to_string()
    };
    for handler in
        ["handler:\n reti", "handler:\n in r2, 9\n in r3, 9\n reti", "handler:\n sbrc r2, 0\n in r3, 9\n reti", ""]
    {
        assert!(refused(handler).contains("does not read the port at 0x29 exactly once"), "{handler}");
    }
    let second = Input { vectors: [16].into(), ..INPUT() };
    let program = format!("{main}handler:\n reti\nother:\n in r2, 9\n reti");
    let error = try_to_prove(&program, Some(&second)).expect_err("INT0 goes before it").to_string();
    assert!(error.contains("vector 1 has priority over vector 16"), "{error}");
}

#[test]
fn a_loop_in_a_handler_or_in_a_critical_section_has_to_have_a_bound() {
    let looping = "1: dec r24\n brne 1b\n";
    assert_refused(
        &format!("start:\n sei\n2: rjmp 2b\nhandler:\n {} reti", saving(looping)),
        "the handler of vector 1 has a loop without a bound",
    );
    assert_refused(
        &format!("start:\n sei\n2: cli\n {looping} sei\n rjmp 2b"),
        "a stretch without interrupts has a loop without a bound",
    );
    // The start-up code may take any time before it turns interrupts on.
    proved(&format!("start:\n {looping} sei\n2: rjmp 2b"));
}

/// A handler's body that saves and restores the registers that it changes.
fn saving(body: &str) -> String {
    format!(
        "push r24\n push r25\n in r24, 0x3f\n push r24\n lds r24, 0x0100\n{body} pop r24\n out 0x3f, r24\n pop r25\n pop r24\n"
    )
}

/// A record with the most executions of the next instruction.
fn at_most(turns: u32) -> String {
    format!("7: .pushsection .loop_bounds, \"\", @progbits\n .long 7b, {turns}\n .popsection\n")
}

#[test]
fn a_loop_with_a_stated_bound_takes_its_turns_and_the_exit() {
    let saved = "push r24\n push r25\n in r24, 0x3f\n push r24\n";
    let restored = "pop r24\n out 0x3f, r24\n pop r25\n pop r24\n";
    let handler =
        |body: &str| format!("start:\n sei\n2: rjmp 2b\nhandler:\n {saved} ldi r24, 8\n{body} {restored} reti");
    let cycles = |body: &str| proved(&handler(body)).handlers[0].longest.cycles.expect("it returns");
    // Response 4, jmp 3, ldi 1, reti 4, and 7 each to save and to restore; eight turns of dec 1 and brne 2, and one more up to the
    // way out, 2.
    assert_eq!(cycles(&format!("1:\n {} dec r24\n brne 1b\n", at_most(8))), 26 + 8 * 3 + 2);
    // Three turns of ldi 1, of the inner loop's eight with their way out, and of dec 1 and brne 2; the last one's way out is 1 shorter.
    let inner = format!("3:\n {} dec r25\n brne 3b\n", at_most(8));
    let outer = format!("1: ldi r25, 8\n {inner} {} dec r24\n brne 1b\n", at_most(3));
    assert_eq!(cycles(&outer), 26 + 3 * (1 + 26 + 3) + (1 + 26 + 2));
}

#[test]
fn a_record_that_a_turn_can_go_round_bounds_nothing() {
    let main = "start:\n sei\n2: rjmp 2b\n";
    let round = format!("1: sbrs r2, 0\n rjmp 3f\n {} nop\n3: dec r24\n brne 1b\n", at_most(8));
    assert_refused(
        &format!("{main}handler:\n {} reti", saving(&round)),
        "the handler of vector 1 has a loop without a bound",
    );
    // The inner loop's record does not bound the outer loop.
    let outer = format!("1: ldi r25, 8\n3:\n {} dec r25\n brne 3b\n dec r24\n brne 1b\n", at_most(8));
    assert_refused(
        &format!("{main}handler:\n {} reti", saving(&outer)),
        "the handler of vector 1 has a loop without a bound",
    );
}

#[test]
fn a_bound_of_a_function_holds_for_each_loop_without_a_record() {
    let cycles = |body: &str, passes: &[u64]| {
        let program = format!("start:\n clr r1\n1: wdr\n rcall waits\n rjmp 1b\nwaits:\n ldi r24, 8\n{body} ret");
        let bound = LoopBound { passes: passes.into(), by_length: false, because: "it counts".into() };
        let bounds = try_to_prove_with(&program, None, &[("waits".into(), bound)].into()).expect("it has bounds");
        bounds.turn.expect("the watchdog is fed").cycles
    };
    // wdr 1, rcall 3, ldi 1, the turns and the exit, ret 4, rjmp 2.
    assert_eq!(cycles("3: dec r24\n brne 3b\n", &[9]), Some(11 + 9 * 3 + 2));
    assert_eq!(cycles(&format!("3:\n {} dec r24\n brne 3b\n", at_most(8)), &[9]), Some(11 + 8 * 3 + 2));
    // Entered in its middle as well: by the longer way, sbrc 1 and rjmp 2; nine times by either beginning, and three cycles from
    // one to the other at most.
    let twice = "sbrc r2, 0\n rjmp 4f\n3: nop\n4: dec r24\n brne 3b\n";
    assert_eq!(cycles(twice, &[9]), Some(11 + 3 + 2 * 9 * 3 + 2));
    // Nine turns of ldi 1, of the inner loop's nine with their way out, and of dec 1 and brne 2; the last way out is 1 shorter.
    let nested = "2: ldi r25, 3\n3: dec r25\n brne 3b\n dec r24\n brne 2b\n";
    assert_eq!(cycles(nested, &[9]), Some(11 + 9 * (1 + 29 + 3) + (1 + 29 + 2)));
    // The same, with another number for the loop within: three of its turns with their way out.
    assert_eq!(cycles(nested, &[9, 3]), Some(11 + 9 * (1 + 11 + 3) + (1 + 11 + 2)));
    // Eight turns are counted, and a smaller number does not lower them. The last one's way out is 1 shorter.
    assert_eq!(cycles("3: dec r24\n brne 3b\n", &[5]), Some(11 + 8 * 3 - 1));
}

#[test]
fn a_constant_length_from_the_caller_bounds_the_loop() {
    let cycles_of = |length: &str, function: &str| {
        let program = format!(
            "start:\n clr r1\n sei\n1: wdr\n cli\n {length}\n rcall {function}\n sei\n rjmp 1b\n\
             jumps:\n sbrc r2, 0\n rjmp 4f\n ldi r20, 44\n ldi r21, 1\n rjmp fills\n4: ldi r20, 7\n ldi r21, 0\n rjmp fills\n\
             fills:\n rjmp 3f\n2: st X+, r22\n3: subi r20, 1\n sbci r21, 0\n brcc 2b\n ret"
        );
        let bound = LoopBound { passes: vec![100], by_length: true, because: "a byte a turn".into() };
        let bounds = try_to_prove_with(&program, None, &[("fills".into(), bound)].into()).expect("it has bounds");
        let turn = bounds.turn.expect("the watchdog is fed").cycles.expect("every loop has a bound");
        // All but wdr 1, cli 1, rjmp 2.
        assert_eq!(bounds.critical_section.cycles, Some(turn - 4), "{length}");
        turn
    };
    let cycles = |length: &str| cycles_of(length, "fills");
    // A byte more is a turn more: st 2, subi 1, sbci 1, brcc 2.
    assert_eq!(cycles("ldi r20, 8\n ldi r21, 0") - cycles("ldi r20, 7\n ldi r21, 0"), 6);
    assert_eq!(cycles("ldi r20, 99\n ldi r21, 0"), cycles("mov r20, r2\n ldi r21, 0"), "the number of the table");
    assert!(cycles("ldi r20, 0\n ldi r21, 1") > cycles("ldi r20, 255\n ldi r21, 0"));
    // After jumps with constants the largest counts: sbrc 1, rjmp 2, two ldi, rjmp 2 instead of the caller's two ldi.
    assert_eq!(cycles_of("", "jumps"), cycles("ldi r20, 44\n ldi r21, 1") + 5);
}

#[test]
fn a_bound_for_a_missing_function_is_refused() {
    let bound = LoopBound { passes: vec![3], by_length: false, because: "it counted".into() };
    let loops = LoopBounds::from([("gone".to_owned(), bound)]);
    let error = try_to_prove_with("start: rjmp start", None, &loops).expect_err("it has no such function").to_string();
    assert!(error.contains("no function of the program is called gone"), "{error}");
    assert!(error.ends_with("or name the budgets of this program"), "{error}");
}

#[test]
fn a_turn_has_a_bound_once_every_loop_in_it_has_one() {
    let program = |record: &str| {
        format!(
            "start:\n sei\n1: wdr\n ldi r24, 8\n rcall waits\n rjmp 1b\nwaits:\n3:\n {record} dec r24\n brne 3b\n ret"
        )
    };
    let turn = proved(&program("")).turn.expect("the watchdog is fed");
    assert_eq!((turn.cycles, turn.without_bound.len()), (None, 1));
    assert_eq!(turn.without_bound[0].function, "waits");
    // wdr 1, ldi 1, rcall 3, eight turns and the way out, ret 4, rjmp 2.
    let turn = proved(&program(&at_most(8))).turn.expect("the watchdog is fed");
    assert_eq!(turn.cycles, Some(1 + 1 + 3 + 26 + 4 + 2));
    assert_eq!(proved("start:\n rjmp start").turn, None);
}

#[test]
fn a_bound_over_its_budget_and_a_rate_under_it_are_reported() {
    let budgets = |stack: u64, rate: u64| {
        let file = tempfile::NamedTempFile::new().expect("there is room for a file");
        let text = format!(
            "stack_bytes = {stack}\nhandler_cycles = 14\ncritical_section_cycles = 0\nloops_without_bound = 0\nturn_cycles = 7\n\
             never_lost_per_s = {rate}\n[input]\nvectors = [1]\nport = 0x29\nedges_between_looks = 2\n"
        );
        std::fs::write(file.path(), text).expect("it can be written");
        Budgets::read(file.path()).expect("it is whole")
    };
    // A push and an interrupt: 3 bytes of stack. Response 4, jmp 3, sbic and nop 2, reti 4: 13 cycles.
    let program = "start:\n sei\n1: wdr\n push r2\n pop r2\n rjmp 1b\nhandler:\n sbic 9, 0\n nop\n reti";
    let bounds = try_to_prove(program, Some(&INPUT())).expect("it has bounds");
    let rate = bounds.edges.as_ref().expect("they were asked for").never_lost_per_s;
    let over = |budgets: Budgets| -> Vec<&str> {
        budgets
            .hold(&bounds)
            .expect("every time has a bound")
            .iter()
            .filter(|held| !held.keeps)
            .map(|held| held.name)
            .collect()
    };
    assert_eq!(over(budgets(3, rate)), [""; 0]);
    assert_eq!(over(budgets(2, rate + 1)), ["stack_bytes", "never_lost_per_s"]);
    let error = Budgets::read("no-such.toml".as_ref()).expect_err("there is none").to_string();
    assert!(error.starts_with("no-such.toml cannot be read: "), "{error}");
}

#[test]
fn a_budget_for_a_time_that_the_program_does_not_have_is_refused() {
    let refused = |budgets: &str, program: &str, words: &str| {
        let budgets: Budgets = toml::from_str(budgets).expect("it is whole");
        let error = budgets.hold(&proved(program)).expect_err("it has no such time").to_string();
        assert!(error.contains(words), "{error}");
    };
    refused("turn_cycles = 9", "start:\n rjmp start", "no loop has `wdr`");
    refused("loops_without_bound = 0", "start:\n rjmp start", "no loop has `wdr`");
    refused("never_lost_per_s = 5", "start:\n rjmp start", "in [input]");
    let unbounded = "start:\n1: wdr\n2: dec r24\n brne 2b\n rjmp 1b";
    refused("turn_cycles = 9", unbounded, "which must have its `wdr` itself, has a loop without a bound");
}

#[test]
fn a_sleep_needs_interrupts_and_delays_the_handlers() {
    let handler = "handler:\n reti";
    let bounds = proved(&format!("start:\n sei\n1: sleep\n rjmp 1b\n{handler}"));
    // Response 4, out of sleep 4 more, jmp 3, reti 4.
    assert_eq!(bounds.handlers[0].longest.cycles, Some(15));
    // With return addresses of three bytes: 5, 5 more, 3 and 5.
    let elf = assembled_for(&format!("start:\n sei\n1: sleep\n rjmp 1b\n{handler}"), true);
    let large = Program::read(elf.path(), Some("atmega2560")).expect("it is an ELF");
    let bounds = prove(&large, &Budgets::default()).expect("it has bounds");
    assert_eq!(bounds.handlers[0].longest.cycles, Some(18));
    // A sleep with interrupts off has no bound.
    assert_refused(&format!("start:\n sei\n1: cli\n sleep\n sei\n rjmp 1b\n{handler}"), "a stretch without interrupts");
}

#[test]
fn a_loop_that_counts_registers_from_a_constant_is_counted() {
    let cycles = |set: &str, turn: &str| {
        let program = format!("start:\n clr r1\n1: wdr\n rcall waits\n rjmp 1b\nwaits:\n {set}\n3: {turn}\n ret");
        proved(&program).turn.expect("the watchdog is fed").cycles
    };
    // wdr 1, rcall 3, ret 4, rjmp 2; what is set, and the last turn's branch takes 1 less.
    assert_eq!(cycles("ldi r24, 8", "dec r24\n brne 3b"), Some(10 + 1 + 8 * 3 - 1));
    // Up to a limit, by two bytes, with a pointer, and by a register that holds the step.
    assert_eq!(cycles("ldi r24, 0", "subi r24, 0xFF\n cpi r24, 10\n brne 3b"), Some(10 + 1 + 10 * 4 - 1));
    assert_eq!(cycles("ldi r24, 0x2C\n ldi r25, 1", "subi r24, 1\n sbci r25, 0\n brne 3b"), Some(10 + 2 + 300 * 4 - 1));
    assert_eq!(cycles("ldi r24, 0x2C\n ldi r25, 1", "sbiw r24, 1\n brne 3b"), Some(10 + 2 + 300 * 4 - 1));
    assert_eq!(
        cycles("ldi r30, 0\n ldi r31, 1\n ldi r18, 1", "st Z+, r1\n cpi r30, 20\n cpc r31, r18\n brne 3b"),
        Some(10 + 3 + 20 * 6 - 1)
    );
    assert_eq!(cycles("ldi r24, 100\n ldi r25, 25", "sub r24, r25\n brne 3b"), Some(10 + 2 + 4 * 3 - 1));
    // A turn may go round something else, and what is called leaves the counter alone.
    assert_eq!(cycles("ldi r24, 8", "sbrc r2, 0\n nop\n dec r24\n brne 3b"), Some(10 + 1 + 8 * 5 - 1));
    // Loops within loops.
    assert_eq!(
        cycles("ldi r25, 3", "ldi r24, 8\n4: dec r24\n brne 4b\n dec r25\n brne 3b"),
        Some(10 + 1 + 3 * (1 + 8 * 3 - 1 + 3) - 1)
    );
}

#[test]
fn a_loop_whose_counter_is_not_followed_to_its_end_has_no_bound() {
    let refused = |set: &str, turn: &str| {
        let program = format!("start:\n clr r1\n1: wdr\n rcall waits\n rjmp 1b\nwaits:\n {set}\n3: {turn}\n ret");
        let turn = proved(&program).turn.expect("the watchdog is fed");
        assert_eq!(turn.cycles, None, "{set} {turn:?}");
        assert!(!turn.without_bound.is_empty());
    };
    refused("lds r24, 0x0100", "dec r24\n brne 3b");
    // A turn can go round the counting, or count again; memory decides; it never comes to its end.
    refused("ldi r24, 8", "sbrc r2, 0\n dec r24\n cpi r24, 0\n brne 3b");
    refused("ldi r24, 8", "sbrc r2, 0\n ldi r24, 8\n dec r24\n brne 3b");
    refused("ldi r24, 8", "lds r24, 0x0100\n dec r24\n brne 3b");
    refused("ldi r24, 7", "subi r24, 2\n brne 3b");
    refused("ldi r24, 8", "rcall clobbers\n dec r24\n brne 3b\n ret\nclobbers:\n lds r24, 0x0100");
}

#[test]
fn an_edge_that_comes_in_front_of_a_sleep_waits_for_the_wake_up_too() {
    let program = "start:
            sei
        1:  cli
            sbis 0x1e, 7
            rjmp 2f
            sei
            sleep
        2:  sei
            rjmp 1b
        handler:
            push r24
            in r24, 0x09
            out 0x1e, r24
            pop r24
            reti";
    let bounds = try_to_prove(program, Some(&INPUT())).expect("it has bounds");
    // cli 1, sbis over a word 2, sei 1, sleep 1, out of sleep 4; without sleep cli 1, sbis 1, rjmp 2, sei 1, rjmp 2.
    assert_eq!((bounds.closed.cycles, bounds.critical_section.cycles), (Some(9), Some(4)));
    // Synchroniser 3; out, pop, reti after the read 7; response 4, jmp 3, push 2, in 1.
    assert_eq!(bounds.edges.expect("they were asked for").wait_cycles, 3 + 7 + 9 + 10);
}

/// The bounds of a program whose function has loops with these bounds, by their depth.
#[track_caller]
fn proved_with(program: &str, function: &str, passes: &[u64]) -> Bounds {
    let bound = LoopBound { passes: passes.into(), by_length: false, because: "it counts".into() };
    try_to_prove_with(program, None, &[(function.into(), bound)].into()).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn a_loop_keeps_its_bound_if_only_a_part_around_it_is_timed() {
    let calling = |body: &str| format!("start:\n sei\n1: wdr\n rcall waits\n sei\n rjmp 1b\nwaits:\n{body} ret");
    let inner = "3: nop\n dec r25\n brne 3b\n";
    // The outer loop is cut by `sei`: in 1, a hundred turns of 4, the way out 3, sei 1.
    let section = calling(&format!("2: cli\n in r25, 0x1e\n {inner} sei\n nop\n dec r24\n brne 2b\n"));
    assert_eq!(proved_with(&section, "waits", &[3, 100]).critical_section.cycles, Some(1 + 400 + 3 + 1));
    // It is cut by `wdr`: wdr 1, in 1, the same, rjmp 2.
    let turn = format!("start:\n1: wdr\n in r25, 0x1e\n {inner} rjmp 1b");
    assert_eq!(proved_with(&turn, "start", &[1, 100]).turn.and_then(|turn| turn.cycles), Some(1 + 1 + 403 + 2));
    // The first turn has interrupts on: in 1, 403, cli 1. Three more: dec 1, brne 2, in 1, 403, cli 1. The last dec 1, brne 1, ret 4.
    // Around it wdr 1, rcall 3, sei 1, rjmp 2.
    let first = calling(&format!("2: in r25, 0x1e\n {inner} cli\n dec r24\n brne 2b\n"));
    let turn = proved_with(&first, "waits", &[3, 100]).turn.and_then(|turn| turn.cycles);
    assert_eq!(turn, Some(405 + 3 * 408 + 6 + 7));
    // `cli` in the inner loop is the beginning. The inner loop turns five times in each of three turns of the outer one, and each
    // counts as the longer way round: dec 1, brne 1, dec 1, brne 2, nop 1, sbrs 1, rjmp 2. Then dec, brne, dec, brne, ret 4, sei.
    let begun =
        calling("2: nop\n3: sbrs r2, 0\n rjmp 4f\n sei\n nop\n cli\n4: dec r25\n brne 3b\n dec r24\n brne 2b\n");
    assert_eq!(proved_with(&begun, "waits", &[3, 5]).critical_section.cycles, Some(3 * 5 * 9 + 8 + 1));
}

#[test]
fn a_record_of_an_inner_loop_does_not_bound_what_is_left_of_the_outer_one() {
    let program = |record: &str| {
        format!(
            "start:\n sei\n1: cli\n rcall waits\n sei\n rjmp 1b\nwaits:\n2: nop\n3:\n {record} sbrs r2, 0\n rjmp 4f\n sei\n \
             nop\n cli\n rjmp 3b\n4: dec r24\n brne 2b\n ret"
        )
    };
    assert_refused(&program(&at_most(2)), "a stretch without interrupts has a loop without a bound");
}

#[test]
fn a_loop_fed_only_in_a_called_function_has_no_known_turn() {
    let turn = |main: &str| proved(&format!("start:\n{main}\nfeeds:\n wdr\n ret")).turn.expect("the watchdog is fed");
    // A small loop in front, whose turn is known.
    let real = turn("1: sbis 3, 0\n rjmp 2f\n wdr\n rjmp 1b\n2: rcall works\n rcall feeds\n rjmp 2b\nworks:\n ret");
    assert_eq!((real.cycles, real.without_bound.len()), (None, 1));
    assert_eq!(real.without_bound[0].function, "start");
    assert_eq!(turn("1: rcall calls\n rjmp 1b\ncalls:\n rcall feeds\n ret").cycles, None);
    // The loop's own wdr 1, rcall 3, wdr 1, ret 4, rjmp 2.
    assert_eq!(turn("1: wdr\n rcall feeds\n rjmp 1b").cycles, Some(11));
    // A function that feeds it for ever does not feed for its caller: wdr 1, rcall 3, ldi 1, eight turns of rcall 3, sbrc over a
    // word 2, ret 4, dec 1, brne 2, the last 1 shorter, ret 4, rjmp 2.
    let stalls = "1: wdr\n rcall waits\n rjmp 1b\nwaits:\n ldi r24, 8\n2: rcall checks\n dec r24\n brne 2b\n ret\n\
        checks:\n sbrc r2, 0\n rjmp stalls\n ret\nstalls:\n wdr\n rjmp stalls";
    assert_eq!(turn(stalls).cycles, Some(1 + 3 + 1 + 8 * 12 - 1 + 4 + 2));
}

#[test]
fn a_time_that_is_too_long_to_count_is_no_bound() {
    let main = "start:\n sei\n1: rjmp 1b\nhandler:\n push r24\n in r24, 0x09\n pop r24\n reti\n";
    let nested = format!("{main}other:\n1: sbis 3, 0\n rjmp 1b\n2: sbis 3, 1\n rjmp 1b\n3: sbis 3, 2\n rjmp 1b\n reti");
    for passes in [1 << 40, 9_000_000_000_000_000_000, u64::MAX] {
        let bound = LoopBound { passes: vec![passes], by_length: false, because: "it counts".into() };
        let error =
            try_to_prove_with(&nested, Some(&INPUT()), &[("other".into(), bound)].into()).expect_err("too long");
        assert!(error.to_string().contains("the handler of vector 16 has a loop without a bound"), "{error}");
    }
    // No loop, and each function calls the next one twice.
    let twice = |levels: usize| -> String {
        let functions = (1..levels).map(|level| format!("f{level}:\n rcall f{0}\n rcall f{0}\n ret\n", level + 1));
        format!("{main}other:\n rcall f1\n reti\n{}f{levels}:\n ret", functions.collect::<String>())
    };
    // Response 4, jmp 3, rcall 3, reti 4; the function ret 4, and around it twice rcall 3 and ret 4.
    assert_eq!(proved(&twice(2)).handlers[1].longest.cycles, Some(14 + 2 * (3 + 4) + 4));
    assert_refused(&twice(80), "or a call of more than 2^40 cycles");
}

#[test]
fn an_eeprom_store_through_a_known_pointer_halts_the_core_too() {
    let cycles = |store: &str| {
        let program = format!("start:\n1: wdr\n ldi r24, 1\n ldi r30, 0x3f\n ldi r31, 0\n {store}\n rjmp 1b");
        proved(&program).turn.and_then(|turn| turn.cycles)
    };
    // wdr, three ldi, the store, rjmp 2; a read halts for 4.
    assert_eq!(cycles("out 0x1f, r24"), Some(4 + 1 + 4 + 2));
    assert_eq!(cycles("st Z, r24"), Some(4 + 2 + 4 + 2));
    assert_eq!(cycles("std Z+1, r24"), Some(4 + 2 + 2), "EEDR");
    assert_eq!(cycles("sbi 0x1f, 1"), Some(4 + 2 + 2 + 2), "a write halts for 2");
}
