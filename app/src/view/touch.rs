//! What a pointer does that draws: plain data, for whoever draws with it.

/// What a pointer does that draws.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Touch {
    /// It moves and is not held.
    Hover,
    /// It goes down.
    Down,
    /// It moves while it is held.
    Move,
    /// It goes up.
    Up,
    /// It is taken away: a second finger moves the picture, or the browser wants it.
    Cancel,
}
