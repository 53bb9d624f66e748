//! Tests of motor phases: patterns and forcing as in core, words at their ticks, unsafe tables refused.

use crate::card::{Card, Shown, pattern, windings};
use crate::support::{seeds, segment, slow_path};
use annulus_core::chance::Chance;
use annulus_core::machine::PhaseTable;
use annulus_core::machine::phases::{Commutator, FORCING, PRESETS, WINDINGS, check, preset};
use annulus_link::cutter::{ChunkCutter, Rule};
use annulus_link::frame::PAYLOAD;
use annulus_link::message::{Chunk, Windings};
use annulus_link::phases::{AROUND_WAIT, MOTORS, PhaseMotor, tables_crc};
use annulus_link::player::{End, Player, Words, without};
use annulus_link::store::Store;
use annulus_link::{AXES, CYCLES_PER_TICK, FULL_RATE, chunk};

/// Tables of every kind: the shipped ones, a reversed one, longer ones, one of odd length.
pub(crate) fn tables() -> Vec<PhaseTable> {
    let named = PRESETS.map(|name| preset(name).unwrap());
    let mirrored = PhaseTable { columns: named[1].columns.iter().rev().copied().collect() };
    let long = PhaseTable { columns: named[3].columns.repeat(8) };
    let longer = PhaseTable { columns: named[0].columns.repeat(5) };
    let odd = PhaseTable { columns: vec![0x05, 0x05, 0x09, 0x0A, 0x0A, 0x06, 0x06] };
    let all: Vec<_> = named.into_iter().chain([mirrored, long, longer, odd]).collect();
    assert!(all.iter().all(|table| check("x.phases", table).is_ok()));
    all
}

fn any_tables(chance: &mut Chance) -> [PhaseTable; MOTORS] {
    let all = tables();
    std::array::from_fn(|_| all[chance.below(all.len())].clone())
}

#[derive(Default)]
struct Patterns {
    now: [u64; AXES],
    shown: [Shown; MOTORS],
    steps: [Vec<bool>; MOTORS],
    words: [Vec<u32>; AXES],
    most: [u32; AXES],
}

impl Words for Patterns {
    fn put(&mut self, axis: usize, word: u32) {
        assert!(axis < MOTORS, "an axis without pins");
        assert!(word >> 8 < 1 << 20, "a wait that is too long or less than none");
        self.now[axis] += u64::from((word >> 8) + AROUND_WAIT);
        let pattern = (word >> 2) as u8 & 0b11_1111;
        if self.shown[axis].last().map_or(0, |last| last.1) != pattern {
            self.shown[axis].push((self.now[axis], pattern));
        }
        if word & 2 != 0 {
            self.steps[axis].push(word & 1 == 1);
        }
        self.words[axis].push(word);
        self.most[axis] += 1;
    }
    fn places(&mut self, _: usize) -> &mut [u32] {
        unreachable!("patterns come one by one")
    }
    fn filled(&mut self, _: usize, _: u32) {}
}

#[test]
fn every_table_gives_the_patterns_of_core() {
    for table in tables() {
        let (mut motor, mut core) = (PhaseMotor::NONE, Commutator::new(table.clone(), 0));
        assert!(motor.take(&windings(0, &table, 100)));
        assert_eq!(motor.pattern(), 0, "nothing is on before the first step");
        let mut chance = Chance::new(5);
        for at in 0..3_000 {
            let forward = chance.below(3) > 0;
            core.step(forward);
            motor.step(forward, at);
            assert_eq!(motor.pattern(), pattern(core.byte()), "{table:?} at {at}");
            let forced = core.byte() & FORCING != 0;
            assert_eq!(motor.forced_until(), forced.then_some(at + 100));
            if chance.below(4) == 0 {
                core.hold();
                motor.hold();
                assert_eq!(motor.pattern(), core.byte() & WINDINGS);
            }
            // The same table again changes nothing: the bridge restarted.
            assert!(motor.take(&windings(0, &table, 100)));
            assert_eq!(motor.pattern(), pattern(core.byte()));
        }
        // Steps that were requested but not made.
        let (here, told) = (motor.pattern() & WINDINGS, chance.below(200) as i32);
        (0..told).for_each(|at| motor.step(true, at as u32));
        motor.undo(told);
        assert_eq!(motor.pattern(), here);
        (0..told).for_each(|at| motor.step(false, at as u32));
        motor.undo(-told);
        assert_eq!(motor.pattern(), here);
    }
}

#[test]
fn harmful_tables_are_refused_and_change_nothing() {
    let good = windings(0, &preset("half").unwrap(), 20_000);
    let with = |change: &dyn Fn(&mut Windings)| {
        let mut table = good;
        change(&mut table);
        table
    };
    let wrong = [
        with(&|table| table.count = 0),
        with(&|table| table.count = 65),
        with(&|table| table.columns[2] = 0x03),
        with(&|table| table.columns[2] = 0x0C),
        with(&|table| table.columns[2] = 0x11),
        with(&|table| table.columns[2] = 0x85),
        with(&|table| table.columns[7] = 0x60),
        with(&|table| table.forcing = 0),
        with(&|table| table.forcing = 1_000_001),
    ];
    let mut motor = PhaseMotor::NONE;
    assert!(motor.take(&good));
    motor.step(true, 0);
    for table in wrong {
        assert!(!motor.take(&table), "{table:?}");
        assert_eq!((motor.table(), motor.pattern()), (&good, 0x05));
    }
    assert!(!Player::new().wind(&with(&|table| table.axis = 3)), "there are three motors");
    let all = [good, Windings { axis: 1, ..good }, Windings { axis: 2, ..good }];
    let other = [Windings { forcing: 20_001, ..good }, all[1], all[2]];
    assert!(tables_crc(&all) != tables_crc(&other) && tables_crc(&all) != 0);
}

fn pieces(segments: &[([Vec<annulus_link::run::Run>; AXES], u32)], rule: &Rule) -> Vec<(Chunk, Vec<u8>)> {
    let (mut all, mut number, mut index) = (Vec::new(), 0, [0; AXES]);
    for (runs, ticks) in segments {
        let lists = runs.each_ref().map(Vec::as_slice);
        let mut cutter = ChunkCutter::new(lists, u64::from(*ticks), number, index);
        while let Some(piece) = cutter.cut(rule) {
            let mut bytes = [0; PAYLOAD];
            let length = chunk::write(&piece.head, piece.slices(), &mut bytes).unwrap();
            all.push((piece.head, bytes[..length].to_vec()));
        }
        (number, index) = (cutter.number(), cutter.index());
    }
    all
}

fn player(tables: &[PhaseTable; MOTORS], forcing: u32) -> Player {
    let mut player = Player::new();
    player.want(FULL_RATE);
    for (axis, table) in tables.iter().enumerate() {
        assert!(player.wind(&windings(axis, table, forcing)));
    }
    player.drive(true);
    player
}

fn played(
    player: &mut Player,
    pieces: &[(Chunk, Vec<u8>)],
    mut each: impl FnMut(&mut Player),
) -> (End, Patterns) {
    let (mut store, mut words) = (Box::new(Store::new()), Patterns::default());
    let (mut waiting, mut begun) = (pieces.iter(), false);
    loop {
        while store.has_room(PAYLOAD) && !(begun && player.is_ending()) {
            let Some((head, bytes)) = waiting.next() else { break };
            assert!(player.keep(&mut store, head, bytes));
        }
        begun = begun || player.begin(&mut store, 2);
        words.most = [0; AXES];
        let end = player.slice(&mut store, &mut words);
        assert!(words.most.iter().all(|count| *count <= player.most_words(2)), "{:?}", words.most);
        if let Some(end) = end {
            return (end, words);
        }
        each(player);
    }
}

#[test]
fn every_pattern_and_forcing_end_is_in_its_tick() {
    let (mut edges, mut ends) = (0, 0);
    for seed in seeds(60) {
        let mut chance = Chance::new(seed);
        let tables = any_tables(&mut chance);
        let forcing = chance.scale(20.0, 60_000.0) as u32;
        let segments: Vec<_> =
            (0..1 + chance.below(3)).map(|_| slow_path(&mut chance, 400_000, (15.0, 20_000.0))).collect();
        let stream: Vec<_> = segments.iter().map(|(runs, ticks)| segment(runs, *ticks)).collect();
        let wanted = Card::new(&tables, forcing).played(&stream);
        let rule = Rule { ticks: chance.scale(500.0, 400_000.0) as u32, ..Rule::resting_within(20_000) };
        let (end, made) = played(&mut player(&tables, forcing), &pieces(&segments, &rule), |_| {});
        assert_eq!(end, End::Rested);
        for (axis, wanted) in wanted.iter().enumerate() {
            let cycles: Shown =
                wanted.iter().map(|(tick, shown)| (tick * u64::from(CYCLES_PER_TICK), *shown)).collect();
            assert_eq!(made.shown[axis], cycles, "motor {axis}, forcing {forcing}");
            edges += cycles.len();
            ends += cycles.windows(2).filter(|pair| pair[0].1 & 0b1111 == pair[1].1).count();
        }
    }
    println!("{edges} patterns in their ticks, {ends} ends of forcing between two steps among them");
    assert!(edges > 20_000 && ends > 500, "{edges} patterns, {ends} ends of forcing between two steps");
}

#[test]
fn motors_stay_at_their_index_after_any_interruption() {
    let mut seen = [0; 3];
    for seed in seeds(100) {
        let mut chance = Chance::new(seed);
        let tables = any_tables(&mut chance);
        let forcing = chance.scale(20.0, 60_000.0) as u32;
        let path = slow_path(&mut chance, 400_000, (15.0, 20_000.0));
        let all =
            pieces(std::slice::from_ref(&path), &Rule { ticks: 20_000, ..Rule::resting_within(50_000) });
        let alive = if chance.below(2) == 0 { all.len() } else { 1 + chance.below(all.len()) };
        let mut player = player(&tables, forcing);
        let mut own = Chance::new(seed + 1000);
        let (end, made) = played(&mut player, &all[..alive], |player| match own.below(200) {
            0 => player.want(0),
            1..4 => player.want(FULL_RATE),
            4 => player.want(own.below(FULL_RATE as usize) as u32),
            5 if own.below(10) == 0 => player.stop(),
            _ => {}
        });
        seen[end as usize] += 1;
        let sum = |steps: &[bool]| steps.iter().map(|up| if *up { 1 } else { -1 }).sum::<i32>();
        let mut index = [0; AXES];
        for axis in 0..MOTORS {
            index[axis] = sum(&made.steps[axis]);
            let mut core = Commutator::new(tables[axis].clone(), 0);
            made.steps[axis].iter().for_each(|up| _ = core.step(*up));
            let held = if made.steps[axis].is_empty() { 0 } else { core.hold() };
            assert_eq!(made.shown[axis].last().map_or(0, |last| last.1), held, "at rest, nothing forced");
        }
        assert_eq!(player.index(), index);
        // Simulates a forced stop before the last words were played.
        let cut: [usize; MOTORS] = std::array::from_fn(|axis| chance.below(made.words[axis].len() + 1));
        for axis in 0..MOTORS {
            for word in made.words[axis][cut[axis]..].iter().rev() {
                index[axis] = without(*word, index[axis]);
            }
        }
        player.cut_short(index);
        player.ready();
        player.want(FULL_RATE);
        let back = std::array::from_fn(|axis| {
            if axis < MOTORS { vec![annulus_link::run::Run::one(true, 5_000)] } else { vec![] }
        });
        let (_, after) =
            played(&mut player, &pieces(&[(back, 10_000)], &Rule::resting_within(5_000)), |_| {});
        for axis in 0..MOTORS {
            let mut core = Commutator::new(tables[axis].clone(), i64::from(index[axis]));
            core.step(true);
            assert_eq!(after.shown[axis].last().unwrap().1, core.hold(), "motor {axis} goes on from there");
        }
    }
    assert!(seen.iter().all(|count| *count > 3), "{seen:?}");
}
