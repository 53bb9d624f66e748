//! How far a piece of work is that is made of several.
//!
//! Comes in: somebody who is told how far the whole is. Goes out: somebody to be told how far a part of it is.

/// Who is told how much of a part is done, and how much of it there is. The part is the whole from the hundredth `from` to the
/// hundredth `to`.
pub(super) fn part(whole: &mut dyn FnMut(u64, u64), from: u64, to: u64) -> impl FnMut(u64, u64) {
    move |done, total: u64| {
        let total = total.max(1);
        whole(from * total + to.saturating_sub(from) * done.min(total), 100 * total);
    }
}

#[cfg(test)]
mod tests {
    use super::part;

    #[test]
    fn a_part_goes_from_one_hundredth_of_the_whole_to_another() {
        let mut told = Vec::new();
        let mut whole = |done: u64, total: u64| told.push(done * 100 / total);
        let mut half = part(&mut whole, 40, 60);
        [(0, 4), (1, 4), (4, 4), (5, 4), (0, 0)].into_iter().for_each(|(done, total)| half(done, total));
        drop(half);
        assert_eq!(told, [40, 45, 60, 60, 40]);
    }
}
