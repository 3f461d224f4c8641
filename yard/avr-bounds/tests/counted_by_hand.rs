//! Proofs of small assembly programs. Their stack can be counted by hand.

mod assembled;

use assembled::{assembled, assembled_for, assert_refused, proved, try_to_prove_by};
use avr_bounds::{Budgets, Program, RegisterRule, prove};

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
fn an_indirect_call_reaches_its_constant_or_any_taken_address() {
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
    let refused = |chip| Program::read(assembled(program).path(), Some(chip)).expect_err("it is another").to_string();
    let error = refused("atmega4");
    assert!(error.contains("atmega328p"), "{error}");
    // Chips with other vectors, and with other return addresses.
    for (chip, core) in [("atmega88", "avr4"), ("atmega2560", "avr6")] {
        let error = refused(chip);
        assert!(error.contains("was made for the core avr5") && error.contains(core), "{error}");
    }
}

#[test]
fn a_store_through_a_known_pointer_acts_like_out() {
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

#[test]
fn a_virtual_call_reaches_the_slot_that_its_loads_select() {
    let called = |loads: &str| {
        let bounds = proved(&format!(
            "start:\n clr r1\n ldi r16, 0x08\n out 0x3e, r16\n ldi r16, 0xff\n out 0x3d, r16\n lds r26, obj\n lds r27, obj+1\n ld r18, X+\n ld r19, X\n movw r26, r18\n {loads}\n icall\n1: rjmp 1b\n\
             first:\n ret\nsecond:\n push r2\n push r3\n pop r3\n pop r2\n ret\n\
             .data\n.type _ZTV1A, @object\n_ZTV1A: .word 0, 0, gs(first), gs(second)\n.size _ZTV1A, . - _ZTV1A\n\
             obj: .word it\nit: .word _ZTV1A + 4"
        ));
        let all = bounds.indirect.iter().flat_map(|call| &call.targets);
        let names = all.map(|target| target.split(' ').nth(1).expect("it has a name").to_owned());
        (names.collect::<Vec<_>>(), bounds.stack_bytes)
    };
    assert_eq!(called("ld r30, X+\n ld r31, X"), (vec!["first".to_owned()], 2));
    assert_eq!(called("ld r24, X+\n ld r25, X+\n ld r30, X+\n ld r31, X"), (vec!["second".to_owned()], 2 + 2));
    assert_eq!(called("ld r24, X+\n ld r25, X+\n ld r31, -X\n ld r30, -X"), (vec!["first".to_owned()], 2));
    // In front of the table, and two bytes that are not side by side.
    assert_eq!(called("ld r31, -X\n ld r30, -X").0, ["first", "second"]);
    assert_eq!(called("ld r30, X\n ld r31, X").0, ["first", "second"]);
}

#[test]
fn calls_within_calls_are_followed_to_a_depth_that_the_host_has_room_for() {
    let chain = |length: usize| -> String {
        let functions = (1..length).map(|number| format!("f{number}:\n rcall f{}\n ret\n", number + 1));
        format!("start:\n rcall f1\n rjmp start\n{}f{length}:\n ret", functions.collect::<String>())
    };
    assert_eq!(proved(&chain(199)).stack_bytes, 2 * 199);
    assert_refused(&chain(200), "200 functions call each other on the way to f200");
    assert_refused(&chain(2500), "call fewer within each other");
}
