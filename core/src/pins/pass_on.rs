//! Wrappers around pins: delegates the methods that a wrapper doesn't change.

/// Implements the named methods of [`crate::pins::Pins`] by a call to the field `pins`. Use inside an `impl
/// Pins for …`, next to the methods that differ.
#[macro_export]
macro_rules! pass_pins_on {
    ($($method:ident),+ $(,)?) => {
        $($crate::pass_pins_on!(@ $method);)+
    };
    (@ step) => {
        fn step(&mut self, at_tick: u64, axes: $crate::pins::AxisSet, forward: $crate::pins::AxisSet) {
            self.pins.step(at_tick, axes, forward);
        }
    };
    (@ spindle) => {
        fn spindle(&mut self, at_tick: u64, rpm: u32) {
            self.pins.spindle(at_tick, rpm);
        }
    };
    (@ spindle_state) => {
        fn spindle_state(&mut self) -> $crate::pins::SpindleState {
            self.pins.spindle_state()
        }
    };
    (@ inputs) => {
        fn inputs(&mut self, at_tick: u64) -> u32 {
            self.pins.inputs(at_tick)
        }
    };
    (@ output) => {
        fn output(&mut self, at_tick: u64, place: u8, on: bool) {
            self.pins.output(at_tick, place, on);
        }
    };
    (@ rest) => {
        fn rest(&mut self, at_tick: u64) {
            self.pins.rest(at_tick);
        }
    };
    (@ due) => {
        fn due(&self) -> Option<u64> {
            self.pins.due()
        }
    };
    (@ bit) => {
        fn bit(&mut self, at_tick: u64, bit: &$crate::job::Bit) {
            self.pins.bit(at_tick, bit);
        }
    };
    (@ stock) => {
        fn stock(&mut self, at_tick: u64, stock: &$crate::magazine::ToolStock) {
            self.pins.stock(at_tick, stock);
        }
    };
    (@ ahead) => {
        fn ahead(&mut self, at_tick: u64, axes: $crate::pins::AxisSet, forward: $crate::pins::AxisSet) {
            self.pins.ahead(at_tick, axes, forward);
        }
    };
    (@ attend) => {
        fn attend(&mut self, at_tick: u64) {
            self.pins.attend(at_tick);
        }
    };
    (@ safe) => {
        fn safe(&mut self) {
            self.pins.safe();
        }
    };
}
