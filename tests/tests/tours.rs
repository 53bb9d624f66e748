//! Closed tours through the TSPLIB instances of the corpus, compared with their known optima.

use annulus_core::cam::bench::tsplib_gap;
use annulus_tests::corpus;
use serde_json::Value;
use std::fs;

#[test]
fn closed_tours_average_within_2_percent_of_the_optimum() {
    let Some(folder) = corpus().map(|corpus| corpus.join("tsplib")) else { return };
    let optima: Value = serde_json::from_slice(&fs::read(folder.join("optima.json")).unwrap()).unwrap();
    let mut gaps = Vec::new();
    for instance in optima["instances"].as_array().unwrap() {
        let name = instance["name"].as_str().unwrap();
        let text = fs::read_to_string(folder.join(format!("{name}.tsp"))).unwrap();
        let gap = tsplib_gap(&text, instance["optimum"].as_f64().unwrap(), 1).unwrap();
        println!("{name}: {:+.2} %", gap * 100.0);
        assert!((0.0..=0.04).contains(&gap), "{name}: {gap}");
        gaps.push(gap);
    }
    assert!(gaps.iter().sum::<f64>() / gaps.len() as f64 <= 0.02, "{gaps:?}");
    assert_eq!(gaps.len(), 5);
}
