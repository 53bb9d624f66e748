//! Which layers are seen, how strongly, and in what colour: what the layers panel changes.
//!
//! ```text
//!   below ─▶ … ─▶ above       seen from above: bottom copper, top copper, …, legend
//!                             seen from below: the other way round
//! ```
//!
//! Comes in: role and side of every layer, what the person chose. Goes out: looks, in the order of drawing. Knows no
//! screens.

use crate::view::{Colour, Palette};

/// What a layer is, as far as its look goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum LayerKind {
    /// Copper of the upper side.
    CopperTop,
    /// Copper of the lower side.
    CopperBottom,
    /// Copper inside the board.
    CopperInner,
    /// Where there is no solder mask.
    Mask,
    /// Legend.
    Silk,
    /// Solder paste.
    Paste,
    /// Anything else.
    Other,
    /// Holes and slots.
    Holes,
    /// Edge of the board.
    Outline,
}

impl LayerKind {
    /// Of a file's role and side.
    pub fn of(role: &str, side: Option<&str>) -> Self {
        match (role, side) {
            ("copper", Some("bottom")) => Self::CopperBottom,
            ("copper", Some("inner")) => Self::CopperInner,
            ("copper", _) => Self::CopperTop,
            ("mask", _) => Self::Mask,
            ("silk", _) => Self::Silk,
            ("paste", _) => Self::Paste,
            ("outline", _) => Self::Outline,
            ("drill", _) => Self::Holes,
            _ => Self::Other,
        }
    }

    /// Its colour until somebody chooses another.
    pub fn colour(self, palette: &Palette) -> Colour {
        match self {
            Self::CopperTop => palette.copper_top,
            Self::CopperBottom => palette.copper_bottom,
            Self::CopperInner => palette.tools[1],
            Self::Mask => palette.tools[0],
            Self::Silk => palette.silk,
            Self::Paste | Self::Other | Self::Holes => palette.tools[4],
            Self::Outline => palette.outline,
        }
    }

    /// Whether something of it can be caught in the picture.
    pub const fn can_be_locked(self) -> bool {
        matches!(self, Self::CopperTop | Self::CopperBottom | Self::Holes | Self::Outline)
    }

    /// Whether it is seen until somebody says otherwise.
    const fn first_seen(self) -> bool {
        matches!(self, Self::CopperTop | Self::CopperBottom | Self::Holes | Self::Outline)
    }

    /// Height over the board's middle: the higher is drawn later when seen from above.
    const fn height(self, side: LayerSide) -> i32 {
        let over = match self {
            Self::CopperInner | Self::Other => 0,
            Self::CopperTop | Self::CopperBottom => 1,
            Self::Mask => 2,
            Self::Paste => 3,
            Self::Silk => 4,
            Self::Outline => 5,
            Self::Holes => 6,
        };
        if matches!(side, LayerSide::Bottom) { -over } else { over }
    }
}

/// Where a layer lies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LayerSide {
    /// Above.
    #[default]
    Top,
    /// Below.
    Bottom,
    /// In between, or through everything.
    Both,
}

impl LayerSide {
    /// Of a file's side.
    pub fn of(word: Option<&str>) -> Self {
        match word {
            Some("top") => Self::Top,
            Some("bottom") => Self::Bottom,
            _ => Self::Both,
        }
    }
}

/// One line of the panel.
#[derive(Clone, Debug, PartialEq)]
pub struct LayerLook {
    /// Tells the layer from others, also when the files are read again.
    pub name: String,
    /// What it is.
    pub kind: LayerKind,
    /// Where it lies.
    pub side: LayerSide,
    /// Index of its triangles; none for holes and outline.
    pub mesh: Option<usize>,
    /// Whether it is seen.
    pub eye: bool,
    /// From 0, not there, to 100.
    pub opacity: u8,
    /// A colour of the person's own.
    pub colour: Option<Colour>,
    /// Nothing of it is caught or changed.
    pub locked: bool,
    /// It is the one that is to be found: the others are dimmed.
    pub front: bool,
    /// It looks as on the board that is made: a mask is the film that it is, not its openings, and copper is copper on either side.
    pub made: bool,
}

/// Groups of layers shown with one press.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Preset {
    /// Everything.
    All,
    /// What lies on the upper side.
    Top,
    /// What lies on the lower side.
    Bottom,
    /// Copper alone.
    Copper,
    /// Holes alone.
    Holes,
    /// What can be drawn here: copper of both sides, holes, edge. A board is seen so first.
    Drawn,
    /// The board as it is made: copper under its mask, with the legend on it.
    Made,
}

/// How much of what is under a mask it hides.
const MASK_SHARE: f64 = 0.82;

impl LayerLook {
    /// A layer as it is seen first.
    pub fn new(name: String, kind: LayerKind, side: LayerSide, mesh: Option<usize>) -> Self {
        Self {
            name,
            kind,
            side,
            mesh,
            eye: kind.first_seen(),
            opacity: 100,
            colour: None,
            locked: false,
            front: false,
            made: false,
        }
    }

    /// The colour it is drawn in.
    pub fn tint(&self, palette: &Palette) -> Colour {
        let share = f64::from(self.opacity.min(100)) / 100.0 * if self.is_film() { MASK_SHARE } else { 1.0 };
        let own = match self.kind {
            LayerKind::Mask if self.made => palette.mask,
            LayerKind::CopperBottom if self.made => palette.copper_top,
            kind => kind.colour(palette),
        };
        self.colour.unwrap_or(own).alpha((share * 255.0) as u8)
    }

    /// The board is covered but where the layer is.
    pub fn is_film(&self) -> bool {
        self.made && self.kind == LayerKind::Mask
    }

    /// Is seen as `preset` shows it, or not.
    pub fn choose(&mut self, preset: Preset) {
        (self.eye, self.made) = (self.in_preset(preset), preset == Preset::Made);
        self.front = false;
    }

    /// Whether `preset` shows it.
    pub fn in_preset(&self, preset: Preset) -> bool {
        let through = matches!(self.kind, LayerKind::Holes | LayerKind::Outline);
        match preset {
            Preset::All => true,
            Preset::Top => through || self.side == LayerSide::Top,
            Preset::Bottom => through || self.side == LayerSide::Bottom,
            Preset::Copper => {
                matches!(
                    self.kind,
                    LayerKind::CopperTop
                        | LayerKind::CopperBottom
                        | LayerKind::CopperInner
                        | LayerKind::Outline
                )
            }
            Preset::Holes => through,
            Preset::Drawn => self.kind.first_seen(),
            Preset::Made => {
                !matches!(self.kind, LayerKind::CopperInner | LayerKind::Paste | LayerKind::Other)
            }
        }
    }
}

/// What the person chose before is kept for layers that are still there.
pub fn kept(fresh: Vec<LayerLook>, before: &[LayerLook]) -> Vec<LayerLook> {
    let keep = |look: LayerLook| match before.iter().find(|old| old.name == look.name) {
        Some(old) => {
            let LayerLook { eye, opacity, colour, locked, front, made, .. } = *old;
            LayerLook { eye, opacity, colour, locked, front, made, ..look }
        }
        None => look,
    };
    fresh.into_iter().map(keep).collect()
}

/// Of what is dimmed so much is seen.
const DIMMED_SHARE: f32 = 0.25;

/// The layer `index` is brought to the front and seen, or is as before where it was there already.
pub fn bring_to_front(looks: &mut [LayerLook], index: usize) {
    for (at, look) in looks.iter_mut().enumerate() {
        look.front = at == index && !look.front;
        look.eye |= look.front;
    }
}

/// Whether `look` is dimmed, because another one is in front.
pub fn is_dimmed(look: &LayerLook, looks: &[LayerLook]) -> bool {
    !look.front && looks.iter().any(|look| look.front)
}

/// The colour that `look` is drawn in among `looks`.
pub fn tint_among(look: &LayerLook, looks: &[LayerLook], palette: &Palette) -> Colour {
    let tint = look.tint(palette);
    let share = if is_dimmed(look, looks) { DIMMED_SHARE } else { 1.0 };
    tint.alpha((f32::from(tint.0[3]) * share) as u8)
}

/// A colour of what cannot be seen through, where it is dimmed on a board of the colour `ground`.
pub fn dimmed(colour: Colour, ground: Colour) -> Colour {
    colour.mixed(ground, DIMMED_SHARE)
}

/// The looks in the order of drawing, the lowest first; what is in front is the last.
pub fn drawn(looks: &[LayerLook], from_below: bool) -> Vec<&LayerLook> {
    let mut order: Vec<&LayerLook> = looks.iter().filter(|look| look.eye && look.opacity > 0).collect();
    order.sort_by_key(|look| {
        let height = look.kind.height(look.side);
        (look.front, if from_below { -height } else { height })
    });
    let sides = [LayerSide::Top, LayerSide::Bottom];
    let [near, far] = if from_below { [sides[1], sides[0]] } else { sides };
    // A board is not seen through under its mask.
    if order.iter().any(|look| look.is_film() && look.side == near) {
        order.retain(|look| look.side != far);
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    fn looks() -> Vec<LayerLook> {
        let rows = [
            ("top", LayerKind::CopperTop, LayerSide::Top, Some(0)),
            ("bottom", LayerKind::CopperBottom, LayerSide::Bottom, Some(1)),
            ("legend", LayerKind::Silk, LayerSide::Top, Some(2)),
            ("holes", LayerKind::Holes, LayerSide::Both, None),
            ("outline", LayerKind::Outline, LayerSide::Both, None),
        ];
        rows.map(|(name, kind, side, mesh)| LayerLook::new(name.to_owned(), kind, side, mesh)).into()
    }

    fn names(order: &[&LayerLook]) -> String {
        order
            .iter()
            .filter(|look| look.mesh.is_some())
            .map(|look| look.name.as_str())
            .collect::<Vec<_>>()
            .join(" ")
    }

    #[test]
    fn the_nearer_side_is_drawn_later() {
        let mut looks = looks();
        assert_eq!(names(&drawn(&looks, false)), "bottom top");
        looks[2].eye = true;
        assert_eq!(names(&drawn(&looks, false)), "bottom top legend");
        assert_eq!(names(&drawn(&looks, true)), "legend top bottom");
        looks[0].opacity = 0;
        assert_eq!(names(&drawn(&looks, false)), "bottom legend");
    }

    #[test]
    fn presets_show_their_layers() {
        let rows = [
            (Preset::All, "top bottom legend holes outline"),
            (Preset::Top, "top legend holes outline"),
            (Preset::Bottom, "bottom holes outline"),
            (Preset::Copper, "top bottom outline"),
            (Preset::Holes, "holes outline"),
            (Preset::Drawn, "top bottom holes outline"),
            (Preset::Made, "top bottom legend holes outline"),
        ];
        for (preset, expected) in rows {
            let shown: Vec<_> =
                looks().iter().filter(|look| look.in_preset(preset)).map(|look| look.name.clone()).collect();
            assert_eq!(shown.join(" "), expected, "{preset:?}");
        }
    }

    #[test]
    fn what_is_brought_to_the_front_is_seen_above_all_and_the_others_are_dimmed() {
        let mut looks = looks();
        bring_to_front(&mut looks, 1);
        assert_eq!(names(&drawn(&looks, false)), "top bottom");
        let alpha = |looks: &[LayerLook], at: usize| tint_among(&looks[at], looks, &Palette::DARK).0[3];
        assert_eq!([0, 1].map(|at| alpha(&looks, at)), [63, 255]);
        assert!(is_dimmed(&looks[3], &looks), "holes too");
        bring_to_front(&mut looks, 2);
        assert!(looks[2].eye, "what was hidden is seen");
        assert_eq!([0, 1, 2].map(|at| alpha(&looks, at)), [63, 63, 255]);
        // Once more, and all are as before; a group shows its layers alike.
        bring_to_front(&mut looks, 2);
        assert_eq!([0, 1, 2].map(|at| alpha(&looks, at)), [255; 3]);
        bring_to_front(&mut looks, 0);
        looks.iter_mut().for_each(|look| look.choose(Preset::All));
        assert_eq!([0, 1, 2].map(|at| alpha(&looks, at)), [255; 3]);
    }

    #[test]
    fn of_a_board_as_it_is_made_the_side_that_is_looked_at_is_seen() {
        let mut looks = looks();
        let films = [("film", LayerSide::Top, 3), ("film below", LayerSide::Bottom, 4)];
        looks
            .extend(films.map(|(name, side, mesh)| {
                LayerLook::new(name.to_owned(), LayerKind::Mask, side, Some(mesh))
            }));
        looks.push(LayerLook::new("paste".to_owned(), LayerKind::Paste, LayerSide::Top, Some(5)));
        looks.iter_mut().for_each(|look| look.choose(Preset::Made));
        assert_eq!(names(&drawn(&looks, false)), "top film legend");
        assert_eq!(names(&drawn(&looks, true)), "bottom film below");
        let palette = Palette::DARK;
        assert_eq!(looks[1].tint(&palette), palette.copper_top, "copper is copper");
        let film = looks.iter().find(|look| look.name == "film").unwrap();
        assert_eq!(film.tint(&palette), palette.mask.alpha(209));
        looks.iter_mut().for_each(|look| look.choose(Preset::All));
        assert_eq!(names(&drawn(&looks, false)), "film below bottom top film paste legend");
        assert!(looks.iter().all(|look| !look.is_film()));
    }

    #[test]
    fn choices_outlive_reading_the_files_again() {
        let mut before = looks();
        before[1].eye = false;
        before[1].opacity = 40;
        before[1].locked = true;
        let mut fresh = looks();
        fresh.swap(0, 1);
        let kept = kept(fresh, &before);
        assert_eq!((kept[0].name.as_str(), kept[0].eye, kept[0].opacity), ("bottom", false, 40));
        assert_eq!([kept[0].locked, kept[1].locked], [true, false]);
        assert_eq!((kept[1].name.as_str(), kept[1].eye), ("top", true));
    }

    #[test]
    fn opacity_is_the_alpha_of_the_colour() {
        let mut look = looks().remove(0);
        assert_eq!(look.tint(&Palette::DARK), Palette::DARK.copper_top);
        look.opacity = 50;
        assert_eq!(look.tint(&Palette::DARK).0[3], 127);
        look.colour = Some(Colour::rgb(0x00ff_0000));
        assert_eq!(look.tint(&Palette::DARK).0, [255, 0, 0, 127]);
    }
}
