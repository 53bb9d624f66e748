//! Tests from a path to pulses: every step at its tick, every axis on the same timeline, a common stop
//! anywhere on the path.

use crate::machines::Machines;
use crate::support::{PULSE, SETUP, meant, path, seeds};
use annulus_core::chance::Chance;
use annulus_link::chunk::{self, Before, SLICE};
use annulus_link::cutter::{ChunkCutter, Piece, Rule};
use annulus_link::frame::PAYLOAD;
use annulus_link::message::{Configure, Refusal};
use annulus_link::player::{End, Player};
use annulus_link::run::Run;
use annulus_link::store::Store;
use annulus_link::{AXES, CYCLES_PER_TICK, FULL_RATE};

const SETTINGS: Configure = Configure {
    pulse: PULSE as u8,
    setup: SETUP as u16,
    limits: 0,
    low_inputs: 0,
    low_steps: 0,
    low_forward: 0,
    phases: 0,
};

fn pieces(runs: &[Vec<Run>; AXES], ticks: u32, rule: &Rule) -> Vec<Piece> {
    let mut cutter = ChunkCutter::new(runs.each_ref().map(Vec::as_slice), ticks.into(), 0, [0; AXES]);
    let mut pieces = Vec::new();
    while let Some(piece) = cutter.cut(rule) {
        pieces.push(piece);
    }
    pieces
}

fn payload(piece: &Piece) -> Vec<u8> {
    let mut bytes = [0; PAYLOAD];
    let length = chunk::write(&piece.head, piece.slices(), &mut bytes).unwrap();
    bytes[..length].to_vec()
}

type Place = ([Before; AXES], [i32; AXES]);

fn checked(bytes: &[u8], (before, first): &Place) -> Result<Place, Refusal> {
    let (ask, runs) = annulus_link::message::Ask::take(4, bytes).ok_or(Refusal::Form)?;
    let annulus_link::message::Ask::Chunk(head) = ask else { return Err(Refusal::Form) };
    chunk::check(&head, runs, (before, *first), &SETTINGS)
}

fn ticks_of(machines: &Machines, axis: usize) -> Vec<(u64, bool)> {
    let tick = u64::from(CYCLES_PER_TICK);
    machines.steps[axis]
        .iter()
        .map(|step| {
            assert_eq!(step.cycle % tick, 0, "a pulse between two ticks");
            (step.cycle / tick, step.forward)
        })
        .collect()
}

fn rule_of(chance: &mut Chance) -> Rule {
    Rule {
        ticks: chance.scale(500.0, 400_000.0) as u32,
        ..Rule::resting_within(chance.scale(2e3, 4e5) as u32)
    }
}

#[test]
fn full_rate_steps_are_in_their_tick_in_any_chunks() {
    let mut steps = 0;
    for seed in seeds(40) {
        let mut chance = Chance::new(seed);
        let length = chance.scale(1e3, 2e6) as u32;
        let (runs, ticks) = path(&mut chance, length);
        let rule = rule_of(&mut chance);
        let (mut player, mut store, mut machines) = (Player::new(), Box::new(Store::new()), Machines::new());
        player.want(FULL_RATE);
        let mut before = ([Before::at_rest(false); AXES], [0; AXES]);
        let mut waiting = pieces(&runs, ticks, &rule).into_iter();
        let mut end = None;
        let mut begun = false;
        while end.is_none() {
            while store.has_room(PAYLOAD) {
                let Some(piece) = waiting.next() else { break };
                let bytes = payload(&piece);
                before = checked(&bytes, &before).expect("a piece is right");
                assert!(player.keep(&mut store, &piece.head, &bytes));
            }
            if !begun {
                assert!(player.begin(&mut store, PULSE));
                begun = true;
            }
            end = player.slice(&mut store, &mut machines);
        }
        assert_eq!(end, Some(End::Rested));
        let wanted = meant(&runs, ticks);
        for (axis, wanted) in wanted.iter().enumerate() {
            assert_eq!(ticks_of(&machines, axis), *wanted, "axis {axis}");
            steps += wanted.len();
            let count = |forward| wanted.iter().filter(|step| step.1 == forward).count() as i32;
            assert_eq!(player.index()[axis], count(true) - count(false));
        }
        assert_eq!(machines.now(), [u64::from(ticks * CYCLES_PER_TICK); AXES]);
        assert!(machines.shortest_setup >= u64::from(SETUP * CYCLES_PER_TICK), "{}", machines.shortest_setup);
    }
    assert!(steps > 50_000, "{steps}");
}

fn played(chance: &mut Chance, runs: &[Vec<Run>; AXES], ticks: u32, rule: &Rule) -> (End, Player, Machines) {
    let (mut player, mut store, mut machines) = (Player::new(), Box::new(Store::new()), Machines::new());
    player.want(FULL_RATE);
    let pieces = pieces(runs, ticks, rule);
    // The bridge dies here.
    let alive = if chance.below(2) == 0 { pieces.len() } else { 1 + chance.below(pieces.len()) };
    let mut waiting = pieces[..alive].iter();
    let mut begun = false;
    for _ in 0..2_000_000 {
        while store.has_room(PAYLOAD) && !(begun && player.is_ending()) {
            let Some(piece) = waiting.next() else { break };
            assert!(player.keep(&mut store, &piece.head, &payload(piece)));
        }
        if !begun {
            assert!(player.begin(&mut store, PULSE));
            begun = true;
        }
        match chance.below(400) {
            0 => player.want(0),
            1..4 => player.want(FULL_RATE),
            4 => player.want(chance.below(FULL_RATE as usize) as u32),
            5 if chance.below(10) == 0 => player.stop(),
            _ => {}
        }
        if let Some(end) = player.slice(&mut store, &mut machines) {
            return (end, player, machines);
        }
    }
    panic!("it never came to rest");
}

#[test]
fn interrupted_motion_stops_on_the_path_on_all_axes() {
    let mut ends = [0; 3];
    for seed in seeds(150) {
        let mut chance = Chance::new(seed);
        let length = chance.scale(1e3, 1e6) as u32;
        let (runs, ticks) = path(&mut chance, length);
        let rule = rule_of(&mut chance);
        let (end, player, machines) = played(&mut chance, &runs, ticks, &rule);
        let wanted = meant(&runs, ticks);
        // The moment of the path at which it stopped: after the last step of every axis and before its
        // next.
        let made = |axis: usize| machines.steps[axis].len();
        let from =
            (0..AXES).filter_map(|axis| wanted[axis].get(made(axis).wrapping_sub(1))).map(|step| step.0);
        let until = (0..AXES).filter_map(|axis| wanted[axis].get(made(axis))).map(|step| step.0);
        let (from, until) = (from.max().unwrap_or(0), until.min().unwrap_or(u64::MAX));
        assert!(from < until, "axes rest at different moments: {from} {until}");
        for axis in 0..AXES {
            let ways =
                |steps: &mut dyn Iterator<Item = bool>| steps.map(|up| if up { 1 } else { -1 }).sum::<i32>();
            assert_eq!(player.index()[axis], ways(&mut machines.steps[axis].iter().map(|step| step.forward)));
            let same =
                machines.steps[axis].iter().zip(&wanted[axis]).all(|(made, wanted)| made.forward == wanted.1);
            assert!(same, "axis {axis}: a step that is not of the path");
            let near = |pair: &[crate::machines::Step]| pair[1].cycle - pair[0].cycle;
            let gap = machines.steps[axis].windows(2).map(near).min().unwrap_or(u64::MAX);
            assert!(
                gap > u64::from(PULSE * CYCLES_PER_TICK),
                "axis {axis}: {gap} cycles from pulse to pulse"
            );
        }
        match end {
            End::Rested => ends[0] += 1,
            End::Starved => ends[1] += 1,
            End::Stopped => ends[2] += 1,
        }
    }
    assert!(ends.iter().all(|count| *count > 5), "{ends:?}");
}

/// Step times of one even axis, and their rate relative to full in every slice.
#[test]
fn time_scale_changes_at_its_ramp_and_is_zero_in_a_hold() {
    let even = Run {
        forward: true,
        count: 40_000,
        interval: 20,
        fraction: 0,
        change: 0,
        phase: annulus_link::run::HALF,
    };
    let runs = [vec![even], vec![], vec![], vec![Run { interval: 30, count: 20_000, ..even }]];
    let rule = Rule { ticks: 50_000, fall: 1000, rise: 500 };
    let (mut player, mut store, mut machines) = (Player::new(), Box::new(Store::new()), Machines::new());
    player.want(FULL_RATE);
    for piece in pieces(&runs, 800_100, &rule) {
        assert!(player.keep(&mut store, &piece.head, &payload(&piece)));
    }
    assert!(player.begin(&mut store, PULSE));
    let mut rates = vec![player.rate()];
    for slice in 0.. {
        match slice {
            100 => player.want(0),
            250 => player.want(FULL_RATE / 2),
            400 => player.want(FULL_RATE),
            _ => {}
        }
        if player.slice(&mut store, &mut machines).is_some() {
            break;
        }
        rates.push(player.rate());
    }
    for pair in rates.windows(2) {
        // The last slice of a chunk is shorter, and so is the next change.
        assert!(pair[0] <= pair[1] + 1000 && pair[1] <= pair[0] + 500, "{pair:?}");
    }
    assert_eq!((rates[170], rates[240], rates[390]), (0, 0, FULL_RATE / 2));
    let ticks: Vec<u64> = ticks_of(&machines, 0).into_iter().map(|step| step.0).collect();
    assert_eq!(ticks.len(), 40_000);
    let longest = ticks.windows(2).map(|pair| pair[1] - pair[0]).max().unwrap();
    assert!(longest > 70 * u64::from(SLICE), "it stood still for {longest} ticks only");
    // 100 slices at full rate, and full rate again at the end.
    assert!(ticks[..5000].windows(2).all(|pair| pair[1] - pair[0] == 20));
    assert!(ticks[35_000..].windows(2).all(|pair| pair[1] - pair[0] == 20));
}

#[test]
fn inconsistent_chunks_are_refused_with_the_reason() {
    let run = |forward, count, interval| Run { count, ..Run::one(forward, interval) };
    let runs = [vec![run(true, 100, 1000), run(false, 100, 1000)], vec![run(true, 3, 60)], vec![], vec![]];
    let rule = Rule { ticks: 60_000, ..Rule::resting_within(20_000) };
    let piece = pieces(&runs, 210_000, &rule).remove(0);
    let rest = ([Before::at_rest(true); AXES], [0; AXES]);
    let verdict = |change: &dyn Fn(&mut Piece)| {
        let mut piece = piece.clone();
        change(&mut piece);
        checked(&payload(&piece), &rest).err()
    };
    assert_eq!(verdict(&|_| {}), None);
    assert_eq!(verdict(&|piece| piece.head.places ^= 1), Some(Refusal::Index));
    assert_eq!(checked(&payload(&piece), &(rest.0, [0, 0, 1, 0])), Err(Refusal::Index));
    assert_eq!(verdict(&|piece| piece.head.ticks = 59_000), Some(Refusal::Counts));
    assert_eq!(verdict(&|piece| piece.head.ticks = 0), Some(Refusal::Counts));
    assert_eq!(verdict(&|piece| piece.head.ticks = 2_500_001), Some(Refusal::Counts));
    assert_eq!(verdict(&|piece| piece.head.fall = 0), Some(Refusal::Tail));
    assert_eq!(verdict(&|piece| piece.head.fall = 3), Some(Refusal::Tail));
    let close = Before { since: 5, forward: true, shown: true };
    let bytes = payload(&pieces(&[vec![run(true, 1, 5)], vec![], vec![], vec![]], 1000, &rule)[0]);
    let at = |before| ([before; AXES], [0; AXES]);
    assert_eq!(checked(&bytes, &at(close)), Err(Refusal::Rate));
    assert_eq!(checked(&bytes, &at(Before { since: 6, ..close })).err(), None);
    // A turn: the pin may have turned long before, or only now.
    let turn = |since, shown| checked(&bytes, &at(Before { since, forward: false, shown })).err();
    assert_eq!(turn(1000, false), Some(Refusal::Turn));
    assert_eq!(turn(1000, true), None);
    assert_eq!(turn(SETUP + PULSE - 6, true), Some(Refusal::Turn));
    assert_eq!(turn(SETUP + PULSE - 5, true), None);
    let bytes = payload(&piece);
    assert_eq!(checked(&bytes[..bytes.len() - 1], &rest), Err(Refusal::Form));
    assert_eq!(checked(&[&bytes[..], &[0]].concat(), &rest), Err(Refusal::Form));
    let fast = payload(&pieces(&[vec![run(true, 3, PULSE)], vec![], vec![], vec![]], 1000, &rule)[0]);
    assert_eq!(checked(&fast, &rest), Err(Refusal::Rate));
}
