//! Tests of refusals before a job and of the pre-flight rows about the tool list. Drills must be in the
//! list; end mills and V-bits need not.

use super::*;

#[test]
fn only_drills_are_checked_against_the_tool_list() {
    let vee = Cutter::Vee { tip: Length::from_um(100), angle_mdeg: 30_000 };
    let bit = |um, cutter, name: &str| Bit {
        diameter: Length::from_um(um),
        name: name.to_owned(),
        cutter,
        handling: Default::default(),
    };
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
    assert!(said.len() == 1 && said[0].contains("drill 0.83") && !said[0].contains("V-bit"), "{said:?}");
}

#[test]
fn start_is_refused_without_homing_zero_and_arming() {
    let bench = Bench::new(&machine(), Faults::default());
    let program = grid(&machine(), 3);
    let (job, stream_digest, checks) = bench.arm(&program);
    let failed: Vec<_> =
        checks.iter().filter(|row| row.verdict == RowVerdict::Fail).map(|row| &row.finding.code).collect();
    assert_eq!(failed, ["preflight.not_homed", "preflight.no_zero"]);
    let start =
        |digest: &str, from_leg| Ask::Start { job: job.clone(), stream_digest: digest.into(), from_leg };
    assert_eq!(bench.drill.ask(start(&stream_digest, 0)).unwrap_err().code, "control.not_homed");
    assert_eq!(bench.drill.ask(Ask::SetZero).unwrap_err().code, "control.not_homed");
    bench.home();
    assert_eq!(bench.drill.ask(start(&stream_digest, 0)).unwrap_err().code, "control.not_armed");
    bench.drill.ask(Ask::SetZero).unwrap();
    bench.arm(&program);
    assert_eq!(bench.drill.ask(start("other", 0)).unwrap_err().code, "control.other_stream");
    assert_eq!(bench.drill.ask(start(&stream_digest, 2)).unwrap_err().code, "control.leg_not_offered");
    let faster = vec![("stroke.feed".to_owned(), Value::Number(9.0))];
    bench.drill.ask(Ask::Configure { changes: faster }).unwrap();
    assert_eq!(bench.drill.ask(start(&stream_digest, 0)).unwrap_err().code, "control.not_armed");
    let (.., checks) = bench.arm(&program);
    assert!(
        checks
            .iter()
            .any(|row| row.finding.code == "preflight.other_machine" && row.verdict == RowVerdict::Fail)
    );
    assert_eq!(bench.drill.upload(&"0".repeat(64), b"junk").unwrap_err().code, "control.wrong_key");
    let saved = bench.folder.path().join("machines/virtual.toml");
    assert_eq!(crate::machine_file::load(&saved).unwrap().process.feed_mm_per_s, 9.0);
    assert_eq!(bench.record().len(), 0, "nothing was drilled");
}
