// The emulated adapter as a servant of the tests: one order a line, one answer a line.
//
//   node serve.mjs FIRMWARE.elf [SLOW]            of a processor that is so many times as slow, pins and time as ever: 1
//   {"do": "run", "cycles": n}                    goes on; with "until": "connected" or "bytes" ends when that is so
//   {"do": "send", "bytes": [...]}                bytes into the cable
//   {"do": "pin", "pin": n, "level": true}        a level from outside
//   {"do": "hang"} {"do": "unplug"} {"do": "peek"}
//   {"do": "stack"}                               the answer has "stack": the most bytes of it that were needed
//   {"do": "touch", "bits": n}                    the port is opened at so many bits a second and let go
//   answer: {"cycle", "bytes", "edges": [cycle, pin * 2 + level, ...], "reset": cycle or null, "connected", "waiting", "boots", "busy"}
import readline from 'node:readline';
import { Machine, image, symbol } from './machine.mjs';

// What is counted is the making of words: all that motion costs the processor.
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
