//! Builds the firmware of this workspace.
//!
//! [`build`] runs `cargo firmware` once a process, in its own target directory. So a test or a trial always uses the
//! present sources. [`uno::elf`] reads the ELF.

use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;

use anyhow::{Context, Error, Result, ensure};
use cargo_metadata::Message;

/// A program for the chip.
struct Program {
    /// Its package, which is also its binary's name, and the alias that builds it.
    package: &'static str,
    alias: &'static str,
    /// The path of its ELF, or the error, once it was built in this process.
    built: OnceLock<Result<PathBuf, String>>,
}

static FIRMWARE: Program = Program::new("weeder-firmware", "firmware");
static BENCH: Program = Program::new("knn-bench", "bench-firmware");
static TESTER: Program = Program::new("tester-firmware", "tester-firmware");

/// Variables of an outer cargo or a shell that would change how the firmware is compiled.
const FOREIGN_SETTINGS: [&str; 9] = [
    // Either of the flags replaces the target-cpu of .cargo/config.toml.
    "RUSTFLAGS",
    "CARGO_ENCODED_RUSTFLAGS",
    "CARGO_BUILD_RUSTFLAGS",
    "CARGO_BUILD_TARGET",
    // Compiled in parts, the handlers' assembly is not accepted.
    "CARGO_INCREMENTAL",
    // `cargo clippy` sets it. It would check the firmware instead of compiling it.
    "RUSTC_WORKSPACE_WRAPPER",
    "RUSTC",
    // The workspace's rust-toolchain.toml decides.
    "RUSTUP_TOOLCHAIN",
    // It puts a commit into a release's firmware. Measurements must not depend on that.
    "WEEDER_COMMIT",
];

/// Builds the firmware of this workspace and returns the path of its ELF.
///
/// Cargo runs at most once a process; later calls return the first one's answer. Its progress and the compiler's
/// messages go to standard error.
///
/// # Errors
/// Where cargo cannot be started, fails, or makes no ELF.
pub fn build() -> Result<PathBuf> {
    FIRMWARE.build_once()
}

/// Builds the classifier's bench, which [`bench`](mod@crate::bench) runs, and returns the path of its ELF.
///
/// # Errors
/// As [`build`].
pub fn build_bench() -> Result<PathBuf> {
    BENCH.build_once()
}

/// Builds the firmware of the tester, the Uno that checks another one. Returns the path of its ELF.
///
/// # Errors
/// As [`build`].
pub fn build_tester() -> Result<PathBuf> {
    TESTER.build_once()
}

impl Program {
    const fn new(package: &'static str, alias: &'static str) -> Self {
        Self { package, alias, built: OnceLock::new() }
    }

    fn build_once(&self) -> Result<PathBuf> {
        self.built.get_or_init(|| self.build().map_err(|error| format!("{error:#}"))).clone().map_err(Error::msg)
    }

    fn build(&self) -> Result<PathBuf> {
        let mut command = Command::new("cargo");
        command
            .args([self.alias, "--message-format", "json-render-diagnostics"])
            .arg("--target-dir")
            .arg(target_directory())
            .current_dir(workspace_root())
            .stdin(Stdio::null())
            .stdout(Stdio::piped());
        for name in FOREIGN_SETTINGS {
            command.env_remove(name);
        }
        const START: &str = "cargo could not be started: put it on PATH, ./setup.sh says how";
        let mut cargo = command.spawn().context(START)?;

        let mut elf = None;
        if let Some(messages) = cargo.stdout.take() {
            for message in Message::parse_stream(BufReader::new(messages)) {
                match message.context("cargo's messages could not be read")? {
                    Message::CompilerArtifact(artifact) if artifact.target.name == self.package => {
                        elf = artifact.executable.map(PathBuf::from).or(elf);
                    }
                    _ => {}
                }
            }
        }
        let status = cargo.wait().context(START)?;
        ensure!(
            status.success(),
            "`cargo {}` failed ({status}): see its messages above; if a tool is missing, run ./setup.sh",
            self.alias
        );
        elf.with_context(|| {
            format!("no ELF was made: the package `{}` should have a binary of that name", self.package)
        })
    }
}

/// The folder of the workspace's Cargo.toml, two above this crate's.
pub fn workspace_root() -> &'static Path {
    let this_crate = Path::new(env!("CARGO_MANIFEST_DIR"));
    this_crate.ancestors().nth(2).unwrap_or(this_crate)
}

/// A separate target directory for the firmware. An outer cargo locks the usual one while it runs a test.
fn target_directory() -> PathBuf {
    let usual = std::env::var_os("CARGO_TARGET_DIR").unwrap_or_else(|| "target".into());
    workspace_root().join(usual).join("firmware")
}
