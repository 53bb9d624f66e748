//! Aperture lists for old Gerber (RS-274-D), which has neither apertures nor a number format. Reads CAM350's
//! GAP files, and rows like `D10 ROUND 0.5`.
//!
//! ```text
//!  D10 ROUND       4.00 0.102  0.00 0.000 …        D-code, shape, width in mil and mm, height in mil and mm
//!  D71 SQUARE 0.610                                D-code, shape, width, optional height
//! ```

use super::number::decimal;
use super::text::{holds, lines};
use super::{Overrides, Units, Zeros};
use std::fmt::Write;

const MOST_ROWS: usize = 10_000;

/// A Gerber head made from aperture lists. Needs units and digits from the user.
pub(super) fn head(lists: &[&[u8]], person: &Overrides) -> Option<String> {
    let (units, digits) = (person.units?, person.digits?);
    let zeros = if person.zeros == Some(Zeros::Trailing) { 'T' } else { 'L' };
    let (integer, decimal) = (digits.integer, digits.decimal);
    let unit = if units == Units::Inch { "IN" } else { "MM" };
    let mut head = String::from("%MOMM*%");
    for list in lists {
        apertures(list, units, &mut head);
    }
    let _ = write!(head, "%MO{unit}*%%FS{zeros}AX{integer}{decimal}Y{integer}{decimal}*%");
    Some(head)
}

fn apertures(list: &[u8], units: Units, head: &mut String) {
    let gap = holds(list, "GAPFile");
    let factor = match units {
        _ if gap => 1.0,
        Units::Mm => 1.0,
        Units::Inch => 25.4,
    };
    for line in lines(list).take(MOST_ROWS) {
        let mut words = line.text.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
        let code = words.next().and_then(|word| word.strip_prefix(b"D")).and_then(decimal);
        let (Some((code, _)), Some(form)) = (code, words.next()) else { continue };
        let sizes: Option<Vec<f64>> =
            words.map_while(|word| decimal(word).filter(|&(_, used)| used == word.len())).map(size).collect();
        let sizes = sizes.unwrap_or_default();
        // A GAP row has every size twice, in mil and in mm.
        let at = |index: usize| sizes.get(if gap { 2 * index + 1 } else { index }).map(|size| size * factor);
        let Some(width) = at(0) else { continue };
        let height = at(1).filter(|height| *height > 0.0).unwrap_or(width);
        let form = match form.to_ascii_uppercase().as_slice() {
            b"ROUND" | b"CIRCLE" | b"CIR" => format!("C,{width:.6}"),
            b"SQUARE" => format!("R,{width:.6}X{width:.6}"),
            b"RECT" | b"RECTANGLE" | b"RECTANGULAR" => format!("R,{width:.6}X{height:.6}"),
            b"OBLONG" | b"OVAL" | b"OBROUND" => format!("O,{width:.6}X{height:.6}"),
            b"OCTAGON" => format!("P,{:.6}X8X22.5", width / libm::cos(std::f64::consts::PI / 8.0)),
            _ => continue,
        };
        let _ = write!(head, "%ADD{}{form}*%", code.mantissa);
    }
}

fn size((number, _): (super::number::Decimal, usize)) -> Option<f64> {
    Some(number.mantissa as f64 / libm::pow(10.0, f64::from(number.decimals)))
}

#[cfg(test)]
mod tests {
    use super::super::Digits;
    use super::*;

    #[test]
    fn aperture_list_and_chosen_format_give_gerber_header() {
        let digits = Some(Digits { integer: 2, decimal: 3 });
        let inch = Overrides { units: Some(Units::Inch), digits, zeros: None };
        let gap =
            b"GAPFile Version 1.0\nD10 ROUND 4.00 0.102 0.00 0.000 0\nD71 SQUARE 24.00 0.610 0.00 0.000\n";
        let want = "%MOMM*%%ADD10C,0.102000*%%ADD71R,0.610000X0.610000*%%MOIN*%%FSLAX23Y23*%";
        assert_eq!(head(&[gap], &inch).as_deref(), Some(want));
        let plain = head(&[b"D12 OVAL 0.1 0.05\nnothing\n"], &inch).unwrap();
        assert!(plain.contains("%ADD12O,2.540000X1.270000*%"), "{plain}");
        assert_eq!(head(&[gap], &Overrides::default()), None);
    }
}
