//! The `weeder` command as a user runs it: its output, files, errors, and its work with Unos at its ports.
//!
//! Each file has one subject. All are modules of one test program, so that it is linked once. Tests that wait for a
//! machine leave the cores to those that compute.

mod a_whole_set_up;
mod any_file;
mod bad_input;
mod common;
mod completions;
mod design;
mod destinations;
mod evaluate;
mod field_trials;
mod flashing;
mod full_screen;
mod host_tools;
mod language;
mod manual;
mod maps;
mod newer;
mod plan;
mod printing;
mod serve;
mod set_up;
mod several_rows;
mod shards;
mod tables_of_the_manual;
mod training;
