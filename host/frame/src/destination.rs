//! The output files of all commands, checked before any work.
//!
//! The rule for `--out`: a report of a page or several files goes into a folder (`FOLDER`), which is created if needed.
//! A single table goes to a file (`FILE.csv`), and so does a study's part. The types ensure that an argument is checked
//! before it is written to. A command checks before it works. Errors after the work, such as a full disk, are reported
//! after the result has been printed.
//!
//! An existing file may hold a user's work: a filled-in table, tuned settings, comments. A command cannot detect that.
//! So no command replaces a file without [`Replace`], the option `--force`. A test in `main.rs` checks every argument
//! that names an output. `--force` does not allow an output that is also another file of its command: [`check`].

use crate::Results;
use anyhow::{Context, Result, bail, ensure};
use clap::{ArgMatches, Args};
use field::conditions::Conditions;
use files::whole_file;
use std::any::Any;
use std::ffi::OsString;
use std::fs;
use std::io::{ErrorKind, Write};
use std::path::{self, Path, PathBuf};
use std::sync::OnceLock;

/// Endings of files that commands write. A folder's name hardly ends so.
const FILE_ENDINGS: [&str; 9] = ["csv", "geojson", "hex", "html", "json", "rs", "svg", "toml", "vcd"];

/// Whether files that are there are replaced.
#[derive(Args, Clone, Copy, Debug, Default)]
pub struct Replace {
    /// Replace existing files.
    #[arg(long)]
    force: bool,
}

/// The name of an output file or folder, as typed.
#[derive(Clone, Debug)]
pub struct OutName(PathBuf);

/// A file that was writable when it was checked.
#[derive(Debug)]
pub struct OutFile(PathBuf);

/// A folder in which these files were writable when it was checked. It may not exist yet.
#[derive(Debug)]
pub struct OutFolder {
    folder: PathBuf,
    names: Vec<String>,
}

impl Replace {
    /// Whether a file may be written: it does not exist, is empty, is a device, or is to be replaced.
    fn check(self, path: &Path) -> Result<()> {
        let holds_something = path.metadata().is_ok_and(|there| there.is_file() && there.len() > 0);
        ensure!(
            self.force || !holds_something,
            "{} is there already: choose another name, or have --force replace it",
            path.display()
        );
        Ok(())
    }
}

impl From<OsString> for OutName {
    fn from(name: OsString) -> Self {
        Self(name.into())
    }
}

impl OutName {
    /// Checks that a file of this name can be written without losing a file.
    pub fn file(&self, replace: Replace) -> Result<OutFile> {
        // What ends in a separator names a folder, which may not exist yet.
        let name = self.0.file_name().unwrap_or_default().as_encoded_bytes();
        let names_file = self.0.as_os_str().as_encoded_bytes().ends_with(name);
        ensure!(names_file && !self.0.is_dir(), "{} is a folder: name a file", self.0.display());
        replace.check(&self.0)?;
        whole_file::check(&self.0).with_context(|| cannot_be_written(&self.0))?;
        Ok(OutFile(self.0.clone()))
    }

    /// Checks that files of these names can be written into a folder of this name without losing a file.
    pub fn folder<N: Into<String>>(&self, names: impl IntoIterator<Item = N>, replace: Replace) -> Result<OutFolder> {
        let folder = &self.0;
        ensure!(!folder.exists() || folder.is_dir(), "{} is a file: name a folder", folder.display());
        let ending = folder.extension().and_then(|ending| ending.to_str());
        if !folder.exists() && ending.is_some_and(|ending| FILE_ENDINGS.contains(&ending)) {
            bail!("{} is named like a file: name a folder, for several files", folder.display());
        }
        // In a link to nothing, or below a name that is too long, no folder can be made.
        let is_absent = |part: &Path| part.symlink_metadata().is_err_and(|error| error.kind() == ErrorKind::NotFound);
        let there = folder.ancestors().find(|part| !is_absent(part)).unwrap_or(Path::new("."));
        whole_file::check_folder(there).with_context(|| cannot_be_written(folder))?;
        let names: Vec<String> = names.into_iter().map(Into::into).collect();
        for path in names.iter().map(|name| folder.join(name)) {
            ensure!(!path.is_dir(), "{} is a folder, and a file would take its place", path.display());
            let is_taken = TAKEN.get().is_some_and(|taken| taken.contains(&full(&path)));
            ensure!(!is_taken, "{} has two uses in this command: name another folder", path.display());
            replace.check(&path)?;
            if path.exists() {
                whole_file::check(&path).with_context(|| cannot_be_written(&path))?;
            }
        }
        Ok(OutFolder { folder: folder.clone(), names })
    }

    /// The name.
    pub fn path(&self) -> &Path {
        &self.0
    }
}

impl OutFile {
    /// Writes it whole, or leaves what was there.
    pub fn write(&self, contents: impl FnOnce(&mut dyn Write) -> Result<()>) -> Result<()> {
        whole_file::write(&self.0, contents).with_context(|| cannot_be_written(&self.0))
    }

    /// The name.
    pub fn path(&self) -> &Path {
        &self.0
    }
}

impl OutFolder {
    /// Makes the folder if necessary.
    pub fn make(&self) -> Result<()> {
        fs::create_dir_all(&self.folder).with_context(|| format!("the folder {} cannot be made", self.folder.display()))
    }

    /// Writes a whole file there, or leaves the old file. Makes the folder if necessary. The name has to be a checked one.
    pub fn write(&self, name: &str, contents: impl FnOnce(&mut dyn Write) -> Result<()>) -> Result<()> {
        ensure!(self.names.iter().any(|checked| checked == name), "{name} was not checked before it was written");
        self.make()?;
        OutFile(self.folder.join(name)).write(contents)
    }

    /// The name.
    pub fn path(&self) -> &Path {
        &self.folder
    }
}

/// The files that the command line names, for the names of a folder, which its command knows.
static TAKEN: OnceLock<Vec<PathBuf>> = OnceLock::new();

/// Checks the files of a parsed command line. Fails, in words, if an output is also an input or another output, or if
/// standard input is named twice. A name may not be empty: a shell's variable may be unset. A `-` that is left names no
/// file: a parser replaces it where standard input is read.
pub(crate) fn check(words: &ArgMatches) -> Result<(), String> {
    if let Some((_, words)) = words.subcommand() {
        return check(words);
    }
    let field = words.try_get_one::<String>("field").ok().flatten();
    let field = field.filter(|field| Conditions::preset(field).is_none());
    let inputs: Vec<&Path> = values::<PathBuf>(words).map(PathBuf::as_path).chain(field.map(Path::new)).collect();
    let outputs: Vec<&Path> = values::<OutName>(words).map(OutName::path).collect();
    if let Some(none) = inputs.iter().chain(&outputs).find(|path| ["", "-"].map(Path::new).contains(path)) {
        return Err(format!("{none:?} is no file here: name one"));
    }
    if inputs.iter().filter(|path| path.as_os_str() == "/dev/stdin").count() > 1 {
        return Err("standard input is read once: name - once".to_owned());
    }
    let mut taken: Vec<PathBuf> = inputs.into_iter().map(full).collect();
    for output in outputs {
        let full = full(output);
        let is_device = full.metadata().is_ok_and(|there| !there.is_file() && !there.is_dir());
        if !is_device && taken.contains(&full) {
            return Err(format!("{} has two uses in this command: name another output", output.display()));
        }
        taken.push(full);
    }
    // A process has one command line. Tests parse several.
    let _ = TAKEN.set(taken);
    Ok(())
}

/// The values of this type, of all arguments.
fn values<T: Any + Clone + Send + Sync>(words: &ArgMatches) -> impl Iterator<Item = &T> {
    words.ids().filter_map(move |id| words.try_get_many::<T>(id.as_str()).ok().flatten()).flatten()
}

/// One path for all names of a file. The file may not exist yet.
fn full(name: &Path) -> PathBuf {
    let in_folder = || {
        let name = path::absolute(name).ok()?;
        Some(name.parent()?.canonicalize().ok()?.join(name.file_name()?))
    };
    name.canonicalize().ok().or_else(in_folder).unwrap_or_else(|| name.to_owned())
}

/// Writes a file that the user asked for, and prints its name behind a title, unless the output is JSON.
pub fn write_if_asked(
    file: Option<&OutFile>,
    title: &str,
    json: bool,
    contents: impl FnOnce(&mut dyn Write) -> Result<()>,
) -> Result<()> {
    let Some(file) = file else { return Ok(()) };
    file.write(contents)?;
    if json { Ok(()) } else { writeln!(Results, "{title:<12}{}", file.path().display()) }
}

fn cannot_be_written(path: &Path) -> String {
    format!("{} cannot be written", path.display())
}
