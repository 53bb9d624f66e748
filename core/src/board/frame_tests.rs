//! Frames around boards: with their own holes, or as the only loop of an outline layer.

use super::from_artwork;
use super::tests::{layer, line, pads, program, rect};
use crate::artwork::{Overrides, read_set};

const PADS: [(f64, f64); 4] = [(5.0, 5.0), (35.0, 5.0), (35.0, 23.0), (12.0, 20.0)];
const TOOLING: [(f64, f64); 2] = [(-5.0, 14.0), (45.0, 14.0)];

/// Widths in mm of the boards found inside an outline of `lines`, and the codes reported about the outline.
fn boards(lines: &str, copper: &str, holes: &[(f64, f64)]) -> (Vec<f64>, Vec<String>) {
    let files = [
        ("b-Edge_Cuts.gm1".to_owned(), layer("Profile,NP", lines)),
        ("b-F_Cu.gtl".to_owned(), layer("Copper,L1,Top", copper)),
        ("b.drl".to_owned(), program(holes)),
    ];
    let artwork = read_set(&files, &Overrides::default());
    let (board, diagnostics) = from_artwork(&artwork, &artwork.default_use());
    let wide = |island: &crate::geometry::Island| {
        let bounds = crate::geometry::path_bounds(&island.outer);
        (bounds.max.x - bounds.min.x).mm().round()
    };
    let codes =
        diagnostics.into_iter().map(|said| said.code).filter(|code| code.starts_with("board.outline"));
    (board.outline.islands.iter().map(wide).collect(), codes.collect())
}

#[test]
fn frames_around_a_board_are_not_cut() {
    let board = rect(0.0, 0.0, 40.0, 28.0);
    let frame = rect(-10.0, -10.0, 60.0, 48.0);
    let all = [&PADS[..], &TOOLING].concat();
    let fiducials = pads(&[&PADS[..], &TOOLING].concat());
    let small: Vec<(f64, f64)> = PADS.iter().map(|(x, y)| (x / 3.0, y / 3.0)).collect();
    let both = board.clone() + &frame;
    for (name, lines, copper, holes, want, codes) in [
        ("holes in the frame", &both, pads(&PADS), &all[..], vec![40.0], &["board.outline_frame_around"][..]),
        ("nothing in the frame", &both, pads(&PADS), &PADS[..], vec![40.0], &["board.outline_frames"]),
        ("copper in the frame", &both, fiducials, &all[..], vec![60.0, 40.0], &[]),
        ("only the board", &board, pads(&PADS), &PADS[..], vec![40.0], &[]),
        (
            "only a sheet",
            &rect(-20.0, -20.0, 80.0, 70.0),
            pads(&PADS),
            &PADS[..],
            vec![80.0],
            &["board.outline_oversize"],
        ),
        ("parts in one corner", &board, pads(&small), &[(3.0, 3.0), (37.0, 25.0)], vec![40.0], &[]),
        (
            "a hole and a large cut-out",
            &(board.clone() + &rect(4.0, 4.0, 20.0, 20.0)),
            pads(&[(30.0, 5.0), (35.0, 20.0), (38.0, 26.0)]) + &line(&[(30.0, 5.0), (35.0, 20.0)]),
            &[(2.0, 2.0), (38.0, 2.0)],
            vec![40.0],
            &[],
        ),
    ] {
        let (found, said) = boards(lines, &copper, holes);
        assert_eq!(
            (found, said.iter().map(String::as_str).collect::<Vec<_>>()),
            (want, codes.to_vec()),
            "{name}"
        );
    }
}

/// Which of two loops is the edge, by their distance and what is between them. Rounded, the inner one is 40 mm
/// wide and the outer one more, if they are at least 0.3 mm apart.
#[test]
fn loops_near_each_other_are_one_board_and_reported() {
    let board = rect(0.0, 0.0, 40.0, 28.0);
    let around = |away: f64| board.clone() + &rect(-away, -away, 40.0 + 2.0 * away, 28.0 + 2.0 * away);
    let beside = [&PADS[..], &[(-0.2, 14.0)]].concat();
    let (nested, rest) = (&["board.outline_nested"][..], &["board.outline_rest"][..]);
    let bare = &["board.outline_frame_around"][..];
    for (name, lines, copper, holes, want, codes) in [
        ("one line drawn twice", around(0.1), pads(&PADS), &PADS[..], 40.0, &[][..]),
        ("0.3 mm", around(0.3), pads(&PADS), &PADS, 40.0, nested),
        ("0.5 mm", around(0.5), pads(&PADS), &PADS, 40.0, nested),
        ("1 mm", around(1.0), pads(&PADS), &PADS, 40.0, nested),
        ("5 mm", around(4.9), pads(&PADS), &PADS, 40.0, nested),
        ("far", around(6.0), pads(&PADS), &PADS, 40.0, &["board.outline_frames"]),
        ("no copper", around(0.5), String::new(), &PADS, 40.0, nested),
        ("nothing in them", around(0.5), String::new(), &[], 40.0, nested),
        ("a pad between them", around(0.4), pads(&beside), &PADS, 41.0, rest),
        (
            "a track that ends between them",
            around(0.4),
            pads(&PADS) + &line(&[(5.0, 5.0), (-0.2, 5.0)]),
            &PADS,
            41.0,
            rest,
        ),
        ("a hole between them", around(0.4), pads(&PADS), &beside[..], 40.0, bare),
    ] {
        let (found, said) = boards(&lines, &copper, holes);
        assert_eq!(
            (found, said.iter().map(String::as_str).collect::<Vec<_>>()),
            (vec![want], codes.to_vec()),
            "{name}"
        );
    }
}

#[test]
fn each_frame_is_reported_with_its_own_holes() {
    let beside = |places: &[(f64, f64)]| places.iter().map(|(x, y)| (x + 100.0, *y)).collect::<Vec<_>>();
    let lines = rect(0.0, 0.0, 40.0, 28.0)
        + &rect(-10.0, -10.0, 60.0, 48.0)
        + &rect(100.0, 0.0, 40.0, 28.0)
        + &rect(85.0, -15.0, 70.0, 58.0);
    let copper = [&PADS[..], &beside(&PADS)].concat();
    let holes = [&copper[..], &TOOLING, &beside(&TOOLING), &[(95.0, -5.0)]].concat();
    let files = [
        ("b-Edge_Cuts.gm1".to_owned(), layer("Profile,NP", &lines)),
        ("b-F_Cu.gtl".to_owned(), layer("Copper,L1,Top", &pads(&copper))),
        ("b.drl".to_owned(), program(&holes)),
    ];
    let artwork = read_set(&files, &Overrides::default());
    let (_, diagnostics) = from_artwork(&artwork, &artwork.default_use());
    let frames = diagnostics.iter().filter(|said| said.code == "board.outline_frame_around");
    let mut found: Vec<_> =
        frames.map(|said| (said.argument(&["width"]).unwrap(), said.argument(&["holes"]).unwrap())).collect();
    found.sort_unstable();
    assert_eq!(found, [("60.00", "2"), ("70.00", "3")]);
}
