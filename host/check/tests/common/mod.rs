//! Shared code of the tests of the check.

use check::Boards;
use check::pair::{CLOCK_PPM, Pair, PairPort, Side, Wiring};
use check::tester::Tester;
use check::wiring::Weeder;
use link::Link;
use std::cell::RefCell;
use std::path::Path;
use std::rc::Rc;
use trial::firmware;

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
    let tester = firmware::build_tester().expect("the tester's firmware is built");
    let pair = Rc::new(RefCell::new(Pair::power_up(&tester, weeder, wiring).expect("both start")));
    let tester = Tester::over(PairPort { pair: Rc::clone(&pair), side: Side::Tester }).expect("the tester answers");
    let opened = Rc::clone(&pair);
    let open = move || {
        opened.borrow_mut().reset(Side::Weeder).expect("it is reset");
        Link::over(PairPort { pair: Rc::clone(&opened), side: Side::Weeder }, true)
    };
    let weeder = Weeder::over(open).expect("the weeder answers");
    (pair, Boards { weeder, tester, clock_ratio: 1.0 + CLOCK_PPM as f64 / 1e6 })
}
