//! Grouped reports: a job that isolates nothing, gaps of one cause, the effect of a smaller depth for the
//! whole job. Also slivers with and without a dependent net.

use super::*;

fn drilled() -> Program {
    let hole = |x: f64, y: f64, hole| Toolpath { mark: Mark::Hole(hole), ..way(&[(x, y)], 2.0) };
    program(bit(0.8, Cutter::Drill), &[hole(2.0, 1.0, 0), hole(6.0, 1.0, 1), hole(4.0, 3.0, 2)])
}

#[test]
fn job_without_isolation_has_one_optional_note() {
    let cut_out = program(mill(1.0), &[contour((-1.0, -1.0, 9.0, 5.0), 0.5, 2.0)]);
    for (programs, isolates) in [
        (vec![drilled()], Some(false)),
        (vec![drilled()], None),
        (vec![drilled(), cut_out.clone()], Some(false)),
        (vec![drilled(), cut_out], None),
    ] {
        let verdict = prove(&three(), &programs, &ProofOptions { isolates, ..ProofOptions::default() });
        let finding = only(&verdict.findings, FindingKind::NotIsolated);
        assert_eq!((finding.count, finding.must_be_read()), (3, false));
        assert!(verdict.findings.iter().all(|finding| !finding.must_be_read()), "{:#?}", verdict.findings);
        assert_eq!(kinds(&verdict.findings), [FindingKind::NotIsolated]);
    }
    // A path among the copper means that isolation is intended; a job that isolates gets every short
    // reported.
    let half = [drilled(), program(mill(0.2), &good()[..1])];
    let told = prove(&three(), &half, &ProofOptions { isolates: None, ..ProofOptions::default() }).findings;
    assert_eq!(kinds(&told), [FindingKind::Short]);
    let told = prove(&three(), &[drilled()], &ProofOptions::default()).findings;
    assert_eq!(kinds(&told), [FindingKind::Short]);
}

fn row(gaps: &[f64]) -> Board {
    let mut left = 0.0;
    let mut rects = vec![((0.0, 0.0, 2.0, 3.0), None)];
    for gap in gaps {
        left += 2.0 + gap;
        rects.push(((left, 0.0, left + 2.0, 3.0), None));
    }
    board(&rects)
}

/// Once around every pad of such a row with a V-bit of 30° and a tip of 0.1, 0.08 deep: 0.143 wide.
fn around_all(gaps: &[f64]) -> Program {
    let depth = 0.08;
    let bit = bit(3.175, Cutter::Vee { tip: Length::from_um(100), angle_mdeg: 30_000 });
    let right = 2.0 * (gaps.len() + 1) as f64 + gaps.iter().sum::<f64>();
    let half = bit.width_at(Length::from_mm(depth)).mm() / 2.0;
    program(bit, &[contour((0.0, 0.0, right, 3.0), half, depth)])
}

#[test]
fn gaps_of_one_cause_are_grouped_with_a_depth_fix() {
    let gaps = [0.13, 0.135, 0.13, 0.125, 0.11, 0.04];
    let verdict = prove(&row(&gaps), &[around_all(&gaps)], &ProofOptions::default());
    let [group] = verdict.groups.as_slice() else { panic!("{:#?}", verdict.groups) };
    assert_eq!((group.kind, group.count, group.pairs.len()), (FindingKind::Gap, 6, 6));
    let mm = |length: Length| libm::round(length.mm() * 1e3) as i64;
    assert_eq!((mm(group.least), mm(group.most), mm(group.tool.unwrap())), (40, 135, 143));
    let said = group.diagnostic().message("en");
    assert!(said.contains("0.143") && said.contains("6") && said.contains("0.040"), "{said}");
    // At 0.05 mm, the least depth that is certainly through, it cuts 0.1268 mm: 0.13 and wider fit, at 0.055.
    let whole = verdict.whole.unwrap();
    let shallower = whole.shallower.clone().unwrap();
    assert_eq!((whole.gaps, shallower.opens, whole.rest), (6, 3, 3));
    assert!(
        shallower.width <= Length::from_mm(0.13) && shallower.depth >= Length::from_mm(0.05),
        "{shallower:?}"
    );
    // 0.11 minus the flanks of 0.0268: a tip of 0.08 opens 0.125 and 0.11. None opens 0.04.
    assert_eq!((whole.tip, whole.tip_opens), (Some(Length::from_mm(0.08)), 2));
    let said: Vec<String> = whole.diagnostics().iter().map(|diagnostic| diagnostic.message("en")).collect();
    assert_eq!(said.len(), 3);
    assert!(said[0].contains("opens 3 of 6") && said[1].contains("0.08 mm is needed for 2"), "{said:?}");
    assert!(said.iter().all(|said| !said.contains('{')), "{said:?}");
}

#[test]
fn no_fix_is_suggested_if_all_gaps_or_none_open() {
    assert_eq!(prove(&three(), &[program(mill(0.2), &good())], &ProofOptions::default()).whole, None);
    let gaps = [0.02, 0.03];
    let whole = prove(&row(&gaps), &[around_all(&gaps)], &ProofOptions::default()).whole.unwrap();
    assert_eq!((whole.shallower, whole.tip, whole.rest), (None, None, 2));
}

#[test]
fn tips_too_fine_to_buy_are_not_suggested() {
    // Minus the flanks of 0.0268, 0.06 would need a tip of 0.03, and 0.09 one of 0.06.
    let gaps = [0.06, 0.09];
    let whole = prove(&row(&gaps), &[around_all(&gaps)], &ProofOptions::default()).whole.unwrap();
    assert_eq!((whole.tip, whole.tip_opens, whole.rest), (Some(Length::from_um(60)), 1, 2));
    let said = whole.diagnostics().last().unwrap().message("en");
    assert!(said.contains("finest V-bit tip (0.05 mm): 1."), "{said}");
}

#[test]
fn sliver_must_be_read_only_if_a_net_depends_on_it() {
    // Two pads connected by a thread, and one with a dead-end thread.
    let pads = [(0.0, 0.0, 2.0, 2.0), (4.0, 0.0, 6.0, 2.0)];
    let thread = |right: f64| (1.9, 0.99, right, 1.01);
    for (right, depends) in [(4.1, true), (2.45, false)] {
        let rects = [pads[0], pads[1], thread(right)];
        let shape = crate::geometry::union(&rects.map(|rect| rectangle(bounds(rect))));
        let nets = vec![Some("A".to_owned()); shape.islands.len()];
        let copper = vec![Copper { face: Face::Top, region: shape.clone(), nets, ..Copper::default() }];
        let board = Board { copper, ..Board::default() };
        // The exact contour, as the planner makes it.
        let path = crate::geometry::grow(&shape, Length::from_mm(0.1));
        let toolpaths: Vec<Toolpath> = path
            .paths()
            .map(|path| {
                way(&path.flattened(0.001).iter().map(|at| (at.x.mm(), at.y.mm())).collect::<Vec<_>>(), 0.1)
            })
            .collect();
        let findings = prove(&board, &[program(mill(0.2), &toolpaths)], &ProofOptions::default()).findings;
        let slivers: Vec<bool> = findings
            .iter()
            .filter(|finding| finding.kind == FindingKind::Sliver)
            .map(Finding::must_be_read)
            .collect();
        assert!(!slivers.is_empty(), "{right}: {findings:#?}");
        assert_eq!(slivers.contains(&true), depends, "{right}: {findings:#?}");
    }
}

#[test]
fn unnamed_islands_are_named_by_their_pads() {
    let mut board = board(&[(A, None), (B, None), (C, Some("GND"))]);
    board.copper[0].pads = vec![Some("R1.2+U3.14".to_owned()), None, Some("C1.1".to_owned())];
    let findings = found(&board, &[program(mill(0.2), &[])]);
    let nets: Vec<String> = findings.iter().map(|finding| finding.nets.join(" ")).collect();
    assert!(nets.contains(&"GND R1.2+U3.14".to_owned()), "{nets:?}");
    assert!(nets.iter().any(|nets| nets.contains("@4.50,0.00")), "{nets:?}");
}

#[test]
fn nearly_touching_nets_suggest_no_cut_of_zero_width() {
    let gaps = [0.13, 0.000_2];
    let verdict = prove(&row(&gaps), &[around_all(&gaps)], &ProofOptions::default());
    let [group] = verdict.groups.as_slice() else { panic!("{:#?}", verdict.groups) };
    let told = group.diagnostic();
    assert_eq!((group.count, told.code.as_str()), (2, "proof.group.gap_of_none"));
    assert!(told.message("en").contains("0.130") && !told.message("en").contains("0.000"), "{told:?}");
}
