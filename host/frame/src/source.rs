//! Input files of commands: `-` is standard input. Some words are known names instead of files, and a shell's
//! completion offers them.

use crate::Messages;
use clap::builder::{OsStringValueParser, PossibleValue, TypedValueParser};
use clap::{Arg, Command};
use field::conditions::{Conditions, presets};
use files::FileError;
use std::ffi::{OsStr, OsString};
use std::path::PathBuf;

/// An input file.
pub fn file() -> impl TypedValueParser<Value = PathBuf> {
    OsStringValueParser::new().try_map(|name| named(name).map(PathBuf::from))
}

/// A field's preset, or a file; a shell that completes offers the presets.
pub fn preset_or_file() -> impl TypedValueParser<Value = String> {
    let in_text = |name: OsString| name.into_string().map_err(|name| format!("{name:?} is no UTF-8: rename the file"));
    offering(|| presets().collect(), OsStringValueParser::new().try_map(move |name| in_text(named(name)?)))
}

/// A file's name, or a word with another meaning. Fails only if the system has no file for standard input.
fn named(name: OsString) -> Result<OsString, String> {
    match name.to_str() {
        Some("-") if cfg!(unix) => Ok("/dev/stdin".into()),
        Some("-") => Err("standard input cannot be read here: name a file".to_owned()),
        _ => Ok(name),
    }
}

/// The conditions of a field. Prints what is likely wrong with them. Fails if it is neither a preset nor a valid file.
pub fn field(preset_or_file: &str) -> Result<Conditions, FileError> {
    Conditions::load(preset_or_file).inspect(warn)
}

/// Prints what is likely wrong with these conditions.
pub fn warn(conditions: &Conditions) {
    conditions.warning().iter().for_each(|warning| writeln!(Messages, "Warning: {warning}"));
}

/// A value that `parser` reads. A shell's completion offers these names, but other words are also accepted.
pub fn offering<P: TypedValueParser>(
    names: fn() -> Vec<&'static str>,
    parser: P,
) -> impl TypedValueParser<Value = P::Value> {
    Offering { names, parser }
}

#[derive(Clone)]
struct Offering<P> {
    names: fn() -> Vec<&'static str>,
    parser: P,
}

impl<P: TypedValueParser> TypedValueParser for Offering<P> {
    type Value = P::Value;

    fn parse_ref(&self, command: &Command, argument: Option<&Arg>, value: &OsStr) -> Result<P::Value, clap::Error> {
        self.parser.parse_ref(command, argument, value)
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        Some(Box::new((self.names)().into_iter().map(PossibleValue::new)))
    }
}
