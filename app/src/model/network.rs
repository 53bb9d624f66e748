//! What is known of the network: whether it is cut, and whether the page is there without it.
//!
//! Comes in: what the browser tells. Goes out: a word and what it means. Does not know the browser.

use crate::said::key;

/// How things stand with it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Network {
    /// The browser has none.
    pub offline: bool,
    /// The site is kept in the browser: the page opens without one.
    pub kept: bool,
}

impl Network {
    /// The keys of the word and of what it means, where there is something to be said; a page that is not `alone` comes from the bridge on
    /// this computer.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn that_a_page_works_without_a_network_is_said_once_it_is_so() {
        let rows = [
            // offline, kept, alone
            (false, false, true, None),
            (false, true, true, Some(["page.network.works", "page.network.works_is"])),
            (true, true, true, Some(["page.network.offline", "page.network.works_is"])),
            (true, false, true, Some(["page.network.offline", "page.network.not_kept"])),
            // From a bridge on this computer nothing else is to be had.
            (false, false, false, None),
            (true, false, false, Some(["page.network.offline", "page.network.works_is"])),
        ];
        for (offline, kept, alone, words) in rows {
            assert_eq!(Network { offline, kept }.words(alone), words, "{offline} {kept} {alone}");
        }
    }
}
