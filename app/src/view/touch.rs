//! Pointer events in drawing mode, as plain data.

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Touch {
    /// Moves while up.
    Hover,
    Down,
    /// Moves while down.
    Move,
    Up,
    /// Cancelled: a second finger moves the picture, or the browser takes the pointer.
    Cancel,
}
