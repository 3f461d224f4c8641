//! The interface of the WebAssembly module: one buffer for questions and answers.
//!
//! `room` makes room for a question and returns its address. `answer` answers the question in the buffer and returns
//! the answer's address. `length` returns the answer's length. `read` takes the buffer as the next bytes of a log
//! instead. Each address is valid until the next call. During a long answer the module calls `progress`, which the page
//! provides. No binding generator is used.

use std::cell::RefCell;

thread_local! {
    static BUFFER: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
}

#[link(wasm_import_module = "page")]
unsafe extern "C" {
    fn progress_is(share: f64);
}

/// Reports the progress of a long answer to the page, from 0 to 1.
pub fn progress(share: f64) {
    // SAFETY: the page provides a function with this name. It takes one number and calls nothing of this module.
    unsafe { progress_is(share) }
}

// SAFETY: only this module has these names: it is linked with nothing but Rust's own library, which exports none of
// them.
#[unsafe(no_mangle)]
extern "C" fn room(length: usize) -> *mut u8 {
    BUFFER.with_borrow_mut(|buffer| {
        buffer.clear();
        buffer.resize(length, 0);
        buffer.as_mut_ptr()
    })
}

// SAFETY: as above.
#[unsafe(no_mangle)]
extern "C" fn answer() -> *const u8 {
    let question = BUFFER.take();
    BUFFER.replace(crate::answer(&question).into_bytes());
    BUFFER.with_borrow(Vec::as_ptr)
}

// SAFETY: as above.
#[unsafe(no_mangle)]
extern "C" fn length() -> usize {
    BUFFER.with_borrow(Vec::len)
}

// SAFETY: as above.
#[unsafe(no_mangle)]
extern "C" fn read() {
    crate::record::take(&BUFFER.take());
}
