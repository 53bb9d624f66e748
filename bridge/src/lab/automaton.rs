//! The step automaton and its phases: `step-automaton/1`. Reference part A.

use super::document::Node;
use super::tally::Tally;
use super::{Checked, at};
use annulus_core::code;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::{
    Dynamics, PhaseTable, dynamics::FARTHEST, dynamics::MOST_STATES, dynamics::SLOWEST, phases,
};
use annulus_core::steps::automaton::{self, Automaton};

const REACH: i64 = 1_000_000_000;
const LATEST: i64 = 1 << 40;

pub(super) fn step_automaton(checked: &mut Checked, root: Node<'_>) -> Result<(), Diagnostic> {
    let list = |key: &str| root.find(key).map_or(Ok(Vec::new()), |list| list.items());
    for (_, table) in root.find("tables").map_or(Ok(Vec::new()), |tables| tables.members())? {
        dynamics(&table)?;
    }
    for case in list("cases")? {
        let tally = steps(checked, &root, &case)?;
        checked.done(tally, &case)?;
    }
    for case in list("totals")? {
        let distance = case.get("n")?.whole(0, REACH)?.unsigned_abs();
        let interrupts = automaton::total(&table(&root, "arendt", &case)?, distance).or_else(at(&case))?;
        let mut tally = Tally::of(&case);
        tally.equal_member(&case, "interrupts", interrupts);
        for (hz, node) in case.find("seconds").map_or(Ok(Vec::new()), |all| all.members())? {
            let hz: f64 = hz
                .parse()
                .ok()
                .filter(|hz| (1e-3..=1e9).contains(hz))
                .ok_or_else(|| node.refuse(code!("lab.unknown_name")).with("found", hz))?;
            let seconds = interrupts as f64 / hz;
            tally.number(&node, seconds, 1e-12 * seconds)?;
        }
        checked.done(tally, &case)?;
    }
    for case in list("table_conditions")? {
        let tally = conditions(&case)?;
        checked.done(tally, &case)?;
    }
    if let Some(bytes) = root.find("phase_table").map(|table| table.get("bytes")) {
        let table = phase_table(&bytes?)?;
        for case in list("phases")? {
            let position = case.get("position")?.whole(-REACH, REACH)?;
            let mut tally = Tally::of(&case);
            tally.equal_member(&case, "takt", phases::index(&table, position).map(|index| index + 1));
            tally.equal_member(&case, "byte", phases::column(&table, position));
            let before = phases::column(&table, position + 1);
            let backward = phases::byte(&table, position, before);
            tally.equal_member(&case, "byte_arriving_backward", backward);
            checked.done(tally, &case)?;
        }
    }
    Ok(())
}

/// The dynamics table `name`: the file's own, or the published one.
fn table(root: &Node<'_>, name: &str, at: &Node<'_>) -> Result<Dynamics, Diagnostic> {
    match root.find("tables").and_then(|tables| tables.find(name)) {
        Some(node) => dynamics(&node),
        None if name == "arendt" => Ok(Dynamics::arendt()),
        None => Err(at.refuse(code!("lab.unknown_name")).with("found", name)),
    }
}

/// Reads a dynamics table from the members `period`, `enter` and `leave`.
pub(super) fn dynamics(node: &Node<'_>) -> Result<Dynamics, Diagnostic> {
    let period = whole_row(&node.get("period")?, 1, SLOWEST)?;
    let (enter, leave) = (node.get("enter")?, node.get("leave")?);
    let dynamics =
        Dynamics { enter: whole_row(&enter, 0, FARTHEST)?, leave: whole_row(&leave, 0, FARTHEST)?, period };
    let wanted = dynamics.period.len().saturating_sub(1);
    for (row, node) in [(&dynamics.enter, enter), (&dynamics.leave, leave)] {
        if row.len() != wanted {
            return Err(node
                .refuse(code!("lab.wrong_length"))
                .with("found", row.len())
                .with("wanted", wanted));
        }
    }
    Ok(dynamics)
}

fn whole_row(node: &Node<'_>, low: u32, high: u32) -> Result<Vec<u32>, Diagnostic> {
    let items = node.items()?;
    if items.is_empty() || items.len() > MOST_STATES + 1 {
        let why = node.refuse(code!("lab.wrong_length")).with("found", items.len());
        return Err(why.with("wanted", format!("1 … {}", MOST_STATES + 1)));
    }
    items.iter().map(|item| item.whole(i64::from(low), i64::from(high)).map(|whole| whole as u32)).collect()
}

/// The steps of one move with its changes of target, interrupt by interrupt.
fn steps(checked: &mut Checked, root: &Node<'_>, case: &Node<'_>) -> Result<Tally, Diagnostic> {
    let name = case.get("table")?;
    let mut axis = Automaton::new(table(root, name.text()?, &name)?, 0);
    axis.retarget(case.get("target")?.whole(-REACH, REACH)?);
    let mut changes = Vec::new();
    for row in case.find("retarget").map_or(Ok(Vec::new()), |rows| rows.items())? {
        let [interrupt, target] = row.exactly()?;
        changes.push((interrupt.whole(1, LATEST)?, target.whole(-REACH, REACH)?));
    }
    changes.sort_by_key(|(interrupt, _)| *interrupt);
    let mut changes = changes.into_iter().peekable();
    let (mut interrupt, mut found) = (0_i64, Vec::new());
    while !axis.is_at_rest() || changes.peek().is_some() {
        checked.spend(1, case)?;
        interrupt += 1;
        while let Some((_, target)) = changes.next_if(|(when, _)| *when == interrupt) {
            axis.retarget(target);
        }
        if let Some(step) = axis.interrupt() {
            found.push([interrupt, step.position, i64::from(step.state)]);
        }
    }
    let mut tally = Tally::of(case);
    if let Some(steps) = case.find("steps") {
        let rows = steps.items()?;
        tally.equal_count(&steps, rows.len(), found.len());
        for (row, step) in rows.iter().zip(&found) {
            for (expected, number) in row.exactly::<3>()?.iter().zip(step) {
                tally.equal(expected, *number);
            }
        }
    }
    tally.equal_member(case, "total_interrupts", found.last().map_or(0, |step| step[0]));
    tally.equal_member(case, "final_position", axis.position());
    tally.equal_member(case, "final_state", axis.state());
    Ok(tally)
}

/// The three sufficient conditions of A.6 for a table with thresholds a (enter) and b (leave), k = 1 … S.
fn conditions(case: &Node<'_>) -> Result<Tally, Diagnostic> {
    let (enter, leave) = (case.get("enter")?, case.get("leave")?);
    let (a, b) = (whole_row(&enter, 0, FARTHEST)?, whole_row(&leave, 0, FARTHEST)?);
    if a.len() != b.len() {
        return Err(leave.refuse(code!("lab.wrong_length")).with("found", b.len()).with("wanted", a.len()));
    }
    let all = |holds: fn(i64, i64, i64) -> bool| {
        let rows = a.iter().zip(&b).zip(1_i64..);
        rows.into_iter().all(|((a, b), k)| holds(i64::from(*a), i64::from(*b), k))
    };
    let mut tally = Tally::of(case);
    tally.equal_member(case, "exact", all(|a, b, k| a >= k - 1 && b >= k));
    tally.equal_member(case, "unimodal", all(|a, b, _| a >= b - 2));
    tally.equal_member(case, "slow_last", all(|a, b, k| a >= k && b > k));
    Ok(tally)
}

fn phase_table(bytes: &Node<'_>) -> Result<PhaseTable, Diagnostic> {
    let items = bytes.items()?;
    if items.is_empty() || items.len() > phases::MOST_COLUMNS {
        let why = bytes.refuse(code!("lab.wrong_length")).with("found", items.len());
        return Err(why.with("wanted", format!("1 … {}", phases::MOST_COLUMNS)));
    }
    let columns = items.iter().map(|item| item.whole(0, 255).map(|byte| byte as u8));
    Ok(PhaseTable { columns: columns.collect::<Result<_, _>>()? })
}
