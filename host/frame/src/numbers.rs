//! Numbers on the command line. Each has a range, which errors and `--help` show.

use clap::{Arg, Command};
use std::fmt::Display;
use std::ops::RangeInclusive;
use std::str::FromStr;

/// A number in a range.
pub fn number_within(range: RangeInclusive<f64>) -> impl Fn(&str) -> Result<f64, String> + Clone {
    move |text| within(text, &range, "a number")
}

/// A whole number in a range.
pub fn whole_within<T>(range: RangeInclusive<T>) -> impl Fn(&str) -> Result<T, String> + Clone
where
    T: FromStr + PartialOrd + Display + Clone,
{
    move |text| within(text, &range, "a whole number")
}

fn within<T: FromStr + PartialOrd + Display>(text: &str, range: &RangeInclusive<T>, kind: &str) -> Result<T, String> {
    let number = text.trim().parse().ok().filter(|number| range.contains(number));
    number.ok_or_else(|| format!("it has to be {kind} from {} to {}", range.start(), range.end()))
}

/// The same command, but options accept a value that begins with a minus. So the error for a wrong value shows its
/// range, and not that it is no option.
pub fn with_negative_numbers(command: Command) -> Command {
    let take = |option: Arg| match option.get_value_delimiter() {
        _ if option.is_positional() || !option.get_action().takes_values() => option,
        None => option.allow_negative_numbers(true),
        // An option with several numbers is no single number.
        Some(_) => option.allow_hyphen_values(true),
    };
    command.mut_args(take).mut_subcommands(with_negative_numbers)
}
