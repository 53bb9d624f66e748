//! Small sample files with seeded random damage: the readers keep their invariants on all of them. Failures
//! print the seed.

use annulus_core::artwork::{members, packed};
use annulus_core::board::Face;
use annulus_core::cam::usual::usual_bits;
use annulus_core::cam::work::{Operation, OperationKind, Remedy, Work};
use annulus_core::chance::Chance;
use annulus_core::geometry::Point;
use annulus_core::project;
use annulus_core::project::saved::{self, Project, SaidOfFiles};
use annulus_tests::{root, rounds, targets};
use std::fs;

/// Inputs per sample and target, short and long: more than 10⁴ and 10⁵ in total.
const ROUNDS: (u64, u64) = (500, 5_000);

/// Damaged layers, which are also painted.
const LAYER_ROUNDS: (u64, u64) = (200, 2_000);

/// Fragments with a meaning for the readers.
const WORDS: [&[u8]; 34] = [
    b"M25\n",
    b"M01\n",
    b"M02X1Y1\n",
    b"R9999X1\n",
    b"G85",
    b"G00",
    b"M15\n",
    b"M16\n",
    b"G91\n",
    b"G93X1Y1\n",
    b"M71\n",
    b"M72\n",
    b"T99999\n",
    b"T1C0.8\n",
    b"%\n",
    b"M48\n",
    b"METRIC,LZ,000.000\n",
    b"INCH\n",
    b"ICI,ON\n",
    b"X99999999999\n",
    b"*",
    b"%FSLAX24Y24*%",
    b";FILE_FORMAT=9:9\n",
    b"G02X1Y1I1J0\n",
    b"%SRX300Y300I1J1*%",
    b"%ABD20*%",
    b"%AB*%",
    b"%LS99*%",
    b"%OFA9B9*%",
    b"%AMBOX*1,1,$1/0,0,0*%",
    b"%ADD12BOX,9999999*%",
    b"G36*",
    b"G37*",
    b"X9999999999Y-9999999999D01*",
];

fn damage(sample: &[u8], chance: &mut Chance) -> Vec<u8> {
    let mut bytes = sample.to_vec();
    for _ in 0..=chance.below(4) {
        let at = chance.below(bytes.len() + 1);
        match chance.below(6) {
            0 => bytes.truncate(at),
            1 => {
                let word = WORDS[chance.below(WORDS.len())];
                bytes.splice(at..at, word.iter().copied());
            }
            2 if at < bytes.len() => bytes[at] ^= 1 << chance.below(8),
            3 if at < bytes.len() => bytes[at] = b"0123456789XYTGMR.-+\n"[chance.below(20)],
            4 if at < bytes.len() => {
                let end = (at + chance.below(12)).min(bytes.len());
                bytes.drain(at..end);
            }
            _ => {
                let from = chance.below(bytes.len() + 1);
                let piece = bytes[from..(from + chance.below(30)).min(bytes.len())].to_vec();
                bytes.splice(at..at, piece);
            }
        }
    }
    bytes
}

/// A layer with a little of everything.
const LAYER: &[u8] = b"G04 #@! TF.FileFunction,Copper,L1,Top*\n%FSLAX36Y36*%\n%MOMM*%\n%AMBOX*\n$3=$1x2-($2+.5)/3*\n\
21,1,$1,$2,0,0,30*\n1,0,$3,0,0*\n7,0,0,1,.5,.1,20*\n%\n%ADD10C,0.5X0.2*%\n%ADD11R,1X0.6*%\n%ADD12BOX,1.2X0.8*%\n%ADD13P,1X6X30*%\n\
%ABD20*%\nD10*\nX1000000Y0D03*\n%AB*%\nG75*\nG01*\nD11*\n%TO.N,GND*%\nX0Y0D02*\nX3000000Y1000000D01*\nD12*\nX5000000Y5000000D03*\n\
%TD*%\n%LPC*%\nD10*\nG03*\nX2000000Y0I1000000J0D01*\n%LPD*%\n%LR45*%\nD13*\nX9000000Y0D03*\n%LR0*%\n%SRX2Y3I5J5*%\nD20*\n\
X0Y0D03*\n%SR*%\nG36*\nX0Y0D02*\nG01X4000000D01*\nY4000000D01*\nG02X0Y0I-4000000J0D01*\nG37*\nM02*\n";

#[test]
fn damaged_layers_never_panic() {
    let mut small = 0;
    for seed in 0..rounds(LAYER_ROUNDS.0, LAYER_ROUNDS.1) {
        let bytes = damage(LAYER, &mut Chance::new(seed));
        small += usize::from(bytes.len() < LAYER.len());
        if let Err(panic) = std::panic::catch_unwind(|| targets::gerber(&bytes)) {
            println!("seed {seed}: {}", String::from_utf8_lossy(&bytes));
            std::panic::resume_unwind(panic);
        }
    }
    assert!(small > 20, "the samples are damaged");
}

#[test]
fn damaged_files_never_panic() {
    let mut samples: Vec<_> =
        fs::read_dir(root().join("tests/data/drill")).unwrap().map(|entry| entry.unwrap().path()).collect();
    samples.sort();
    let (mut count, rounds) = (0, rounds(ROUNDS.0, ROUNDS.1));
    for path in &samples {
        let sample = fs::read(path).unwrap();
        for (name, target) in
            [("drill", targets::drill as fn(&[u8])), ("any", targets::any), ("beside", targets::beside)]
        {
            for round in 0..rounds {
                let seed = round * 1_000 + count / rounds;
                let bytes = damage(&sample, &mut Chance::new(seed));
                if let Err(panic) = std::panic::catch_unwind(|| target(&bytes)) {
                    println!("{} {name} seed {seed}: {}", path.display(), String::from_utf8_lossy(&bytes));
                    std::panic::resume_unwind(panic);
                }
                count += 1;
            }
        }
    }
    println!("{count} damaged inputs");
    assert!(count >= 20 * rounds, "only {count} inputs");
}

/// Damaged projects and jobs.
const PROJECT_ROUNDS: (u64, u64) = (300, 3_000);

/// Fragments with a meaning for the readers of projects and jobs.
const JOB_WORDS: [&[u8]; 16] = [
    b"[setup]\n",
    b"[[bit]]\n",
    b"[[operation]]\n",
    b"[[operation.cure]]\n",
    b"kind = \"cut_out\"\n",
    b"with = \"centred\"\n",
    b"name = \"m\"\n",
    b"1e308",
    b"-1",
    b"nan",
    b"9223372036854775808",
    b"[[[[[[[[",
    b"\"\"\"",
    b"\xff",
    b"{\"annulus_project\":1,\"said\":{\"used\":[\"../../a\"]}}",
    b"\\u0000",
];

/// A job, damaged as bytes and by fragments.
fn damaged_job(sample: &str, chance: &mut Chance) -> Vec<u8> {
    let mut bytes = damage(sample.as_bytes(), chance);
    for _ in 0..chance.below(3) {
        let at = chance.below(bytes.len() + 1);
        let word = JOB_WORDS[chance.below(JOB_WORDS.len())];
        bytes.splice(at..at, word.iter().copied());
    }
    bytes
}

/// The job of the sample project: every kind of operation, and a fix.
fn sample_job() -> String {
    let operations = OperationKind::WORDS.iter().filter_map(|word| Operation::usual(word, Face::Top));
    let mut work = Work { bits: usual_bits(), operations: operations.collect(), ..Work::default() };
    let isolate = work.operations.iter_mut().find_map(|operation| match &mut operation.action {
        OperationKind::Isolate(isolate) => Some(isolate),
        _ => None,
    });
    isolate.unwrap().cure(Point::from_mm(1.0, 1.0), Point::from_mm(1.1, 1.0), Remedy::Centred);
    project::write(&work)
}

#[test]
fn damaged_projects_and_jobs_never_panic() {
    let job = sample_job();
    let files = ["b/a.drl", "b/a.gbr"].map(str::to_owned).into_iter();
    let drill = b"M48\nMETRIC\nT1C0.8\n%\nT1\nX1.0Y1.0\nM30\n".to_vec();
    let said =
        SaidOfFiles { used: Some(vec!["b/a.drl".to_owned()]), aligned: true, ..SaidOfFiles::default() };
    let project =
        Project { files: files.zip([drill, LAYER.to_vec()]).collect(), said, job: Some(job.clone()) };
    let zip = saved::write(&project).unwrap();
    let whole = members(&zip).unwrap();
    let (mut read, mut refused) = (0, 0);
    let rounds = rounds(PROJECT_ROUNDS.0, PROJECT_ROUNDS.1);
    for seed in 0..rounds {
        let chance = &mut Chance::new(seed);
        // The zip itself; a damaged member in an intact zip; only the job.
        let (target, bytes): (fn(&[u8]), _) = match seed % 3 {
            0 => (targets::project, damage(&zip, chance)),
            1 => {
                let mut members = whole.clone();
                let which = chance.below(members.len());
                members[which].1 = damaged_job(&String::from_utf8_lossy(&members[which].1), chance);
                (targets::project, packed(&members).unwrap())
            }
            _ => (targets::job, damaged_job(&job, chance)),
        };
        *(if saved::read("p", &bytes).is_ok() { &mut read } else { &mut refused }) += 1;
        if let Err(panic) = std::panic::catch_unwind(|| target(&bytes)) {
            println!("seed {seed}: {}", String::from_utf8_lossy(&bytes));
            std::panic::resume_unwind(panic);
        }
    }
    println!("{read} projects read, {refused} refused or jobs");
    assert!(read as u64 > rounds / 10 && refused as u64 > rounds / 10, "{read} {refused}");
}

#[test]
fn projects_that_unpack_too_large_are_refused() {
    // Zeros compress a thousandfold: one member over the limit, and many that exceed it together while
    // declaring small sizes.
    let zip = saved::write(&Project { job: Some("schema = 1\n".to_owned()), ..Project::default() }).unwrap();
    targets::project(&zip);
    let at = zip.windows(4).position(|four| four == b"PK\x01\x02").unwrap();
    for size in [0, 1, u32::MAX / 2, u32::MAX] {
        for field in [20, 24, 42] {
            let mut lying = zip.clone();
            lying[at + field..at + field + 4].copy_from_slice(&size.to_le_bytes());
            targets::project(&lying);
        }
    }
    let most = vec![(String::from("files/x"), Vec::new()); 70_000];
    assert!(packed(&most).is_err(), "no more members than can be read again");
}
