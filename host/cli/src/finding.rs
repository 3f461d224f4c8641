//! A command's finding, which becomes its exit status.

/// A command's finding, for scripts that check its exit status.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Finding {
    /// No plant was damaged, nothing differs.
    Good,
    /// A plant was damaged, something differs, or a bound is over its budget.
    Bad,
}
