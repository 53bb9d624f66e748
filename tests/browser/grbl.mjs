// Runs the unmodified GRBL firmware on a simulated board, and gives pages a fake `navigator.serial` whose
// port is connected to it. Only the browser API is faked, not the firmware.

import { spawn, spawnSync } from "node:child_process";
import { existsSync, mkdirSync, mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { root, until } from "./harness.mjs";

/** Steps per millimetre of every axis. Positions range from minus the travel, in mm, to 0. */
export const STEPS = 250;
const TRAVEL = 200;

/** A machine with homing, of moderate speed. */
const SETTINGS = [
  [22, 1],
  [20, 1],
  [24, 600],
  [25, 5000],
  [26, 25],
  [27, 1],
  [30, 30000],
  ...[0, 1, 2].flatMap((axis) => [
    [100 + axis, STEPS],
    [110 + axis, 5000],
    [120 + axis, 500],
    [130 + axis, TRAVEL],
  ]),
];

/** The built simulator; null if this computer doesn't have it (an error with ANNULUS_NOTHING_SKIPPED). */
export function instrument() {
  const folder = process.env.ANNULUS_GRBL ?? resolve(root, "../shared/instruments/grbl");
  const built = join(root, "target/tmp/grbl-pty-browser");
  mkdirSync(join(root, "target/tmp"), { recursive: true });
  const flags = ["-std=gnu11", "-O2", "-w", "-I/usr/include/simavr", `-I${folder}`, "-o", built, join(root, "tests/data/instruments/grbl-pty-eeprom.c")];
  const made = existsSync(join(folder, "grbl-pty.c")) && spawnSync("cc", [...flags, "-lsimavr", "-lelf", "-lm"]).status === 0;
  if (made) return { simulator: built, firmware: join(folder, "grbl-1.1h.elf") };
  if (process.env.ANNULUS_NOTHING_SKIPPED) throw new Error(`GRBL cannot be built from ${folder}`);
  return null;
}

/** Opens a port: bytes in and out through two processes, which hold it as a driver would. */
function openPort(path) {
  const script = 'exec 3<>"$1"; stty raw -echo <&3; cat <&3 & exec cat >&3';
  const child = spawn("sh", ["-c", script, "sh", path], { detached: true, stdio: ["pipe", "pipe", "ignore"] });
  const [came, waiting] = [[], []];
  let ended = false;
  const next = () => (came.length ? Buffer.concat(came.splice(0)) : null);
  const tell = () => {
    while (waiting.length && (came.length || ended)) waiting.shift()(next());
  };
  child.stdout.on("data", (bytes) => (came.push(bytes), tell()));
  child.stdout.on("end", () => ((ended = true), tell()));
  child.stdin.on("error", () => {});
  return {
    /** The bytes since the last call; null once the port is gone. */
    read: () => new Promise((told) => (waiting.push(told), tell())),
    write: (bytes) => child.stdin.write(Buffer.from(bytes)),
    close: () => {
      try {
        process.kill(-child.pid, "SIGKILL");
      } catch {
        // The process had already ended.
      }
    },
  };
}

/** Starts a board. `speed` is relative to real time; `surface` is what the probe meets, in the simulator's format. */
export async function startBoard(tools, speed, surface) {
  const folder = mkdtempSync(join(tmpdir(), "annulus-board-"));
  const at = (name) => join(folder, name);
  const launch = async (...more) => {
    const options = ["--link", at("port"), "--json", at("report"), "--edges", at("edges"), "--eeprom", at("eeprom")];
    const fixed = ["--max-seconds", "600", "--boot-ms", "200", "--steps", String(STEPS), "--travel", String(TRAVEL)];
    const child = spawn(tools.simulator, [...options, ...fixed, ...more, tools.firmware], { stdio: ["ignore", "pipe", "ignore"] });
    const ended = new Promise((done) => child.on("exit", done));
    await new Promise((started) => child.stdout.once("data", started));
    return { child, ended };
  };
  const first = await launch("--speed", "0", "--fast-eeprom");
  const port = openPort(at("port"));
  const hears = async (wanted) => {
    for (let heard = ""; !heard.includes(wanted); ) {
      const bytes = await port.read();
      if (!bytes) throw new Error(`the board is gone: ${heard}`);
      heard += bytes;
    }
  };
  await hears("help]");
  for (const [number, value] of SETTINGS) {
    port.write(`$${number}=${value}\n`);
    await hears("ok");
  }
  port.close();
  first.child.kill("SIGTERM");
  await first.ended;
  rmSync(at("edges"), { force: true });
  rmSync(at("report"), { force: true });
  const { child, ended } = await launch("--speed", String(speed), ...(surface ? ["--probe-z", surface] : []));
  const reports = () => (existsSync(at("report")) ? readFileSync(at("report"), "utf8").split("\n").filter(Boolean) : []);
  return {
    path: at("port"),
    port: () => openPort(at("port")),
    plugged: () => existsSync(at("port")),
    /** Pulls the cable, or plugs it in again. */
    replug: async () => {
      const before = existsSync(at("port"));
      child.kill("SIGUSR2");
      await until(() => existsSync(at("port")) !== before, "the cable");
    },
    /** Net steps of X, Y, Z since power-on, from the pins. */
    steps: async () => {
      const before = reports().length;
      child.kill("SIGUSR1");
      await until(() => reports().length > before, "a report of the board");
      return JSON.parse(reports().at(-1)).steps;
    },
    /** Turns the board off. Returns all XY positions where Z was below the surface, in order, each with the
     *  lowest Z, in steps. */
    end: async (surface) => {
      child.kill("SIGTERM");
      await ended;
      const now = [0, 0, 0];
      const dips = [];
      let dip = null;
      for (const line of readFileSync(at("edges"), "utf8").split("\n").filter(Boolean)) {
        const [, axis, to] = line.split(" ");
        now[Number.isNaN(Number(axis)) ? "XYZ".indexOf(axis) : Number(axis)] = Number(to);
        if (now[2] >= surface) dip = null;
        else if (!dip) dips.push((dip = { at: [now[0], now[1]], lowest: now[2], moved: false }));
        else {
          dip.lowest = Math.min(dip.lowest, now[2]);
          dip.moved ||= now[0] !== dip.at[0] || now[1] !== dip.at[1];
        }
      }
      rmSync(folder, { recursive: true, force: true });
      return dips;
    },
    /** Turns the board off; its recording remains readable. */
    off: async () => {
      child.kill("SIGTERM");
      await ended;
    },
    /** After `off`: the board's time in s of every step of an axis, and the position then, in steps. */
    moves: (axis) => {
      const edges = readFileSync(at("edges"), "utf8").split("\n").filter(Boolean).map((line) => line.split(" "));
      return edges.filter(([, own]) => own === axis || own === String("XYZ".indexOf(axis))).map(([cycle, , to]) => [Number(cycle) / 16e6, Number(to)]);
    },
    kill: () => child.kill("SIGKILL"),
  };
}

/** USB id of the serial chip on many boards. */
const CH340 = { usbVendorId: 0x1a86, usbProductId: 0x7523 };

/** Gives the pages of `context` a `navigator.serial` with this board at its port. Returns the number of
 *  openings and the received bytes. In the page, `navigator.serial` has extra functions: `disturb(name)` acts
 *  like a line error, `anew()` creates a new object for the port, as after a replug, and `strange(info)` adds
 *  another port. */
export async function plugInto(context, board) {
  let port = null;
  const told = { opens: 0, heard: [] };
  const close = () => (port?.close(), (port = null));
  await context.exposeFunction("boardOpens", () => {
    if (!board.plugged()) return false;
    close();
    told.opens += 1;
    port = board.port();
    return true;
  });
  await context.exposeFunction("boardPlugged", () => board.plugged());
  await context.exposeFunction("boardReads", async () => {
    const bytes = await port?.read();
    return bytes ? [...bytes] : null;
  });
  await context.exposeFunction("boardHears", (bytes) => {
    told.heard.push(...bytes);
    port?.write(bytes);
  });
  await context.exposeFunction("boardCloses", close);
  await context.addInitScript(standIn, board.usb ?? CH340);
  return told;
}

/** Runs in the page. */
function standIn(usb) {
  const lost = () => new DOMException("The device has been lost.", "NetworkError");
  // Pending bytes belong to the reader at their arrival, so that an error loses none.
  let waiting = null;
  const next = () => {
    if (waiting) return waiting;
    const own = globalThis.boardReads().finally(() => {
      if (waiting === own) waiting = null;
    });
    return (waiting = own);
  };
  /** The error for the first read of the port that is opened next. */
  let early = null;
  const make = (info) => {
    let from = null;
    const stream = () =>
      new ReadableStream(
        {
          start: (to) => void (from = to),
          async pull(to) {
            if (early) return port.disturb(early);
            const bytes = await next();
            if (from !== to) return;
            if (bytes) return to.enqueue(Uint8Array.from(bytes));
            port.readable = null;
            to.error(lost());
          },
          cancel: () => globalThis.boardCloses(),
        },
        { highWaterMark: 0 },
      );
    const port = {
      readable: null,
      writable: null,
      getInfo: () => info,
      async open({ baudRate }) {
        if (port.readable) throw new DOMException("The port is already open.", "InvalidStateError");
        if (!Number.isInteger(baudRate) || !(await globalThis.boardOpens())) {
          throw new DOMException("Failed to open serial port.", "NetworkError");
        }
        waiting = null;
        port.readable = stream();
        port.writable = new WritableStream({ write: (bytes) => globalThis.boardHears([...bytes]) });
      },
      async close() {
        if (port.readable?.locked || port.writable?.locked) throw new TypeError("a stream of the port is locked");
        await globalThis.boardCloses();
        port.readable = port.writable = null;
      },
      /** Ends the stream with this error; there is a new one, as the Web Serial specification requires. */
      disturb(name) {
        const before = from;
        early = null;
        port.readable = stream();
        before.error(new DOMException("The line was disturbed.", name));
      },
    };
    return port;
  };
  const granted = () => sessionStorage.getItem("port granted") !== null;
  let ports = [make(usb)];
  const strangers = [];
  const serial = Object.assign(new EventTarget(), {
    async requestPort() {
      if (!navigator.userActivation.isActive) throw new DOMException("Must be handling a user gesture.", "SecurityError");
      sessionStorage.setItem("port granted", "yes");
      return ports[0];
    },
    getPorts: async () => [...strangers, ...(granted() && (await globalThis.boardPlugged()) ? ports : [])],
    disturb: (name) => (ports[0].readable ? ports[0].disturb(name) : (early = name)),
    anew: () => (ports = [make(usb)]),
    /** Adds another port that this site may use; counts its openings. */
    strange(info) {
      const open = async () => {
        serial.strange_opens += 1;
        throw new DOMException("Failed to open serial port.", "NetworkError");
      };
      strangers.push({ readable: null, writable: null, getInfo: () => info, open, close: async () => {} });
    },
    strange_opens: 0,
  });
  Object.defineProperty(navigator, "serial", { value: serial, configurable: true });
}
