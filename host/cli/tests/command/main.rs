//! The `weeder` command as a user calls it: what it prints, writes, refuses and does with the Unos at its ports.
//!
//! One file a subject. They are modules of one test program, so that it is linked once, and tests that wait for a machine leave the
//! processor's cores to those that compute.

mod any_file;
mod bad_input;
mod common;
mod completions;
mod design;
mod destinations;
mod evaluate;
mod field_trials;
mod flashing;
mod host_tools;
mod language;
mod manual;
mod plan;
mod printing;
mod serve;
mod set_up;
mod several_rows;
mod shards;
mod tables_of_the_manual;
mod training;
mod typed;
