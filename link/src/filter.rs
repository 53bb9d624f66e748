//! An input that counts as on only when it was touched for longer than its filter; shorter touches are counted.
//!
//! ```text
//! level    ___▂▔▂_____▂▔▔▔▔▔▔▔▔▔▔▔▔▂___
//! on       _________________▂▔▔▔▔▔▔▂___      off at once
//! counted    1 short        filter
//! ```
//!
//! Whoever has the pins looks at every edge, but not before [`LOOK_US`] after the edge before, and when a touch that lasts comes of age. An
//! edge between two looks is remembered for the second. Comes in: looks. Goes out: whether it is on; how many touches were short, and the longest of them. Times in µs. Does not know
//! pins, nor what stops.

/// Behind an edge the next look is so much later: noise takes a part of the processor, never all of it.
pub const LOOK_US: u32 = 5;

/// Longest filter.
pub const LONGEST_FILTER_US: u16 = 10_000;

/// One look at an input.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Glance {
    /// It is touched.
    pub touched: bool,
    /// It began to be, since the look before.
    pub came: bool,
    /// It ceased to be, since the look before.
    pub left: bool,
}

/// One input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Filter {
    least_us: u16,
    since: Option<u32>,
    is_on: bool,
    short: u16,
    longest_us: u16,
}

impl Filter {
    /// Without a filter: what is touched is on.
    pub const NONE: Self = Self { least_us: 0, since: None, is_on: false, short: 0, longest_us: 0 };

    /// From now on touches are to be longer than `least_us`. What was counted stays.
    pub fn set(&mut self, least_us: u16) {
        if self.least_us != least_us {
            *self = Self { least_us, since: None, is_on: false, ..*self };
        }
    }

    /// Whether touches have to last.
    pub fn is_set(&self) -> bool {
        self.least_us > 0
    }

    /// Whether it is touched long enough.
    pub fn is_on(&self) -> bool {
        self.is_on
    }

    /// How long from `now_us` on until a touch that is too short as yet is long enough; none where there is no such touch.
    #[inline(always)]
    pub fn left_us(&self, now_us: u32) -> Option<u32> {
        let since = self.since.filter(|_| !self.is_on)?;
        // The clock counts whole µs: one more is sure to be longer.
        Some((u32::from(self.least_us) + 1).saturating_sub(now_us.wrapping_sub(since)))
    }

    /// Touches that were too short, at most 65,535.
    pub fn short(&self) -> u16 {
        self.short
    }

    /// The longest of them, up to [`LOOK_US`] and a µs more than it was; at most 65,535.
    pub fn longest_us(&self) -> u16 {
        self.longest_us
    }

    /// Takes a look.
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

    /// Looks every so many µs at a touch that begins at `from`: when it was on first.
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
    fn a_touch_counts_as_on_when_it_is_longer_than_the_filter_and_not_before() {
        for least_us in [1, 3, 40, 1_000, LONGEST_FILTER_US] {
            // The clock begins anew in the middle of it.
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
    fn touches_one_behind_the_other_are_not_one_long_one() {
        let mut filter = filter(20);
        filter.look(look(true, true, false), 0);
        for turn in 1..200 {
            // Between two looks it was let go of and touched again.
            filter.look(look(true, true, true), 10 * turn);
            assert!(!filter.is_on() && filter.left_us(10 * turn) == Some(21));
        }
        assert_eq!((filter.short(), filter.longest_us()), (199, 11));
    }

    #[test]
    fn what_came_and_left_between_two_looks_is_counted_once() {
        let mut filter = filter(20);
        filter.look(look(false, true, true), 5);
        filter.look(NOTHING, 9);
        assert_eq!((filter.short(), u32::from(filter.longest_us())), (1, LOOK_US));
        // It was seen going first, its edge is remembered for the next look.
        filter.look(look(false, true, false), 15);
        filter.look(look(false, false, true), 16);
        assert_eq!((filter.short(), filter.left_us(16)), (2, None));
    }

    #[test]
    fn counts_stay_at_their_end_and_outlast_another_filter() {
        let mut filter = filter(20);
        filter.short = u16::MAX;
        filter.look(TOUCHED, 0);
        filter.look(NOTHING, 100_000);
        assert_eq!((filter.short(), filter.longest_us()), (u16::MAX, u16::MAX));
        filter.set(30);
        assert_eq!((filter.short(), filter.left_us(0)), (u16::MAX, None));
    }

    #[test]
    fn without_a_filter_what_is_touched_is_on_at_once() {
        let mut filter = Filter::NONE;
        filter.look(TOUCHED, 3);
        assert!(filter.is_on() && !filter.is_set());
        filter.look(NOTHING, 4);
        assert!(!filter.is_on());
    }
}
