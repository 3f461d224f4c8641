//! The two boards' ports: a port that is not named is found among those of all Unos.

use crate::error::CheckError;
use crate::tester::Tester;
use crate::wiring::Weeder;
use link::Link;

/// Opens both boards. A port without a name is one of `unos` where such a board answers: the tester by its protocol,
/// the weeder by its console.
///
/// # Errors
/// If a named port cannot be opened or does not answer, or no other port has such a board.
pub fn open(weeder: Option<&str>, tester: Option<&str>, unos: &[String]) -> Result<(Weeder, Tester), CheckError> {
    let (tester_port, tester) = opened("tester", tester, weeder, unos, |port| {
        Tester::over(link::open_other(port).map_err(CheckError::TesterPort)?)
    })?;
    let (_, weeder) = opened("weeder", weeder, Some(&tester_port), unos, |port| {
        let port = port.to_owned();
        Weeder::over(move || Link::open(Some(&port)))
    })?;
    Ok((weeder, tester))
}

/// The board at the named port, or at the first other port where it answers. The port `taken` is skipped.
fn opened<T>(
    board: &'static str,
    named: Option<&str>,
    taken: Option<&str>,
    unos: &[String],
    open: impl Fn(&str) -> Result<T, CheckError>,
) -> Result<(String, T), CheckError> {
    if let Some(port) = named {
        return Ok((port.to_owned(), open(port)?));
    }
    let mut others = unos.iter().filter(|uno| Some(uno.as_str()) != taken);
    let found = others.find_map(|port| open(port).ok().map(|board| (port.clone(), board)));
    found.ok_or_else(|| CheckError::NotFound(board, unos.join(", ")))
}
