//! Checks that every function keeps the calling convention, and that handlers change nothing.
//!
//! Every function preserves R2 to R17, R28 and R29, and leaves zero in R1. This also finds a missing push or pop in
//! assembly. Assembly also calls parts of a function that have no symbol of a function; only the function around them is
//! held to the convention. A handler leaves every register and every flag as it found them. This proof does not check that handlers
//! and main program share memory correctly. Rust ensures that.

use crate::effects::Registers;
use crate::error::BoundsError;
use crate::flow::Code;
use crate::routine::{Kind, Node, Routine};
use std::collections::BTreeMap;
use std::rc::Rc;

/// The register that is zero except between instructions that change it (AVR calling convention).
const ZERO: usize = 1;

/// Proves that functions keep the calling convention, and that handlers restore all registers and flags.
pub(crate) fn prove(program: &Code, handlers: &BTreeMap<u8, Rc<Routine>>) -> Result<(), BoundsError> {
    let is_named = |routine: &Routine| program.elf.functions.contains_key(&routine.entry.address);
    let functions = program.routines().filter(|routine| routine.entry.kind == Kind::Function && is_named(routine));
    for routine in functions.filter(|routine| !routine.returns.is_empty()) {
        let broken = |routine: &Routine| {
            let zero = if routine.leaves_zero { Registers::empty() } else { Registers::one(ZERO) };
            (Registers::PRESERVED - routine.keeps) | zero
        };
        // An error names the function itself, not its caller.
        let called = routine.nodes.iter().flat_map(Node::called);
        let called = called.filter(|called| !called.returns.is_empty() && is_named(called));
        let broken = broken(routine) - called.map(|called| broken(called)).collect();
        if !broken.is_empty() {
            let function = program.name_of(routine.entry);
            return Err(BoundsError(format!(
                "{function} does not preserve {broken}, which the calling convention asks of every function: mend it, or write \
                 `registers = \"unchecked\"` into the budgets"
            )));
        }
    }
    for (&vector, handler) in handlers {
        let clobbered = Registers::ALL - handler.keeps;
        // A handler that never returns may change registers.
        if !clobbered.is_empty() && !handler.returns.is_empty() {
            let function = program.name_of(handler.entry);
            let reason = format!("the handler of vector {vector}, {function}, does not restore {clobbered}");
            return Err(BoundsError(reason));
        }
    }
    Ok(())
}
