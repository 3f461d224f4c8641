//! Writes a file completely or not at all: after an error the old file is still there.
//!
//! The text goes to a temporary file in the same folder, which is then renamed. If the path is a link, its target is
//! replaced. Paths that are no files, such as `/dev/null` or a pipe, are written directly, once the text is complete.
//! Folders are not made. Error messages name the path, not the temporary file.

use std::borrow::Cow;
use std::fs::OpenOptions;
use std::io::{self, ErrorKind, Write};
#[cfg(unix)]
use std::os::unix::fs::{MetadataExt, fchown};
use std::path::{Path, PathBuf};
use tempfile::{Builder, NamedTempFile};

/// Writes a file, or replaces one.
///
/// # Errors
/// The errors of the system and of `contents`. The old file is then unchanged.
pub fn write<E: From<io::Error>>(path: &Path, contents: impl FnOnce(&mut dyn Write) -> Result<(), E>) -> Result<(), E> {
    let path = target(path);
    if is_device(&path) {
        let mut device = OpenOptions::new().write(true).open(&path)?;
        // A buffered writer would try again when it is dropped, behind what a failed try has written.
        let mut text = Vec::new();
        contents(&mut text)?;
        return Ok(device.write_all(&text)?);
    }
    let mut file = temporary(&path)?;
    // A file that its owner alone may read stays so, also if root writes it. Some file systems have no such permissions.
    #[cfg(unix)]
    if let Ok(there) = path.metadata() {
        let _ = fchown(file.as_file(), Some(there.uid()), Some(there.gid()));
        let _ = file.as_file().set_permissions(there.permissions());
    }
    let mut buffered = io::BufWriter::new(file.as_file_mut());
    contents(&mut buffered)?;
    buffered.flush()?;
    drop(buffered);
    // After a loss of power, the name could lead to an empty file.
    saved(file.as_file().sync_all())?;
    file.persist(path).map_err(|error| without_name(error.error))?;
    Ok(())
}

/// The result of asking the system to save a file to the disk. Some file systems save by themselves, and cannot be asked.
///
/// # Errors
/// The other errors.
pub fn saved(result: io::Result<()>) -> io::Result<()> {
    match result {
        Err(error) if matches!(error.kind(), ErrorKind::InvalidInput | ErrorKind::Unsupported) => Ok(()),
        result => result,
    }
}

/// Checks that a file can be written now. Leaves no file behind.
///
/// # Errors
/// The errors of the system.
pub fn check(path: &Path) -> io::Result<()> {
    let path = target(path);
    if path.is_dir() {
        Err(ErrorKind::IsADirectory.into())
    } else if is_device(&path) {
        // Opening a pipe would disturb its reader. Its errors show when it is written.
        Ok(())
    } else if let Err(error) = path.symlink_metadata()
        && error.kind() != ErrorKind::NotFound
    {
        // The name itself, such as one that is too long.
        Err(error)
    } else {
        // A file that another program has open cannot be replaced. The rights are DELETE and GENERIC_WRITE.
        #[cfg(windows)]
        if path.is_file() {
            std::os::windows::fs::OpenOptionsExt::access_mode(&mut OpenOptions::new(), 0x4001_0000).open(&path)?;
        }
        temporary(&path).map(drop)
    }
}

/// Checks that a new file can be made in this folder now. Leaves no file behind.
///
/// # Errors
/// The errors of the system.
pub fn check_folder(folder: &Path) -> io::Result<()> {
    // The probe's name is random, so it does not hit an existing file.
    temporary_in(folder).map(drop)
}

/// The file itself, if the path is a link to one. That file may not be there yet.
fn target(path: &Path) -> Cow<'_, Path> {
    path.canonicalize().ok().or_else(|| missing_target(path)).map_or(Cow::Borrowed(path), Cow::Owned)
}

/// The path to which a link leads that has no file yet, also by further links. `None` if the path is no such link. A
/// pipe's name in `/dev/fd` is a link that can be opened, and leads to no path.
fn missing_target(path: &Path) -> Option<PathBuf> {
    /// As many as Linux follows. A link may lead back to itself.
    const LINKS: usize = 40;
    let next = |link: &PathBuf| Some(link.parent()?.join(link.read_link().ok()?));
    let first = next(&path.to_path_buf()).filter(|_| !path.exists());
    std::iter::successors(first, next).take(LINKS).last()
}

/// Whether the path exists and is no file. Such a path must not be replaced.
fn is_device(path: &Path) -> bool {
    path.metadata().is_ok_and(|there| !there.is_file() && !there.is_dir())
}

/// A file in the same folder, which is deleted again unless it is renamed.
fn temporary(path: &Path) -> io::Result<NamedTempFile> {
    temporary_in(path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new(".")))
}

/// A file in a folder, which is deleted again unless it is renamed.
fn temporary_in(folder: &Path) -> io::Result<NamedTempFile> {
    #[cfg_attr(not(unix), expect(unused_mut, reason = "only the permissions change it"))]
    let mut builder = Builder::new();
    // A temporary file is its owner's alone, which a report is not: the system's mask decides, as for any file.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder).map_err(without_name)
}

/// The system's error, without the temporary name that the library adds.
fn without_name(error: io::Error) -> io::Error {
    let said = error.to_string();
    match said.split_once(" at path ") {
        Some((cause, _)) => io::Error::new(error.kind(), cause),
        None => error,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn a_file_that_fails_half_way_leaves_the_old_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("report.html");
        write(&path, |to| to.write_all(b"whole")).unwrap();
        let error = write(&path, |to| {
            to.write_all(b"half")?;
            Err(io::Error::other("no more"))
        });
        assert_eq!(error.unwrap_err().to_string(), "no more");
        assert_eq!(fs::read_to_string(&path).unwrap(), "whole");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "nothing else is left behind");
    }

    #[test]
    fn a_file_is_replaced_and_others_may_read_it() {
        let folder = tempfile::tempdir().unwrap();
        let (path, plain) = (folder.path().join("trial.csv"), folder.path().join("plain.csv"));
        for text in ["first", "second"] {
            write(&path, |to| to.write_all(text.as_bytes())).unwrap();
            assert_eq!(fs::read_to_string(&path).unwrap(), text);
        }
        fs::write(&plain, "").unwrap();
        assert_eq!(fs::metadata(&path).unwrap().permissions(), fs::metadata(&plain).unwrap().permissions());
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            fs::set_permissions(&path, PermissionsExt::from_mode(0o600)).unwrap();
            write(&path, |to| to.write_all(b"third")).unwrap();
            assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o600);
        }
    }

    #[test]
    fn an_unwritable_file_is_known_before_and_nothing_is_left_behind() {
        let folder = tempfile::tempdir().unwrap();
        assert!(check(&folder.path().join("report.html")).is_ok());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
        assert_eq!(check(folder.path()).unwrap_err().kind(), ErrorKind::IsADirectory);
        assert!(check(&folder.path().join("n".repeat(300))).is_err(), "longer than a name can be");
        let error = check(&folder.path().join("no/such/file")).unwrap_err().to_string();
        assert!(error.starts_with("No such file or directory") && !error.contains("tmp"), "{error}");
        let written = write(&folder.path().join("no/such/file"), |to| to.write_all(b"text"));
        assert_eq!(written.unwrap_err().kind(), ErrorKind::NotFound);
    }

    #[cfg(unix)]
    #[test]
    fn a_link_stays_a_link_and_a_device_stays_a_device() {
        let folder = tempfile::tempdir().unwrap();
        let (file, link) = (folder.path().join("table.csv"), folder.path().join("newest.csv"));
        fs::write(&file, "old").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        write(&link, |to| to.write_all(b"new")).unwrap();
        assert!(link.is_symlink());
        assert_eq!(fs::read_to_string(&file).unwrap(), "new");
        // Through another link from another folder, to a file that is not there yet.
        let (other, far) = (folder.path().join("other"), folder.path().join("other/far.csv"));
        fs::create_dir(&other).unwrap();
        fs::remove_file(&file).unwrap();
        std::os::unix::fs::symlink("../newest.csv", &far).unwrap();
        check(&far).unwrap();
        write(&far, |to| to.write_all(b"first")).unwrap();
        assert!(link.is_symlink() && far.is_symlink() && !file.is_symlink());
        assert_eq!(fs::read_to_string(&file).unwrap(), "first");
        write(Path::new("/dev/null"), |to| to.write_all(b"nothing")).unwrap();
        assert!(!Path::new("/dev/null").is_file());
        let full = write(Path::new("/dev/full"), |to| to.write_all(b"more than a disk holds")).unwrap_err();
        assert_eq!(full.kind(), ErrorKind::StorageFull);
    }

    #[cfg(unix)]
    #[test]
    fn a_device_gets_nothing_of_a_text_that_fails_half_way() {
        use std::io::Read;
        use std::os::fd::AsRawFd;
        let (mut read, write_end) = io::pipe().unwrap();
        let path = format!("/dev/fd/{}", write_end.as_raw_fd());
        let error = write(Path::new(&path), |to| {
            to.write_all(b"half")?;
            Err(io::Error::other("no more"))
        });
        assert_eq!(error.unwrap_err().to_string(), "no more");
        drop(write_end);
        let mut there = String::new();
        read.read_to_string(&mut there).unwrap();
        assert_eq!(there, "");
    }
}
