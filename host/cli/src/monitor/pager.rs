//! Pages through the console's output: which of its lines are shown, each on as many rows of the screen as it takes.
//!
//! It follows the newest line until the operator pages back. Then the lines stay in their places while new ones come.

use std::cell::Cell;

#[derive(Clone, Debug, Default)]
pub struct Pager {
    /// Lines up to the last shown one. `None` follows the newest.
    end: Option<usize>,
    /// Lines that the last drawing had room for, and the end of it.
    shown: Cell<(usize, usize)>,
}

impl Pager {
    /// Shows the newest line again.
    pub fn follow(&mut self) {
        self.end = None;
    }

    /// Goes a page back, of `count` lines. A line of this page stays visible.
    pub fn back(&mut self, count: usize) {
        let (shown, end) = self.shown.get();
        self.end = Some(end.min(count).saturating_sub(step(shown)));
    }

    /// Goes a page forward, of `count` lines.
    pub fn forward(&mut self, count: usize) {
        let (shown, end) = self.shown.get();
        self.end = self.end.map(|_| end + step(shown)).filter(|&end| end < count);
    }

    /// The oldest line is gone.
    pub fn dropped(&mut self) {
        self.end = self.end.map(|end| end.saturating_sub(1));
    }

    /// How many of `count` lines are below the shown ones.
    pub fn below(&self, count: usize) -> usize {
        self.end.map_or(0, |end| count.saturating_sub(end))
    }

    /// The rows of a screen of this size.
    pub fn rows<'a>(&self, lines: &[&'a str], width: u16, height: u16) -> Vec<&'a str> {
        let (width, height) = (usize::from(width), usize::from(height));
        let numbered = lines.iter().enumerate();
        let rows = numbered.flat_map(|(line, text)| wrapped(text, width).into_iter().map(move |row| (line, row)));
        let rows: Vec<(usize, &str)> = rows.collect();
        let end = self.end.unwrap_or(lines.len()).min(lines.len());
        // The first page is full too.
        let from = rows.partition_point(|&(line, _)| line < end).saturating_sub(height);
        let shown: Vec<_> = rows.into_iter().skip(from).take(height).collect();
        let first = shown.first().map_or(end, |&(line, _)| line);
        let next = shown.last().map_or(end, |&(line, _)| line + 1);
        self.shown.set((next - first, next));
        shown.into_iter().map(|(_, row)| row).collect()
    }
}

/// Lines from a page to the next one.
fn step(shown: usize) -> usize {
    shown.saturating_sub(1).max(1)
}

/// A line's rows: at most `width` characters each, parted at blanks where there are some.
fn wrapped(line: &str, width: usize) -> Vec<&str> {
    let (mut rows, mut rest) = (Vec::new(), line);
    while let Some((limit, _)) = rest.char_indices().nth(width.max(1)) {
        let fits = limit + usize::from(rest[limit..].starts_with(' '));
        let end = rest[..fits].rfind(' ').filter(|&end| end > 0).unwrap_or(limit);
        rows.push(&rest[..end]);
        rest = rest[end..].trim_start();
    }
    rows.push(rest);
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_line_is_seen_by_paging_back_and_forward_while_new_lines_come() {
        let owned: Vec<String> = (0..63).map(|number| format!("{number} {}", "word ".repeat(number % 23))).collect();
        let mut lines: Vec<&str> = owned[..60].iter().map(String::as_str).collect();
        let mut pager = Pager::default();
        let shows = |pager: &Pager, lines: &[&str]| pager.rows(lines, 50, 8).join("\n");
        assert!(shows(&pager, &lines).starts_with("5") && pager.below(60) == 0);
        let mut seen = shows(&pager, &lines);
        for _ in 0..60 {
            pager.back(lines.len());
            seen = shows(&pager, &lines) + "\n" + &seen;
        }
        let first = shows(&pager, &lines);
        assert!(first.starts_with("0 \n1 word"), "{first}");
        for number in 0..60 {
            assert!(seen.lines().any(|row| row.starts_with(&format!("{number} "))), "{number} of {seen}");
        }
        lines.push(&owned[60]);
        assert_eq!(shows(&pager, &lines), first, "it stays where it is");
        pager.forward(lines.len());
        assert_ne!(shows(&pager, &lines), first);
        for _ in 0..60 {
            pager.forward(lines.len());
            shows(&pager, &lines);
        }
        lines.push(&owned[61]);
        assert!(shows(&pager, &lines).contains("61 ") && pager.below(lines.len()) == 0, "it follows again");
    }

    #[test]
    fn a_long_line_is_parted_at_its_blanks_and_a_word_without_one_anywhere() {
        assert_eq!(wrapped("set name value - sets", 10), ["set name", "value -", "sets"]);
        assert_eq!(wrapped("abcdefgh", 3), ["abc", "def", "gh"]);
        assert_eq!(wrapped("ab cd", 5), ["ab cd"]);
        assert_eq!(wrapped("", 5), [""]);
        assert_eq!(wrapped("\u{fffd}\u{fffd}\u{fffd}", 2), ["\u{fffd}\u{fffd}", "\u{fffd}"]);
    }
}
