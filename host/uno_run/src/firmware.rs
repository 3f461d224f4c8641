//! The firmware: that inside this program, or else that of this workspace.
//!
//! A release has its firmware inside, with its budgets: its program calls [`put_inside`]. It is written to the user's
//! cache folder, from where it is read as any other. Otherwise [`build`] runs `cargo firmware` once a process, in its own target directory. So a test or a
//! trial always uses the present sources. [`uno::elf`] reads the ELF.

use std::fs;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;

use anyhow::{Context, Error, Result, anyhow, ensure};
use cargo_metadata::Message;
use etcetera::BaseStrategy;
use files::whole_file;

/// Where releases are. `None` until there is such a place.
pub const RELEASES: Option<&str> = None;

/// The files inside this program, if it is a release: their names and contents.
static INSIDE: OnceLock<&[(&str, &[u8])]> = OnceLock::new();

/// The folder with the files inside, or the error, once they were written in this process.
static WRITTEN: OnceLock<Result<PathBuf, String>> = OnceLock::new();

/// The variable that names the cache folder.
const CACHE: &str = if cfg!(windows) { "LOCALAPPDATA" } else { "XDG_CACHE_HOME" };

/// A program for the chip.
pub struct Program {
    /// Its package, which is also its binary's name, and the alias that builds it.
    package: &'static str,
    alias: &'static str,
    /// The path of its ELF, or the error, once it was built in this process.
    built: OnceLock<Result<PathBuf, String>>,
}

static FIRMWARE: Program = Program::new("weeder-firmware", "firmware");
/// The classifier's bench, which [`bench`](mod@crate::bench) runs.
pub static BENCH: Program = Program::new("knn-bench", "bench-firmware");
/// The firmware of the tester, the Uno that checks another one.
pub static TESTER: Program = Program::new("tester-firmware", "tester-firmware");

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

/// Uses these files in place of building them: the ELFs, their budgets, and `optiboot.hex`. Only the first call counts.
pub fn put_inside(files: &'static [(&'static str, &'static [u8])]) {
    INSIDE.get_or_init(|| files);
}

/// The firmware's ELF.
///
/// # Errors
/// As [`Program::elf`].
pub fn build() -> Result<PathBuf> {
    FIRMWARE.elf()
}

impl Program {
    const fn new(package: &'static str, alias: &'static str) -> Self {
        Self { package, alias, built: OnceLock::new() }
    }

    /// The program's ELF: that inside this program, or else that of this workspace, which is built.
    ///
    /// Cargo runs at most once a process; later calls return the first one's answer. Its progress and the compiler's
    /// messages go to standard error.
    ///
    /// # Errors
    /// If it can neither be written nor built: cargo cannot be started, fails, or makes no ELF.
    pub fn elf(&self) -> Result<PathBuf> {
        if let Some(folder) = inside()? {
            return Ok(folder.join(self.package).with_extension("elf"));
        }
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
        let start = || {
            let releases = RELEASES.map(|at| format!(", see {at}")).unwrap_or_default();
            format!(
                "cargo could not be started, and this weeder has no firmware inside, as that of a release has{releases}: \
                 put cargo on PATH, ./setup.sh says how, or name the firmware's file by --elf"
            )
        };
        let mut cargo = command.spawn().with_context(start)?;

        let mut elf = None;
        if let Some(messages) = cargo.stdout.take() {
            for message in Message::parse_stream(BufReader::new(messages)) {
                if let Message::CompilerArtifact(artifact) = message.context("cargo's messages could not be read")?
                    && artifact.target.name == self.package
                {
                    elf = artifact.executable.map(PathBuf::from).or(elf);
                }
            }
        }
        let status = cargo.wait().with_context(start)?;
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

/// The file with the budgets of the firmware, or of the tester.
///
/// # Errors
/// If this program has it inside, and it cannot be written.
pub fn budgets(tester: bool) -> Result<PathBuf> {
    let name = if tester { "yard/tester/budgets.toml" } else { "budgets.toml" };
    Ok(inside()?.unwrap_or_else(workspace_root).join(name))
}

/// The HEX file of Optiboot, the Uno's bootloader, if this program has it inside.
///
/// # Errors
/// If it cannot be written.
pub fn optiboot() -> Result<Option<PathBuf>> {
    Ok(inside()?.map(|folder| folder.join("optiboot.hex")))
}

/// The folder with the files of this program, if it is a release.
fn inside() -> Result<Option<&'static Path>> {
    let Some(files) = INSIDE.get() else { return Ok(None) };
    let written = WRITTEN.get_or_init(|| {
        let home = etcetera::choose_base_strategy()
            .map_err(|error| format!("no folder for the firmware: {error}: let HOME name a writable folder"))?;
        write(files, &home.cache_dir()).map_err(|error| format!("{error:#}"))
    });
    written.as_deref().map(Some).map_err(|error| Error::msg(error.clone()))
}

/// Writes the files into a folder of the cache, another one for each build of this program. Files that are there stay.
fn write(files: &[(&str, &[u8])], cache: &Path) -> Result<PathBuf> {
    let mut hash = DefaultHasher::new();
    files.hash(&mut hash);
    let folder = cache.join("weeder").join(format!("firmware-{:016x}", hash.finish()));
    for (name, content) in files {
        let path = folder.join(name);
        if fs::read(&path).is_ok_and(|there| there == *content) {
            continue;
        }
        fs::create_dir_all(path.parent().unwrap_or(&folder))
            .and_then(|()| whole_file::write(&path, |to| to.write_all(content)))
            .map_err(|error| {
                let path = path.display();
                anyhow!("the firmware cannot be written to {path}: {error}: let {CACHE} name a writable folder")
            })?;
    }
    Ok(folder)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_damaged_firmware_is_written_again_and_builds_do_not_mix() {
        let cache = tempfile::tempdir().unwrap();
        let build: [(&str, &[u8]); 2] = [("weeder-firmware.elf", b"new"), ("yard/tester/budgets.toml", b"stack = 1")];
        let folder = write(&build, cache.path()).unwrap();
        let elf = folder.join("weeder-firmware.elf");
        fs::write(&elf, b"ne").unwrap();
        assert_eq!(write(&build, cache.path()).unwrap(), folder);
        assert_eq!(fs::read(&elf).unwrap(), b"new");
        assert_eq!(fs::read(folder.join("yard/tester/budgets.toml")).unwrap(), b"stack = 1");
        assert_ne!(write(&[("weeder-firmware.elf", b"newer")], cache.path()).unwrap(), folder);
        assert_eq!(fs::read(&elf).unwrap(), b"new");
    }

    #[test]
    fn a_firmware_that_cannot_be_written_names_the_cache_variable() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let error = write(&[("weeder-firmware.elf", b"new")], file.path()).unwrap_err().to_string();
        assert!(error.ends_with(&format!(": let {CACHE} name a writable folder")), "{error}");
    }

    #[test]
    fn the_readme_links_to_releases_where_there_are_some() {
        let readme = fs::read_to_string(workspace_root().join("README.md")).unwrap();
        let linked = readme.split("](").filter(|link| link.starts_with("http")).find(|link| link.contains("releases"));
        assert_eq!(linked.and_then(|link| link.split(')').next()), RELEASES);
    }
}
