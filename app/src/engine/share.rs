//! Progress of a task that consists of several parts.

/// A progress callback for a part that covers the per cent `from` to `to` of the whole.
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
    fn partial_progress_maps_onto_its_share_of_the_whole() {
        let mut told = Vec::new();
        let mut whole = |done: u64, total: u64| told.push(done * 100 / total);
        let mut half = part(&mut whole, 40, 60);
        [(0, 4), (1, 4), (4, 4), (5, 4), (0, 0)].into_iter().for_each(|(done, total)| half(done, total));
        drop(half);
        assert_eq!(told, [40, 45, 60, 60, 40]);
    }
}
