//! The firmware's name: version and commit.
//!
//! The commit comes from the environment variable `WEEDER_COMMIT`, which `release.sh` sets. A build without it names no commit, so
//! its size is the same at every commit.

/// For example `weeder 0.2.0`, or `weeder 0.2.0 (abc1234)`.
pub(super) const NAME: &str = match core::str::from_utf8(&BYTES) {
    Ok(name) => name,
    Err(_) => panic!("WEEDER_COMMIT is not text"),
};

const VERSION: &str = concat!("weeder ", env!("CARGO_PKG_VERSION"));

const COMMIT: [&str; 3] = match option_env!("WEEDER_COMMIT") {
    Some(commit) if !commit.is_empty() => [" (", commit, ")"],
    _ => [""; 3],
};

const PARTS: [&str; 4] = [VERSION, COMMIT[0], COMMIT[1], COMMIT[2]];

const LENGTH: usize = PARTS[0].len() + PARTS[1].len() + PARTS[2].len() + PARTS[3].len();

const BYTES: [u8; LENGTH] = {
    let (mut bytes, mut length, mut part) = ([0; LENGTH], 0, 0);
    while part < PARTS.len() {
        let mut place = 0;
        while place < PARTS[part].len() {
            bytes[length] = PARTS[part].as_bytes()[place];
            length += 1;
            place += 1;
        }
        part += 1;
    }
    bytes
};
