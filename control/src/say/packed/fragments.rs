//! The fragments of the texts, sorted. The test below finds them by joining the most frequent pair again and again;
//! `UPDATE_EXPECT=1 cargo test -p control fragments` writes them here.

#[rustfmt::skip]
pub(super) const FRAGMENTS: &[&str] = &[
    "\r\n", " #", " [", " a", " an", " b", " c", " d", " det", " detec", " detection", " di",
    " f", " is ", " m", " mm", " ms", " on", " p", " plant", " s", " setting", " tak", " the ",
    " the tool ", " w", " wh", "# ", "#,", "#,#,", ", ", ", or", ", or ", "0 ", "00 ", ":#",
    "; ", "; 0 ", "; 0 n", "=#", "=# ", "_m", "_mm", "_mm,", "_ms", "_p", "_per", "_s",
    "ac", "ach", "ack", "ak", "al", "alar", "alarm", "ali", "alibr", "all", "am", "an",
    "and", "and ", "ant", "ar", "are ", "at", "atch", "ate", "av", "be", "beam", "beam_",
    "bel", "br", "calibr", "calibrate", "ce", "ch", "chan", "ck", "co", "coder", "comm", "d ",
    "d b", "d_", "de", "der", "do", "e ", "e a", "e, ", "ec", "ed", "ee", "eed",
    "eed_mm", "eel", "een", "el", "en", "encoder", "er", "ervo", "es", "es ", "et", "ett",
    "etting", "ettings", "ev", "ex", "exam", "examp", "example", "fa", "fi", "fir", "first", "for",
    "fr", "fro", "ga", "get", "hol", "in", "ind", "ing", "is ", "it", "la", "le",
    "lea", "lead_", "li", "list", "lo", "m ", "mi", "mm", "nam", "name", "no", "now",
    "of", "off", "ol", "on", "op", "or", "ou", "oun", "out", "ow", "pl", "plant",
    "res", "row", "s ", "s and ", "s th", "s=# ", "sav", "seen", "servo", "servo_", "settings", "sp",
    "speed_mm", "st", "st ", "star", "stat", "sw", "t ", "tak", "te", "ter", "th", "the ",
    "ti", "tion", "to", "tool", "tool ", "ul", "um", "un", "unseen", "us", "vo", "wh",
];

#[cfg(test)]
mod tests {
    use super::FRAGMENTS;
    use crate::say::packed::{CHARACTERS, DIGITS, HALVINGS, WAITING};
    use crate::say::texts::GROUPS;
    use crate::say::version;
    use std::collections::{BTreeMap, BTreeSet};
    use std::{format, fs, string::String, vec::Vec};

    /// The two parts of a fragment, as in the table.
    fn parts<'a>(fragment: &'a str, fragments: &BTreeSet<String>) -> (&'a str, &'a str) {
        let is_known = |part: &str| part.len() == 1 || fragments.contains(part);
        let mut splits = (1..fragment.len()).map(|at| fragment.split_at(at));
        splits.find(|(first, second)| is_known(first) && is_known(second)).expect("a fragment consists of two")
    }

    /// Second halves on the stack, and the steps to the first character.
    fn depth(part: &str, fragments: &BTreeSet<String>) -> (usize, usize) {
        if part.len() == 1 {
            return (0, 0);
        }
        let (first, second) = parts(part, fragments);
        let ((waiting, halvings), (of_second, _)) = (depth(first, fragments), depth(second, fragments));
        ((waiting + 1).max(of_second), halvings + 1)
    }

    fn can_be_unpacked(fragments: &BTreeSet<String>) -> bool {
        fragments.iter().all(|fragment| {
            let (waiting, halvings) = depth(fragment, fragments);
            waiting + DIGITS < WAITING && halvings <= HALVINGS
        })
    }

    /// Joins the most frequent pair while bytes are free and a pair saves more than its two bytes. Leaves out the version, so that
    /// a commit changes nothing.
    fn found() -> BTreeSet<String> {
        let said = GROUPS.iter().copied().flatten().filter(|text| **text != version::NAME);
        let mut texts: Vec<Vec<String>> = said.map(|text| text.chars().map(String::from).collect()).collect();
        let (mut fragments, mut refused) = (BTreeSet::new(), BTreeSet::new());
        while fragments.len() + CHARACTERS.1 < 256 {
            let mut pairs: BTreeMap<(&str, &str), u32> = BTreeMap::new();
            for pair in texts.iter().flat_map(|text| text.windows(2)) {
                *pairs.entry((&pair[0], &pair[1])).or_default() += 1;
            }
            let free = pairs
                .iter()
                .filter(|((first, second), count)| **count > 2 && !refused.contains(&format!("{first}{second}")));
            let Some((first, second)) = free.rev().max_by_key(|(_, count)| **count).map(|(pair, _)| *pair) else {
                break;
            };
            let (first, second) = (String::from(first), String::from(second));
            let joined = format!("{first}{second}");
            let mut more = fragments.clone();
            more.insert(joined.clone());
            if !can_be_unpacked(&more) {
                refused.insert(joined);
                continue;
            }
            fragments = more;
            for text in &mut texts {
                let mut at = 0;
                while at + 1 < text.len() {
                    if text[at] == first && text[at + 1] == second {
                        text.splice(at..at + 2, [joined.clone()]);
                    }
                    at += 1;
                }
            }
        }
        fragments
    }

    #[test]
    fn the_fragments_are_those_that_are_found() {
        let found: Vec<_> = found().into_iter().collect();
        if std::env::var_os("UPDATE_EXPECT").is_none() {
            assert_eq!(FRAGMENTS, found, "`UPDATE_EXPECT=1 cargo test -p control fragments` writes them");
            return;
        }
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/src/say/packed/fragments.rs");
        let file = fs::read_to_string(path).expect("this file can be read");
        let (begin, end) = ("= &[\n", "\n];\n");
        let (head, rest) = file.split_once(begin).expect("the list begins");
        let (_, tail) = rest.split_once(end).expect("the list ends");
        let words: Vec<_> = found.iter().map(|fragment| format!("{fragment:?},")).collect();
        let lines: Vec<_> = words.chunks(12).map(|some| format!("    {}", some.join(" "))).collect();
        fs::write(path, format!("{head}{begin}{}{end}{tail}", lines.join("\n"))).expect("this file can be written");
    }
}
