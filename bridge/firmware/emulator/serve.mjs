// The emulated adapter for the tests: one order per line, one answer per line.
//
//   node serve.mjs FIRMWARE.elf [SLOW]        SLOW slows the processor by this factor, but not pins and time; default 1
//   {"do": "run", "cycles": n}                runs; "until": "connected", "bytes" or "taken" ends the run earlier
//   {"do": "send", "bytes": [...]}            sends bytes into the cable
//   {"do": "pin", "pin": n, "level": true}    sets the external level of a pin
//   {"do": "hang"} {"do": "unplug"} {"do": "peek"}
//   {"do": "stack"}                           adds "stack" to the answer: the maximum stack usage in bytes
//   {"do": "touch", "bits": n}                opens the port at this bit rate and releases it
//   answer: {"cycle", "bytes", "edges": [cycle, pin * 2 + level, ...], "reset": cycle or null, "connected",
//            "waiting", "driven": level per pin or 2, "boots", "busy"}
import readline from 'node:readline';
import { Machine, image, symbol } from './machine.mjs';

// Counts the cycles for making words: the whole processor time of motion.
const machine = new Machine(image(process.argv[2]), symbol(process.argv[2], 'annulus_firmware4make'), Number(process.argv[3] ?? 1));

const orders = {
  run({ cycles, until }) {
    const done = {
      connected: () => machine.connected,
      bytes: () => machine.bytes.length > 0,
      taken: () => machine.host.waiting.length === 0,
    }[until];
    return machine.run(cycles, done);
  },
  send({ bytes }) { machine.host.put(bytes); return null; },
  pin({ pin, level }) { machine.pin(pin, level); return null; },
  hang() { machine.hang(); return null; },
  unplug() { machine.host.plugged = false; machine.host.waiting = []; return null; },
  touch({ bits }) {
    machine.host.touch(bits);
    machine.run(120_000);
    machine.host.letGo();
    return machine.run(120_000);
  },
  peek() { return null; },
  stack() { return null; },
};

for await (const line of readline.createInterface({ input: process.stdin })) {
  const order = JSON.parse(line);
  const reset = orders[order.do](order);
  const { cycle, bytes, edges, connected } = machine;
  const driven = machine.chip.gpio.map((pin) => (pin.outputEnable ? Number(pin.outputValue) : 2));
  process.stdout.write(`${JSON.stringify({ cycle, bytes, edges, reset, connected, waiting: machine.host.waiting.length, driven, boots: machine.inBootMode, busy: machine.busyCycles, stack: order.do === 'stack' ? machine.stack : undefined })}\n`);
  machine.bytes = [];
  machine.edges = [];
}
