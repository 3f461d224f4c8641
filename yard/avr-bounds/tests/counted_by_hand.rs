//! Proofs of small assembly programs. Their stack and cycles can be counted by hand.

use avr_bounds::{Bounds, BoundsError, Budgets, Input, LoopBound, LoopBounds, Program, RegisterRule, prove};
use std::io::Write;
use std::process::{Command, Stdio};

/// Assembles a program for the ATmega328P and proves its bounds. It begins at `start`. `handler` is INT0's, if there is
/// one, and `other` is Timer0's. An unused vector leads to the reset, as in avr-libc.
fn try_to_prove(program: &str, input: Option<&Input>) -> Result<Bounds, BoundsError> {
    try_to_prove_with(program, input, &LoopBounds::new())
}

/// The same with loop bounds of its functions.
fn try_to_prove_with(program: &str, input: Option<&Input>, loops: &LoopBounds) -> Result<Bounds, BoundsError> {
    try_to_prove_by(program, &Budgets { input: input.cloned(), loops: loops.clone(), ..Budgets::default() })
}

/// The same with facts of any kind. Every time that a budget can limit must have a bound.
fn try_to_prove_by(program: &str, facts: &Budgets) -> Result<Bounds, BoundsError> {
    let elf = assembled(program);
    let bounds = prove(&Program::read(elf.path(), Some("atmega328p"))?, facts)?;
    let any = Some(u64::MAX);
    Budgets { handler_cycles: any, critical_section_cycles: any, ..Budgets::default() }.hold(&bounds)?;
    Ok(bounds)
}

/// The ELF of a program that begins at `start`.
fn assembled(program: &str) -> tempfile::NamedTempFile {
    assembled_for(program, false)
}

/// The same, with the vectors of an ATmega2560 if `is_large` is set.
fn assembled_for(program: &str, is_large: bool) -> tempfile::NamedTempFile {
    let used = |label: &str| if program.contains(&format!("{label}:")) { label.to_owned() } else { "0".to_owned() };
    let vectors: String = (0..57)
        .map(|vector| match vector {
            0 => "jmp start\n".to_owned(),
            1 => format!("jmp {}\n", used("handler")),
            16 => format!("jmp {}\n", used("other")),
            26.. if !is_large => String::new(),
            _ => "jmp 0\n".to_owned(),
        })
        .collect();
    let functions: String = (program.lines())
        .filter_map(|line| line.trim().strip_suffix(':'))
        .filter(|label| label.parse::<u8>().is_err())
        .map(|label| format!(".type {label}, @function\n"))
        .collect();
    let elf = tempfile::NamedTempFile::new().expect("there is room for a file");
    let mut gcc = Command::new("avr-gcc")
        .args(["-mmcu=atmega328p", "-nostdlib", "-x", "assembler", "-", "-o"])
        .arg(elf.path())
        .stdin(Stdio::piped())
        .spawn()
        .unwrap_or_else(|error| panic!("avr-gcc could not be started ({error}): run ./setup.sh"));
    let mut source = gcc.stdin.take().expect("it was asked for");
    writeln!(source, "{functions}{vectors}{program}").expect("avr-gcc reads");
    drop(source);
    assert!(gcc.wait().expect("avr-gcc ends").success(), "{program}");
    elf
}

#[track_caller]
fn proved(program: &str) -> Bounds {
    try_to_prove(program, None).unwrap_or_else(|error| panic!("{error}"))
}

/// Asserts that a program is refused with this message.
#[track_caller]
fn assert_refused(program: &str, words: &str) {
    let error = try_to_prove(program, None).expect_err("it has no bounds").to_string();
    assert!(error.contains(words), "{error}");
}

#[test]
fn the_stack_counts_pushes_and_calls_on_the_deepest_path() {
    let bounds = proved(
        "start:
            rcall flat
            rcall one
            rjmp start
        one:
            push r2
            rcall two
            pop r2
            ret
        two:
            push r3
            push r4
            pop r4
            pop r3
            ret
        flat:
            ret",
    );
    // Two calls, and three bytes pushed.
    assert_eq!(bounds.stack_bytes, 7);
    let frames: Vec<_> = bounds.stack.iter().map(|frame| (frame.function.as_str(), frame.bytes)).collect();
    assert_eq!(frames, [("reset", 2), ("one", 3), ("two", 2)]);
}

#[test]
fn a_jump_into_another_function_is_its_call_at_the_end() {
    let bounds = proved(
        "start:\n rcall one\n rjmp start\none:\n push r2\n pop r2\n rjmp two\ntwo:\n push r2\n push r3\n pop r3\n pop r2\n ret",
    );
    assert_eq!(bounds.stack_bytes, 4);
}

#[test]
fn of_two_paths_that_push_the_deeper_counts() {
    let bounds = proved(
        "start:
            sbrc r24, 0
            rjmp 1f
            push r2
            pop r2
            rjmp start
        1:
            push r2
            push r3
            push r4
            pop r4
            pop r3
            pop r2
            rjmp start",
    );
    assert_eq!(bounds.stack_bytes, 3);
}

#[test]
fn a_frame_is_made_by_arithmetic_on_the_stack_pointer() {
    // 300 bytes by two subtractions, as compilers make large frames.
    let frame = |size: u16, inner: &str| {
        format!(
            "in r28, 0x3d\n in r29, 0x3e\n subi r28, lo8({size})\n sbci r29, hi8({size})\n in r0, 0x3f\n cli\n out 0x3e, r29\n \
             out 0x3f, r0\n out 0x3d, r28\n {inner}\n subi r28, lo8(-{size})\n sbci r29, hi8(-{size})\n in r0, 0x3f\n cli\n \
             out 0x3e, r29\n out 0x3f, r0\n out 0x3d, r28\n"
        )
    };
    let large = frame(300, "rcall leaf");
    let bounds = proved(&format!(
        "start:\n sei\n1: rcall one\n rjmp 1b\none:\n push r28\n push r29\n {large} pop r29\n pop r28\n ret\nleaf:\n ret"
    ));
    assert_eq!(bounds.stack_bytes, 2 + 2 + 300 + 2);
    // `out SPH` and `out SREG` after `cli`. The stretch includes one instruction before and one after.
    assert_eq!((bounds.critical_section.cycles, bounds.closed.cycles), (Some(2), Some(4)));
}

#[test]
fn a_function_that_clobbers_the_frame_s_pointer_leaves_the_stack_unknown() {
    assert_refused(
        "start:\n in r28, 0x3d\n in r29, 0x3e\n rcall clobbers\n out 0x3e, r29\n out 0x3d, r28\n rjmp start\nclobbers:\n ldi r28, 1\n ret",
        "start sets the stack pointer to an unknown value",
    );
}

#[test]
fn a_handler_comes_in_where_the_stack_is_deepest_with_interrupts_on() {
    let handler = "handler:\n push r2\n pop r2\n reti";
    let on = proved(&format!("start:\n sei\n1: push r2\n push r3\n pop r3\n pop r2\n rjmp 1b\n{handler}"));
    assert_eq!(on.stack_bytes, 2 + 2 + 1);
    // The deepest place has interrupts off. But an interrupt can be served directly before it.
    let off =
        proved(&format!("start:\n sei\n1: push r2\n cli\n push r3\n pop r3\n sei\n nop\n pop r2\n rjmp 1b\n{handler}"));
    assert_eq!(off.stack_bytes, 1 + 2 + 1);
}

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
fn a_handler_that_jumps_away_for_ever_counts_for_the_stack_and_not_for_the_time() {
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
fn an_edge_waits_for_the_other_handler_a_critical_section_and_the_path_to_the_read() {
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
fn recursion_is_refused_with_its_circle() {
    assert_refused(
        "start:\n rcall one\n rjmp start\none:\n rcall two\n ret\ntwo:\n rcall one\n ret",
        "one, which calls two, which calls one calls itself",
    );
}

#[test]
fn a_call_of_an_unknown_address_is_refused() {
    assert_refused("start:\n icall\n rjmp start", "start calls or jumps to an address that it works out");
    assert_refused("start:\n ijmp", "start calls or jumps to an address that it works out");
    assert_refused(
        "start:\n rcall one\n rjmp start\none:\n push r2\n push r3\n ret",
        "one returns with a stack that is not as it found it",
    );
}

#[test]
fn a_stack_that_grows_in_a_loop_is_refused() {
    assert_refused("start:\n push r2\n rjmp start", "puts more onto the stack in every turn of a loop");
    assert_refused("start:\n rcall 1f\n1: rjmp start", "puts more onto the stack in every turn of a loop");
    assert_refused("start:\n pop r2\n rjmp start", "takes more from the stack than it has put there");
}

#[test]
fn a_handler_that_lets_others_in_is_refused() {
    let main = "start:\n sei\n1: rjmp 1b\n";
    assert_refused(&format!("{main}handler:\n sei\n nop\n reti"), "the handler of vector 1 turns interrupts on");
    assert_refused(
        &format!("{main}handler:\n rcall opens\n reti\nopens:\n sei\n ret"),
        "the handler of vector 1 turns interrupts on",
    );
    assert_refused(
        &format!("{main}handler:\n lds r2, 0x0100\n out 0x3f, r2\n reti"),
        "a value that is not a saved SREG",
    );
    assert_refused(&format!("{main}handler:\n ret"), "ends a handler by `ret`");
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
fn a_bound_of_a_function_holds_for_each_of_its_loops_unless_a_record_is_at_one() {
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
}

#[test]
fn a_function_that_goes_over_as_many_bytes_as_its_caller_says_does_so_where_that_is_a_constant() {
    let cycles = |length: &str| {
        let program = format!(
            "start:\n clr r1\n1: wdr\n {length}\n rcall fills\n rjmp 1b\n\
             fills:\n rjmp 3f\n2: st X+, r22\n3: subi r20, 1\n sbci r21, 0\n brcc 2b\n ret"
        );
        let bound = LoopBound { passes: vec![100], by_length: true, because: "a byte a turn".into() };
        let bounds = try_to_prove_with(&program, None, &[("fills".into(), bound)].into()).expect("it has bounds");
        bounds.turn.expect("the watchdog is fed").cycles.expect("every loop has a bound")
    };
    // A byte more is a turn more: st 2, subi 1, sbci 1, brcc 2.
    assert_eq!(cycles("ldi r20, 8\n ldi r21, 0") - cycles("ldi r20, 7\n ldi r21, 0"), 6);
    assert_eq!(cycles("ldi r20, 99\n ldi r21, 0"), cycles("mov r20, r2\n ldi r21, 0"), "the number of the table");
    assert!(cycles("ldi r20, 0\n ldi r21, 1") > cycles("ldi r20, 255\n ldi r21, 0"));
}

#[test]
fn a_bound_for_a_missing_function_is_refused() {
    let bound = LoopBound { passes: vec![3], by_length: false, because: "it counted".into() };
    let loops = LoopBounds::from([("gone".to_owned(), bound)]);
    let error = try_to_prove_with("start: rjmp start", None, &loops).expect_err("it has no such function").to_string();
    assert!(error.contains("no function of the program is called gone"), "{error}");
}

#[test]
fn a_turn_of_the_loop_that_feeds_the_watchdog_has_a_bound_once_every_loop_in_it_has() {
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

/// A program whose first function calls the second one, with r1 zero.
fn calling(caller: &str, called: &str) -> String {
    format!("start:\n clr r1\n sei\n1: rcall caller\n rjmp 1b\ncaller:\n {caller}\n ret\ncalled:\n {called}\n ret")
}

#[test]
fn a_handler_puts_every_register_and_every_flag_back() {
    let main = "start:\n sei\n1: rjmp 1b\n";
    let flags = "push r24\n in r24, 0x3f\n out 0x1e, r24\n inc r24\n in r24, 0x1e\n out 0x3f, r24\n pop r24\n reti";
    proved(&format!("{main}handler:\n {flags}"));
    let without = |line: &str| format!("{main}handler:\n {}", flags.replacen(line, "nop\n", 1));
    assert_refused(&without("out 0x3f, r24\n"), "does not restore flag Z, flag N, flag V, flag S");
    assert_refused(&without("out 0x1e, r24\n"), "a value that is not a saved SREG");
    assert_refused(&format!("{main}handler:\n in r24, 0x09\n reti"), "handler, does not restore r24");
    // On one of two paths.
    assert_refused(&format!("{main}handler:\n sbic 0x09, 2\n in r24, 0x09\n reti"), "does not restore r24");
}

#[test]
fn words_that_are_no_instructions_are_refused() {
    assert_refused("start:\n .word 0xFFFF", "start reaches an address without an instruction of the chip, at 0x0068");
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
fn a_program_sleeps_with_interrupts_on_and_its_handlers_take_longer_to_answer() {
    let handler = "handler:\n reti";
    let bounds = proved(&format!("start:\n sei\n1: sleep\n rjmp 1b\n{handler}"));
    // Response 4, out of sleep 4 more, jmp 3, reti 4.
    assert_eq!(bounds.handlers[0].longest.cycles, Some(15));
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
fn a_call_by_a_constant_address_is_followed_and_one_by_an_unknown_address_leads_to_what_the_program_takes_the_address_of()
 {
    let main = |body: &str| {
        format!(
            "start:\n clr r1\n ldi r16, 0x08\n out 0x3e, r16\n ldi r16, 0xff\n out 0x3d, r16\n1: {body}\n rjmp 1b\none:\n push r2\n pop r2\n ret\ntwo:\n push r2\n push r3\n pop r3\n pop r2\n ret"
        )
    };
    let known = proved(&main("ldi r30, lo8(gs(one))\n ldi r31, hi8(gs(one))\n icall"));
    assert_eq!(known.stack_bytes, 2 + 1);
    assert_eq!(known.indirect.len(), 1);
    // From a variable, which both can have been put into.
    let take = |name: &str| {
        format!("ldi r24, lo8(gs({name}))\n ldi r25, hi8(gs({name}))\n sts 0x0100, r24\n sts 0x0101, r25\n")
    };
    let call = "lds r30, 0x0100\n lds r31, 0x0101\n icall";
    assert_eq!(proved(&main(&format!("{}{call}", take("one")))).stack_bytes, 2 + 1);
    assert_eq!(proved(&main(&format!("{}{}{call}", take("one"), take("two")))).stack_bytes, 2 + 2);
    // A jump through a table in memory could be a computed goto.
    assert_refused(&main("ld r30, X+\n ld r31, X\n ijmp"), "start calls or jumps to an address that it works out");
}

#[test]
fn the_calls_of_a_function_can_be_listed_and_its_recursion_bounded() {
    let facts = |budgets: &str| -> Budgets { toml::from_str(budgets).expect("it is whole") };
    let listed = "start:\n clr r1\n1: icall\n rjmp 1b\none:\n push r2\n pop r2\n ret";
    let bounds = try_to_prove_by(listed, &facts("[calls]\nstart = [\"one\"]")).expect("it has bounds");
    assert_eq!(bounds.stack_bytes, 3);
    let error = try_to_prove_by(listed, &facts("[calls]\nstart = [\"gone\"]")).expect_err("there is none");
    assert!(error.to_string().contains("no function of the program is called gone, which the budgets name in [calls]"));
    let recursive = "start:\n clr r1\n1: rcall one\n rjmp 1b\none:\n push r2\n sbrc r24, 0\n rcall two\n pop r2\n ret\ntwo:\n rcall one\n ret";
    let bounded = facts("[recursion]\none = { depth = 3, because = \"it counts down\" }");
    let bounds = try_to_prove_by(recursive, &bounded).expect("it has bounds");
    // Three times one with its push, and two in between; the third calls two, which calls no fourth.
    assert_eq!(bounds.stack_bytes, 2 + 3 * (1 + 2) + 2 * 2);
}

#[test]
fn a_switch_jumps_to_every_entry_of_its_table_and_to_no_other_function() {
    // The table stands in front of the code, and behind it stands another function's.
    let program = "table:\n .word gs(4f), gs(5f), gs(elsewhere)\n\
        start:\n clr r1\n1: lds r30, 0x0100\n ldi r31, 0\n cpi r30, 2\n brcc 1b\n subi r30, lo8(-(gs(table)))\n sbci r31, hi8(-(gs(table)))\n \
        rjmp __tablejump2__\n4: push r2\n pop r2\n rjmp 1b\n5: push r2\n push r2\n pop r2\n pop r2\n rjmp 1b\n\
        elsewhere:\n push r2\n push r2\n push r2\n pop r2\n pop r2\n pop r2\n rjmp elsewhere\n\
        __tablejump2__:\n lsl r30\n rol r31\n lpm r0, Z+\n lpm r31, Z\n mov r30, r0\n ijmp";
    assert_eq!(proved(program).stack_bytes, 2);
}

#[test]
fn a_function_that_breaks_the_convention_is_found() {
    let breaks = |called: &str, registers: &str| {
        let program = calling("rcall called", called);
        assert_refused(&program, &format!("called does not preserve {registers}, "));
        let unchecked = Budgets { registers: RegisterRule::Unchecked, ..Budgets::default() };
        try_to_prove_by(&program, &unchecked).expect("its stack and time have bounds");
    };
    breaks("lds r16, 0x0100", "r16");
    breaks("sbrc r24, 0\n ldi r16, 1", "r16");
    breaks("mul r24, r22", "r1");
    breaks("ldi r26, 3\n mov r1, r26\n2: dec r1\n brpl 2b", "r1");
    for kept in [
        "push r16\n lds r16, 0x0100\n pop r16",
        "mov r30, r16\n lds r16, 0x0100\n mov r16, r30",
        "lds r24, 0x0100",
        "mul r24, r22\n clr r1",
        // Counted down to zero.
        "ldi r26, 3\n mov r1, r26\n2: dec r1\n brne 2b",
        // Saved in a frame, as `-mcall-prologues` does.
        "push r28\n push r29\n in r28, 0x3d\n in r29, 0x3e\n push r1\n std Y+0, r16\n lds r16, 0x0100\n ldd r16, Y+0\n pop r0\n pop r29\n pop r28",
    ] {
        proved(&calling("rcall called", kept));
    }
}

#[test]
fn a_chip_with_more_flash_puts_longer_addresses_onto_the_stack() {
    let program = "start:\n clr r1\n sei\n1: rcall one\n rjmp 1b\none:\n rcall two\n ret\ntwo:\n ret\nhandler:\n reti";
    let bounds = |chip| {
        let elf = assembled_for(program, chip == "atmega2560");
        prove(&Program::read(elf.path(), Some(chip)).expect("it is an ELF"), &Budgets::default())
            .expect("it has bounds")
    };
    let (small, large) = (bounds("atmega328p"), bounds("atmega2560"));
    assert_eq!((small.stack_bytes, large.stack_bytes), (2 * 2 + 2, 3 * 3));
    assert_eq!(
        (small.handlers[0].longest.cycles, large.handlers[0].longest.cycles),
        (Some(4 + 3 + 4), Some(5 + 3 + 5))
    );
    let error = Program::read(assembled(program).path(), Some("atmega4")).expect_err("there is none").to_string();
    assert!(error.contains("atmega328p"), "{error}");
}

#[test]
fn a_store_through_a_known_pointer_sets_flags_and_stack_pointer_as_out_does() {
    let handler = "handler:\n push r2\n pop r2\n reti";
    // SREG at 0x5F: interrupts are on while a byte is on the stack.
    let on = "ldi r30, 0x5f\n ldi r31, 0\n ldi r24, 0x80\n st Z, r24";
    let bounds = proved(&format!("start:\n {on}\n1: push r2\n pop r2\n rjmp 1b\n{handler}"));
    assert_eq!(bounds.stack_bytes, 1 + 2 + 1);
    let displaced = "ldi r28, 0x50\n ldi r29, 0\n ldi r24, 0x80\n std Y+15, r24";
    assert_eq!(proved(&format!("start:\n {displaced}\n1: push r2\n pop r2\n rjmp 1b\n{handler}")).stack_bytes, 4);
    // SPL at 0x5D.
    let sets = "ldi r26, 0x5e\n ldi r27, 0\n mov r24, r5\n st -X, r24\n ret";
    assert_refused(&calling("rcall called", sets), "sets the stack pointer to an unknown value");
    assert_refused(&calling("rcall called", "sts 0x0010, r24"), "writes to a register by its address in memory");
}

#[test]
fn control_characters_of_a_file_are_not_printed_as_such() {
    let file = tempfile::NamedTempFile::new().expect("there is room for a file");
    for (text, says) in [("\u{1b}[2J", "invalid basic string"), (r"\u001b[2J", r"\u{1b}[2J")] {
        std::fs::write(file.path(), format!("stack_bytes = \"{text}\"")).expect("it can be written");
        let error = Budgets::read(file.path()).expect_err("it is no number").to_string();
        assert!(error.contains(says) && !error.contains('\u{1b}'), "{error}");
    }
}
