//! A pseudo terminal: a serial port without a cable, for programs that expect an Uno.
//!
//! [`Pty`] is the device's side. Programs open the other side by its path, or by a symbolic link, like /dev/ttyACM0. It
//! starts in raw mode, so that bytes pass unchanged. The crate notices when a program opens it, because opening a real
//! Uno's port resets the Uno. There the modem line DTR is wired to the reset pin; a pseudo terminal has no such line.
//!
//! The other side is held open here as well, so that the terminal outlives the programs. inotify reports their opening
//! and closing. There is no baud rate: bytes pass at the pace of writing and reading. It needs Linux.
//!
//! The system calls are rustix's. Crates for pseudo terminals (portable-pty, pty-process) start a program behind one,
//! and do not report who opens it.

use crate::board::BAUD;
use crate::file_error::FileError;
use rustix::fd::OwnedFd;
use rustix::fs::{OFlags, fcntl_setfl, inotify};
use rustix::io::Errno;
use rustix::pty::{OpenptFlags, grantpt, ioctl_tiocgptpeer, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, QueueSelector, ioctl_tiocnxcl, tcflush, tcgetattr, tcsetattr};
use std::fs::File;
use std::io::{self, ErrorKind, Read, Write};
use std::mem::MaybeUninit;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};

/// The system's folder for the programs' sides.
const TERMINALS: &str = "/dev/pts";

/// The device's side of a pseudo terminal. Dropping it looks like a pulled cable to programs at the other side.
#[derive(Debug)]
pub struct Pty {
    device: File,
    /// The programs' side, held open.
    other_side: OwnedFd,
    /// Reports programs that open and close it.
    watch: OwnedFd,
    /// Whether a program has it open. inotify merges two events of the same moment, so programs cannot be counted. If
    /// several have it open, the first that closes it counts for all.
    is_open: bool,
    path: PathBuf,
    link: Option<PathBuf>,
}

impl Pty {
    /// Opens one.
    ///
    /// # Errors
    /// If the system has none to give.
    pub fn open() -> Result<Pty, FileError> {
        let open = || -> io::Result<Pty> {
            let flags = OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC;
            let device = openpt(flags)?;
            grantpt(&device)?;
            unlockpt(&device)?;
            let path: PathBuf = ptsname(&device, Vec::new())?.into_string().map_err(io::Error::other)?.into();
            let other_side = ioctl_tiocgptpeer(&device, flags)?;
            let mut attributes = tcgetattr(&other_side)?;
            attributes.make_raw();
            // For programs that read the rate and do not set it.
            attributes.set_speed(BAUD as u32)?;
            tcsetattr(&other_side, OptionalActions::Now, &attributes)?;
            fcntl_setfl(&device, OFlags::NONBLOCK)?;
            let watch = inotify::init(inotify::CreateFlags::NONBLOCK | inotify::CreateFlags::CLOEXEC)?;
            inotify::add_watch(&watch, &path, inotify::WatchFlags::OPEN | inotify::WatchFlags::CLOSE)?;
            Ok(Pty { device: device.into(), other_side, watch, is_open: false, path, link: None })
        };
        let problem = "has no pseudo terminal to give: is it mounted?";
        open().map_err(|source| FileError::failed(Path::new(TERMINALS), problem, source))
    }

    /// The path for programs.
    pub fn path(&self) -> &Path {
        self.link.as_deref().unwrap_or(&self.path)
    }

    /// Makes a symbolic link to it, and removes it at the end. A link to another pseudo terminal is replaced, unless a
    /// process uses that terminal. Killed processes leave such links.
    ///
    /// # Errors
    /// If something else is there or uses it, or the folder cannot be written to.
    pub fn link(&mut self, path: &Path) -> Result<(), FileError> {
        let target = std::fs::read_link(path).ok().filter(|target| target.starts_with(TERMINALS));
        // A leftover link may point to this very terminal: the system reuses the numbers.
        if let Some(target) = target.as_ref().filter(|&target| *target != self.path && target.exists()) {
            let holder = holder(target);
            let target = target.display();
            let right = "end it, or name another link; if it is none of your virtual Unos, remove the link";
            return Err(FileError::new(path, format_args!("leads to {target}, which {holder} has: {right}")));
        }
        let removed = if target.is_some() { std::fs::remove_file(path) } else { Ok(()) };
        removed.and_then(|()| symlink(&self.path, path)).map_err(|source| match source.kind() {
            ErrorKind::AlreadyExists => FileError::new(
                path,
                "exists already and is no link to a pseudo terminal: name another link, or remove it",
            ),
            _ => FileError::failed(path, "cannot be made a link to the pseudo terminal", source),
        })?;
        self.link = Some(path.into());
        Ok(())
    }

    /// Whether a program has opened it since the last call, while no other had it open. Bytes not read before are gone.
    ///
    /// # Errors
    /// If it has failed.
    pub fn was_opened(&mut self) -> Result<bool, FileError> {
        let mut opened = false;
        let mut buffer = [MaybeUninit::uninit(); 1024];
        let mut events = inotify::Reader::new(&self.watch, &mut buffer);
        loop {
            match events.next() {
                Ok(event) if event.events().contains(inotify::ReadFlags::OPEN) => {
                    opened |= !self.is_open;
                    self.is_open = true;
                }
                Ok(_) => self.is_open = false,
                Err(Errno::INTR) => {}
                Err(Errno::AGAIN) => break,
                Err(error) => return Err(self.failed(error.into())),
            }
        }
        if opened {
            tcflush(&self.other_side, QueueSelector::IFlush).map_err(|error| self.failed(error.into()))?;
        }
        if !self.is_open {
            // A killed program may have left its exclusive claim of the port.
            ioctl_tiocnxcl(&self.other_side).map_err(|error| self.failed(error.into()))?;
        }
        Ok(opened)
    }

    /// Takes what programs have written, up to `buffer`'s length; without waiting. Returns the number of bytes.
    ///
    /// # Errors
    /// If it has failed.
    pub fn read(&mut self, buffer: &mut [u8]) -> Result<usize, FileError> {
        self.count(|mut device| device.read(buffer))
    }

    /// Hands over bytes to the program that reads, as many as it has room for; without waiting. Returns the number of bytes.
    ///
    /// # Errors
    /// If it has failed.
    pub fn write(&mut self, bytes: &[u8]) -> Result<usize, FileError> {
        self.count(|mut device| device.write(bytes))
    }

    fn count(&self, transfer: impl FnOnce(&File) -> io::Result<usize>) -> Result<usize, FileError> {
        match transfer(&self.device) {
            Ok(count) => Ok(count),
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted) => Ok(0),
            Err(error) => Err(self.failed(error)),
        }
    }

    fn failed(&self, source: io::Error) -> FileError {
        FileError::failed(&self.path, "has failed", source)
    }
}

/// The process that has the device's side of a pseudo terminal, in words.
fn holder(terminal: &Path) -> String {
    let number = terminal.file_name().unwrap_or_default().to_string_lossy();
    // The system lists each open file this way. Processes of other users hide theirs.
    let index = format!("tty-index:\t{number}\n");
    let has_it = |process: &u32| {
        let files = std::fs::read_dir(format!("/proc/{process}/fdinfo")).into_iter().flatten().flatten();
        files.into_iter().any(|file| std::fs::read_to_string(file.path()).is_ok_and(|text| text.contains(&index)))
    };
    let entries = std::fs::read_dir("/proc").into_iter().flatten().flatten();
    let mut processes = entries.filter_map(|entry| entry.file_name().to_str()?.parse().ok());
    processes.find(has_it).map_or("another process".to_owned(), |process| {
        let name = std::fs::read_to_string(format!("/proc/{process}/comm")).unwrap_or_default();
        format!("process {process} ({})", name.trim())
    })
}

impl Drop for Pty {
    fn drop(&mut self) {
        if let Some(link) = &self.link
            && std::fs::read_link(link).is_ok_and(|target| target == self.path)
        {
            // An error here cannot be reported. The next process replaces a link that leads nowhere.
            let _ = std::fs::remove_file(link);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs::OpenOptions;

    #[test]
    fn bytes_pass_both_ways_unchanged() {
        let mut pty = Pty::open().unwrap();
        let mut program = open(&pty);
        let bytes = [0, 3, 4, b'\r', b'\n', 17, 19, 127, 255];
        program.write_all(&bytes).unwrap();
        let mut buffer = [0; 32];
        let count = pty.read(&mut buffer).unwrap();
        assert_eq!(&buffer[..count], bytes);
        assert_eq!(pty.write(&bytes).unwrap(), bytes.len());
        let mut buffer = [0; 9];
        program.read_exact(&mut buffer).unwrap();
        assert_eq!(buffer, bytes);
    }

    fn open(pty: &Pty) -> File {
        OpenOptions::new().read(true).write(true).open(pty.path()).unwrap()
    }

    #[test]
    fn each_opening_is_noticed_once_however_short_the_time_between() {
        let mut pty = Pty::open().unwrap();
        assert!(!pty.was_opened().unwrap());
        let mut program = open(&pty);
        assert!(pty.was_opened().unwrap());
        assert!(!pty.was_opened().unwrap());
        drop(program);
        program = open(&pty);
        assert!(pty.was_opened().unwrap(), "it was closed and opened");
        let second = open(&pty);
        assert!(!pty.was_opened().unwrap(), "another one has it open");
        drop((program, second));
        assert!(!pty.was_opened().unwrap());
        drop(open(&pty));
        assert!(pty.was_opened().unwrap(), "it was opened and closed");
    }

    #[test]
    fn a_program_reads_nothing_that_was_meant_for_the_one_before() {
        let mut pty = Pty::open().unwrap();
        let program = open(&pty);
        assert!(pty.was_opened().unwrap());
        pty.write(b"unread").unwrap();
        drop(program);
        let mut program = open(&pty);
        assert!(pty.was_opened().unwrap());
        pty.write(b"new").unwrap();
        let mut buffer = [0; 3];
        program.read_exact(&mut buffer).unwrap();
        assert_eq!(&buffer, b"new");
    }

    #[test]
    fn a_link_to_a_living_one_is_left_to_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("uno");
        let mut first = Pty::open().unwrap();
        first.link(&path).unwrap();
        let error = Pty::open().unwrap().link(&path).unwrap_err().to_string();
        let holder = format!("which process {} (", std::process::id());
        assert!(error.contains(&holder), "{error}");
        assert_eq!(std::fs::read_link(&path).unwrap(), first.path);
        // A leftover link may point to the next terminal.
        let mut next = Pty::open().unwrap();
        std::fs::remove_file(&path).unwrap();
        symlink(&next.path, &path).unwrap();
        next.link(&path).unwrap();
    }

    #[test]
    fn a_link_replaces_a_left_over_one_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("uno");
        symlink("/dev/pts/no-such", &path).unwrap();
        let mut pty = Pty::open().unwrap();
        pty.link(&path).unwrap();
        let file = folder.path().join("file");
        std::fs::write(&file, "mine").unwrap();
        let error = pty.link(&file).unwrap_err().to_string();
        assert!(error.contains("exists already"), "{error}");
        assert_eq!(std::fs::read_to_string(&file).unwrap(), "mine");
        let error = pty.link(&folder.path().join("no-such/uno")).unwrap_err().to_string();
        assert!(error.contains("cannot be made a link"), "{error}");
    }
}
