// Runs the firmware of the USB step adapter in an emulated RP2040, with a carriage and switches driven by its
// pins. At the chip's own clock it is nine times slower than real time, seventeen times next to a page.

import { spawn } from "node:child_process";
import { existsSync, mkdtempSync, readFileSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { createInterface } from "node:readline";
import { root } from "./harness.mjs";

const [STEP, DIRECTION, STOP, INPUT, SPINDLE] = [2, 6, 10, 11, 20]; // pins
const CLOCK_HZ = 120_000_000;
/** Factor by which the emulated processor is slower than the chip's, to save time on this computer. Timing
 *  and load of the firmware are tested elsewhere, at full speed. With a factor of 8 the firmware can't keep
 *  its pin timing, and reports that. */
const SLOW = 3;
const TURN = 60_000; // cycles: half a millisecond
/** Start position of the carriage in steps from its switches: X and Y next to them, Z below. */
const START = [90, 70, -120];

/** The built firmware; null if there is none (an error with ANNULUS_NOTHING_SKIPPED). */
export function firmware() {
  const built = process.env.ANNULUS_FIRMWARE ?? join(root, "target/firmware/thumbv6m-none-eabi/release/annulus-firmware");
  if (existsSync(built) && existsSync(join(root, "bridge/firmware/emulator/node_modules"))) return built;
  if (process.env.ANNULUS_NOTHING_SKIPPED) throw new Error(`no firmware at ${built}: cargo xtask test adapter builds it`);
  return null;
}

/** The firmware with another build number, as if built from other sources. */
export function renumbered(built) {
  const bytes = readFileSync(built);
  const own = Number(/Annulus step adapter, sources (\d+)/.exec(bytes.toString("latin1"))[1]);
  const [found, other] = [Buffer.alloc(4), Buffer.alloc(4)];
  found.writeUInt32LE(own);
  other.writeUInt32LE((own ^ 1) >>> 0);
  let count = 0;
  for (let at = bytes.indexOf(found); at >= 0; at = bytes.indexOf(found, at + 4), count++) other.copy(bytes, at);
  if (!count) throw new Error(`the number ${own} is nowhere in ${built}`);
  const file = join(mkdtempSync(join(tmpdir(), "annulus-")), "other-firmware");
  writeFileSync(file, bytes);
  return file;
}

/** Starts an adapter with its machine. */
export async function startAdapter(built) {
  const child = spawn("node", [join(root, "bridge/firmware/emulator/serve.mjs"), built, String(SLOW)], { stdio: ["pipe", "pipe", "inherit"] });
  // Ignore write errors after the process was killed.
  child.stdin.on("error", () => {});
  const lines = createInterface({ input: child.stdout })[Symbol.asyncIterator]();
  const order = async (what) => {
    child.stdin.write(`${JSON.stringify(what)}\n`);
    const { value, done } = await lines.next();
    return done ? null : JSON.parse(value);
  };
  await order({ do: "run", cycles: 4_800_000, until: "connected" });
  await order({ do: "pin", pin: STOP, level: true });
  const place = [...START];
  const ways = [false, false, false];
  const [said, came, waiting, passages, touches, depths] = [[], [], [], [], [], []];
  let [plugged, spindle, steps, turns, over] = [true, false, 0, 0, false];
  const tell = () => {
    while (waiting.length && (came.length || !plugged)) waiting.shift()(came.length ? Buffer.concat(came.splice(0)) : null);
  };
  const switches = () => [place[0] <= 0, place[1] <= 0, place[2] >= 0];
  const edge = (pin, level) => {
    if (pin >= DIRECTION && pin < DIRECTION + 3) ways[pin - DIRECTION] = level;
    if (pin === SPINDLE) spindle = level;
    if (pin < STEP || pin >= STEP + 3 || !level) return;
    const axis = pin - STEP;
    place[axis] += ways[axis] ? 1 : -1;
    steps++;
    if (axis !== 2) return;
    passages.push([...place, ways[axis], spindle]);
    for (const { told } of depths.filter(({ z }) => place[axis] <= z)) told();
  };
  const live = async () => {
    let on = [false, false, false];
    while (!over) {
      const now = switches();
      for (const [input, level] of now.entries()) {
        if (on[input] !== level) await order({ do: "pin", pin: INPUT + 2 * input, level });
      }
      on = now;
      for (const [input, micros] of touches.splice(0)) {
        for (const [level, cycles] of [[true, (micros * CLOCK_HZ) / 1e6], [false, TURN]]) {
          await order({ do: "pin", pin: INPUT + input, level });
          await order({ do: "run", cycles });
        }
      }
      const bytes = said.splice(0).flatMap((part) => [...part]);
      if (plugged && bytes.length) await order({ do: "send", bytes });
      const answer = await order({ do: "run", cycles: TURN });
      if (!answer) return;
      turns++;
      for (let at = 0; at < answer.edges.length; at += 2) edge(answer.edges[at + 1] >> 1, (answer.edges[at + 1] & 1) === 1);
      if (plugged && answer.bytes.length) came.push(Buffer.from(answer.bytes));
      tell();
    }
  };
  live();
  return {
    usb: { usbVendorId: 0x1209, usbProductId: 0x0001 },
    plugged: () => plugged,
    port: () => ({
      read: () => new Promise((told) => (waiting.push(told), tell())),
      write: (bytes) => said.push(bytes),
      close: () => {
        came.length = 0;
        while (waiting.length) waiting.shift()(null);
      },
    }),
    /** Pulls the cable, or plugs it in again. */
    replug: () => {
      plugged = !plugged;
      said.length = came.length = 0;
      tell();
    },
    /** Waits until this many seconds of the adapter's time have passed. */
    passed: async (seconds) => {
      const end = turns + (seconds * CLOCK_HZ) / TURN;
      while (turns < end && !over) await new Promise((later) => setTimeout(later, 20));
    },
    /** Waits until Z is at or below `z` steps. */
    below: (z) => new Promise((told) => depths.push({ z, told })),
    /** Activates an input for this many µs. */
    touch: (input, micros) => touches.push([input, micros]),
    place: () => [...place],
    spindle: () => spindle,
    steps: () => steps,
    /** All XY positions where Z went below `bottom`, in order, and whether the spindle was on during the
     *  whole plunge. The retract can be with the spindle off, if the host was lost while the tool was in the
     *  board. */
    holes: (bottom) => {
      const found = [];
      let inside = false;
      for (const [x, y, z, up, turns] of passages) {
        if (z <= bottom && !inside) found.push({ at: [x, y], turned: true });
        inside = z <= bottom;
        if (inside && !up) found.at(-1).turned &&= turns;
      }
      return found;
    },
    kill: () => {
      over = true;
      child.kill("SIGKILL");
    },
  };
}
