//! The real firmware in its field: measured, at pseudo terminals, in logs that are replayed, and before a satellite receiver.
//!
//! One file a subject. They are modules of one test program, so that it is linked once, and tests that wait for a machine in real time
//! leave the processor's cores to those that compute.

mod bench;
mod live;
mod live_rows;
mod log_replay;
mod places;
