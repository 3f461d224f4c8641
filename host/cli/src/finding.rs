//! What a command found out, which becomes its status.

/// What a command found out, for scripts that ask by its status.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Finding {
    /// No plant was damaged, nothing differs.
    Good,
    /// A plant was damaged, something differs, or a bound is over its budget.
    Bad,
}
