//! The door of the WebAssembly module: one buffer, in which a question is put and its answer is found.
//!
//! `room` makes room for a question and says where, `answer` answers what stands there and says where the answer is, and `length`
//! how long. Each place holds until the next call. No binding generator has a part in it.

use std::cell::RefCell;

thread_local! {
    static BUFFER: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
}

// SAFETY: the three names are this module's alone: it is linked with nothing but Rust's own library, which exports none of them.
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
