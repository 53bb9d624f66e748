//! Icons: line drawings on a grid of 24.
//!
//! Hidden from screen readers: the button or word next to an icon has the name.

use leptos::prelude::*;
use leptos::svg::{path, svg};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Icon {
    Annulus,
    Alarm,
    Arrow,
    Bit,
    Check,
    Cross,
    Down,
    Eye,
    File,
    Fit,
    Home,
    Lock,
    Mill,
    Minus,
    Moon,
    Next,
    NextHole,
    Pause,
    Pencil,
    Play,
    Plug,
    Plus,
    Previous,
    PreviousHole,
    Redo,
    ToBeginning,
    ToEnd,
    Undo,
    Up,
    Warning,
}

fn drawing(icon: Icon) -> &'static str {
    match icon {
        Icon::Annulus => "M12 3a9 9 0 1 0 0 18a9 9 0 1 0 0-18M12 9a3 3 0 1 0 0 6a3 3 0 1 0 0-6",
        Icon::Alarm => "M8 2.5h8L21.5 8v8L16 21.5H8L2.5 16V8zM12 7.5v5.5M12 16.4v.1",
        Icon::Arrow => "M4 12h16M14 6l6 6-6 6",
        Icon::Bit => "M9 3h6v5H9zM9.5 8l5 3-5 3 5 3M12 17v4l2.2-4",
        Icon::Check => "M5 12.5l4.5 4.5L19 7",
        Icon::Cross => "M6 6l12 12M18 6L6 18",
        Icon::Down => "M12 4v16M6 14l6 6 6-6",
        Icon::Eye => {
            "M2.5 12S6 5.5 12 5.5S21.5 12 21.5 12S18 18.5 12 18.5S2.5 12 2.5 12M12 9a3 3 0 1 0 0 6a3 3 0 1 0 0-6"
        }
        Icon::File => "M6 2.5h8l4.5 4.5v14.5H6zM14 2.5V7h4.5",
        Icon::Fit => "M4 9V4h5M20 9V4h-5M4 15v5h5M20 15v5h-5",
        Icon::Home => "M3.5 11.5L12 4l8.5 7.5M6 9.8V20h12V9.8",
        Icon::Lock => "M6 11h12v9.5H6zM8.5 11V7.5a3.5 3.5 0 0 1 7 0V11",
        Icon::Mill => "M3 20.5h18M5 20.5V6h14v14.5M9.5 6v6h5V6M12 12v5",
        Icon::Minus => "M5 12h14",
        Icon::Moon => "M12 3a9 9 0 1 0 0 18zM12 3a9 9 0 0 1 0 18",
        Icon::Next => "M9 5l7 7-7 7",
        Icon::NextHole => "M6 5l7 7-7 7M17 5v14",
        Icon::Pause => "M8 5v14M16 5v14",
        Icon::Pencil => "M4 20l1-4.5L16.5 4l3.5 3.5L8.5 19zM14 6.5l3.5 3.5",
        Icon::Play => "M7 4.5v15l12-7.5z",
        Icon::Plug => "M9 3v5M15 3v5M6.5 8h11v3.5a5.5 5.5 0 0 1-11 0zM12 17v4",
        Icon::Plus => "M5 12h14M12 5v14",
        Icon::Previous => "M15 5l-7 7 7 7",
        Icon::PreviousHole => "M18 5l-7 7 7 7M7 5v14",
        Icon::Redo => "M15 5l5 5-5 5M20 10H9.5a5.5 5.5 0 0 0 0 11H12",
        Icon::ToBeginning => "M5 5v14M19 5l-10 7 10 7z",
        Icon::ToEnd => "M19 5v14M5 5l10 7-10 7z",
        Icon::Undo => "M9 5l-5 5 5 5M4 10h10.5a5.5 5.5 0 0 1 0 11H12",
        Icon::Up => "M12 20V4M6 10l6-6 6 6",
        Icon::Warning => "M12 3.5l9.5 17h-19zM12 10v5M12 17.7v.1",
    }
}

pub fn icon(icon: Icon) -> impl IntoView {
    svg()
        .attr("viewBox", "0 0 24 24")
        .attr("fill", "none")
        .attr("stroke", "currentColor")
        .attr("stroke-width", "2")
        .attr("stroke-linecap", "round")
        .attr("stroke-linejoin", "round")
        .attr("aria-hidden", "true")
        .child(path().attr("d", drawing(icon)))
}
