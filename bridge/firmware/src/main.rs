//! Firmware of the USB step adapter: turns frames from USB into words, and words into pulses.
//!
//! ```text
//! USB ─ bytes ─▶ Adapter (annulus-link) ─ words, 2 ms ahead ─▶ rings ─ DMA ─▶ state machines ─▶ step, direction
//!  ▲                                                                              ▲
//!  └── status every 10 ms          emergency stop, limit switches ─ watcher ─ RUN ┘── interrupt: outputs off
//! ```
//!
//! One core, one loop. Two interrupts touch only registers and atomics; two more time the filtered inputs
//! (`touches`). The loop may take up to 2 ms; after that the machines run dry, which is a fault. If it
//! hangs, the watchdog resets the chip after 100 ms, and resistors pull the pins to rest.
#![no_std]
#![no_main]

mod board;
mod machines;
mod rings;
mod touches;

use annulus_link::adapter::{Adapter, Inputs, Order};
use annulus_link::frame::ON_LINE;
use annulus_link::message::{State, Welcome};
use annulus_link::player::End;
use annulus_link::store::Store;
use annulus_link::{AXES, CYCLES_PER_TICK, TICK_HZ};
use core::cell::UnsafeCell;
use cortex_m_rt as _; // the linker's script
use rp2040_hal::clocks::ClocksManager;
use rp2040_hal::fugit::{HertzU32, MicrosDurationU32};
use rp2040_hal::pac;
use rp2040_hal::pll::{common_configs::PLL_USB_48MHZ, setup_pll_blocking, PLLConfig};
use rp2040_hal::usb::UsbBus;
use rp2040_hal::watchdog::Watchdog;
use rp2040_hal::xosc::setup_xosc_blocking;
use usb_device::bus::UsbBusAllocator;
use usb_device::device::{StringDescriptors, UsbDevice, UsbDeviceBuilder, UsbVidPid};
use usbd_serial::SerialPort;

/// Second stage of the boot, called by the chip's ROM.
#[link_section = ".boot2"]
#[no_mangle]
#[used]
pub static SECOND_STAGE: [u8; 256] = rp2040_boot2::BOOT_LOADER_W25Q080;

/// How far ahead words are made, in ticks: 2 ms. A hold takes effect at most that much later.
const AHEAD: u32 = 20_000;

/// Identifies the firmware in a file: `annulus firmware flash` searches for it.
#[used]
static ABOUT: &str = concat!("Annulus step adapter, sources ", env!("ANNULUS_SOURCES"), ".");

/// Opening the port at this speed and closing it requests the boot mode.
const BOOT_BITS_PER_S: u32 = 1200;

/// The clock: 12 MHz · 100 / 10, a whole number of cycles per tick.
const CLOCK: PLLConfig = PLLConfig { vco_freq: HertzU32::MHz(1200), refdiv: 1, post_div1: 5, post_div2: 2 };

const CRYSTAL_HZ: u32 = 12_000_000;

struct Place(UnsafeCell<Store>);

// SAFETY: only the main function takes it, once.
unsafe impl Sync for Place {}

static STORE: Place = Place(UnsafeCell::new(Store::new()));

/// Critical sections do nothing: no interrupt touches what they guard, and no pulse has to wait for USB.
struct OneThread;
critical_section::set_impl!(OneThread);
// SAFETY: only the main loop enters critical sections.
unsafe impl critical_section::Impl for OneThread {
    unsafe fn acquire() -> critical_section::RawRestoreState {}
    unsafe fn release(_: critical_section::RawRestoreState) {}
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    cortex_m::interrupt::disable();
    machines::stop_by_force();
    // The watchdog is no longer fed, so it resets the chip.
    loop {
        cortex_m::asm::nop();
    }
}

struct Usb {
    device: UsbDevice<'static, UsbBus>,
    serial: SerialPort<'static, UsbBus>,
    /// The frame being sent: bytes, length, bytes already sent.
    frame: [u8; ON_LINE],
    length: usize,
    gone: usize,
    /// At the last check, the port had been opened at the boot speed and closed.
    is_touched: bool,
}

impl Usb {
    fn new(bus: &'static UsbBusAllocator<UsbBus>) -> Self {
        let serial = SerialPort::new(bus);
        let names = StringDescriptors::default().manufacturer("Annulus").product("Annulus step adapter");
        let device = UsbDeviceBuilder::new(bus, UsbVidPid(0x1209, 0x0001))
            .strings(&[names])
            .and_then(|builder| builder.max_packet_size_0(64))
            .expect("what USB allows")
            .device_class(usbd_serial::USB_CLASS_CDC)
            .build();
        Self { device, serial, frame: [0; ON_LINE], length: 0, gone: 0, is_touched: false }
    }

    /// Returns `true` once after each request of the boot mode. Never at other speeds or while the port is
    /// open. A request at a wrong moment is dropped, not delayed.
    fn wants_boot(&mut self) -> bool {
        let before = self.is_touched;
        self.is_touched = self.serial.line_coding().data_rate() == BOOT_BITS_PER_S && !self.serial.dtr();
        self.is_touched && !before
    }

    /// Reads received bytes, and sends the next ones.
    fn turn(&mut self, adapter: &mut Adapter<'_>, now: u32) {
        self.device.poll(&mut [&mut self.serial]);
        let mut bytes = [0; 64];
        if let Ok(count) = self.serial.read(&mut bytes) {
            bytes.iter().take(count).for_each(|byte| adapter.hear(*byte, now));
        }
        if self.gone == self.length {
            (self.length, self.gone) = (adapter.tell(now, &mut self.frame).unwrap_or(0), 0);
        }
        if self.gone < self.length {
            self.gone += self.serial.write(&self.frame[self.gone..self.length]).unwrap_or(0);
        }
        let _ = self.serial.flush();
    }
}

enum Motion {
    Rest,
    /// Words are being made; start time of the machines, in µs.
    Making(u32),
    /// All words are made and are being played.
    Playing(End),
}

/// Makes words up to `until`, in machine ticks. Returns how the path ended, if it did.
#[link_section = ".data.ram"]
#[inline(never)]
fn make(adapter: &mut Adapter<'_>, until: u32) -> Option<End> {
    let words = adapter.most_words();
    let mut rings = rings::Rings::open();
    let mut end = None;
    while end.is_none() && (until.wrapping_sub(adapter.machine()) as i32) > 0 && rings.have_room(words) {
        end = adapter.slice(&mut rings);
    }
    rings.close();
    end
}

/// Arms the machines. A filtered input may have turned on since the link allowed the start, so check it
/// again.
fn arm(adapter: &Adapter<'_>) {
    machines::arm(adapter.settings());
    touches::stop_where_on();
}

fn obey(adapter: &mut Adapter<'_>, order: Order, motion: &mut Motion) {
    match order {
        Order::Settle if matches!(motion, Motion::Rest) && adapter.state() != State::Unset => {
            let (limits, filters_us) = (adapter.limits(), adapter.filters_us());
            machines::settle(adapter.settings(), limits & !touches::filtered(filters_us));
            touches::settle(adapter.settings(), limits, filters_us);
            name_pins(adapter.welcome_mut());
            // A forced stop stays in force until it is cleared.
            if !adapter.is_forced() {
                arm(adapter);
            }
        }
        Order::Settle => {}
        Order::Clear => arm(adapter),
        Order::Begin => {
            arm(adapter);
            adapter.begin();
            let end = make(adapter, AHEAD);
            machines::start();
            *motion = end.map_or(Motion::Making(board::micros()), Motion::Playing);
        }
    }
}

fn go_on(adapter: &mut Adapter<'_>, motion: &mut Motion) {
    if machines::is_stopped() {
        if !matches!(adapter.state(), State::Limit | State::EmergencyStop | State::Fault) {
            let (is_emergency, inputs) = machines::seen();
            let input = inputs.trailing_zeros() as u8;
            let index = machines::index_of(adapter.index());
            adapter.forced(index, (input < machines::map().inputs).then_some(input), is_emergency);
        }
        *motion = Motion::Rest;
        return;
    }
    match *motion {
        Motion::Making(since) => {
            if rings::ran_dry() {
                machines::stop_by_force();
                return;
            }
            let played = board::micros().wrapping_sub(since).wrapping_mul(TICK_HZ / 1_000_000);
            if let Some(end) = make(adapter, played.wrapping_add(AHEAD)) {
                *motion = Motion::Playing(end);
            }
        }
        Motion::Playing(end) if machines::are_idle() => {
            machines::rest();
            *motion = Motion::Rest;
            adapter.ended(end);
        }
        Motion::Playing(_) | Motion::Rest => {}
    }
}

fn inputs(adapter: &Adapter<'_>) -> Inputs {
    let map = machines::map();
    let levels = (0..map.inputs)
        .fold(0, |levels, input| levels | u8::from(board::level(map.input() + input)) << input);
    let touched = levels ^ adapter.settings().low_inputs;
    let (filtered, on) = touches::now(touched);
    let on = touched & !filtered | on;
    Inputs { on, stop: !board::level(map.stop) }
}

fn show(adapter: &Adapter<'_>) {
    let map = machines::map();
    let bit = |bit: u8, pin: u32| if adapter.outputs() >> bit & 1 == 1 { pin } else { 0 };
    let on = bit(0, 1 << map.output) | bit(1, map.second_output);
    // An interrupt may stop the pulses between the check and the switch, so interrupts are off here.
    cortex_m::interrupt::free(|_| {
        let on = if machines::is_stopped() { 0 } else { on };
        board::switch(on, !on & map.outputs());
    });
}

/// Releases every pin, with a pull-down: the wiring is still unknown.
fn pins() {
    board::drive(0);
    board::ALL.into_iter().for_each(|pin| board::pad(pin, false));
}

#[rp2040_hal::entry]
fn main() -> ! {
    let mut chip = pac::Peripherals::take().expect("taken once");
    let mut watchdog = Watchdog::new(chip.WATCHDOG);
    // SAFETY: the HAL's watchdog driver does not expose the reset reason.
    let by_watchdog = board::read(0x4005_8008) & 1;
    let crystal = setup_xosc_blocking(chip.XOSC, HertzU32::Hz(CRYSTAL_HZ)).expect("a crystal");
    watchdog.enable_tick_generation((CRYSTAL_HZ / 1_000_000) as u8);
    let mut clocks = ClocksManager::new(chip.CLOCKS);
    let crystal_hz = HertzU32::Hz(CRYSTAL_HZ);
    let fast = setup_pll_blocking(chip.PLL_SYS, crystal_hz, CLOCK, &mut clocks, &mut chip.RESETS);
    let usb = setup_pll_blocking(chip.PLL_USB, crystal_hz, PLL_USB_48MHZ, &mut clocks, &mut chip.RESETS);
    let (fast, usb) = (fast.expect("a clock"), usb.expect("a clock for USB"));
    clocks.init_default(&crystal, &fast, &usb).expect("clocks");
    board::bring_up();
    pins();
    machines::prepare(chip.PIO0, chip.PIO1, &mut chip.RESETS);
    rings::prepare();
    interrupts();
    let bus = UsbBus::new(chip.USBCTRL_REGS, chip.USBCTRL_DPRAM, clocks.usb_clock, true, &mut chip.RESETS);
    let bus = cortex_m::singleton!(: UsbBusAllocator<UsbBus> = UsbBusAllocator::new(bus)).expect("once");
    watchdog.start(MicrosDurationU32::millis(100));
    // SAFETY: taken only here.
    let store = unsafe { &mut *STORE.0.get() };
    run(Adapter::new(welcome(by_watchdog as u8), store), Usb::new(bus), &watchdog)
}

fn interrupts() {
    touches::prepare();
    // SAFETY: two handlers touch only registers and atomics; the two others access the touch states, always
    // with interrupts off.
    unsafe {
        let mut own = cortex_m::Peripherals::steal();
        own.NVIC.set_priority(pac::Interrupt::PIO1_IRQ_0, 0);
        own.NVIC.set_priority(pac::Interrupt::DMA_IRQ_0, 0x40);
        own.NVIC.set_priority(pac::Interrupt::IO_IRQ_BANK0, 0);
        own.NVIC.set_priority(pac::Interrupt::TIMER_IRQ_0, 0);
        pac::NVIC::unmask(pac::Interrupt::PIO1_IRQ_0);
        pac::NVIC::unmask(pac::Interrupt::DMA_IRQ_0);
        pac::NVIC::unmask(pac::Interrupt::IO_IRQ_BANK0);
        pac::NVIC::unmask(pac::Interrupt::TIMER_IRQ_0);
    }
}

const fn number(digits: &str) -> u32 {
    let (bytes, mut number, mut at) = (digits.as_bytes(), 0, 0);
    while at < bytes.len() {
        number = number * 10 + (bytes[at] - b'0') as u32;
        at += 1;
    }
    number
}

fn welcome(by_watchdog: u8) -> Welcome {
    Welcome {
        firmware: const { number(env!("ANNULUS_SOURCES")) },
        clock_hz: TICK_HZ * CYCLES_PER_TICK,
        window: annulus_link::receiver::WINDOW as u8,
        axes: AXES as u8,
        step_pin: board::STEP,
        direction_pin: board::DIRECTION,
        max_rate_hz: 500_000,
        by_watchdog,
        ..Welcome::default()
    }
}

fn name_pins(welcome: &mut Welcome) {
    let map = machines::map();
    (welcome.stop_pin, welcome.input_pin, welcome.output_pin) = (map.stop, map.input(), map.output);
}

/// Everything off, then the chip's boot ROM, which accepts new firmware as a USB disk.
fn boot() -> ! {
    cortex_m::interrupt::disable();
    machines::stop_by_force();
    // Never returns.
    rp2040_hal::rom_data::reset_to_usb_boot(0, 0)
}

fn run(mut adapter: Adapter<'static>, mut usb: Usb, watchdog: &Watchdog) -> ! {
    let (mut motion, mut alive) = (Motion::Rest, 0);
    name_pins(adapter.welcome_mut());
    loop {
        let now = board::micros();
        usb.turn(&mut adapter, now);
        adapter.obey_next();
        while let Some(order) = adapter.order() {
            obey(&mut adapter, order, &mut motion);
        }
        go_on(&mut adapter, &mut motion);
        // Not between two holes either.
        if usb.wants_boot() && matches!(motion, Motion::Rest) && !adapter.is_attended(now) {
            boot();
        }
        adapter.attend(inputs(&adapter), now);
        if adapter.asks_touches() {
            adapter.touched(touches::counted());
        }
        show(&adapter);
        if now.wrapping_sub(alive) >= 500 {
            alive = now;
            if machines::is_wired() && !machines::is_stopped() {
                board::toggle(machines::map().alive);
            }
        }
        watchdog.feed();
    }
}
