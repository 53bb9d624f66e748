//! Edits of a job. Each returns a new job, so that it can be undone.

use crate::format::Unit;
use annulus_core::board::{COPPER_THICKNESS, DEPTH_MARGIN, Face};
use annulus_core::cam::parameters::OF_MACHINE;
use annulus_core::cam::work::{Operation, OperationKind, Remedy, Work};
use annulus_core::job::{Bit, Cutter};
use annulus_core::locale;
use annulus_core::machine::{Field, Machine, Value};
use annulus_core::proof::{self, Finding};
use annulus_core::units::Length;

const MOST_OPERATIONS: usize = 100;

pub fn moved(work: &Work, from: usize, to: usize) -> Work {
    let mut work = work.clone();
    if from < work.operations.len() && to < work.operations.len() {
        let operation = work.operations.remove(from);
        work.operations.insert(to, operation);
    }
    work
}

/// Adds an operation of kind `word` after index `after`; also returns its index. `None` if the job is full or
/// the kind is unknown.
pub fn added(work: &Work, word: &str, after: Option<usize>) -> Option<(Work, usize)> {
    let operation = Operation::usual(word, work.setup.face)?;
    if work.operations.len() >= MOST_OPERATIONS {
        return None;
    }
    let mut work = work.clone();
    let at = after.map_or(work.operations.len(), |after| after + 1).min(work.operations.len());
    work.operations.insert(at, operation);
    Some((work, at))
}

pub fn removed(work: &Work, at: usize) -> Work {
    let mut work = work.clone();
    if at < work.operations.len() {
        work.operations.remove(at);
    }
    work
}

pub fn changed(work: &Work, at: usize, act: impl FnOnce(&mut Operation)) -> Work {
    let mut work = work.clone();
    if let Some(operation) = work.operations.get_mut(at) {
        act(operation);
    }
    work
}

pub fn turned(work: &Work, face: Face) -> Work {
    let mut work = work.clone();
    work.setup.face = face;
    work
}

pub fn of_face(work: &Work, face: Face) -> Vec<usize> {
    let on = work.operations.iter().enumerate().filter(|(_, operation)| operation.face == face);
    on.map(|(at, _)| at).collect()
}

/// The typed text as a value of a parameter; text that is not a number stays text, which the job refuses. An
/// empty field returns to the machine's value, if the parameter has one.
pub fn value<T>(row: &Field<T>, text: &str) -> Value {
    if row.follows_machine() && text.trim().is_empty() {
        return Value::Text(OF_MACHINE.to_owned());
    }
    row.kind.typed(text)
}

/// Like [`value`], with lengths typed in `unit`; the value is in millimetres.
pub fn value_in<T>(row: &Field<T>, text: &str, unit: Unit) -> Value {
    match value(row, text) {
        Value::Number(number) if row.unit == "mm" && unit == Unit::Inch => {
            Value::Number(number / Unit::Inch.of_mm(1.0))
        }
        value => value,
    }
}

/// Width that the V-bit of `operation` cuts at the surface; `None` for other tools.
pub fn width(work: &Work, operation: &Operation) -> Option<Length> {
    let bit = work.bit(&operation.bit)?;
    (operation.uses_bit() && matches!(bit.cutter, Cutter::Vee { .. })).then(|| bit.width_at(operation.depth))
}

/// Smallest and largest width of the V-bit of `operation`: just through the copper, and its full diameter.
pub fn widths(work: &Work, operation: &Operation) -> Option<(Length, Length)> {
    width(work, operation)?;
    let bit = work.bit(&operation.bit)?;
    Some((bit.width_at(COPPER_THICKNESS + DEPTH_MARGIN), bit.diameter))
}

/// Sets the depth at which the V-bit of the operation cuts `wanted` wide; `None` if it cannot.
pub fn widened(work: &Work, at: usize, wanted: Length) -> Option<Work> {
    let operation = work.operations.get(at)?;
    let (low, high) = widths(work, operation)?;
    let depth = work.bit(&operation.bit)?.depth_for(wanted).filter(|_| wanted >= low && wanted <= high)?;
    Some(changed(work, at, |operation| operation.depth = depth))
}

/// End of a cut with depth 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ThroughTo {
    Below,
    /// Below the board by the full diameter of a drill: deeper by the length of its point.
    WholeDrill,
    /// In the bed, with the full diameter: holes for alignment pins.
    Bed,
}

/// Meaning of depth 0: where it ends, the board's thickness, how far beyond it. `None` if the operation has a
/// depth.
pub fn through(work: &Work, operation: &Operation, machine: &Machine) -> Option<(ThroughTo, Length, Length)> {
    let process = &machine.process;
    let (to, below) = if operation.action.rules().makes_pins {
        (ThroughTo::Bed, work.setup.alignment.depth)
    } else if operation.uses_bit() {
        (ThroughTo::Below, process.breakthrough)
    } else {
        (ThroughTo::WholeDrill, process.breakthrough)
    };
    (operation.depth == Length::ZERO).then_some((to, process.board_thickness, below))
}

/// A new tool with an unused name.
pub fn new_bit(work: &Work) -> Bit {
    let free = |number: &u32| work.bit(&format!("Mill {number}")).is_none();
    let number = (1..).find(free).unwrap_or(1);
    Bit {
        diameter: Length::from_um(1_000),
        name: format!("Mill {number}"),
        cutter: Cutter::Mill,
        handling: Default::default(),
    }
}

/// Replaces the tool at `at`; operations that use it get its new name.
pub fn bit_changed(work: &Work, at: usize, bit: Bit) -> Work {
    let mut work = work.clone();
    let Some(place) = work.bits.get_mut(at) else { return work };
    let before = std::mem::replace(&mut place.name, bit.name.clone());
    *place = bit;
    let name = place.name.clone();
    for operation in &mut work.operations {
        if operation.bit == before {
            operation.bit.clone_from(&name);
        }
    }
    work
}

/// Applies `cure` to the isolation at `at`, or else to the first one of this side. A deeper cut changes the
/// operation's depth; other fixes apply only to the problem's gap.
pub fn cured(work: &Work, at: usize, finding: &Finding, cure: &proof::Cure) -> Work {
    let action = |at: &usize| work.operations.get(*at).map(|operation| &operation.action);
    let isolates = |at: &usize| matches!(action(at), Some(OperationKind::Isolate(_)));
    let first = || of_face(work, work.setup.face).into_iter().find(isolates);
    let Some(at) = Some(at).filter(isolates).or_else(first) else { return work.clone() };
    changed(work, at, |operation| {
        let with = match cure {
            proof::Cure::Deeper { depth, .. } => {
                operation.depth = operation.depth.max(*depth);
                return;
            }
            proof::Cure::Shallower { depth, .. } => Remedy::Depth(*depth),
            proof::Cure::OtherBit { bit, .. } => Remedy::Bit(bit.clone()),
            proof::Cure::Centred { .. } => Remedy::Centred,
        };
        let Some((from, to)) = finding.ends else { return };
        if let OperationKind::Isolate(isolate) = &mut operation.action {
            isolate.cure(from, to, with);
        }
    })
}

/// Limits every isolation of this side that uses the offer's tool to the offer's depth.
pub fn shallower(work: &Work, offer: &proof::Shallower) -> Work {
    let mut work = work.clone();
    let face = work.setup.face;
    for operation in work.operations.iter_mut().filter(|own| own.isolates(face) && own.bit == offer.bit) {
        operation.depth = operation.depth.min(offer.depth);
    }
    work
}

/// Largest depth of the tool from [`finer_tip`]: just what the copper needs.
pub const FINER_TIP_DEPTH: Length = Length::from_nm(COPPER_THICKNESS.nm() + DEPTH_MARGIN.nm());

/// Replaces the finest V-bit that isolates this side by one with `tip`, with just the depth that the copper
/// needs. Uses an equal tool of the job, or adds one.
pub fn finer_tip(work: &Work, tip: Length) -> Work {
    let mut work = work.clone();
    let (face, least) = (work.setup.face, FINER_TIP_DEPTH);
    let used = work.operations.iter().filter(|own| own.isolates(face));
    let used = used.filter_map(|operation| work.bit(&operation.bit));
    let vees = used.filter(|bit| matches!(bit.cutter, Cutter::Vee { .. }));
    let Some(before) = vees.min_by_key(|bit| (bit.width_at(least), bit.name.clone())).cloned() else {
        return work;
    };
    let Cutter::Vee { angle_mdeg, .. } = before.cutter else { return work };
    let cutter = Cutter::Vee { tip, angle_mdeg };
    let known = work.bits.iter().find(|bit| bit.cutter == cutter).map(|bit| bit.name.clone());
    let name = known.unwrap_or_else(|| {
        let mut bit = Bit { name: String::new(), cutter, ..before.clone() };
        bit.name = bit.title(locale::FALLBACK);
        work.bits.push(bit.clone());
        bit.name
    });
    for operation in work.operations.iter_mut().filter(|own| own.isolates(face) && own.bit == before.name) {
        operation.bit.clone_from(&name);
        operation.depth = operation.depth.min(least);
    }
    work
}

#[cfg(test)]
mod tests {
    use super::*;
    use annulus_core::cam::parameters;
    use annulus_core::cam::usual::usual_bits;
    use annulus_core::cam::work::{Holes, LocalIsolation};
    use annulus_core::geometry::Point;
    use annulus_core::machine::virtual_drill;

    fn work(words: &[&str]) -> Work {
        let operation = |word: &&str| Operation::usual(word, Face::Top).unwrap();
        Work { bits: usual_bits(), operations: words.iter().map(operation).collect(), ..Work::default() }
    }

    fn words(work: &Work) -> String {
        work.operations.iter().map(|operation| operation.action.word()).collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn operations_can_be_added_removed_and_moved() {
        let before = work(&["isolate", "drill", "cut_out"]);
        assert_eq!(words(&moved(&before, 0, 2)), "drill cut_out isolate");
        assert_eq!(words(&moved(&before, 2, 1)), "isolate cut_out drill");
        assert_eq!(moved(&before, 1, 9), before);
        assert_eq!(moved(&moved(&before, 0, 2), 2, 0), before, "and back");
        let (more, at) = added(&before, "mill_holes", Some(1)).unwrap();
        assert_eq!((words(&more).as_str(), at), ("isolate drill mill_holes cut_out", 2));
        assert_eq!(removed(&more, at), before);
        assert_eq!(added(&before, "fold", None), None);
    }

    #[test]
    fn job_has_a_maximum_of_operations() {
        let mut full = work(&[]);
        while let Some((more, _)) = added(&full, "drill", None) {
            full = more;
        }
        assert_eq!(full.operations.len(), MOST_OPERATIONS);
    }

    #[test]
    fn each_side_has_its_operations() {
        let mut both = work(&["isolate", "drill"]);
        both.operations[0].face = Face::Bottom;
        assert_eq!(of_face(&both, Face::Bottom), [0]);
        assert_eq!(of_face(&both, Face::Top), [1]);
        assert_eq!(turned(&both, Face::Bottom).setup.face, Face::Bottom);
    }

    #[test]
    fn only_a_v_bit_has_a_computed_width() {
        let work = work(&["isolate", "cut_out", "drill"]);
        let found: Vec<_> = work.operations.iter().map(|operation| width(&work, operation)).collect();
        let expected = 0.1 + 2.0 * 0.08 * libm::tan(15.0_f64.to_radians());
        assert!((found[0].unwrap().mm() - expected).abs() < 2e-6, "{found:?}");
        assert_eq!(found[1..], [None, None]);
    }

    #[test]
    fn zero_depth_means_through_the_board_or_bed() {
        let um = Length::from_um;
        let mut machine = virtual_drill();
        (machine.process.board_thickness, machine.process.breakthrough) = (um(1_600), um(300));
        let mut work = Work::default();
        work.setup.alignment.depth = um(5_000);
        let mut operation = Operation::usual("drill", Face::Top).unwrap();
        let said = |operation: &Operation| through(&work, operation, &machine);
        assert_eq!(operation.depth, Length::ZERO, "drills go through");
        assert_eq!(said(&operation), Some((ThroughTo::WholeDrill, um(1_600), um(300))));
        if let OperationKind::Drill(drill) = &mut operation.action {
            drill.holes = Holes::Alignment;
        }
        assert_eq!(said(&operation), Some((ThroughTo::Bed, um(1_600), um(5_000))));
        operation.depth = um(900);
        assert_eq!(said(&operation), None, "it is said by its number");
        let mut cut = Operation::usual("cut_out", Face::Top).unwrap();
        cut.depth = Length::ZERO;
        assert_eq!(said(&cut), Some((ThroughTo::Below, um(1_600), um(300))));
    }

    #[test]
    fn depth_follows_the_typed_width() {
        let before = work(&["isolate", "cut_out"]);
        let um = Length::from_um;
        let after = widened(&before, 0, um(200)).unwrap();
        let told = width(&after, &after.operations[0]).unwrap();
        assert!((told - um(200)).mm().abs() < 2e-6, "{told:?}");
        let (low, high) = widths(&before, &before.operations[0]).unwrap();
        assert!(widened(&before, 0, low).is_some() && widened(&before, 0, high).is_some());
        assert_eq!(widened(&before, 0, low - um(1)), None, "not through the copper");
        assert_eq!(widened(&before, 0, high + um(1)), None, "wider than the bit");
        assert_eq!(widened(&before, 1, um(200)), None, "an end mill has one width");
    }

    #[test]
    fn typed_parameter_becomes_a_value_or_is_refused() {
        let row = parameters::find(parameters::OPERATION, "isolate.passes").unwrap();
        let mut operation = work(&["isolate"]).operations.remove(0);
        assert!(row.set(&mut operation, &value(row, " 3 ")).is_ok());
        assert_eq!(row.get(&operation), Some(Value::Number(3.0)));
        assert!(row.set(&mut operation, &value(row, "three")).is_err());
        assert!(row.set(&mut operation, &value(row, "1,5")).is_err(), "no half passes");
    }

    #[test]
    fn shallower_fix_changes_equal_isolations_of_the_side() {
        let mut before = work(&["isolate", "isolate", "cut_out"]);
        before.operations[1].face = Face::Bottom;
        let um = Length::from_um;
        let bit = before.operations[0].bit.clone();
        let offer = proof::Shallower { bit, depth: um(50), width: um(127), opens: 33 };
        let depths: Vec<Length> =
            shallower(&before, &offer).operations.iter().map(|operation| operation.depth).collect();
        assert_eq!(depths, [um(50), before.operations[1].depth, before.operations[2].depth]);
    }

    #[test]
    fn typed_lengths_use_the_shown_unit() {
        let typed = |key: &str, text: &str, unit| {
            let row = annulus_core::cam::parameters::OPERATION.iter().find(|row| row.key == key).unwrap();
            value_in(row, text, unit)
        };
        let (inch, mm) = (Unit::Inch, Unit::Millimetre);
        for (key, text, unit, wanted) in [
            ("operation.depth", "0.08", mm, 0.08),
            ("operation.depth", "0.01", inch, 0.254),
            ("operation.depth_per_pass", "0,1", inch, 2.54),
            ("operation.feed", "10", inch, 10.0),
            ("isolate.passes", "3", inch, 3.0),
        ] {
            let Value::Number(found) = typed(key, text, unit) else { panic!("{key}") };
            assert!((found - wanted).abs() < 1e-9, "{key} {text}: {found}");
        }
        assert_eq!(typed("operation.depth", "deep", inch), Value::Text("deep".to_owned()));
    }

    #[test]
    fn finer_tip_adds_one_tool_to_the_job() {
        let mut before = work(&["isolate", "isolate", "cut_out"]);
        before.operations[1].face = Face::Bottom;
        let tip = Length::from_um(80);
        let after = finer_tip(&before, tip);
        let bit = after.bit(&after.operations[0].bit).unwrap();
        assert!(matches!(bit.cutter, Cutter::Vee { tip: found, .. } if found == tip), "{bit:?}");
        assert_eq!(bit.name, "V-bit 30°, tip 0.08", "called as the others are");
        assert_eq!(after.bits.len(), before.bits.len() + 1);
        assert_eq!(after.operations[0].depth, COPPER_THICKNESS + DEPTH_MARGIN);
        assert_eq!(after.operations[1..], before.operations[1..], "the other side stays as it is");
        let again = finer_tip(&after, tip);
        assert_eq!(again, after, "and one bit is enough");
    }

    #[test]
    fn gap_has_one_fix_across_it() {
        let before = work(&["drill", "isolate"]);
        let ends = (Point::from_mm(3.0, 1.0), Point::from_mm(3.0, 1.1));
        let found = Finding::new(
            proof::FindingKind::Gap,
            Point::from_mm(3.0, 1.05),
            Length::from_um(100),
            Vec::new(),
        );
        let finding = Finding { ends: Some(ends), ..found };
        let cures = |work: &Work| match &work.operations[1].action {
            OperationKind::Isolate(isolate) => isolate.cures.clone(),
            _ => Vec::new(),
        };
        let um = Length::from_um;
        let bit = |name: &str| name.to_owned();
        let centred = proof::Cure::Centred {
            bit: bit("V-bit 30°, tip 0.1"),
            depth: um(80),
            width: um(140),
            lost: um(20),
        };
        let centred = cured(&before, 1, &finding, &centred);
        let wanted = LocalIsolation { from: ends.0, to: ends.1, with: Remedy::Centred };
        assert_eq!(cures(&centred), std::slice::from_ref(&wanted));
        let other = proof::Cure::OtherBit { owned: 1, bit: bit("V 60°"), depth: um(60), width: um(90) };
        let changed = cured(&centred, 1, &finding, &other);
        assert_eq!(cures(&changed), [LocalIsolation { with: Remedy::Bit("V 60°".to_owned()), ..wanted }]);
    }

    #[test]
    fn renamed_tool_remains_the_operations_tool() {
        let before = work(&["isolate"]);
        let bit = Bit { name: "Thin V".to_owned(), ..before.bits[0].clone() };
        let after = bit_changed(&before, 0, bit);
        assert_eq!(after.operations[0].bit, "Thin V");
        assert!(width(&after, &after.operations[0]).is_some());
        let name = new_bit(&after).name;
        assert!(after.bit(&name).is_none());
    }
}
