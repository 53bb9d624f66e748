//! Hand-made programs on hand-made boards: provokes every kind of finding and checks its position to 0.1 mm.
//! Good programs have none; any single fault in a good one is found.

mod holes;
mod inside;
mod seeded;
mod together;

use super::*;
use crate::board::{Copper, Hole};
use crate::geometry::{Island, Path, Point, rectangle};
use crate::job::{Command, Cutter, Leg, Mark};
use crate::locale;

type Rect = (f64, f64, f64, f64);

fn bounds((left, bottom, right, top): Rect) -> crate::geometry::Bounds {
    crate::geometry::Bounds { min: Point::from_mm(left, bottom), max: Point::from_mm(right, top) }
}

fn board(rects: &[(Rect, Option<&str>)]) -> Board {
    let island = |rect: Rect| Island { outer: rectangle(bounds(rect)), holes: Vec::new() };
    let region = Region { islands: rects.iter().map(|(rect, _)| island(*rect)).collect() };
    let nets = rects.iter().map(|(_, net)| net.map(str::to_owned)).collect();
    Board { copper: vec![Copper { face: Face::Top, region, nets, ..Copper::default() }], ..Board::default() }
}

/// Three pads: gaps of 0.5 (A–B, at x = 4.25) and 0.3 (to C, at y = 2.15).
const A: Rect = (0.0, 0.0, 4.0, 2.0);
const B: Rect = (4.5, 0.0, 8.0, 2.0);
const C: Rect = (0.0, 2.3, 8.0, 4.0);

fn three() -> Board {
    board(&[(A, Some("A")), (B, Some("B")), (C, Some("C"))])
}

fn bit(diameter: f64, cutter: Cutter) -> Bit {
    Bit {
        diameter: Length::from_mm(diameter),
        name: format!("{diameter} mm"),
        cutter,
        handling: Default::default(),
    }
}

/// A V-bit of 60° with a tip of 0.1 mm.
fn vee() -> Bit {
    bit(3.0, Cutter::Vee { tip: Length::from_um(100), angle_mdeg: 60_000 })
}

#[derive(Clone, Debug)]
struct Toolpath {
    points: Vec<(f64, f64)>,
    depth: f64,
    mark: Mark,
}

fn way(points: &[(f64, f64)], depth: f64) -> Toolpath {
    Toolpath { points: points.to_vec(), depth, mark: Mark::Toolpath(0) }
}

fn contour((left, bottom, right, top): Rect, away: f64, depth: f64) -> Toolpath {
    let (left, bottom, right, top) = (left - away, bottom - away, right + away, top + away);
    way(&[(left, bottom), (right, bottom), (right, top), (left, top), (left, bottom)], depth)
}

const ON: Command = Command::Spindle { rpm: 30_000 };

fn program(bit: Bit, toolpaths: &[Toolpath]) -> Program {
    let safe_height = Length::from_mm(2.0);
    let leg = |way: &Toolpath| {
        let height = Length::from_mm(-way.depth);
        let place = |(x, y): (f64, f64)| Point::from_mm(x - 1.0, y - 2.0);
        let mut commands = vec![
            Command::Rapid { to: place(way.points[0]) },
            Command::Plunge { to: height, feed_um_per_s: 1000, gate: None },
        ];
        let mill = |&at: &(f64, f64)| Command::Mill { to: place(at), height, feed_um_per_s: 1000 };
        commands.extend(way.points[1..].iter().map(mill));
        commands.push(Command::Retract { to: safe_height });
        Leg { mark: way.mark, commands }
    };
    let first = Leg { mark: Mark::ToolChange(0), commands: vec![Command::AwaitBit { bit: 0 }, ON] };
    Program {
        name: String::new(),
        machine: String::new(),
        origin: Point::from_mm(1.0, 2.0),
        bits: vec![bit],
        spindles: 1,
        safe_height,
        legs: std::iter::once(first).chain(toolpaths.iter().map(leg)).collect(),
        accepted: Vec::new(),
    }
}

fn good() -> Vec<Toolpath> {
    [A, B, C].map(|pad| contour(pad, 0.1, 0.1)).to_vec()
}

fn mill(diameter: f64) -> Bit {
    bit(diameter, Cutter::Mill)
}

fn found(board: &Board, programs: &[Program]) -> Vec<Finding> {
    prove(board, programs, &ProofOptions::default()).findings
}

fn kinds(findings: &[Finding]) -> Vec<FindingKind> {
    let mut kinds: Vec<FindingKind> = findings.iter().map(|finding| finding.kind).collect();
    kinds.dedup();
    kinds
}

#[track_caller]
fn only(findings: &[Finding], kind: FindingKind) -> &Finding {
    let of_kind: Vec<&Finding> = findings.iter().filter(|finding| finding.kind == kind).collect();
    assert_eq!(of_kind.len(), 1, "{kind:?} in {findings:#?}");
    of_kind[0]
}

#[track_caller]
fn near(finding: &Finding, x: Option<f64>, y: Option<f64>) {
    let close = |found: Length, wanted: Option<f64>| wanted.is_none_or(|mm| (found.mm() - mm).abs() <= 0.1);
    assert!(close(finding.at.x, x) && close(finding.at.y, y), "{finding:?}");
}

#[track_caller]
fn wide(finding: &Finding, mm: f64) {
    assert!((finding.width.mm() - mm).abs() < 2e-3, "{finding:?}");
}

#[test]
fn good_program_has_no_problems() {
    assert_eq!(found(&three(), &[program(mill(0.2), &good())]), []);
    // The depth at which the V-bit is 0.2 mm wide at the surface.
    let depth = vee().depth_for(Length::from_mm(0.2)).unwrap().mm();
    let toolpaths = [A, B, C].map(|pad| contour(pad, 0.1, depth));
    assert_eq!(found(&three(), &[program(vee(), &toolpaths)]), []);
    // Two programs, one after the other.
    let halves = [program(mill(0.2), &good()[..1]), program(mill(0.2), &good()[1..])];
    assert_eq!(found(&three(), &halves), []);
    // Two islands of one net need not be isolated.
    let same = board(&[(A, Some("A")), (B, Some("A")), (C, Some("C"))]);
    assert_eq!(found(&same, &[program(mill(0.2), &good()[2..])]), []);
}

#[test]
fn uncut_board_is_all_shorts() {
    let findings = found(&three(), &[program(mill(0.2), &[])]);
    assert_eq!(kinds(&findings), [FindingKind::Short]);
    let nets: Vec<String> = findings.iter().map(|finding| finding.nets.concat()).collect();
    assert_eq!(nets.len(), 3, "{nets:?}");
    for finding in &findings {
        match finding.nets.concat().as_str() {
            "AB" => {
                near(finding, Some(4.25), None);
                wide(finding, 0.5);
            }
            "AC" | "BC" => {
                near(finding, None, Some(2.15));
                wide(finding, 0.3);
            }
            other => panic!("{other}"),
        }
    }
}

#[test]
fn missing_and_shallow_toolpaths_are_found() {
    // A's contour alone separates A and B.
    let toolpaths = [good()[0].clone(), good()[2].clone()];
    assert_eq!(found(&three(), &[program(mill(0.2), &toolpaths)]), []);
    let findings = found(&three(), &[program(mill(0.2), &toolpaths[1..])]);
    assert_eq!(kinds(&findings), [FindingKind::Short]);
    let short = only(&findings, FindingKind::Short);
    near(short, Some(4.25), None);
    wide(short, 0.5);
    assert_eq!(short.nets, ["A", "B"]);
    assert_eq!(short.tool, Some(Length::from_mm(0.2)));
    let shallow = [contour(A, 0.1, 0.03), toolpaths[1].clone()];
    let findings = found(&three(), &[program(mill(0.2), &shallow)]);
    assert_eq!(kinds(&findings), [FindingKind::Short, FindingKind::Shallow]);
    let shallow = only(&findings, FindingKind::Shallow);
    wide(shallow, 0.03);
    assert_eq!(shallow.leg, Some((0, 1)));
    assert!(matches!(&shallow.cures[..], [Cure::Deeper { depth, .. }] if *depth == Length::from_um(50)));
}

#[test]
fn shifted_toolpath_and_wide_tool_remove_copper() {
    let mut toolpaths = good();
    toolpaths[0].points.iter_mut().for_each(|(x, _)| *x += 0.2);
    let findings = found(&three(), &[program(mill(0.2), &toolpaths)]);
    let lost = only(&findings, FindingKind::Lost);
    near(lost, Some(0.1), None);
    wide(lost, 0.2);
    assert_eq!((lost.nets.concat(), lost.leg), ("A".to_owned(), Some((0, 1))));
    let findings = found(&three(), &[program(mill(0.3), &good())]);
    let lost: Vec<&Finding> = findings.iter().filter(|finding| finding.kind == FindingKind::Lost).collect();
    assert!(lost.len() >= 3, "{findings:#?}");
    assert!(lost.iter().all(|finding| (finding.width.mm() - 0.05).abs() < 2e-3), "{lost:#?}");
    // 4 µm is within the tolerance.
    assert_eq!(found(&three(), &[program(mill(0.208), &good())]), []);
}

#[test]
fn cut_through_a_net_is_a_break() {
    let mut toolpaths = good();
    toolpaths.push(way(&[(2.0, -0.5), (2.0, 2.1)], 0.1));
    let findings = found(&three(), &[program(mill(0.2), &toolpaths)]);
    let broken = only(&findings, FindingKind::Break);
    near(broken, Some(2.0), Some(1.0));
    wide(broken, 0.2);
    assert_eq!(broken.nets, ["A"]);
    assert_eq!(kinds(&findings), [FindingKind::Break, FindingKind::Lost]);
    wide(only(&findings, FindingKind::Lost), 0.2);
}

#[test]
fn milled_away_island_is_gone() {
    let board = board(&[(A, Some("A")), ((4.4, 0.9, 4.6, 1.1), Some("dot"))]);
    let toolpaths = [contour(A, 0.1, 0.1), way(&[(4.5, 0.0), (4.5, 2.0)], 0.1)];
    let findings = found(&board, &[program(mill(0.4), &toolpaths)]);
    near(only(&findings, FindingKind::Gone), Some(4.5), Some(1.0));
}

fn tight(gap: f64) -> Board {
    board(&[((0.0, 0.0, 1.0, 1.0), Some("P")), ((1.0 + gap, 0.2, 2.0, 0.8), None)])
}

fn around_tight() -> Vec<Toolpath> {
    vec![
        way(&[(1.1, -0.1), (-0.1, -0.1), (-0.1, 1.1), (1.1, 1.1), (1.1, 0.9), (2.1, 0.9), (2.1, 0.1)], 0.1),
        way(&[(2.1, 0.1), (1.1, 0.1), (1.1, -0.1)], 0.1),
    ]
}

#[test]
fn gap_narrower_than_the_tool_has_fixes() {
    let owned = vec![mill(0.1), mill(0.12), mill(0.3), bit(0.1, Cutter::Drill)];
    let options = ProofOptions { owned, ..ProofOptions::default() };
    let findings = prove(&tight(0.15), &[program(mill(0.2), &around_tight())], &options).findings;
    let gap = only(&findings, FindingKind::Gap);
    near(gap, Some(1.075), Some(0.5));
    wide(gap, 0.15);
    assert_eq!(gap.nets, ["@1.15,0.20", "P"]);
    let depth = Length::from_um(50);
    let other = Cure::OtherBit { owned: 1, bit: "0.12 mm".to_owned(), depth, width: Length::from_mm(0.12) };
    let (width, lost) = (Length::from_mm(0.2), Length::from_um(25));
    assert_eq!(gap.cures, [other, Cure::Centred { bit: "0.2 mm".to_owned(), depth, width, lost }]);
    // The centred pass, once made, is reported with its losses.
    let mut cured = around_tight();
    cured.push(way(&[(1.075, 0.0), (1.075, 1.0)], 0.1));
    let findings = prove(&tight(0.15), &[program(mill(0.2), &cured)], &options).findings;
    let lost: Vec<&Finding> = findings.iter().filter(|finding| finding.kind == FindingKind::Lost).collect();
    assert_eq!(lost.len(), 2, "{findings:#?}");
    lost.iter().for_each(|finding| wide(finding, 0.025));
    assert!(findings.iter().all(|finding| finding.kind != FindingKind::Gap));
}

#[test]
fn neck_across_a_narrow_gap_is_no_short() {
    // Plunges in the gap leave a neck of 5 µm; the straight line between the sides hits it only in the
    // middle.
    let board = board(&[((0.0, 0.0, 1.0, 1.0), Some("P")), ((1.13, 0.2, 2.0, 0.8), Some("Q"))]);
    let mut toolpaths = around_tight();
    toolpaths.extend([0.2, 0.35, 0.5, 0.705, 0.8].map(|y| way(&[(1.065, y)], 0.1)));
    let findings = found(&board, &[program(mill(0.2), &toolpaths)]);
    let gap = only(&findings, FindingKind::Gap);
    near(gap, Some(1.065), Some(0.6025));
    wide(gap, 0.13);
    assert!(findings.iter().all(|finding| finding.kind != FindingKind::Short), "{findings:#?}");
}

#[test]
fn deep_v_bit_is_fixed_by_less_depth() {
    let depth = vee().depth_for(Length::from_mm(0.2)).unwrap().mm();
    let toolpaths: Vec<Toolpath> = around_tight().into_iter().map(|way| Toolpath { depth, ..way }).collect();
    let findings = found(&tight(0.17), &[program(vee(), &toolpaths)]);
    let gap = only(&findings, FindingKind::Gap);
    let [Cure::Shallower { depth, width, .. }] = &gap.cures[..] else { panic!("{gap:?}") };
    assert!((width.mm() - 0.17).abs() < 1e-5, "{gap:?}");
    assert!(*depth > Length::from_um(60) && *depth < Length::from_um(61), "{gap:?}");
}

#[test]
fn slivers_and_fragments_are_found() {
    // Two parallel toolpaths leave 30 µm between them.
    let mut toolpaths = good();
    toolpaths.push(way(&[(0.0, 6.0), (3.0, 6.0)], 0.1));
    toolpaths.push(way(&[(0.0, 6.23), (3.0, 6.23)], 0.1));
    let findings = found(&three(), &[program(mill(0.2), &toolpaths)]);
    assert_eq!(kinds(&findings), [FindingKind::Sliver]);
    let sliver = only(&findings, FindingKind::Sliver);
    near(sliver, None, Some(6.115));
    wide(sliver, 0.03);
    // An isolated square of 80 µm.
    let mut toolpaths = good();
    toolpaths.push(contour((6.0, 6.0, 6.08, 6.08), 0.1, 0.1));
    let findings = found(&three(), &[program(mill(0.2), &toolpaths)]);
    assert_eq!(kinds(&findings), [FindingKind::Fragment]);
    near(only(&findings, FindingKind::Fragment), Some(6.04), Some(6.04));
    assert!(!findings[0].must_be_read());
}

fn drilled(board: &mut Board, x: f64, y: f64, diameter: f64) -> Program {
    let at = Point::from_mm(x, y);
    let hole = Hole {
        at,
        diameter: Some(Length::from_mm(diameter)),
        plated: None,
        source: 0,
        tool_code: 1,
        line: 1,
    };
    board.holes = vec![hole];
    let stroke = Toolpath { mark: Mark::Hole(0), ..way(&[(x, y)], 1.8) };
    program(bit(diameter, Cutter::Drill), &[stroke])
}

#[test]
fn holes_are_checked_against_surrounding_copper() {
    let isolate = program(mill(0.2), &good());
    // In the middle of A, 1 mm to its edges; 30 µm to its edge; 100 µm out of it; in the gap, over A.
    let rows = [
        (2.0, 1.0, None, 0.0),
        (2.0, 0.63, Some(FindingKind::Ring), 0.03),
        (2.0, 0.5, Some(FindingKind::Ring), -0.1),
        (4.25, 1.0, Some(FindingKind::Hit), 0.35),
    ];
    for (x, y, kind, width) in rows {
        let mut board = three();
        let drill = drilled(&mut board, x, y, 1.2);
        let findings = found(&board, &[isolate.clone(), drill]);
        match kind {
            None => assert_eq!(findings, []),
            Some(FindingKind::Ring) => {
                let ring = only(&findings, FindingKind::Ring);
                near(ring, Some(2.0), Some(0.0));
                wide(ring, width);
            }
            Some(kind) => {
                let hits: Vec<&Finding> = findings.iter().filter(|finding| finding.kind == kind).collect();
                assert_eq!(hits.len(), 2, "{findings:#?}");
                hits.iter().for_each(|hit| wide(hit, width));
                near(hits[0], Some(4.0), Some(1.0));
            }
        }
    }
    // In the middle of A, with a large runout.
    let mut board = three();
    let mut drill = drilled(&mut board, 2.0, 1.0, 1.2);
    drill.bits[0].handling.run_out = Length::from_mm(0.38);
    let findings = found(&board, &[isolate.clone(), drill]);
    wide(only(&findings, FindingKind::Ring), 0.02);
    // A pad with an open centre: the drill is larger than the opening.
    let mut board = three();
    let mut hole = rectangle(bounds((1.8, 0.8, 2.2, 1.2)));
    hole = hole.reversed();
    board.copper[0].region.islands[0].holes.push(hole);
    let drill = drilled(&mut board, 2.0, 1.0, 1.2);
    assert_eq!(found(&board, &[isolate, drill]), []);
}

#[test]
fn cut_without_a_tool_is_reported() {
    let mut program = program(mill(0.2), &good());
    program.legs[0] = Leg { mark: Mark::Prepare, commands: vec![ON] };
    let findings = found(&three(), &[program]);
    assert_eq!(kinds(&findings), [FindingKind::NoBit]);
}

#[test]
fn cut_with_stopped_spindle_is_reported_once_per_stop() {
    let off = Command::Spindle { rpm: 0 };
    // Spindle off in legs 1 and 2, on in 3: reported at the start of leg 1; then off in leg 3 too.
    let mut program = program(mill(0.2), &good());
    program.legs[0].commands.pop();
    program.legs[3].commands.insert(0, ON);
    let findings = found(&three(), &[program.clone()]);
    assert_eq!(kinds(&findings), [FindingKind::Still]);
    let still = only(&findings, FindingKind::Still);
    near(still, Some(-0.1), Some(-0.1));
    wide(still, 0.1);
    assert_eq!((still.leg, still.mark, still.must_be_read()), (Some((0, 1)), Some(Mark::Toolpath(0)), true));
    let said = still.diagnostic().message("en");
    assert!(said.starts_with("The program cuts 0.100 mm deep at X -0.10 Y -0.10"), "{said}");
    assert!(said.contains("segment 2") && said.contains("(toolpath 1)"), "{said}");
    let named = Finding { operation: Some("Isolate the top".to_owned()), ..still.clone() };
    assert!(named.diagnostic().message("en").starts_with("Isolate the top cuts"), "{said}");
    program.legs[2].commands.insert(0, ON);
    program.legs[3].commands[0] = off;
    let legs: Vec<Option<(u32, u32)>> =
        found(&three(), &[program]).iter().map(|finding| finding.leg).collect();
    assert_eq!(legs, [Some((0, 1)), Some((0, 3))]);
}

#[test]
fn copper_within_the_clearance_is_a_remnant() {
    let options = ProofOptions { clearance: Some(Length::from_mm(0.36)), ..ProofOptions::default() };
    let inner = contour(A, 0.1, 0.1);
    let outer = contour(A, 0.26, 0.1);
    let alone = board(&[(A, Some("A"))]);
    let both = program(mill(0.2), &[inner.clone(), outer]);
    assert_eq!(prove(&alone, &[both], &options).findings, []);
    let findings = prove(&alone, &[program(mill(0.2), &[inner])], &options).findings;
    assert_eq!(kinds(&findings), [FindingKind::Remnant]);
}

#[test]
fn strip_in_a_cleared_area_is_a_remnant() {
    let alone = board(&[(A, Some("A"))]);
    let cleared = Cleared {
        surface: Length::from_mm(0.8),
        through: Length::from_mm(0.8),
        margin: Length::ZERO,
        beyond: Length::from_mm(1.0),
    };
    let clearance = ProofOptions { clearance: Some(Length::from_mm(1.4)), ..ProofOptions::default() };
    let clearing = ProofOptions { cleared: vec![cleared], ..ProofOptions::default() };
    for (outer, remnants) in [(1.0, &[][..]), (1.22, &[FindingKind::Remnant][..])] {
        // Between the two toolpaths a strip of 0.02 mm is left, about 0.3 mm².
        let toolpaths = program(mill(0.8), &[contour(A, 0.4, 0.1), contour(A, outer, 0.1)]);
        for options in [&clearance, &clearing] {
            let findings = prove(&alone, std::slice::from_ref(&toolpaths), options).findings;
            let told: Vec<FindingKind> =
                kinds(&findings).into_iter().filter(|kind| *kind != FindingKind::Sliver).collect();
            assert_eq!(told, remnants, "{outer} {options:?}");
        }
        assert!(!kinds(&found(&alone, &[toolpaths])).contains(&FindingKind::Remnant));
    }
}

#[test]
fn copper_beyond_the_outline_does_not_count() {
    let mut board = three();
    const CARD: Rect = (-0.5, -0.5, 8.5, 3.0);
    let outer = rectangle(bounds(CARD));
    board.outline = Region { islands: vec![Island { outer, holes: Vec::new() }] };
    let mut toolpaths = good();
    // Cut out along the edge, through the part of C beyond it.
    toolpaths.push(contour(CARD, 0.1, 0.1));
    assert_eq!(found(&board, &[program(mill(0.2), &toolpaths)]), []);
}

#[test]
fn problem_ids_ignore_order_and_every_kind_has_a_text() {
    let names = |rects: &[(Rect, Option<&str>)]| {
        let mut names: Vec<String> =
            found(&board(rects), &[program(mill(0.2), &[])]).into_iter().map(|finding| finding.id).collect();
        names.sort();
        names
    };
    let there = names(&[(A, Some("A")), (B, None), (C, Some("C"))]);
    assert_eq!(there, names(&[(C, Some("C")), (A, Some("A")), (B, None)]));
    assert_eq!(there.len(), 3);
    for kind in FindingKind::ALL {
        for part in ["message", "advice"] {
            let key = format!("{}.{part}", kind.code());
            assert!(locale::lookup("en", &key).is_some(), "no sentence {key}");
        }
        // Unnamed nets and findings without nets give complete sentences.
        for nets in [Vec::new(), vec!["@1.00,2.00".to_owned()]] {
            let said =
                Finding::new(kind, Point::default(), Length::from_um(20), nets).diagnostic().message("en");
            assert!(!said.ends_with(' ') && !said.contains(". @"), "{said:?}");
        }
    }
    let verdict =
        prove(&three(), &[program(mill(0.2), &[])], &ProofOptions { most: 1, ..ProofOptions::default() });
    assert_eq!((verdict.findings.len(), verdict.more, verdict.islands, verdict.nets), (1, 2, 3, 3));
    assert_eq!(to_be_read(&verdict.groups).count(), 3, "what is not listed must be read all the same");
}

#[test]
fn outcome_counts_isolated_nets_and_the_smallest_gap() {
    let sentence = |verdict: &Verdict, unread: usize| {
        let (key, words) = verdict.outcome.sentence(unread);
        let words: Vec<_> = words.into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
        locale::text("en", key, &words)
    };
    // A cut of 0.2 mm around A isolates A; B and C stay one piece.
    let alone = program(mill(0.2), &[contour(A, 0.15, 0.1)]);
    let options = ProofOptions::default();
    let proved = prove(&three(), std::slice::from_ref(&alone), &options);
    assert_eq!((proved.outcome.nets, proved.outcome.isolated), (3, 1), "{:?}", proved.outcome);
    assert_eq!(sentence(&proved, 1), "Not proved: 1 of 3 nets isolated, 1 open problem");
    let both = program(mill(0.2), &[contour(A, 0.15, 0.1), contour(B, 0.15, 0.1)]);
    let proved = prove(&three(), &[both], &options);
    assert_eq!(sentence(&proved, 0), "Proved: 3 of 3 nets isolated, smallest gap 0.20 mm");
    // A single net, no cut, no copper, copper on the other side.
    let one = prove(&board(&[(A, Some("A"))]), std::slice::from_ref(&alone), &options);
    assert_eq!(sentence(&one, 0), "Proved: 1 of 1 net isolated");
    let nothing = prove(&three(), &[], &ProofOptions { isolates: None, ..options.clone() });
    assert_eq!(sentence(&nothing, 0), "No isolation on this side: the copper stays as it is on the blank.");
    let bare = prove(&Board::default(), std::slice::from_ref(&alone), &options);
    assert_eq!(sentence(&bare, 0), "Nothing to prove: no copper layer is open.");
    let other = prove(&three(), &[alone], &ProofOptions { face: Face::Bottom, ..options });
    assert_eq!(sentence(&other, 0), "Nothing to prove: this side has no copper.");
}
