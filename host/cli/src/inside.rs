//! The files of a release inside this program. Other builds have none: they build the firmware, and read the page.

/// The files, as build.rs has put them in.
pub struct Inside {
    /// The firmware of each chip, its budgets and the bootloader: names and contents.
    pub firmware: &'static [(&'static str, &'static [u8])],
    /// The page: its content, style and script.
    pub page: [&'static [u8]; 3],
}

/// `None` if this program is not a release's.
pub const INSIDE: Option<Inside> = include!(concat!(env!("OUT_DIR"), "/inside.rs"));
