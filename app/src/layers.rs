//! Visibility, opacity and colour of layers: the state of the layers panel.
//!
//! ```text
//!   below ─▶ … ─▶ above       seen from above: bottom copper, top copper, …, silkscreen
//!                             seen from below: the other way round
//! ```

use crate::view::{Colour, Palette};
use annulus_core::artwork::{Role, Side};

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum LayerKind {
    CopperTop,
    CopperBottom,
    CopperInner,
    /// Openings in the solder mask.
    Mask,
    Silk,
    Paste,
    Other,
    Holes,
    Outline,
}

impl LayerKind {
    /// From a file's role and side.
    pub const fn of(role: Role, side: Option<Side>) -> Self {
        match (role, side) {
            (Role::Copper, Some(Side::Bottom)) => Self::CopperBottom,
            (Role::Copper, Some(Side::Inner)) => Self::CopperInner,
            (Role::Copper, _) => Self::CopperTop,
            (Role::Mask, _) => Self::Mask,
            (Role::Silk, _) => Self::Silk,
            (Role::Paste, _) => Self::Paste,
            (Role::Outline, _) => Self::Outline,
            (Role::Drill, _) => Self::Holes,
            (Role::Other, _) => Self::Other,
        }
    }

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

    /// True if things on it can be selected in the picture.
    pub const fn can_be_locked(self) -> bool {
        matches!(self, Self::CopperTop | Self::CopperBottom | Self::Holes | Self::Outline)
    }

    /// Default visibility.
    const fn first_seen(self) -> bool {
        matches!(self, Self::CopperTop | Self::CopperBottom | Self::Holes | Self::Outline)
    }

    /// Height above the middle of the board. Seen from above, higher layers are drawn later.
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

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LayerSide {
    #[default]
    Top,
    Bottom,
    /// In between, or through the whole board.
    Both,
}

impl LayerSide {
    /// From a file's side.
    pub const fn of(side: Option<Side>) -> Self {
        match side {
            Some(Side::Top) => Self::Top,
            Some(Side::Bottom) => Self::Bottom,
            Some(Side::Inner) | None => Self::Both,
        }
    }
}

#[derive(Clone, Debug, PartialEq)]
pub struct LayerLook {
    pub name: String,
    pub kind: LayerKind,
    pub side: LayerSide,
    /// Index of its mesh; none for holes and outline.
    pub mesh: Option<usize>,
    /// Visible.
    pub eye: bool,
    /// Percent, 0 to 100.
    pub opacity: u8,
    /// A colour that the user chose.
    pub colour: Option<Colour>,
    pub locked: bool,
    /// Highlighted: all other layers are dimmed.
    pub front: bool,
    /// Realistic view: a mask is shown as the film, not as its openings, and copper has one colour on both
    /// sides.
    pub made: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Preset {
    All,
    Top,
    Bottom,
    Copper,
    Holes,
    /// Everything that can be drawn here: copper of both sides, holes, edge. The default for a new board.
    Drawn,
    /// Realistic view: copper under solder mask and silkscreen.
    Made,
}

const MASK_SHARE: f64 = 0.82;

impl LayerLook {
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

    /// The colour to draw it in, with opacity.
    pub fn tint(&self, palette: &Palette) -> Colour {
        let share = f64::from(self.opacity.min(100)) / 100.0 * if self.is_film() { MASK_SHARE } else { 1.0 };
        let own = match self.kind {
            LayerKind::Mask if self.made => palette.mask,
            LayerKind::CopperBottom if self.made => palette.copper_top,
            kind => kind.colour(palette),
        };
        self.colour.unwrap_or(own).alpha((share * 255.0) as u8)
    }

    /// True if the mesh shows openings and everything else is covered: the mask in realistic view.
    pub fn is_film(&self) -> bool {
        self.made && self.kind == LayerKind::Mask
    }

    pub fn choose(&mut self, preset: Preset) {
        (self.eye, self.made) = (self.in_preset(preset), preset == Preset::Made);
        self.front = false;
    }

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

/// Carries the user's choices over to layers that still exist.
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

const DIMMED_SHARE: f32 = 0.25;

/// Toggles the highlight of layer `index`; a highlighted layer becomes visible.
pub fn bring_to_front(looks: &mut [LayerLook], index: usize) {
    for (at, look) in looks.iter_mut().enumerate() {
        look.front = at == index && !look.front;
        look.eye |= look.front;
    }
}

/// True if another layer is highlighted.
pub fn is_dimmed(look: &LayerLook, looks: &[LayerLook]) -> bool {
    !look.front && looks.iter().any(|look| look.front)
}

pub fn tint_among(look: &LayerLook, looks: &[LayerLook], palette: &Palette) -> Colour {
    let tint = look.tint(palette);
    let share = if is_dimmed(look, looks) { DIMMED_SHARE } else { 1.0 };
    tint.alpha((f32::from(tint.0[3]) * share) as u8)
}

pub fn dimmed(colour: Colour, ground: Colour) -> Colour {
    colour.mixed(ground, DIMMED_SHARE)
}

/// The visible layers in drawing order, lowest first; the highlighted one is last.
pub fn drawn(looks: &[LayerLook], from_below: bool) -> Vec<&LayerLook> {
    let mut order: Vec<&LayerLook> = looks.iter().filter(|look| look.eye && look.opacity > 0).collect();
    order.sort_by_key(|look| {
        let height = look.kind.height(look.side);
        (look.front, if from_below { -height } else { height })
    });
    let sides = [LayerSide::Top, LayerSide::Bottom];
    let [near, far] = if from_below { [sides[1], sides[0]] } else { sides };
    // Nothing shows through a board under its mask film.
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
    fn nearer_side_is_drawn_later() {
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
    fn highlighted_layer_is_in_front_and_others_are_dimmed() {
        let mut looks = looks();
        bring_to_front(&mut looks, 1);
        assert_eq!(names(&drawn(&looks, false)), "top bottom");
        let alpha = |looks: &[LayerLook], at: usize| tint_among(&looks[at], looks, &Palette::DARK).0[3];
        assert_eq!([0, 1].map(|at| alpha(&looks, at)), [63, 255]);
        assert!(is_dimmed(&looks[3], &looks), "holes too");
        bring_to_front(&mut looks, 2);
        assert!(looks[2].eye, "what was hidden is seen");
        assert_eq!([0, 1, 2].map(|at| alpha(&looks, at)), [63, 63, 255]);
        // A second press restores all; a preset also clears the highlight.
        bring_to_front(&mut looks, 2);
        assert_eq!([0, 1, 2].map(|at| alpha(&looks, at)), [255; 3]);
        bring_to_front(&mut looks, 0);
        looks.iter_mut().for_each(|look| look.choose(Preset::All));
        assert_eq!([0, 1, 2].map(|at| alpha(&looks, at)), [255; 3]);
    }

    #[test]
    fn realistic_view_shows_the_viewed_side() {
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
    fn layer_choices_survive_rereading_files() {
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
    fn opacity_sets_the_alpha_of_the_colour() {
        let mut look = looks().remove(0);
        assert_eq!(look.tint(&Palette::DARK), Palette::DARK.copper_top);
        look.opacity = 50;
        assert_eq!(look.tint(&Palette::DARK).0[3], 127);
        look.colour = Some(Colour::rgb(0x00ff_0000));
        assert_eq!(look.tint(&Palette::DARK).0, [255, 0, 0, 127]);
    }
}
