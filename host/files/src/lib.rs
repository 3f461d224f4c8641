//! Shared file handling of the host's crates: CSV tables that people made, and files that are written completely or not
//! at all.
//!
//! [`csv_table`] reads a table. Its errors name file, line and column. The caller interprets the values. [`FileError`]
//! is the error for any file that people write. [`whole_file`] writes files. This crate is independent of weeding.

pub mod csv_table;
mod file_error;
pub mod whole_file;

pub use csv_table::{CsvTable, Line};
pub use file_error::{FileError, in_a_line};
