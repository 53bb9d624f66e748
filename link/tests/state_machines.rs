//! A second opinion on the firmware's state machines: a model runs their source text, independently of the
//! firmware's assembler and emulator.

use crate::machines::{Machines, Step};
use crate::support::{PULSE, path, seeds};
use annulus_core::chance::Chance;
use annulus_link::CYCLES_PER_TICK;
use annulus_link::phases::phase_word;
use annulus_link::player::{Words, pulse_word, wait_word};
use std::collections::VecDeque;

const PULSES: &str = include_str!("../../bridge/firmware/src/pulses.pio");
const PHASES: &str = include_str!("../../bridge/firmware/src/phases.pio");
const WATCHER: &str = include_str!("../../bridge/firmware/src/watcher.pio");

struct Model {
    /// Operation, operands, level of the side pin, delay cycles.
    program: Vec<(String, Vec<String>, Option<bool>, u32)>,
    labels: Vec<(String, usize)>,
    wrap: (usize, usize),
    place: usize,
    delay: u32,
    x: u32,
    y: u32,
    out: u32,
    into: u32,
    words: VecDeque<u32>,
    inputs: u32,
    asked: bool,
    side: bool,
    pins: u32,
    interrupts: u32,
}

impl Model {
    fn new(text: &str) -> Self {
        let (mut program, mut labels, mut wrap) = (Vec::new(), Vec::new(), (0, 0));
        for line in text.lines().map(|line| line.split(';').next().unwrap().trim()) {
            match line {
                ".wrap_target" => wrap.0 = program.len(),
                ".wrap" => wrap.1 = program.len() - 1,
                _ if line.is_empty() || line.starts_with('.') => {}
                _ if line.ends_with(':') => {
                    labels.push((line.trim_end_matches(':').to_owned(), program.len()));
                }
                _ => {
                    let (line, delay) = line.split_once('[').unwrap_or((line, "0]"));
                    let (line, side) = line.split_once("side").unwrap_or((line, ""));
                    let mut words = line.split([' ', ',']).filter(|word| !word.is_empty()).map(str::to_owned);
                    let delay = delay.trim_end_matches(']').parse().unwrap();
                    let side = side.trim().parse().ok().map(|level: u32| level == 1);
                    program.push((words.next().unwrap(), words.collect(), side, delay));
                }
            }
        }
        let (words, inputs, asked, side) = (VecDeque::new(), 1, true, false);
        let (x, y, out, into, pins, interrupts) = (0, 0, 0, 0, 0, 0);
        let (place, delay) = (0, 0);
        Self {
            program,
            labels,
            wrap,
            place,
            delay,
            x,
            y,
            out,
            into,
            words,
            inputs,
            asked,
            side,
            pins,
            interrupts,
        }
    }

    fn cycle(&mut self) {
        if self.delay > 0 {
            self.delay -= 1;
            return;
        }
        let (operation, operands, side, delay) = self.program[self.place].clone();
        self.side = side.unwrap_or(self.side);
        let mut next = if self.place == self.wrap.1 { self.wrap.0 } else { self.place + 1 };
        let first = operands.first().map_or("", String::as_str);
        match (operation.as_str(), first) {
            ("pull", "block") => match self.words.pop_front() {
                Some(word) => self.out = word,
                None => return,
            },
            ("out", to) => {
                let count: u32 = operands[1].parse().unwrap();
                let bits = self.out & ((1_u64 << count) - 1) as u32;
                self.out = self.out.checked_shr(count).unwrap_or(0);
                match to {
                    "pins" => self.pins = bits,
                    "x" => self.x = bits,
                    "null" => {}
                    _ => self.y = bits,
                }
            }
            ("set", to) => {
                let value = operands[1].parse().unwrap();
                if to == "pins" { self.pins = value } else { self.y = value }
            }
            ("in", "pins") => self.into = self.into << operands[1].parse::<u32>().unwrap() | self.inputs,
            ("mov", "isr") => self.into = 0,
            ("mov", "pins") => self.pins = self.y,
            ("mov", "x") => self.x = self.into,
            ("push", "noblock") | ("nop", "") => {}
            ("irq", "0") => self.interrupts += 1,
            ("jmp", condition) => {
                let jumps = match condition {
                    "x--" | "y--" => {
                        let counter = if condition == "x--" { &mut self.x } else { &mut self.y };
                        let before = *counter;
                        *counter = before.wrapping_sub(1);
                        before != 0
                    }
                    "!y" => self.y == 0,
                    "pin" => self.asked,
                    "x!=y" => self.x != self.y,
                    _ => true,
                };
                if jumps {
                    let label = operands.last().unwrap();
                    next = self.labels.iter().find(|(name, _)| name == label).unwrap().1;
                }
            }
            other => panic!("{other:?} is no operation that the programs need"),
        }
        (self.place, self.delay) = (next, delay);
    }
}

/// Steps and pulse lengths of a machine that plays `words` for this many cycles.
fn played(words: &[u32], cycles: u64) -> (Vec<Step>, Vec<u64>) {
    let mut model = Model::new(PULSES);
    model.words.extend(words);
    let (mut steps, mut lengths, mut before) = (Vec::new(), Vec::new(), false);
    for cycle in 0..cycles {
        model.cycle();
        if model.side && !before {
            steps.push(Step { cycle, forward: model.pins == 1 });
            lengths.push(0);
        }
        if let Some(length) = lengths.last_mut().filter(|_| model.side) {
            *length += 1;
        }
        before = model.side;
    }
    (steps, lengths)
}

#[test]
fn pulse_words_become_the_intended_steps() {
    for seed in seeds(4) {
        let (runs, _) = path(&mut Chance::new(seed), 60_000);
        let (mut machines, mut words, mut at) = (Machines::new(), Vec::new(), 0);
        for run in &runs[0] {
            // Now and then a word without a pulse, as at the end of a slice.
            for step in 0..run.count.min(200) {
                let word = if step % 7 == 3 {
                    wait_word(run.interval, run.forward)
                } else {
                    pulse_word(run.interval.max(2), run.forward)
                };
                words.push(word);
                machines.put(0, word);
                at = machines.now()[0];
            }
        }
        let (steps, lengths) = played(&words, at);
        assert!(steps.len() > 50 && steps == machines.steps[0], "seed {seed}");
        assert!(lengths.iter().all(|length| *length == u64::from(PULSE * CYCLES_PER_TICK)), "{lengths:?}");
    }
}

/// Patterns of a motor's pins by cycle, with RUN high up to `run`.
fn shown(words: &[u32], cycles: u64, run: u64) -> Vec<(u64, u32)> {
    let mut model = Model::new(PHASES);
    model.words.extend(words);
    let mut shown = Vec::new();
    for cycle in 0..cycles {
        model.asked = cycle < run;
        let before = model.pins;
        model.cycle();
        if model.pins != before {
            shown.push((cycle + 1, model.pins));
        }
    }
    shown
}

#[test]
fn phase_patterns_change_at_once_and_only_with_run() {
    for seed in seeds(4) {
        let mut chance = Chance::new(seed);
        let (mut words, mut wanted, mut ticks, mut last) = (Vec::new(), Vec::new(), 0, 0);
        for _ in 0..500 {
            let interval = 1 + chance.scale(1.0, 1024.0) as u32;
            let pattern = chance.below(64) as u8;
            words.push(phase_word(interval, pattern, [None, Some(false), Some(true)][chance.below(3)]));
            ticks += interval;
            if pattern != last {
                wanted.push((u64::from(ticks * CYCLES_PER_TICK), u32::from(pattern)));
            }
            last = pattern;
        }
        let cycles = u64::from(ticks * CYCLES_PER_TICK) + 100;
        assert_eq!(shown(&words, cycles, u64::MAX), wanted, "seed {seed}");
        // When RUN goes low, earlier patterns are shown and later ones never; the machine does not restart
        // itself.
        let run = wanted[wanted.len() / 2].0 + chance.below(5_000) as u64;
        let before: Vec<_> = wanted.into_iter().filter(|(cycle, _)| cycle - 2 < run).collect();
        assert_eq!(shown(&words, cycles, run), before, "seed {seed}, without RUN from {run} on");
    }
}

#[test]
fn pulses_end_without_run_and_stay_off() {
    let words = [pulse_word(50, true); 4];
    let mut model = Model::new(PULSES);
    model.words.extend(words);
    let (mut pulses, mut before) = (0, false);
    for cycle in 0..20_000 {
        model.asked = !(1000..2000).contains(&cycle);
        model.cycle();
        pulses += u32::from(model.side && !before);
        before = model.side;
    }
    assert_eq!(pulses, 1, "the one before; afterwards the machine waits to be started anew");
}

#[test]
fn watcher_ignores_short_touches_and_clears_run_for_long_ones() {
    // All phases of its loop, every length of a touch.
    for (from, length) in (0..12).flat_map(|from| (1..300).map(move |length| (from, length))) {
        let mut model = Model::new(WATCHER);
        let mut tripped = None;
        for cycle in 0..600_u32 {
            let touched = (100 + from..100 + from + length).contains(&cycle);
            model.inputs = if touched { 0b100 | 1 } else { 1 };
            model.cycle();
            if cycle > 50 && model.pins == 0 {
                tripped.get_or_insert(cycle - 100 - from);
            }
        }
        match length {
            ..=90 => assert_eq!(tripped, None, "{length} cycles at {from}"),
            120.. => {
                assert!(tripped.is_some_and(|after| after < 120), "{length} cycles at {from}: {tripped:?}");
            }
            _ => {}
        }
        assert_eq!(model.interrupts, u32::from(tripped.is_some()));
    }
}
