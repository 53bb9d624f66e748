//! The window around the screens, as plain data: title, colour scheme, panel widths, network.

use super::Model;
use crate::keys::Tab;
use crate::said::key;

/// Whether the browser is offline, and whether the page works offline.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Network {
    pub offline: bool,
    /// The site is cached: the page opens offline.
    pub kept: bool,
}

impl Network {
    /// Keys of the state's name and meaning, if there is something to show. A page that is not `alone` is
    /// served by the bridge on this computer.
    pub fn words(self, alone: bool) -> Option<[&'static str; 2]> {
        let works = key!("page.network.works_is");
        match (self.offline, self.kept || !alone) {
            (true, true) => Some([key!("page.network.offline"), works]),
            (true, false) => Some([key!("page.network.offline"), key!("page.network.not_kept")]),
            (false, true) if alone => Some([key!("page.network.works"), works]),
            (false, _) => None,
        }
    }
}

/// The page's colour scheme.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Theme {
    /// The system's setting.
    #[default]
    Auto,
    Light,
    Dark,
    /// Black and white with full contrast.
    Contrast,
}

impl Theme {
    pub const ALL: [Self; 4] = [Self::Auto, Self::Light, Self::Dark, Self::Contrast];

    /// Name in the style sheet and in the browser's storage.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Light => "light",
            Self::Dark => "dark",
            Self::Contrast => "contrast",
        }
    }

    /// The scheme named `word`; [`Self::Auto`] if there is none.
    pub fn called(word: &str) -> Self {
        Self::ALL.into_iter().find(|theme| theme.word() == word).unwrap_or_default()
    }
}

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

impl Model {
    /// The open board's name. Without a board, for example after a reload during a job, the name of the
    /// machine's job.
    pub fn title(&self) -> Option<&str> {
        let board = self.board.document.as_ref().map(|document| document.reading.board.name.as_str());
        let shown = self.start.shown.as_ref().map(|job| job.program.name.as_str());
        let told = self.link.status.as_ref().and_then(|status| status.job_name.as_deref());
        [board, shown, told].into_iter().flatten().find(|name| !name.is_empty())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn offline_message_depends_on_network_and_cache() {
        let rows = [
            // offline, kept, alone
            (false, false, true, None),
            (false, true, true, Some(["page.network.works", "page.network.works_is"])),
            (true, true, true, Some(["page.network.offline", "page.network.works_is"])),
            (true, false, true, Some(["page.network.offline", "page.network.not_kept"])),
            // From a bridge on this computer the page needs no cache.
            (false, false, false, None),
            (true, false, false, Some(["page.network.offline", "page.network.works_is"])),
        ];
        for (offline, kept, alone, words) in rows {
            assert_eq!(Network { offline, kept }.words(alone), words, "{offline} {kept} {alone}");
        }
    }

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
