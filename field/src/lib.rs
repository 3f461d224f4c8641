//! The field on a desk: the simulated row and machine, the virtual Uno that runs the real firmware, and their reports.
//!
//! - **The field**: [`row`] says what stands in the row, [`planting`] grows one by chance, [`ground`] counts which ground is
//!   covered. [`motion`] is how the machine rolls, [`machine`] turns both into levels on the firmware's pins ([`signal`]),
//!   and [`servo`] is what its pulses do to the tool.
//! - **The virtual Uno**: [`firmware`] builds and reads the ELF, [`hex`] reads bootloaders and writes what avrdude takes, [`uno`] runs
//!   it on simavr and proves what it can need at most ([`uno::bounds`]), [`console`] talks to it. [`live`] runs it in real time, at
//!   a serial port that other programs open ([`pty`]).
//! - **Trials**: [`trial`] joins them, [`verdict`] judges what happened to each plant, [`report`] and [`picture`] show it,
//!   and [`waveform`] writes down what was on the pins. [`replay`] plays a recording ([`capture`]) instead of a row, and
//!   [`mod@bench`] counts cycles and bytes.
//! - **Field trials**: under some [`conditions`], [`stand`] grows what the tools meet and [`driving`] rolls through it; [`experiment`]
//!   has the firmware weed it, on the virtual Uno or as its native [`twin`], and its [`rivals`] after it; [`tool_path`] counts plants and
//!   weeds, [`sweep`] maps a result against parameters. [`evaluation`] judges the plots of a trial, real or simulated, with the
//!   [`statistics`] that this takes, and [`page`] shows them in a browser.
//! - **Soak**: [`soak`] has everything go wrong now and then, for hours.
//! - **Training**: [`training`] makes the example table that the firmware carries, of labelled objects.
//! - **Files**: [`whole_file`] writes one whole or not at all.
//! - **Wiring**: [`wiring`] says what is wired to which contact of the Uno, as a table and as a diagram.

pub mod bench;
pub mod capture;
pub mod conditions;
pub mod console;
mod csv_table;
mod drawing;
pub mod driving;
pub mod evaluation;
pub mod experiment;
pub mod firmware;
pub mod ground;
pub mod hex;
pub mod link;
pub mod live;
pub mod machine;
pub mod motion;
pub mod page;
pub mod picture;
pub mod planting;
pub mod pty;
pub mod replay;
pub mod report;
pub mod rivals;
pub mod row;
pub mod servo;
pub mod signal;
pub mod soak;
pub mod stand;
pub mod statistics;
pub mod sweep;
pub mod tool_path;
pub mod training;
pub mod trial;
pub mod twin;
pub mod uno;
pub mod verdict;
pub mod waveform;
pub mod whole_file;
pub mod wiring;
