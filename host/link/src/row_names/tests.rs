//! The file of the rows' names, and how boards are found again.

use super::*;
use crate::port::tests::usb;

const UNO: (u16, u16) = (0x2341, 0x0043);

fn number(text: &str) -> Board {
    Board::SerialNumber(text.to_owned())
}

#[test]
fn a_board_with_a_number_is_found_at_whichever_port_it_comes_back() {
    let before = [usb("/dev/ttyACM0", UNO, Some("A1")), usb("/dev/ttyACM1", UNO, Some("B2"))];
    let after = [usb("/dev/ttyACM1", UNO, Some("A1")), usb("/dev/ttyACM4", UNO, Some("B2"))];
    assert_eq!(of(&before[0], &before, Path::new("/no-such")), number("A1"));
    assert_eq!([&before, &after].map(|ports| numbered("A1", ports).unwrap()), ["/dev/ttyACM0", "/dev/ttyACM1"]);
    let error = numbered("C3", &after).unwrap_err().to_string();
    assert!(error.starts_with("the board with the serial number C3 is not plugged in"), "{error}");
}

#[test]
fn a_number_that_windows_makes_up_is_no_board_s_own() {
    for (number, elsewhere, on_windows) in [("5", Some("5"), None), ("1A", Some("1A"), None), (" ", None, None)] {
        assert_eq!([own(number, false), own(number, true)], [elsewhere, on_windows]);
    }
    assert_eq!([false, true].map(|on_windows| own(" 85735 ", on_windows)), [Some("85735"); 2]);
}

#[cfg(unix)]
#[test]
fn boards_without_a_unique_number_are_identified_by_socket() {
    let folder = tempfile::tempdir().unwrap();
    let folder = fs::canonicalize(folder.path()).unwrap();
    let [first, second] = ["ttyUSB0", "ttyUSB1"].map(|name| {
        fs::write(folder.join(name), "").unwrap();
        folder.join(name).display().to_string()
    });
    let places = folder.join("by-path");
    fs::create_dir(&places).unwrap();
    std::os::unix::fs::symlink(&first, places.join("usb-0:2:1.0")).unwrap();
    std::os::unix::fs::symlink(&first, places.join("usbv2-0:2:1.0")).unwrap();
    let by_place = Board::Port(places.join("usb-0:2:1.0").display().to_string());
    for number in [None, Some("0001"), Some(" ")] {
        let ports = [usb(&first, UNO, number), usb(&second, UNO, number)];
        assert_eq!(of(&ports[0], &ports, &places), by_place);
        assert_eq!(of(&ports[1], &ports, &places), Board::Port(second.clone()), "it has no link for a socket");
    }
    let twins = [usb(&first, UNO, Some("0001")), usb(&second, UNO, Some("0001"))];
    let error = numbered("0001", &twins).unwrap_err().to_string();
    assert!(error.contains("are both of the serial number 0001") && error.contains("weeder rows name"), "{error}");
}

#[test]
fn names_are_kept_in_their_order_with_the_user_s_comments() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("new/rows.toml");
    let mut names = Names::read(&path).unwrap();
    assert!(names.rows().is_empty());
    names.name("left", number("A1")).unwrap();
    names.name("right", Board::Port("/dev/pts/7".to_owned())).unwrap();
    names.write().unwrap();
    let text = fs::read_to_string(&path).unwrap();
    assert!(text.ends_with("left = { serial_number = \"A1\" }\nright = { port = \"/dev/pts/7\" }\n"), "{text}");
    fs::write(&path, text.replace("right =", "# by the hedge\nright =")).unwrap();

    let mut names = Names::read(&path).unwrap();
    names.name("left", number("C3")).unwrap();
    names.name("middle", Board::Port("/dev/pts/7".to_owned())).unwrap();
    let rows: Vec<(&str, &Board)> = names.rows().iter().map(|row| (row.name.as_str(), &row.board)).collect();
    assert_eq!(rows, [("left", &number("C3")), ("middle", &Board::Port("/dev/pts/7".to_owned()))]);
    names.write().unwrap();
    assert_eq!(Names::read(&path).unwrap().rows(), names.rows());
    names.forget("Middle").unwrap();
    let error = names.forget("middle").unwrap_err().to_string();
    assert!(error.ends_with("has no row middle: it has left"), "{error}");
}

#[test]
fn a_row_name_that_is_taken_or_unfit_for_a_file_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let mut names = Names::read(&folder.path().join("rows.toml")).unwrap();
    names.name("Left", number("A1")).unwrap();
    for (name, problem) in [
        ("", "1 to 24 characters"),
        ("a row with a very long name", "1 to 24 characters"),
        ("a/b", "none of /"),
        ("1: x", "none of /"),
        (".hidden", "neither a blank nor a dot"),
        (" 1", "neither a blank nor a dot"),
        ("row.", "neither a blank nor a dot"),
        ("Con", "Windows keeps con for a device"),
        ("com1.left", "Windows keeps com1 for a device: add a word, as in row-com1"),
        ("All", "`all` means every row"),
        ("left", "there is a row Left already"),
    ] {
        let error = names.name(name, number("B2")).unwrap_err().to_string();
        assert!(error.contains(problem), "{name:?}: {error}");
    }
    assert_eq!(names.rows().len(), 1);
}

#[test]
fn an_error_in_a_file_has_its_line() {
    let path = Path::new("rows.toml");
    for (text, problem) in [
        ("\nleft = 3\n", "rows.toml, line 2: left is `3`: it has to be { serial_number"),
        ("left = { port = \"\" }\n", "line 1: left is"),
        ("left = { port = \"a\", serial_number = \"b\" }\n", "line 1: left is"),
        ("a = { port = \"x\" }\nb = { port = \"x\" }\n", "line 2: b has the board of a"),
        ("a = { port = \"x\" }\nA = { port = \"y\" }\n", "line 2: there is a row a already"),
        ("\"a/b\" = { port = \"x\" }\n", "line 1: \"a/b\" cannot be a row's name"),
        ("left = \n", "line 1: "),
    ] {
        let error = parse(path, text).unwrap_err().to_string();
        assert!(error.contains(problem), "{error}");
    }
}

#[test]
fn a_renamed_or_forgotten_row_leaves_the_order_and_the_user_s_comments() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("rows.toml");
    let line = |name: &str, number: &str| format!("{name} = {{ serial_number = \"{number}\" }}");
    let [left, right] = [line("left", "A1") + " # a new servo", line("right", "B2")];
    fs::write(&path, format!("# my machine\n{left}\n# by the hedge\n{right}\n# the end\n")).unwrap();
    let mut names = Names::read(&path).unwrap();
    let text = |names: &Names| {
        names.write().unwrap();
        fs::read_to_string(&path).unwrap()
    };
    names.name("links", number("A1")).unwrap();
    let renamed = line("links", "A1") + " # a new servo";
    assert_eq!(text(&names), format!("# my machine\n{renamed}\n# by the hedge\n{right}\n# the end\n"));
    assert_eq!(Names::read(&path).unwrap().rows(), names.rows());
    names.forget("Links").unwrap();
    assert_eq!(text(&names), format!("# my machine\n# by the hedge\n{right}\n# the end\n"));
    names.name("middle", number("C3")).unwrap();
    // The board of a row takes another row's name.
    names.name("middle", number("B2")).unwrap();
    let middle = line("middle", "B2");
    assert_eq!(text(&names), format!("# my machine\n# by the hedge\n{middle}\n# the end\n"));
    names.forget("middle").unwrap();
    assert_eq!(text(&names), "# my machine\n# by the hedge\n# the end\n");
}
