//! The values of a line, which follow its beginning as words `key=value`.

/// The words `key=value` of a line, by their keys.
pub struct Values<'a>(pub &'a str);

impl<'a> Values<'a> {
    /// The text of a key. `None` if the line lacks it. An empty key is the first word.
    pub fn text(&self, key: &str) -> Option<&'a str> {
        if key.is_empty() {
            return self.0.split(' ').next();
        }
        self.0.split(' ').find_map(|word| word.strip_prefix(key)?.strip_prefix('='))
    }

    /// As [`text`](Self::text), parsed as a number. `None` if it is no number.
    pub fn number<T: std::str::FromStr>(&self, key: &str) -> Option<T> {
        self.text(key)?.parse().ok()
    }
}

/// The rest of an event's line after its beginning. `None` if the line begins otherwise.
pub(super) fn behind<'a>(line: &'a str, beginning: &str) -> Option<Values<'a>> {
    let rest = line.strip_prefix(beginning)?;
    let is_whole = beginning.is_empty() || rest.is_empty() || rest.starts_with([' ', ',']);
    is_whole.then_some(Values(rest))
}
