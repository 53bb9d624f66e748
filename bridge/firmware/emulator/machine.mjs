// An RP2040 with our firmware in it, true to the cycle: rp2040js with what it leaves out.
//
//   mended here: state machines go by the clock of the processor; a machine that is off does nothing; joined queues hold 8 words
//   and are emptied by joining; a pad is read back by its own input; USB packets wait until there is room, none is lost;
//   an aborted channel is aborted at once; what the boot memory does; the watchdog resets; pads are read from the reset on.
//   left out as there: caches and waits of the flash, time of DMA transfers, clock dividers, the second processor.
//
// Comes in: an ELF file, bytes, levels of pins. Goes out: bytes, edges with their cycle. Does not know the link.
import fs from 'node:fs';
import { RP2040, USBCDC } from 'rp2040js';

const [SET_LINE_CODING, TO_INTERFACE] = [0x20, 0x21]; // of USB CDC

export const CLOCK_HZ = 120e6;
const NANOS = 1e9 / CLOCK_HZ;
const FLASH = 0x10000000;
const RAM = 0x20000000;
const STACK_FROM = 0x40000; // it grows down from the end of the memory
const STACK_MARK = 0xa5; // what the stack has not touched
const FREE = 4096; // so many bytes that nobody touched are what is left of it
const SECOND_STAGE = RAM + 0x41f00;
const PACKET_MICROS = 53; // 19 packets of 64 bytes in a millisecond
const RUN = [19, 28]; // the pins that the watching machine drives and the others read, by the map
const PAD = 0x56; // what a pad is after a reset: read, with a resistor down
const STEADY = 1000; // cycles after which the watching machine goes round in the same circle
const CIRCLE = 5; // cycles of that circle; the dead end has 1

/** What of an ELF file is loaded, and where. */
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

/** Where the function whose name has `part` in it begins; null where there is none. */
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

/** The check of the second stage, as the boot memory of the chip makes it: CRC-32, highest bit first, not turned over. */
function bootCheck(bytes) {
  let crc = 0xffffffff;
  for (const byte of bytes) {
    crc ^= byte << 24;
    for (let bit = 0; bit < 8; bit++) crc = (crc << 1) ^ (crc < 0 ? 0x04c11db7 : 0);
  }
  return crc >>> 0;
}

const CHAN_ABORT = 0x444;
const LOOK_UP = 0x200; // the boot memory's function that finds others, and the only one that there is here
const BOOT_MODE = 0x220;

class Reset extends Error {}

/** A computer at the other end of the cable, which keeps what finds no room. */
class Host extends USBCDC {
  constructor(chip) {
    super(chip.usbCtrl);
    this.waiting = [];
    this.rooms = {};
    this.plugged = true;
    this.sent = 0;
    chip.usbCtrl.readDelayMicroseconds = PACKET_MICROS;
    chip.usbCtrl.onEndpointRead = (endpoint, size) => {
      // The firmware gives room before the host knows which endpoint is the right one.
      this.rooms[endpoint] = size;
      this.pump();
    };
  }
  put(bytes) {
    for (const byte of bytes) this.waiting.push(byte);
    this.pump();
  }
  /** Somebody opens the port at so many bits a second and lets go of it. */
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
  /** `busy` is where the function begins whose cycles are counted; every instruction takes `slow` times as long as the chip's. */
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
    // ldr r0, [pc]; bx lr; and the function that it finds: b .
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
        // An instruction from outside may have changed pins.
        block.checkChangedPins();
      };
    }
    // Whatever touches the watching machine finds it where it is.
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
        // Nobody drives it any more: it is what somebody outside says.
        if (value > 1 && RUN.includes(index)) pin.setInputValue(this.levels.get(index) ?? false);
        if (value > 1) return;
        if (before !== value) this.edges.push(this.cycle, (index << 1) | value);
        before = value;
        // Of those that change while the program runs only RUN is read by anybody.
        if (RUN.includes(index)) pin.setInputValue(value === 1);
      });
    });
  }

  /** A level at a pin from outside. */
  pin(pin, level) {
    this.settle();
    this.exact = STEADY;
    this.levels.set(pin, level);
    this.chip.gpio[pin].setInputValue(level);
  }

  /** The watching machine takes the cycles that it owes: whole circles are left out. */
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
        // `jmp x--` to itself without a delay: so many cycles and nothing else.
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

  /** The state machines take `cycles` cycles. */
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

  /** Goes on for so many cycles, or until `done`, or until a reset. */
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

  /** How many bytes of stack were needed at most since the reset. */
  get stack() {
    let free = 0;
    for (let at = STACK_FROM; at-- > 0; ) {
      free = this.chip.sram[at] === STACK_MARK ? free + 1 : 0;
      if (free === FREE) return STACK_FROM - at - FREE;
    }
    return STACK_FROM;
  }

  /** Whether the chip's own boot program has it. */
  get inBootMode() { return this.chip.core.PC === BOOT_MODE; }

  /** The program hangs: the processor goes round in one instruction, interrupts still come. */
  hang() {
    const free = RAM + 0x41e00;
    this.chip.writeUint32(free, 0xe7fee7fe);
    this.chip.core.PC = free;
  }
}
