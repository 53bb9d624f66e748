//! Colours by meaning. The page chooses the palette.

/// An sRGB colour with straight alpha, one byte each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(transparent)]
pub struct Colour(pub [u8; 4]);

impl Colour {
    /// From `0xRRGGBB`, opaque.
    pub const fn rgb(hex: u32) -> Self {
        Self([(hex >> 16) as u8, (hex >> 8) as u8, hex as u8, 255])
    }

    /// This colour with another alpha: 0 is transparent, 255 opaque.
    #[must_use]
    pub const fn alpha(self, alpha: u8) -> Self {
        Self([self.0[0], self.0[1], self.0[2], alpha])
    }

    /// `share` of this colour, the rest of `other`; opaque.
    #[must_use]
    pub fn mixed(self, other: Self, share: f32) -> Self {
        let mix = |own: u8, other: u8| (f32::from(own) * share + f32::from(other) * (1.0 - share)) as u8;
        let [red, green, blue, _] = self.0;
        Self([mix(red, other.0[0]), mix(green, other.0[1]), mix(blue, other.0[2]), 255])
    }

    /// From `#rrggbb`, opaque.
    pub fn of_css(text: &str) -> Option<Self> {
        let digits = text.strip_prefix('#').filter(|digits| digits.len() == 6)?;
        u32::from_str_radix(digits, 16).ok().map(Self::rgb)
    }

    pub fn css(self) -> String {
        let [red, green, blue, alpha] = self.0;
        format!("#{red:02x}{green:02x}{blue:02x}{alpha:02x}")
    }

    /// Linear light from 0 to 1, alpha last, as the GPU blends it.
    pub fn linear(self) -> [f32; 4] {
        let [red, green, blue, alpha] = self.0;
        [light(red), light(green), light(blue), f32::from(alpha) / 255.0]
    }

    /// Relative luminance by WCAG.
    pub fn luminance(self) -> f32 {
        let [red, green, blue, _] = self.linear();
        0.2126 * red + 0.7152 * green + 0.0722 * blue
    }
}

fn light(byte: u8) -> f32 {
    let share = f64::from(byte) / 255.0;
    let out = if share <= 0.040_45 { share / 12.92 } else { libm::pow((share + 0.055) / 1.055, 2.4) };
    out as f32
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Palette {
    pub background: Colour,
    /// Body of the board.
    pub plate: Colour,
    pub edge: Colour,
    pub grid: Colour,
    pub outline: Colour,
    pub copper_top: Colour,
    pub copper_bottom: Colour,
    pub silk: Colour,
    pub mask: Colour,
    pub joined: Colour,
    /// A problem found by the proof.
    pub finding: Colour,
    pub bore: Colour,
    /// A drilled hole.
    pub done: Colour,
    /// The current hole, and the accent.
    pub current: Colour,
    /// A failed hole.
    pub failed: Colour,
    /// Halo of the selection.
    pub selected: Colour,
    pub head: Colour,
    pub travel: Colour,
    pub travelled: Colour,
    /// One colour per tool, distinguishable with all common kinds of colour blindness.
    pub tools: [Colour; 8],
    /// One colour per kind of operation.
    pub operations: [Colour; 6],
}

impl Palette {
    pub const DARK: Self = Self {
        background: Colour::rgb(0x0012_161a),
        plate: Colour::rgb(0x001b_2f2a),
        edge: Colour::rgb(0x0047_6a5e),
        grid: Colour::rgb(0x009f_c4b8),
        outline: Colour::rgb(0x00f2_e8a0),
        copper_top: Colour::rgb(0x00d9_6a3a),
        copper_bottom: Colour::rgb(0x004a_7fd0),
        silk: Colour::rgb(0x00e6_e9e6),
        mask: Colour::rgb(0x0012_6b43),
        joined: Colour::rgb(0x00ff_5a52),
        finding: Colour::rgb(0x00ff_5cd6),
        bore: Colour::rgb(0x000b_0e10),
        done: Colour::rgb(0x004a_de80),
        current: Colour::rgb(0x00e8_945f),
        failed: Colour::rgb(0x00ff_5a52),
        selected: Colour::rgb(0x00ff_ffff),
        head: Colour::rgb(0x00ff_b37e),
        travel: Colour::rgb(0x009f_b3c2).alpha(120),
        travelled: Colour::rgb(0x004a_de80).alpha(110),
        tools: TOOLS,
        operations: OPERATIONS,
    };

    /// For light themes. The board stays dark, so that tools keep their colours.
    pub const LIGHT: Self = Self {
        background: Colour::rgb(0x00e9_edf0),
        plate: Colour::rgb(0x0026_443b),
        edge: Colour::rgb(0x0014_2a23),
        grid: Colour::rgb(0x006f_8f85),
        outline: Colour::rgb(0x00f2_e8a0),
        copper_top: Colour::rgb(0x00e0_7444),
        copper_bottom: Colour::rgb(0x005a_90e0),
        silk: Colour::rgb(0x00f2_f4f2),
        mask: Colour::rgb(0x0018_7a4d),
        joined: Colour::rgb(0x00ff_6b63),
        finding: Colour::rgb(0x00ff_6bdb),
        bore: Colour::rgb(0x000e_1513),
        done: Colour::rgb(0x004a_de80),
        current: Colour::rgb(0x00ff_a26b),
        failed: Colour::rgb(0x00ff_6b63),
        selected: Colour::rgb(0x00ff_ffff),
        head: Colour::rgb(0x00d9_5f1e),
        travel: Colour::rgb(0x00b9_c9d6).alpha(130),
        travelled: Colour::rgb(0x004a_de80).alpha(120),
        tools: TOOLS,
        operations: OPERATIONS,
    };

    /// The colour of a kind of operation; repeats after six.
    pub fn operation(&self, kind: usize) -> Colour {
        self.operations[kind % self.operations.len()]
    }

    /// The colour of a tool; repeats after eight.
    pub fn tool(&self, index: usize) -> Colour {
        self.tools[index % self.tools.len()]
    }
}

/// After Okabe and Ito, lightened for a dark board; green is reserved for done.
const TOOLS: [Colour; 8] = [
    Colour::rgb(0x0055_cae8),
    Colour::rgb(0x00f0_a830),
    Colour::rgb(0x00f2_e85c),
    Colour::rgb(0x00df_8fbe),
    Colour::rgb(0x00bb_cacb),
    Colour::rgb(0x00db_664c),
    Colour::rgb(0x005c_85f8),
    Colour::rgb(0x00a2_8bdf),
];

/// Distinguishable from copper of both sides and from done.
const OPERATIONS: [Colour; 6] = [
    Colour::rgb(0x00f6_e27a),
    Colour::rgb(0x0062_d6d6),
    Colour::rgb(0x00d5_9df0),
    Colour::rgb(0x00f0_f3f5),
    Colour::rgb(0x00b9_d66a),
    Colour::rgb(0x00ff_b3a0),
];

#[cfg(test)]
mod tests {
    use super::*;

    fn contrast(a: Colour, b: Colour) -> f32 {
        let (a, b) = (a.luminance(), b.luminance());
        (a.max(b) + 0.05) / (a.min(b) + 0.05)
    }

    #[test]
    fn css_colours_and_linear_light_convert_correctly() {
        assert_eq!(Colour::rgb(0x00ff_8000).css(), "#ff8000ff");
        assert_eq!(Colour::of_css("#ff8000"), Some(Colour::rgb(0x00ff_8000)));
        for wrong in ["ff8000", "#ff80", "#ff80zz", "#ff80éé"] {
            assert_eq!(Colour::of_css(wrong), None, "{wrong}");
        }
        assert_eq!(Colour::rgb(0x00ff_8000).alpha(16).css(), "#ff800010");
        assert_eq!(Colour::rgb(0x00ff_ffff).linear(), [1.0; 4]);
        assert!((Colour::rgb(0x0080_8080).linear()[0] - 0.215_86).abs() < 1e-4);
    }

    #[test]
    fn board_colours_have_a_contrast_of_3_to_1() {
        for (theme, palette) in [("dark", Palette::DARK), ("light", Palette::LIGHT)] {
            let signs = [
                palette.done,
                palette.current,
                palette.failed,
                palette.selected,
                palette.outline,
                palette.copper_top,
                palette.copper_bottom,
                palette.finding,
            ];
            for (index, sign) in signs.iter().chain(&palette.tools).enumerate() {
                for ground in [palette.plate, palette.bore] {
                    let ratio = contrast(*sign, ground);
                    assert!(ratio >= 3.0, "{theme} {index}: {} on {} is {ratio}", sign.css(), ground.css());
                }
            }
        }
    }

    /// Colours as seen with one kind of cone missing (Viénot, Brettel and Mollon 1999, linear light).
    fn seen(colour: Colour, missing: usize) -> [f32; 3] {
        let [r, g, b, _] = colour.linear();
        let rows = [
            [[0.11238, 0.88762, 0.0], [0.11238, 0.88762, 0.0], [0.00401, -0.00401, 1.0]],
            [[0.29275, 0.70725, 0.0], [0.29275, 0.70725, 0.0], [-0.02234, 0.02234, 1.0]],
        ][missing];
        rows.map(|row: [f32; 3]| (row[0] * r + row[1] * g + row[2] * b).max(0.0).sqrt())
    }

    #[test]
    fn tool_colours_differ_for_colour_blind_people() {
        let tools = Palette::DARK.tools;
        for missing in [0, 1] {
            for (i, a) in tools.iter().enumerate() {
                for (j, b) in tools.iter().enumerate().skip(i + 1) {
                    let (p, q) = (seen(*a, missing), seen(*b, missing));
                    let apart = (0..3).map(|k| (p[k] - q[k]) * (p[k] - q[k])).sum::<f32>().sqrt();
                    assert!(apart > 0.12, "cone {missing}: tools {i} and {j} are {apart} apart");
                }
            }
        }
    }
}
