//! Shared file handling of the host's crates: CSV tables that people made, and files that are written completely or not
//! at all.
//!
//! [`csv_table`] reads a table and names file, line and column where something is wrong. The reader of each table says what
//! the values mean. [`FileError`] is how any file that people write is refused. [`bounded_file`] reads a file up to a limit.
//! [`toml_entry`] names the key where a TOML file is wrong. [`whole_file`] writes a file whole or not at all. The crate knows
//! nothing of weeding.

pub mod bounded_file;
pub mod csv_table;
mod file_error;
pub mod toml_entry;
pub mod whole_file;

pub use csv_table::{CsvTable, Line};
pub use file_error::{FileError, in_a_line};
