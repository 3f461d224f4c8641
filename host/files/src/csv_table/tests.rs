//! Tests of the tables: spreadsheets' habits, errors with their lines, and unclear numbers.

use super::*;
use std::fs;

/// The values of the column `place_mm` with their lines, or the error for a file with this text.
fn read(text: impl AsRef<[u8]>) -> Result<Vec<(u64, i16)>, String> {
    let table = CsvTable::parse(Path::new("table.csv"), text.as_ref().to_owned(), &["place_mm"]);
    let values = table.and_then(|table| {
        table.lines().map(|line| Ok((line.number, line.value("place_mm", "a whole number")?))).collect()
    });
    values.map_err(|error: FileError| error.to_string())
}

#[test]
fn a_first_line_that_no_separator_follows_declares_none() {
    for text in ["sep=\u{2028}", "sep=", "sep", "abcd\u{2028}x", ""] {
        assert_eq!(declared_separator(text), None, "{text:?}");
    }
    assert_eq!(declared_separator("sep=;"), Some(b';'));
}

#[test]
fn lines_are_counted_alike_however_they_end() {
    let text = "# measured in May\nplace_mm,width_mm\n\n7,1\n# a gap\n\n8,1\n";
    for end in ["\n", "\r\n", "\r"] {
        assert_eq!(read(text.replace('\n', end)), Ok(vec![(4, 7), (7, 8)]), "{end:?}");
        let wrong = "table.csv, line 8: place_mm is `far`: it has to be a whole number";
        assert_eq!(read(format!("{text}far,1").replace('\n', end)), Err(wrong.to_owned()), "{end:?}");
        let short = "table.csv, line 8: fields: 1, where the header has 2: each line has one field a column";
        assert_eq!(read(format!("{text}9").replace('\n', end)), Err(short.to_owned()), "{end:?}");
    }
}

#[test]
fn whole_numbers_may_have_the_exponent_that_r_writes() {
    assert_eq!(read("place_mm\n1e+02\n1.2e3\n-2E1\n"), Ok(vec![(2, 100), (3, 1200), (4, -20)]));
    for fraction in ["1.5e0", "1e-05", "1e5", "e5"] {
        assert!(read(format!("place_mm\n{fraction}\n")).is_err(), "{fraction}");
    }
}

#[test]
fn a_wrong_table_is_refused_with_the_line_and_what_would_be_right() {
    let missing = "the column `place_mm` is missing: the header has to name place_mm";
    for (text, line, problem) in [
        ("# measured in May\nwidth_mm\n7\n", 2, missing),
        ("", 1, missing),
        ("Place mm,width_mm\n7,1\n", 1, "the column `place_mm` is missing: did you mean place_mm by `Place mm`?"),
        ("plase_mm;width_mm\n7;1\n", 1, "the column `place_mm` is missing: did you mean place_mm by `plase_mm`?"),
        (
            "place_mm,width_mm\n7,0,4\n",
            2,
            "fields: 3, where the header has 2: each line has one field a column; numbers with decimal commas need \
             semicolons or tabs between the fields, or a point",
        ),
        (
            "place_mm,width_mm\n\"7,5\",1\n",
            2,
            "place_mm is `7,5`: it has to be a whole number; decimal commas need semicolons or tabs between the fields",
        ),
        (
            "place_mm,width_mm,place_mm\n7,1,8\n",
            1,
            "the column `place_mm` occurs twice: each column needs its own name",
        ),
        ("place_mm,width_mm\n7,1\n# 5\" pot\n8,\"1\n9,1\n", 4, UNCLOSED),
        ("place_mm,width_mm\n7,1\n\n8,\"1\n9,1\n10,1\n\"11,1", 4, UNCLOSED),
        ("place_mm,width_mm\n7,1\n8,\"1\n", 3, UNCLOSED),
        ("place_mm,width_mm\n7,1\n8,\"", 3, UNCLOSED),
        ("\"place_mm,width_mm\n7,1\n", 1, UNCLOSED),
        ("place_mm,\"width_mm\n7,1\n", 1, UNCLOSED),
        ("place_mm,pot\n7,\"two\nlines\"\n8,1\n", 2, UNCLOSED),
        ("place_mm,width_mm\n7,1\n#REF!,2\n", 3, "the formula of the first cell failed, `#REF!`: enter its value"),
    ] {
        assert_eq!(read(text), Err(format!("table.csv, line {line}: {problem}")), "{text:?}");
    }
    let failed = "N/A N/D N/B N/V I/T Н/Д Δ/Υ NV YOK HIÁNYZIK NEDOSTUPNÝ NENÍ_K_DISPOZICI N/D! ¿NOMBRE?";
    for word in failed.split(' ') {
        let problem = format!("table.csv, line 2: the formula of the first cell failed, `#{word}`: enter its value");
        assert_eq!(read(format!("place_mm;width_mm\n\"#{word}\";2\n7;1\n")), Err(problem));
    }
    for text in [
        "place_mm,x\n7,a\n8,Stra\u{df}e\n",
        "place_mm,x\r\n7,a\r\n8,Stra\u{df}e\r\n",
        "place_mm,x\r7,a\r8,Stra\u{df}e\r",
    ] {
        let latin: Vec<u8> = text.chars().map(|letter| u32::from(letter) as u8).collect();
        let error = read(latin).unwrap_err();
        assert!(error.starts_with("table.csv, line 3: the byte 0xDF is not UTF-8"), "{error}");
        let wide = |mark: &[u8], bytes: fn(u16) -> [u8; 2]| {
            [mark, &text.encode_utf16().flat_map(bytes).collect::<Vec<_>>()].concat()
        };
        for wide in
            [wide(b"\xFF\xFE", u16::to_le_bytes), wide(b"\xFE\xFF", u16::to_be_bytes), wide(b"", u16::to_le_bytes)]
        {
            let error = read(wide).unwrap_err();
            assert_eq!(error, "table.csv, line 1: the file is saved as UTF-16: save it as CSV in UTF-8");
        }
    }
    assert_eq!(read("place_mm,width_mm,width_mm\n7,1,8\n"), Ok(vec![(2, 7)]), "it is not read");
    assert_eq!(read("place_mm,pot\n7,\"5\"\", clay\"\n8,5\" clay\n"), Ok(vec![(2, 7), (3, 8)]));
    let notes = "#7,1\n#Wet!,\n# WET!,\n#P7,1\n#N/a,1\n#1/A,1\n#DRY\n";
    assert_eq!(read(format!("place_mm,pot\n{notes}8,1\n")), Ok(vec![(9, 8)]), "these are notes");
}

#[test]
fn a_heading_that_may_mean_a_column_that_a_table_may_lack_is_asked_about() {
    let optional = |header: &str| {
        let line = vec!["7"; header.split(',').count()].join(",");
        let table = CsvTable::parse(Path::new("table.csv"), format!("# May\n{header}\n{line}\n").into(), &[]);
        table.unwrap().with_optional(&["plot", "row", "position", "label"]).map(drop).map_err(|error| error.to_string())
    };
    for heading in ["Plot", "PLOT", "plot no", "Plots", "Plot Nr.", "plot_id", "Plot #"] {
        let question = format!("the column `plot` is missing: did you mean plot by `{heading}`? If not, ");
        let error = optional(&format!("place_mm,{heading}")).unwrap_err();
        assert!(error.starts_with(&format!("table.csv, line 2: {question}")), "{error}");
    }
    let others = "plot_area,Plot length m,row_spacing,position_mm,label colour";
    for header in ["plot,place_mm", "place_mm,pilot", "Plot no,plot", others] {
        assert_eq!(optional(header), Ok(()), "{header}");
    }
}

#[test]
fn an_ambiguous_comma_or_point_in_a_number_is_refused() {
    let read = |text: &str| {
        let table = CsvTable::parse(Path::new("table.csv"), text.into(), &["place_mm", "count"]).unwrap();
        let places = table.lines().map(|line| line.value::<f64>("place_mm", "a number"));
        let counts = table.lines().map(|line| line.value::<u16>("count", "a whole number"));
        let values = places.zip(counts).map(|(place, count)| Ok((place?, count?)));
        values.collect::<Result<Vec<_>, FileError>>().map_err(|error| error.to_string())
    };
    for (text, values) in [
        ("place_mm;count\n12,125;1,000\n0,125;2", vec![(12.125, 1), (0.125, 2)]),
        ("place_mm;count\n12,125;1,000\n750;2,0", vec![(12.125, 1), (750.0, 2)]),
        ("place_mm\tcount\n-1200,5\t12,0", vec![(-1200.5, 12)]),
        ("place_mm\tcount\n1.2\t1000", vec![(1.2, 1000)]),
        ("place_mm;count\n1.200;2\n0.5;1.000", vec![(1.2, 2), (0.5, 1)]),
        ("place_mm;count;read_at\n0,5;1,000;14.30", vec![(0.5, 1)]),
        ("place_mm,count\n1.200,2", vec![(1.2, 2)]),
        ("place_mm,count\n1.200,2.000\n0.5,1", vec![(1.2, 2), (0.5, 1)]),
    ] {
        assert_eq!(read(text), Ok(values), "{text:?}");
    }
    for (text, wrong) in [
        ("place_mm\tcount\n750\t1\n1,250\t2", "line 3: place_mm is `1,250`: it has to be a number; its comma"),
        ("place_mm;count;read_at\n1,250;1;0,5", "line 2: place_mm is `1,250`: it has to be a number; its comma"),
        ("place_mm;count\n0.5;1,000", "count is `1,000`: it has to be a whole number; its comma or point may"),
        ("place_mm,count\n\"-1,250\",1", "; its comma may be one of thousands: leave it out, or write a point"),
        ("place_mm;count\n0,4;1.000", "a whole number; its comma or point may be one of thousands: leave it out"),
        ("place_mm\tcount\n1.200\t1", "line 2: place_mm is `1.200`: it has to be a number; its point may be one"),
        ("place_mm;count\n0,4;1\n0.5;1\n1,250;1", "line 4: place_mm is `1,250`: it has to be a number; its comma"),
        ("place_mm,count\n1.250,1.000", "count is `1.000`: it has to be a whole number; its comma or point may"),
    ] {
        let error = read(text).unwrap_err();
        assert!(error.contains(wrong), "{error}");
    }
}

#[test]
fn the_console_s_ok_is_no_line_of_the_table() {
    for end in ["ok", "ok\n", "ok\n\n"] {
        for between in ["\n", "\r\n"] {
            let text = format!("place_mm,width_mm\n7,1\n{end}").replace('\n', between);
            assert_eq!(read(&text), Ok(vec![(2, 7)]), "{text:?}");
        }
    }
    assert_eq!(read("place_mm,width_mm\nok\n7,1\nok,\n8,1"), Ok(vec![(3, 7), (5, 8)]));
    assert!(read("place_mm,width_mm\nok\n").unwrap_err().starts_with("table.csv, line 1: no line is below"));
}

/// A table as a spreadsheet may save it: the habits are bits of `habits`.
fn saved(habits: u32) -> Vec<u8> {
    let has = |habit: u32| habits & (1 << habit) != 0;
    let separator = [",", ";", "\t", ";"][habits as usize & 3];
    let point = if separator == "," { "." } else { "," };
    let width = if has(2) { 6 } else { 3 };
    let blank = separator.repeat(width - 1);
    // Excel looks at the first 16 rows, and pads no further than these need.
    let row = |number: usize, cells: &[&str]| {
        let padded = if has(3) && number > 16 { 3 } else { width };
        cells.join(separator) + &separator.repeat(padded - 3)
    };
    let mut lines = Vec::new();
    if has(4) {
        lines.push(format!("sep={separator}{}", separator.repeat(if separator == "," { 0 } else { 2 })));
    }
    if has(5) {
        lines.push(format!("\"# counted \"\"here\"\"{separator} and there\"{}", separator.repeat(2)));
    }
    if has(6) {
        lines.push(blank.clone());
    }
    lines.push(row(0, &["place_mm", "width_mm", "kind"]));
    for number in 1..=20 {
        let decimals = if has(7) { format!("{point}0") } else { String::new() };
        let quote = if has(8) { "\"" } else { "" };
        let (whole, decimal) = (format!("{number}{decimals}"), format!("{number}{point}25"));
        let [whole, decimal] = [whole, decimal].map(|cell| format!("{quote}{cell}{quote}"));
        lines.push(row(number, &[&whole, &decimal, "plant"]));
        if has(9) && number % 7 == 0 {
            lines.push(blank.clone());
        }
    }
    if has(6) {
        lines.extend(vec![blank; 3]);
    }
    let text = lines.join(if has(10) { "\r\n" } else { "\n" });
    let mark = if has(11) { "\u{feff}" } else { "" };
    format!("{mark}{text}{}", if has(12) { "\n" } else { "" }).into_bytes()
}

#[test]
fn every_mixture_of_a_spreadsheet_s_habits_gives_the_same_table() {
    // A fifth of all mixtures: each two habits meet with and without each other.
    for habits in (0..1 << 13).step_by(5) {
        let text = saved(habits);
        let shown = String::from_utf8_lossy(&text).into_owned();
        let table = CsvTable::parse(Path::new("table.csv"), text, &["place_mm", "width_mm", "kind"]);
        let table = table.unwrap_or_else(|error| panic!("{error}\n{shown}"));
        let values = table.lines().map(|line| {
            let place: i16 = line.value("place_mm", "a whole number")?;
            Ok((place, line.value::<f64>("width_mm", "a number")?, line.text("kind").to_owned()))
        });
        let values: Vec<_> =
            values.collect::<Result<_, FileError>>().unwrap_or_else(|error| panic!("{error}\n{shown}"));
        let expected: Vec<_> = (1..=20).map(|place| (place, f64::from(place) + 0.25, "plant".to_owned())).collect();
        assert_eq!(values, expected, "{shown}");
    }
}

#[test]
fn short_lines_and_empty_tables_are_errors_unless_allowed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("table.csv");
    fs::write(&path, "place_mm,width_mm\n7\n").unwrap();
    assert!(CsvTable::read(&path, &["place_mm"]).is_err());
    let table = CsvTable::read_with_gaps(&path, &["place_mm"]).unwrap();
    assert_eq!(table.lines().map(|line| line.text("width_mm").to_owned()).collect::<Vec<_>>(), [""]);
    fs::write(&path, "place_mm,width_mm\n").unwrap();
    assert!(CsvTable::read(&path, &["place_mm"]).is_err());
    assert_eq!(CsvTable::read_or_empty(&path, &["place_mm"]).unwrap().lines().count(), 0);
}

#[test]
fn a_long_cell_is_quoted_without_its_middle() {
    let error = read(format!("place_mm\n{}\n", "x".repeat(9000))).unwrap_err();
    assert!(error.len() < 500 && error.ends_with("it has to be a whole number"), "{error}");
}
