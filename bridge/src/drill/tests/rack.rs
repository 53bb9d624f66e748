//! What the pre-flight says of the rack: drills are looked for in it, mills and V-bits are not.

use super::*;

#[test]
fn only_drills_are_looked_for_in_the_rack() {
    let vee = Cutter::Vee { tip: Length::from_um(100), angle_mdeg: 30_000 };
    let bit = |um, cutter, name: &str| Bit { diameter: Length::from_um(um), name: name.to_owned(), cutter };
    let job = vec![
        bit(800, Cutter::Drill, "0.8 mm"),
        bit(3_175, vee, "V 30°"),
        bit(1_500, Cutter::Mill, "Mill 1.5 mm"),
    ];
    let told = |bits: Vec<Bit>| {
        let bench = Bench::new(&machine(), Faults::default());
        let (.., checks) = bench.arm(&Program { bits, ..grid(&machine(), 1) });
        let rows = checks.into_iter().filter(|row| row.finding.code == "preflight.bit_not_in_rack");
        rows.map(|row| row.finding.message("en")).collect::<Vec<_>>()
    };
    assert_eq!(told(job.clone()), Vec::<String>::new(), "no rack lists V-bits and mills");
    let strange = bit(830, Cutter::Drill, "0.83 mm");
    let said = told([job, vec![strange]].concat());
    assert!(said.len() == 1 && said[0].contains("0.83 mm") && !said[0].contains("V 30"), "{said:?}");
}
