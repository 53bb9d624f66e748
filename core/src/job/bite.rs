//! Checks the feed per turn and the surface speed of bits.
//!
//! ```text
//! 12 mm/s at 1,500 rpm      0.48 mm per turn     a 0.8 mm drill survives 0.2 mm: it breaks
//! 12 mm/s at 30,000 rpm     0.024 mm per turn    good
//! 3.2 mm at 60,000 rpm      603 m/min            edge too hot: the board's resin smears, the bit dulls early
//! ```

use super::{Bit, Command, Cutter, Mark, Program};
use crate::diagnostic::Diagnostic;
use crate::{error, warning};

/// Greatest feed per turn, as a share of the width of cut.
pub const MOST_BITE_SHARE: f64 = 0.25;

/// Greatest surface speed, m/min. Boards are drilled at 100 to 250; carbide survives little more in their
/// glass fibre.
pub const MOST_SURFACE_M_PER_MIN: f64 = 350.0;

fn surface_m_per_min(bit: &Bit, rpm: u32) -> f64 {
    std::f64::consts::PI * bit.diameter.mm() * f64::from(rpm) / 1e3
}

/// Problems of `bit` with a plunge at `feed_mm_per_s` and `rpm`.
pub fn judged(bit: &Bit, feed_mm_per_s: f64, rpm: u32) -> Vec<Diagnostic> {
    [breaks(bit, feed_mm_per_s, rpm), burns(bit, rpm)].into_iter().flatten().collect()
}

/// Warns if the edge of `bit` gets too hot at `rpm`. Not for V-bits: they cut near their tip, so their
/// diameter doesn't matter.
fn burns(bit: &Bit, rpm: u32) -> Option<Diagnostic> {
    let surface = surface_m_per_min(bit, rpm);
    if matches!(bit.cutter, Cutter::Vee { .. }) || surface <= MOST_SURFACE_M_PER_MIN {
        return None;
    }
    // Rounded down: slower is safe.
    let slower = libm::floor(f64::from(rpm) * MOST_SURFACE_M_PER_MIN / surface / 100.0) * 100.0;
    let why = warning!("job.bit_burns", bit = bit.titled(), ..);
    let why = why.with("rpm", rpm).with("surface", format!("{surface:.0}"));
    Some(why.with("most", MOST_SURFACE_M_PER_MIN).with("slower", format!("{slower:.0}")))
}

/// Warns if `bit` breaks in a plunge at `feed_mm_per_s` and `rpm`. Not for V-bits: their width depends on the
/// depth, so they are checked along the cut.
pub fn breaks(bit: &Bit, feed_mm_per_s: f64, rpm: u32) -> Option<Diagnostic> {
    let diameter_mm = bit.diameter.mm();
    if matches!(bit.cutter, Cutter::Vee { .. }) || rpm == 0 || diameter_mm <= 0.0 {
        return None;
    }
    let turns_per_s = f64::from(rpm) / 60.0;
    let (bite_mm, most_mm) = (feed_mm_per_s / turns_per_s, MOST_BITE_SHARE * diameter_mm);
    if bite_mm <= most_mm {
        return None;
    }
    let why = error!("job.bit_breaks", bit = bit.titled(), ..);
    let why = why.with("feed", format!("{feed_mm_per_s:.1}")).with("rpm", rpm);
    let why = why.with("bite", format!("{bite_mm:.3}")).with("most", format!("{most_mm:.3}"));
    let why = why.with("surface", format!("{:.0}", surface_m_per_min(bit, rpm)));
    // Rounded to the safe side.
    let slower = libm::floor(most_mm * turns_per_s * 10.0) / 10.0;
    let faster = libm::ceil(feed_mm_per_s / most_mm * 60.0 / 100.0) * 100.0;
    Some(why.with("slower", format!("{slower:.1}")).with("faster", format!("{faster:.0}")))
}

/// Problems of the bits of `program` in plunges, each once.
pub fn judged_all(program: &Program) -> Vec<Diagnostic> {
    let (mut bit, mut rpm) = (0_usize, 0);
    let mut found: Vec<(usize, Diagnostic)> = Vec::new();
    for leg in &program.legs {
        if let Mark::ToolChange(next) = leg.mark {
            bit = next as usize;
        }
        for command in &leg.commands {
            match command {
                Command::Spindle { rpm: now } => rpm = *now,
                Command::AwaitBit { bit: next } => bit = *next as usize,
                Command::Plunge { feed_um_per_s, .. } if !found.iter().any(|(known, _)| *known == bit) => {
                    let feed_mm_per_s = f64::from(*feed_um_per_s) / 1e3;
                    let why = program.bits.get(bit).map(|bit| judged(bit, feed_mm_per_s, rpm));
                    found.extend(why.into_iter().flatten().map(|why| (bit, why)));
                }
                _ => {}
            }
        }
    }
    found.into_iter().map(|(_, why)| why).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::Length;

    fn bit(um: i64, cutter: Cutter) -> Bit {
        Bit { diameter: Length::from_um(um), name: String::new(), cutter, handling: Default::default() }
    }

    #[test]
    fn slow_small_drill_breaks_and_the_suggested_fix_helps() {
        let vee = Cutter::Vee { tip: Length::from_um(100), angle_mdeg: 30_000 };
        let rows = [
            (800, Cutter::Drill, 12.0, 1_500, true),
            (800, Cutter::Drill, 12.0, 30_000, false),
            (800, Cutter::Drill, 12.0, 3_600, false),
            (800, Cutter::Drill, 12.0, 3_599, true),
            (300, Cutter::Drill, 60.0, 10_000, true),
            (1_000, Cutter::Mill, 2.0, 300, true),
            (3_175, vee, 12.0, 300, false),
            (800, Cutter::Drill, 12.0, 0, false),
        ];
        for (um, cutter, feed, rpm, does) in rows {
            let bit = bit(um, cutter);
            let why = breaks(&bit, feed, rpm);
            assert_eq!(why.is_some(), does, "{um} {feed} {rpm}");
            if let Some(why) = why {
                let said =
                    |name: &str| why.args.iter().find(|(key, _)| key == name).map(|(_, value)| value.clone());
                let number = |name: &str| said(name).and_then(|text| text.parse::<f64>().ok()).unwrap();
                assert_eq!(breaks(&bit, number("slower"), rpm), None);
                assert_eq!(breaks(&bit, feed, number("faster") as u32), None);
                assert!(why.message("en").contains(&said("bite").unwrap()) && !why.advice("en").is_empty());
            }
        }
    }

    #[test]
    fn fast_edge_burns_but_not_at_the_suggested_speed() {
        let rows = [
            (3_200, Cutter::Drill, 30_000, false),
            (3_200, Cutter::Drill, 60_000, true),
            (800, Cutter::Drill, 60_000, false),
            (6_000, Cutter::Mill, 24_000, true),
            (6_000, Cutter::Vee { tip: Length::ZERO, angle_mdeg: 30_000 }, 24_000, false),
        ];
        for (um, cutter, rpm, does) in rows {
            let bit = bit(um, cutter);
            let found = judged(&bit, 1.0, rpm);
            assert_eq!(!found.is_empty(), does, "{um} {rpm}");
            for why in found {
                assert_eq!(why.code, "job.bit_burns");
                let slower = why.args.iter().find(|(key, _)| key == "slower").unwrap().1.parse().unwrap();
                assert_eq!(judged(&bit, 1.0, slower), []);
                assert!(slower > rpm / 2 && why.message("en").contains("350"), "{}", why.message("en"));
            }
        }
    }
}
