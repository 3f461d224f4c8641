//! Shared file handling of the host's crates: CSV tables that people made, and files that are written completely or not
//! at all.
//!
//! [`csv_table`] reads a table and names file, line and column where something is wrong; what the values mean is for the reader
//! of each table to say. [`FileError`] is how any file that people write is refused. [`text_file`] reads one up to a limit. [`toml_entry`] names the key where a TOML file is wrong. [`whole_file`] writes a file whole or not at
//! all. It knows nothing of weeding.

pub mod csv_table;
mod file_error;
pub mod text_file;
pub mod toml_entry;
pub mod whole_file;

pub use csv_table::{CsvTable, Line};
pub use file_error::{FileError, in_a_line};
