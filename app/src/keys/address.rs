//! The part of a URL after its screen: an operation of the job, or a time of the playback.

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AddressPart {
    Operation {
        /// Position in the list, from 1.
        number: usize,
    },
    Second {
        at_s: f64,
    },
}

pub fn named(address: &str) -> Option<AddressPart> {
    if let Some(number) = address.strip_prefix("#/cam/op/") {
        return number
            .parse()
            .ok()
            .filter(|number| *number > 0)
            .map(|number| AddressPart::Operation { number });
    }
    let at_s = address.strip_prefix("#/simulate?")?.split('&').find_map(|pair| pair.strip_prefix("t="));
    let at_s = at_s?.parse().ok().filter(|at_s: &f64| at_s.is_finite())?;
    Some(AddressPart::Second { at_s: at_s.max(0.0) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_parse_operations_and_seconds() {
        let operation = |number| Some(AddressPart::Operation { number });
        let second = |at_s| Some(AddressPart::Second { at_s });
        let rows = [
            ("#/cam/op/2", operation(2)),
            ("#/simulate?t=12.5", second(12.5)),
            ("#/simulate?x=1&t=3", second(3.0)),
            ("#/simulate?t=-3", second(0.0)),
            ("#/simulate?t=inf", None),
            ("#/simulate?t=", None),
            ("#/simulate", None),
            ("#/cam/op/0", None),
            ("#/cam/op/x", None),
            ("#/cam", None),
            ("#/board?t=3", None),
            ("", None),
        ];
        for (address, expected) in rows {
            assert_eq!(named(address), expected, "{address}");
        }
    }
}
