// A cycle-accurate emulation of an RP2040 with our firmware, based on rp2040js.
//
// Added to rp2040js: state machines run by the clock of the processor; a disabled machine does nothing; joined
// queues hold 8 words and joining empties them; an input reads back its own pad; USB packets wait for room, and
// none is lost; a channel is aborted at once; the boot ROM's functions; the watchdog resets; pads are readable
// from the reset on.
// Missing, as in rp2040js: caches and wait states of the flash, duration of DMA transfers, clock dividers, the
// second processor.
import fs from 'node:fs';
import { RP2040, USBCDC } from 'rp2040js';

const [SET_LINE_CODING, TO_INTERFACE] = [0x20, 0x21]; // of USB CDC

export const CLOCK_HZ = 120e6;
const NANOS = 1e9 / CLOCK_HZ;
const FLASH = 0x10000000;
const RAM = 0x20000000;
const STACK_FROM = 0x40000; // grows down from the end of the memory
const STACK_MARK = 0xa5; // fills the memory that the stack has not used
const FREE = 4096; // this many unused bytes in a row are the free end of the stack
const SECOND_STAGE = RAM + 0x41f00;
const PACKET_MICROS = 53; // 19 packets of 64 bytes in a millisecond
const RUN = [19, 28]; // pins that the watcher drives and the other machines read, for each map
const PAD = 0x56; // state of a pad after a reset: input, with a pull-down
const STEADY = 1000; // cycles after which the watcher repeats the same loop
const CIRCLE = 5; // cycles of that loop; the dead end has 1

/** The parts of an ELF file that are loaded, with their addresses. */
export function image(path) {
  const file = fs.readFileSync(path);
  const [at, size, count] = [file.readUInt32LE(28), file.readUInt16LE(42), file.readUInt16LE(44)];
  const parts = [];
  for (let index = 0; index < count; index++) {
    const head = at + index * size;
    const [kind, from, , to, length] = [0, 4, 8, 12, 16].map((field) => file.readUInt32LE(head + field));
    if (kind === 1 && length > 0) parts.push({ to, bytes: file.subarray(from, from + length) });
  }
  return parts;
}

/** Address of the function whose name contains `part`, or null. */
export function symbol(path, part) {
  const file = fs.readFileSync(path);
  const [at, size, count] = [file.readUInt32LE(32), file.readUInt16LE(46), file.readUInt16LE(48)];
  const section = (index) => [4, 16, 20, 24].map((field) => file.readUInt32LE(at + index * size + field));
  for (let index = 0; index < count; index++) {
    const [kind, from, length, names] = section(index);
    if (kind !== 2) continue;
    const [, text] = section(names);
    for (let entry = from; entry < from + length; entry += 16) {
      const name = text + file.readUInt32LE(entry);
      if (file.toString('latin1', name, file.indexOf(0, name)).includes(part)) return file.readUInt32LE(entry + 4) & ~1;
    }
  }
  return null;
}

/** Checksum of the second boot stage as in the boot ROM: CRC-32, most significant bit first, not inverted. */
function bootCheck(bytes) {
  let crc = 0xffffffff;
  for (const byte of bytes) {
    crc ^= byte << 24;
    for (let bit = 0; bit < 8; bit++) crc = (crc << 1) ^ (crc < 0 ? 0x04c11db7 : 0);
  }
  return crc >>> 0;
}

const CHAN_ABORT = 0x444;
const LOOK_UP = 0x200; // the boot ROM's function that looks up others; here it finds only one
const BOOT_MODE = 0x220;

class Reset extends Error {}

/** The host at the other end of the cable. Bytes wait until the firmware has room. */
class Host extends USBCDC {
  constructor(chip) {
    super(chip.usbCtrl);
    this.waiting = [];
    this.rooms = {};
    this.plugged = true;
    this.sent = 0;
    chip.usbCtrl.readDelayMicroseconds = PACKET_MICROS;
    chip.usbCtrl.onEndpointRead = (endpoint, size) => {
      // The firmware offers room before the host knows the endpoint.
      this.rooms[endpoint] = size;
      this.pump();
    };
  }
  put(bytes) {
    for (const byte of bytes) this.waiting.push(byte);
    this.pump();
  }
  /** Opens the port at this bit rate and releases it. */
  touch(bitsPerS) {
    const coding = new Uint8Array(7);
    new DataView(coding.buffer).setUint32(0, bitsPerS, true);
    coding[6] = 8;
    const { usb } = this;
    const before = usb.onEndpointRead;
    usb.onEndpointRead = (endpoint, size) => {
      if (endpoint !== 0) return before(endpoint, size);
      usb.onEndpointRead = before;
      usb.endpointReadDone(0, coding);
      this.lets = true;
    };
    usb.sendSetupPacket(Uint8Array.of(TO_INTERFACE, SET_LINE_CODING, 0, 0, 0, 0, coding.length, 0));
  }
  letGo() {
    if (this.lets) this.cdcSetControlLineState(0);
    this.lets = false;
  }
  pump() {
    const room = this.rooms[this.outEndpoint];
    if (!this.initialized || !this.plugged || !room || this.waiting.length === 0) return;
    this.rooms[this.outEndpoint] = 0;
    const packet = this.waiting.splice(0, room);
    this.sent += packet.length;
    this.usb.endpointReadDone(this.outEndpoint, Uint8Array.from(packet));
  }
}

export class Machine {
  /** `busy` is the address of a function whose cycles are counted; every instruction takes `slow` times its normal duration. */
  constructor(parts, busy = null, slow = 1) {
    this.parts = parts;
    this.slow = slow;
    Object.assign(this, { busy, busyCycles: 0, busySince: null, busyReturn: 0 });
    this.levels = new Map();
    this.resets = 0;
    this.boot();
  }

  boot() {
    const chip = new RP2040();
    this.chip = chip;
    const silent = () => {};
    chip.logger = { debug: silent, info: silent, warn: silent, error: silent };
    chip.onBreak = () => {};
    chip.sram.fill(STACK_MARK, 0, STACK_FROM);
    for (const { to, bytes } of this.parts) chip.flash.set(bytes, to - FLASH);
    if (bootCheck(chip.flash.subarray(0, 252)) !== chip.flashView.getUint32(252, true)) {
      throw new Error('The check of the second stage is wrong: a real chip would not start.');
    }
    chip.sram.set(chip.flash.subarray(0, 256), SECOND_STAGE - RAM);
    // The look-up, `ldr r0, [pc]; bx lr`, and the function that it finds, `b .`
    [[0x14, 0x0100], [0x18, LOOK_UP | 1], [LOOK_UP, 0x47704800], [LOOK_UP + 4, BOOT_MODE | 1], [BOOT_MODE, 0xe7fee7fe]]
      .forEach(([at, word]) => { chip.bootrom[at / 4] = word; });
    Object.assign(chip.core, { SP: SECOND_STAGE, LR: 0, PC: SECOND_STAGE });
    const watchdog = chip.peripherals[0x40058];
    watchdog.onWatchdogTrigger = () => { throw new Reset(); };
    if (this.resets > 0) watchdog.reason = 1;
    this.cycle = 0;
    this.owed = 0;
    this.exact = STEADY;
    this.edges = [];
    this.bytes = [];
    this.connected = false;
    for (const block of chip.pio) this.mendBlock(block);
    this.mendPins(chip);
    const { readUint32: read } = chip.dma;
    chip.dma.readUint32 = (offset) => (offset === CHAN_ABORT ? 0 : read.call(chip.dma, offset));
    this.host = new Host(chip);
    this.host.onSerialData = (bytes) => this.bytes.push(...bytes);
    this.host.onDeviceConnected = () => { this.connected = true; };
    for (const [pin, level] of this.levels) chip.gpio[pin].setInputValue(level);
  }

  mendBlock(block) {
    block.run = () => {};
    for (const machine of block.machines) {
      Object.assign(machine, { idle: 0, stalled: false });
      const write = machine.writeUint32.bind(machine);
      const FIFO = machine.txFIFO.constructor;
      machine.writeUint32 = (offset, value) => {
        const joined = machine.shiftCtrl & (1 << 30);
        write(offset, value);
        if ((machine.shiftCtrl & (1 << 30)) !== joined) {
          machine.txFIFO = new FIFO(joined ? 4 : 8);
          machine.updateDMATx();
        }
        // An instruction written by the processor may have changed pins.
        block.checkChangedPins();
      };
    }
    // Every access to the watcher must see its current state.
    if (block === this.chip.pio[1]) this.settleBefore(block);
  }

  settleBefore(part) {
    const { readUint32: read, writeUint32: write } = part;
    part.readUint32 = (offset) => { this.settle(); return read.call(part, offset); };
    part.writeUint32 = (offset, value) => {
      this.settle();
      this.exact = STEADY;
      write.call(part, offset, value);
    };
  }

  mendPins(chip) {
    const pins = chip.peripherals[0x40014];
    const { writeUint32: write } = pins;
    pins.writeUint32 = (offset, value) => {
      this.settle();
      this.exact = STEADY;
      write.call(pins, offset, value);
    };
    chip.gpio.forEach((pin, index) => {
      pin.padValue = PAD;
      let before = pin.value;
      pin.addListener((value) => {
        // The pin is no longer driven: its level is the external one.
        if (value > 1 && RUN.includes(index)) pin.setInputValue(this.levels.get(index) ?? false);
        if (value > 1) return;
        if (before !== value) this.edges.push(this.cycle, (index << 1) | value);
        before = value;
        // Among the pins that change at run time, only RUN is read by a machine.
        if (RUN.includes(index)) pin.setInputValue(value === 1);
      });
    });
  }

  /** Sets the external level of a pin. */
  pin(pin, level) {
    this.settle();
    this.exact = STEADY;
    this.levels.set(pin, level);
    this.chip.gpio[pin].setInputValue(level);
  }

  /** Runs the watcher's outstanding cycles. Whole loops are skipped because they change nothing. */
  settle() {
    if (this.owed === 0) return;
    const left = this.owed % CIRCLE;
    this.owed = 0;
    for (let n = 0; n < left; n++) this.tick(this.chip.pio[1]);
  }

  /** One cycle of a block of state machines. */
  tick(block) {
    let ran = false;
    for (const machine of block.machines) {
      if (!machine.enabled) {
        Object.assign(machine, { idle: 0, stalled: false });
      } else if (machine.idle > 0) {
        machine.idle--;
      } else if (machine.stalled || machine.waiting) {
        if (machine.waiting) machine.checkWait();
        machine.stalled = machine.waiting;
        if (!machine.waiting) machine.idle = Math.max(0, machine.waitDelay);
      } else {
        const opcode = block.instructions[machine.pc];
        // `jmp x--` to itself without a delay only takes x cycles.
        if (opcode >>> 5 === 2 && (opcode & 0x1f) === machine.pc && machine.x > 0) {
          machine.idle = machine.x - 1;
          machine.x = 0;
          continue;
        }
        const before = machine.cycles;
        machine.step();
        ran = true;
        if (machine.waiting) machine.stalled = true;
        else machine.idle = machine.cycles - before - 1;
      }
    }
    if (ran) block.checkChangedPins();
  }

  /** Runs the state machines for `cycles` cycles. */
  pass(cycles) {
    const [pulses, watch] = this.chip.pio;
    const end = this.cycle + cycles;
    if (this.exact > 0 && !watch.stopped) {
      const start = this.cycle;
      for (; this.cycle < end; this.cycle++) this.tick(watch);
      this.exact = Math.max(0, this.exact - cycles);
      this.cycle = start;
    } else if (!watch.stopped) {
      this.owed += cycles;
    }
    while (this.cycle < end && !pulses.stopped) {
      let free = end - this.cycle;
      for (const machine of pulses.machines) {
        if (machine.enabled) free = Math.min(free, machine.stalled || machine.waiting ? 0 : machine.idle);
      }
      if (free > 0) {
        for (const machine of pulses.machines) if (machine.enabled) machine.idle -= free;
        this.cycle += free;
      } else {
        this.tick(pulses);
        this.cycle++;
      }
    }
    this.cycle = end;
  }

  /** Runs for `cycles` cycles, or until `done`, or until a reset. Returns the cycle of the reset, or null. */
  run(cycles, done) {
    const { core, clock } = this.chip;
    const end = this.cycle + cycles;
    let count = 0;
    while (this.cycle < end) {
      if (core.PC === this.busy) Object.assign(this, { busySince: this.cycle, busyReturn: core.LR & ~1 });
      else if (this.busySince !== null && core.PC === this.busyReturn) {
        this.busyCycles += this.cycle - this.busySince;
        this.busySince = null;
      }
      const taken = core.waiting ? Math.max(1, Math.min(64, Math.ceil(clock.nanosToNextAlarm / NANOS) || 64)) : core.executeInstruction() * this.slow;
      this.pass(taken);
      try {
        clock.tick(taken * NANOS);
      } catch (reset) {
        if (!(reset instanceof Reset)) throw reset;
        const at = this.cycle;
        this.resets++;
        this.boot();
        return at;
      }
      if (done && (++count & 31) === 0 && done()) break;
    }
    return null;
  }

  /** Maximum stack usage since the reset, in bytes. */
  get stack() {
    let free = 0;
    for (let at = STACK_FROM; at-- > 0; ) {
      free = this.chip.sram[at] === STACK_MARK ? free + 1 : 0;
      if (free === FREE) return STACK_FROM - at - FREE;
    }
    return STACK_FROM;
  }

  /** True if the chip is in its boot program. */
  get inBootMode() { return this.chip.core.PC === BOOT_MODE; }

  /** Makes the program hang: the processor loops in one instruction, but interrupts are still served. */
  hang() {
    const free = RAM + 0x41e00;
    this.chip.writeUint32(free, 0xe7fee7fe);
    this.chip.core.PC = free;
  }
}
