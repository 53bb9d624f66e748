//! The widths of the side panels, per screen.

use crate::keys::Tab;

/// Smallest and largest width of a panel, CSS pixels.
pub const PANEL_PX: (u16, u16) = (200, 640);

/// Left and right widths in CSS pixels, in the order of the screens; 0 for the default width.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Panels {
    px: [[u16; 2]; Tab::ALL.len()],
}

impl Panels {
    /// Reads saved widths; an unreadable one becomes the default.
    pub fn of_kept(text: &str) -> Self {
        let mut panels = Self::default();
        for (px, word) in panels.px.iter_mut().flatten().zip(text.split(' ')) {
            *px = word.parse().map_or(0, bounded);
        }
        panels
    }

    /// As text for saving; empty if all are default.
    pub fn kept(&self) -> String {
        if *self == Self::default() {
            return String::new();
        }
        self.px.as_flattened().iter().map(u16::to_string).collect::<Vec<_>>().join(" ")
    }

    /// Width of a panel of this screen, CSS pixels; `None` for the default.
    pub fn px(&self, tab: Tab, right: bool) -> Option<u16> {
        let [left_px, right_px] = self.px[place(tab)];
        Some(if right { right_px } else { left_px }).filter(|px| *px > 0)
    }

    /// Sets the width of a panel of this screen; 0 for the default.
    pub(super) fn set(&mut self, tab: Tab, right: bool, px: u16) {
        self.px[place(tab)][usize::from(right)] = bounded(px);
    }
}

fn bounded(px: u16) -> u16 {
    if px == 0 { 0 } else { px.clamp(PANEL_PX.0, PANEL_PX.1) }
}

fn place(tab: Tab) -> usize {
    Tab::ALL.iter().position(|one| *one == tab).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn panel_widths_are_saved_per_screen_within_bounds() {
        let mut panels = Panels::default();
        assert_eq!(panels.kept(), "");
        panels.set(Tab::Cam, false, 333);
        panels.set(Tab::Cam, true, 20);
        panels.set(Tab::Draw, true, 9_000);
        let again = Panels::of_kept(&panels.kept());
        assert_eq!(again, panels);
        let found = [(Tab::Cam, false), (Tab::Cam, true), (Tab::Draw, true), (Tab::Draw, false)];
        assert_eq!(found.map(|(tab, right)| again.px(tab, right)), [Some(333), Some(200), Some(640), None]);
        panels.set(Tab::Cam, false, 0);
        assert_eq!(panels.px(Tab::Cam, false), None);
        assert_eq!(Panels::of_kept("x 300 -1"), Panels::of_kept("0 300"), "what cannot be read is not there");
        assert_eq!(Panels::of_kept(""), Panels::default());
    }
}
