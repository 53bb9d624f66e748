//! A filtered input: on only after it was touched longer than its filter; shorter touches are counted.
//!
//! ```text
//! level    ___▂▔▂_____▂▔▔▔▔▔▔▔▔▔▔▔▔▂___
//! on       _________________▂▔▔▔▔▔▔▂___      off at once
//! counted    1 short        filter
//! ```
//!
//! The caller looks at every edge, but not earlier than [`LOOK_US`] after the previous one, and when a
//! touch reaches its time. An edge between two looks is latched for the second. Times in µs.

/// Delay from an edge to the next look: noise takes only part of the processor's time.
pub const LOOK_US: u32 = 5;

pub const LONGEST_FILTER_US: u16 = 10_000;

/// A look at an input.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Glance {
    pub touched: bool,
    /// A touch started since the last look.
    pub came: bool,
    /// A touch ended since the last look.
    pub left: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Filter {
    least_us: u16,
    since: Option<u32>,
    is_on: bool,
    short: u16,
    longest_us: u16,
}

impl Filter {
    /// Without a filter: a touched input is on.
    pub const NONE: Self = Self { least_us: 0, since: None, is_on: false, short: 0, longest_us: 0 };

    /// Requires touches longer than `least_us` from now on. The counters stay.
    pub fn set(&mut self, least_us: u16) {
        if self.least_us != least_us {
            *self = Self { least_us, since: None, is_on: false, ..*self };
        }
    }

    /// Returns `true` if touches must last.
    pub fn is_set(&self) -> bool {
        self.least_us > 0
    }

    /// Returns `true` if the touch lasted long enough.
    pub fn is_on(&self) -> bool {
        self.is_on
    }

    /// Time from `now_us` until the current touch is long enough; `None` if there is no such touch.
    #[inline(always)]
    pub fn left_us(&self, now_us: u32) -> Option<u32> {
        let since = self.since.filter(|_| !self.is_on)?;
        // The clock counts whole µs: one more makes it certainly longer.
        Some((u32::from(self.least_us) + 1).saturating_sub(now_us.wrapping_sub(since)))
    }

    /// Number of touches that were too short, at most 65,535.
    pub fn short(&self) -> u16 {
        self.short
    }

    /// The longest of them, overestimated by at most [`LOOK_US`] + 1 µs; at most 65,535.
    pub fn longest_us(&self) -> u16 {
        self.longest_us
    }

    #[inline(always)]
    pub fn look(&mut self, glance: Glance, now_us: u32) {
        let is_over = glance.left || !glance.touched;
        match self.since {
            Some(since) if is_over => {
                if !self.is_on {
                    self.count(now_us.wrapping_sub(since) + 1);
                }
                (self.since, self.is_on) = (None, false);
            }
            None if glance.came && is_over => self.count(LOOK_US),
            _ => {}
        }
        if glance.touched {
            self.since.get_or_insert(now_us);
            self.is_on |= self.least_us == 0 || self.left_us(now_us) == Some(0);
        }
    }

    #[inline(always)]
    fn count(&mut self, length_us: u32) {
        self.short = self.short.saturating_add(1);
        self.longest_us = self.longest_us.max(u16::try_from(length_us).unwrap_or(u16::MAX));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn look(touched: bool, came: bool, left: bool) -> Glance {
        Glance { touched, came, left }
    }

    const TOUCHED: Glance = look(true, false, false);
    const NOTHING: Glance = look(false, false, false);

    fn filter(least_us: u16) -> Filter {
        let mut filter = Filter::NONE;
        filter.set(least_us);
        filter
    }

    /// Looks every few µs at a touch that starts at `from`. Returns when it was first on.
    fn touched(filter: &mut Filter, from: u32, length_us: u32) -> Option<u32> {
        let mut on = None;
        filter.look(look(true, true, false), from);
        let mut now = from;
        while now.wrapping_sub(from) + LOOK_US < length_us {
            now = now.wrapping_add(LOOK_US);
            filter.look(TOUCHED, now);
            if filter.is_on() {
                on.get_or_insert(now.wrapping_sub(from));
            }
        }
        filter.look(look(false, false, true), from.wrapping_add(length_us));
        on
    }

    #[test]
    fn input_is_on_only_after_the_filter_time() {
        for least_us in [1, 3, 40, 1_000, LONGEST_FILTER_US] {
            // The clock wraps in the middle of it.
            for from in [7, u32::MAX - u32::from(least_us) / 2] {
                for length_us in [1, u32::from(least_us) / 2, u32::from(least_us)] {
                    let mut filter = filter(least_us);
                    assert_eq!(touched(&mut filter, from, length_us), None, "{length_us} of {least_us}");
                    assert_eq!(filter.short(), 1);
                    assert!((length_us..=length_us + 1).contains(&u32::from(filter.longest_us())));
                }
                let mut filter = filter(least_us);
                let on = touched(&mut filter, from, u32::from(least_us) + 20).expect("it is on");
                assert!((u32::from(least_us) + 1..=u32::from(least_us) + 1 + LOOK_US).contains(&on), "{on}");
                assert_eq!((filter.short(), filter.is_on(), filter.left_us(from)), (0, false, None));
            }
        }
    }

    #[test]
    fn separate_touches_are_not_merged() {
        let mut filter = filter(20);
        filter.look(look(true, true, false), 0);
        for turn in 1..200 {
            // Released and touched again between two looks.
            filter.look(look(true, true, true), 10 * turn);
            assert!(!filter.is_on() && filter.left_us(10 * turn) == Some(21));
        }
        assert_eq!((filter.short(), filter.longest_us()), (199, 11));
    }

    #[test]
    fn touch_between_two_looks_is_counted_once() {
        let mut filter = filter(20);
        filter.look(look(false, true, true), 5);
        filter.look(NOTHING, 9);
        assert_eq!((filter.short(), u32::from(filter.longest_us())), (1, LOOK_US));
        // The level changed first; its edge is latched for the next look.
        filter.look(look(false, true, false), 15);
        filter.look(look(false, false, true), 16);
        assert_eq!((filter.short(), filter.left_us(16)), (2, None));
    }

    #[test]
    fn counters_saturate_and_survive_a_new_filter() {
        let mut filter = filter(20);
        filter.short = u16::MAX;
        filter.look(TOUCHED, 0);
        filter.look(NOTHING, 100_000);
        assert_eq!((filter.short(), filter.longest_us()), (u16::MAX, u16::MAX));
        filter.set(30);
        assert_eq!((filter.short(), filter.left_us(0)), (u16::MAX, None));
    }

    #[test]
    fn input_without_filter_is_on_at_once() {
        let mut filter = Filter::NONE;
        filter.look(TOUCHED, 3);
        assert!(filter.is_on() && !filter.is_set());
        filter.look(NOTHING, 4);
        assert!(!filter.is_on());
    }
}
