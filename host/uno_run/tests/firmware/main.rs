//! Tests of the real firmware in its field: benchmarks, pseudo terminals, replayed logs, and a satellite receiver.
//!
//! Each file has one subject. All are modules of one test program, so that it is linked once. Tests that wait in real
//! time leave the cores to those that compute.

mod bench;
mod live;
mod live_rows;
mod log_replay;
mod places;
