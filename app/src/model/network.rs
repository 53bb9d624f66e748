//! Whether the browser is offline and whether the page works offline.

use crate::said::key;

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Network {
    /// The browser is offline.
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
}
