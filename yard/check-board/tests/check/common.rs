//! Shared code of the tests of the check.

use check_board::Boards;
use check_board::pair::{CLOCK_PPM, Pair, Side, Wiring};
use check_board::tester::Tester;
use check_board::wiring::Weeder;
use link::{Link, Wire};
use std::cell::RefCell;
use std::io::{self, Read, Write};
use std::path::Path;
use std::rc::Rc;
use uno::CYCLES_PER_SECOND;
use uno_run::firmware;

/// Two virtual Unos with the firmware of this workspace, wire to wire.
pub fn boards(wiring: Wiring) -> Boards {
    boards_and_pair(wiring).1
}

/// The same, and the pair of Unos for the test to inspect.
pub fn boards_and_pair(wiring: Wiring) -> (Rc<RefCell<Pair>>, Boards) {
    boards_with(&firmware::build().expect("the weeder's firmware is built"), wiring)
}

/// The same with another firmware of the weeder.
pub fn boards_with(weeder: &Path, wiring: Wiring) -> (Rc<RefCell<Pair>>, Boards) {
    let tester = firmware::TESTER.elf().expect("the tester's firmware is built");
    let pair = Rc::new(RefCell::new(Pair::power_up(&tester, weeder, None, wiring).expect("both start")));
    let tester = Tester::over(PairPort { pair: Rc::clone(&pair), side: Side::Tester }).expect("the tester answers");
    let opened = Rc::clone(&pair);
    let open = move || {
        opened.borrow_mut().reset(Side::Weeder).expect("it is reset");
        Link::over(Wire::over(PairPort { pair: Rc::clone(&opened), side: Side::Weeder }, true))
    };
    let weeder = Weeder::over(open).expect("the weeder answers");
    (pair, Boards { weeder, tester, clock_ratio: 1.0 + CLOCK_PPM as f64 / 1e6 })
}

/// A port of one of the boards, without a terminal. Both clocks run while it is read, at full speed.
struct PairPort {
    pair: Rc<RefCell<Pair>>,
    side: Side,
}

/// Longest time that a read waits for a byte, by the tester's clock.
const READ_MS: u64 = 20;

impl Read for PairPort {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let mut pair = self.pair.borrow_mut();
        for _ in 0..READ_MS {
            if !pair.received(self.side).is_empty() {
                return pair.received(self.side).read(buffer);
            }
            pair.run_for(CYCLES_PER_SECOND / 1000).map_err(io::Error::other)?;
        }
        Err(io::ErrorKind::TimedOut.into())
    }
}

impl Write for PairPort {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.pair.borrow_mut().send(self.side, bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
