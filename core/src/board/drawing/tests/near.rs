//! Hits under the pointer and in a box, and the smallest gaps, tracks and rings.

use super::*;

#[test]
fn pointer_finds_objects_snaps_and_boxes() {
    let drawing = small();
    let finder = Finder::new(&drawing, Arc::new(imported(&given(), &[1])));
    let (pads, holes) = (all(&drawing, "pad"), all(&drawing, "hole"));
    let drawn = |id: Id| Some(Catch::Drawn(id));
    let hit = |x, y| finder.at(&drawing, mm(x, y), um(100)).first().copied();
    let track = all(&drawing, "track")[0];
    assert_eq!(
        [hit(5.1, 5.1), hit(5.8, 5.0), hit(10.0, 5.2)],
        [drawn(holes[0]), drawn(pads[0]), drawn(track)]
    );
    assert_eq!(hit(1.0, 1.4), Some(Catch::Imported(0)));
    assert_eq!(hit(10.0, 8.0), None);
    let grid = Some(um(500));
    let snap = |x, y, without: &[Id]| {
        let without = without.iter().copied().map(Catch::Drawn).collect();
        finder.snap(&drawing, mm(x, y), um(300), grid, &without)
    };
    let node = drawing.node_at(mm(5.0, 5.0)).unwrap();
    assert_eq!(snap(5.1, 4.9, &[]), Snap::Node(mm(5.0, 5.0), node));
    assert_eq!(snap(10.2, 5.1, &[]), Snap::Middle(mm(10.0, 5.0), track));
    assert_eq!(snap(10.2, 5.1, &[track]), Snap::Grid(mm(10.0, 5.0)));
    assert_eq!(snap(12.3, 7.8, &[]), Snap::Grid(mm(12.5, 8.0)));
    assert_eq!(snap(1.1, 0.9, &[]), Snap::Imported(mm(1.0, 1.0), 0));
    let inside = Bounds { min: mm(3.9, 3.9), max: mm(7.0, 6.1) };
    assert_eq!(finder.within(inside, false).len(), 3, "pad, hole and node");
    assert!(finder.within(inside, true).contains(&Catch::Drawn(track)));
}

#[test]
fn node_at_a_corner_is_selected_before_its_tracks() {
    let mut drawing = Drawing::default();
    for (from, to) in [((0.0, 0.0), (5.0, 0.0)), ((5.0, 0.0), (5.0, 5.0)), ((5.0, 5.0), (5.5, 5.0))] {
        let ends = (TrackEnd::At(mm(from.0, from.1)), TrackEnd::At(mm(to.0, to.1)));
        drawing.apply(&track(&drawing, ends, um(600), Layer::Top).0).unwrap();
    }
    let finder = Finder::new(&drawing, Arc::default());
    let hit = |x, y| finder.at(&drawing, mm(x, y), um(400)).first().copied();
    let node = |x, y| drawing.node_at(mm(x, y)).map(Catch::Drawn);
    for (x, y) in [(5.0, 0.0), (5.1, 0.1), (4.7, 0.0), (5.0, 0.39)] {
        assert_eq!(hit(x, y), node(5.0, 0.0), "{x} {y}");
    }
    // The nearer of two nodes within reach.
    assert_eq!((hit(5.2, 5.1), hit(5.3, 5.1)), (node(5.0, 5.0), node(5.5, 5.0)));
    assert_eq!(hit(2.5, 0.1), Some(Catch::Drawn(all(&drawing, "track")[0])));
}

#[test]
fn smallest_distances_follow_every_edit() {
    let mut drawing = small();
    let first = mm(5.0, 5.0);
    let ends = (TrackEnd::At(mm(0.0, 3.0)), TrackEnd::At(mm(20.0, 3.0)));
    drawing.apply(&track(&drawing, ends, um(400), Layer::Top).0).unwrap();
    let mut finder = Finder::new(&drawing, Arc::default());
    let mut figures = DrawingFigures::new(&drawing, &finder);
    let smallest = figures.smallest();
    let size = |of: Option<(Length, Id)>| of.unwrap().0;
    assert_eq!(smallest.gap.unwrap().0, um(800), "from the octagon's flat to the edge of the track");
    assert_eq!((size(smallest.track), size(smallest.hole)), (um(400), um(800)));
    assert_eq!(size(smallest.ring), um(600));
    let mut history = History::new(drawing);
    let node = history.now().node_at(first).unwrap();
    let mut chance = Chance::new(3);
    for _ in 0..600 {
        let edit = if chance.below(3) == 0 {
            moved(history.now(), &set(&[node]), mm(chance.between(-0.3, 0.3), chance.between(-0.3, 0.3)))
        } else {
            some_edit(history.now(), &Arc::default(), &mut chance)
        };
        let touched = if chance.below(4) == 0 {
            history.step(true).unwrap_or_default()
        } else {
            history.make(&edit).unwrap_or_default()
        };
        let moved = finder.update(history.now(), &touched);
        figures.update(history.now(), &finder, &moved);
        let anew = Finder::new(history.now(), Arc::default());
        let all = DrawingFigures::new(history.now(), &anew);
        assert_eq!(figures.smallest(), all.smallest());
        assert_eq!(figures.smallest().gap.map(|(gap, ..)| gap), looked_for(history.now(), &anew));
    }
}

#[test]
fn nets_joined_by_a_plated_hole_separate_without_its_track() {
    // A track to the node of a plated hole on the top, another from there on the bottom. Without the first,
    // the second is another net.
    let mut history = History::new(Drawing::named(""));
    let via = TrackEnd::At(mm(5.0, 5.0));
    let far = (TrackEnd::At(mm(5.0, 9.0)), TrackEnd::At(mm(9.0, 9.0)));
    let steps: [&dyn Fn(&Drawing) -> Edit; 5] = [
        &|drawing| track(drawing, far, um(300), Layer::Bottom).0,
        &|drawing| hole(drawing, via, um(600), true),
        &|drawing| track(drawing, (via, far.0), um(300), Layer::Bottom).0,
        &|drawing| pad(drawing, via, (PadShape::Circle, um(1_000)), None, Layer::Top),
        &|drawing| pad(drawing, TrackEnd::At(mm(6.5, 5.0)), (PadShape::Circle, um(1_000)), None, Layer::Both),
    ];
    for step in steps {
        let edit = step(history.now());
        history.make(&edit).unwrap();
    }
    let mut finder = Finder::new(history.now(), Arc::default());
    let mut figures = DrawingFigures::new(history.now(), &finder);
    let mut tracks = all(history.now(), "track");
    tracks.extend(all(history.now(), "hole"));
    for id in tracks {
        let touched = history.make(&removed(history.now(), &set(&[id]))).unwrap();
        let moved = finder.update(history.now(), &touched);
        figures.update(history.now(), &finder, &moved);
        let anew = DrawingFigures::new(history.now(), &finder);
        assert_eq!(figures.smallest(), anew.smallest());
        assert_eq!(figures.smallest().gap.map(|(gap, ..)| gap), looked_for(history.now(), &finder));
    }
}

fn looked_for(drawing: &Drawing, finder: &Finder) -> Option<Length> {
    let layer = |id: Id| drawing.thing(id)?.layer().filter(|layer| *layer != Layer::Edge);
    let copper: Vec<Id> = drawing.things().map(|(id, _)| id).filter(|id| layer(*id).is_some()).collect();
    let plated = |node: &Id| {
        drawing.hanging(*node).any(|id| matches!(drawing.thing(id), Some(Thing::Hole { plated: true, .. })))
    };
    let through =
        |id: Id| drawing.thing(id).into_iter().flat_map(Thing::nodes).filter(plated).collect::<Vec<_>>();
    let mut net: BTreeMap<Id, Id> = copper.iter().map(|id| (*id, *id)).collect();
    let mut gaps = Vec::new();
    for (at, one) in copper.iter().enumerate() {
        for other in &copper[at + 1..] {
            let (a, b) =
                (finder.body(Catch::Drawn(*one)).unwrap(), finder.body(Catch::Drawn(*other)).unwrap());
            let gap = Length::from_mm(a.gap_mm(b)).nm();
            let meet = layer(*one).unwrap().meets(layer(*other).unwrap());
            if meet && gap <= 1 || through(*one).iter().any(|node| through(*other).contains(node)) {
                let (from, to) = (net[one], net[other]);
                net.values_mut().filter(|of| **of == from).for_each(|of| *of = to);
            } else if meet && gap <= WINDOW.nm() {
                gaps.push((gap, *one, *other));
            }
        }
    }
    gaps.retain(|(_, one, other)| net[one] != net[other]);
    gaps.into_iter().map(|(gap, ..)| Length::from_nm(gap)).min()
}
