// Measures the page's performance budgets in Chromium on the built page: `cargo xtask bench --page`.
//
// Needs ANNULUS_CHROMIUM, ANNULUS_BIN and ANNULUS_SITE (a site with its page in `www` next to it); uses the
// corpus if present. Arguments select groups. Prints a table, `budget | target | fail limit | measured`, with
// the machine and its load. Times are wall-clock; "processor" is the CPU time of the page's process with all
// threads, which a busy machine changes little. Sets no limits, because a busy machine without a graphics
// card isn't representative.

import { spawnSync } from "node:child_process";
import { existsSync, readFileSync, readdirSync } from "node:fs";
import { createServer } from "node:http";
import { cpus, loadavg } from "node:os";
import { dirname, extname, join } from "node:path";
import { brotliCompressSync } from "node:zlib";
import { corpus, drillOnly, openBrowser, planned, program, show, site, startBridge, startJob, tab, until } from "./harness.mjs";

const www = join(dirname(site), "www");
const BOARDS = {
  LimeSDR: ["-RoundHoles.TXT", "-SlotHoles.TXT", ".DRR", ".GTL", ".GTS"].map((end) => `altium/limesdr-qpcie/LimeSDR-QPCIe_1v2${end}`),
  multivibrator: [".drl", "-B.Cu.gbr", "-Edge.Cuts.gbr"].map((end) => `kicad/4.0-multivibrator/multivibrator${end}`),
};

const rows = [["budget", "target", "fail limit", "measured"]];
const row = (budget, target, limit, measured) => {
  rows.push([budget, target, limit, measured]);
  console.error(`  ${budget}: ${measured}`);
};
const ms = (value) => (Number.isFinite(value) ? `${Math.round(value)} ms` : "not seen");
const kB = (bytes) => `${Math.round(bytes / 1000)} kB`;
const at = (values, share) => [...values].sort((a, b) => a - b)[Math.min(values.length - 1, Math.floor(values.length * share))];
const spread = (values) => `median ${ms(at(values, 0.5))}, longest ${ms(Math.max(...values))} of ${values.length}`;

/** Collects measurements inside the page; runs before all other scripts. */
function probe() {
  const seen = { tasks: [], events: [], paints: {}, history: [] };
  globalThis.annulusProbe = seen;
  const observe = (type, take, more = {}) =>
    new PerformanceObserver((list) => list.getEntries().forEach(take)).observe({ type, buffered: true, ...more });
  observe("longtask", ({ startTime, duration }) => seen.tasks.push([startTime, duration]));
  observe("paint", ({ name, startTime }) => (seen.paints[name] = startTime));
  observe("largest-contentful-paint", ({ startTime }) => (seen.paints.largest = startTime));
  const words = (one) => (one === document.body ? "the page" : null) ?? one?.getAttribute?.("aria-label") ?? one?.textContent?.trim().slice(0, 30) ?? "";
  const hear = ({ interactionId, duration, name, target }) =>
    interactionId && seen.events.push([interactionId, duration, `${name} ${words(target)}`]);
  observe("event", hear, { durationThreshold: 16 });
  // Records the visible state with a time whenever it changes.
  let last = "";
  setInterval(() => {
    const button = (name) => [...document.querySelectorAll("button")].find((one) => one.textContent.includes(name));
    // Confirms the import review. Not on Draw, where the button with the same text makes a board each time.
    if (document.querySelector("main")?.dataset.screen !== "draw") button("Use this board")?.click();
    const picture = document.querySelector("canvas")?.dataset ?? {};
    const now = {
      layers: Number(picture.layers ?? 0),
      lines: Number(picture.lines ?? 0),
      ready: Boolean(button("Sample board")),
      busy: Boolean(document.querySelector("main[data-stale], footer progress")),
    };
    const said = JSON.stringify(now);
    if (said !== last) seen.history.push({ ...now, at: performance.timeOrigin + performance.now() });
    last = said;
  }, 4);
}

const browser = await openBrowser();
const session = await browser.newBrowserCDPSession();

/** CPU seconds of each process so far. */
async function taken() {
  const { processInfo } = await session.send("SystemInfo.getProcessInfo");
  return new Map(processInfo.filter(({ type }) => type === "renderer").map(({ id, cpuTime }) => [id, cpuTime]));
}

/** CPU milliseconds since `before` of the busiest page process, and that process. */
async function since(before) {
  const all = [...(await taken())].map(([id, seconds]) => [(seconds - (before.get(id) ?? 0)) * 1000, id]);
  return all.sort((a, b) => b[0] - a[0])[0];
}

/** Private memory of a process, bytes. */
function own(pid) {
  const lines = readFileSync(`/proc/${pid}/smaps_rollup`, "utf8").split("\n").filter((line) => line.startsWith("Private_"));
  return lines.reduce((sum, line) => sum + 1024 * Number(line.match(/\d+/)[0]), 0);
}

/** A page with the probe; its CPU `slow` times slower, its network limited to `net` bits per second. */
async function opened(url, { slow = 1, net = 0 } = {}) {
  const context = await browser.newContext({ viewport: { width: 1440, height: 900 }, reducedMotion: "reduce" });
  context.setDefaultTimeout(240_000);
  await context.addInitScript(probe);
  await context.addInitScript(() => delete window.showOpenFilePicker);
  const page = await context.newPage();
  const cdp = await context.newCDPSession(page);
  const slower = (rate) => cdp.send("Emulation.setCPUThrottlingRate", { rate });
  if (slow > 1) await slower(slow);
  let received = 0;
  await cdp.send("Network.enable");
  cdp.on("Network.loadingFinished", ({ encodedDataLength }) => (received += encodedDataLength));
  const throughput = { downloadThroughput: net / 8, uploadThroughput: net / 8 };
  if (net) await cdp.send("Network.emulateNetworkConditions", { offline: false, latency: 40, ...throughput });
  page.on("filechooser", () => {});
  await page.goto(url);
  const told = () => page.evaluate(() => globalThis.annulusProbe);
  const longest = async (from_ms) => Math.max(0, ...(await told()).tasks.filter(([start]) => start >= from_ms).map(([, took]) => took));
  return { page, context, told, longest, slower, received: () => received, now: () => page.evaluate(() => performance.now()) };
}

/** A static file server with compression. */
async function serve() {
  const kinds = { ".html": "text/html", ".js": "text/javascript", ".wasm": "application/wasm", ".css": "text/css", ".svg": "image/svg+xml" };
  const server = createServer((request, response) => {
    const name = decodeURIComponent(new URL(request.url, "http://x").pathname).slice(1) || "index.html";
    if (name.includes("..") || !existsSync(join(site, name))) return response.writeHead(404).end();
    const packed = join(www, `${name}.br`);
    const same = existsSync(packed) && readFileSync(join(site, name)).equals(readFileSync(join(www, name)));
    const coding = same ? { "content-encoding": "br" } : {};
    response.writeHead(200, { "content-type": kinds[extname(name)] ?? "application/octet-stream", ...coding });
    return response.end(readFileSync(same ? packed : join(site, name)));
  });
  await new Promise((listening) => server.listen(0, "127.0.0.1", listening));
  return { url: `http://127.0.0.1:${server.address().port}/`, stop: () => (server.closeAllConnections(), server.close()) };
}

const bridge = await startBridge({ speed: 20 });

/** A page of the bridge. */
function fresh() {
  const link = spawnSync(program, ["link"], { env: { ...process.env, ANNULUS_HOME: bridge.home }, encoding: "utf8" });
  return opened(link.stdout.match(/http:\/\/\S+/)[0]);
}

/** Opens a board, the sample or one of the corpus, and waits until its plan is proved; returns the visible
 *  states with times. */
async function board({ page, told }, name) {
  const before = await taken();
  let began;
  if (name in BOARDS) {
    const chooser = page.waitForEvent("filechooser");
    await page.getByRole("button", { name: "Open files…" }).click();
    const files = BOARDS[name].map((file) => join(corpus(), file));
    began = Date.now();
    await (await chooser).setFiles(files);
  } else {
    began = Date.now();
    await page.getByRole("button", { name: /Sample board/ }).click();
  }
  await page.getByText(/^Planned .* m,/).waitFor();
  await planned(page);
  const history = (await told()).history.filter((one) => one.at >= began);
  const first = (look) => history.find(look)?.at - began;
  const most = Math.max(...history.map((one) => one.layers));
  const done = history.findLast((one, index) => !one.busy && history[index - 1]?.busy);
  const [processor, pid] = await since(before);
  return { layer: first((one) => one.layers > 0), picture: first((one) => one.layers === most), toolpaths: first((one) => one.lines > 0), all: done?.at - began, processor, pid };
}

/** Moves a playback slider in small and large steps, as by hand; returns the time until the next frame for each. */
const scrubbed = (slider) =>
  slider.evaluate(async (slider) => {
    const canvas = document.querySelector("canvas");
    const shares = [...Array(40).keys()].map((step) => 0.2 + step / 100).concat([0.9, 0.1, 0.7, 0.3, 0.95, 0.05]);
    const took = [];
    for (const share of shares) {
      const [frames, began] = [canvas.dataset.frames, performance.now()];
      slider.value = String(Number(slider.max) * share);
      slider.dispatchEvent(new Event("input", { bubbles: true }));
      while (canvas.dataset.frames === frames && performance.now() - began < 5000) await new Promise((next) => requestAnimationFrame(next));
      took.push(performance.now() - began);
    }
    return took;
  });

/** A drawing of this many things: pads on their nodes. */
function drawing(count) {
  const things = {};
  for (let pad = 0; pad < count / 2; pad += 1) {
    things[2 * pad + 1] = { node: { at: { x: (pad % 100) * 3e6, y: Math.floor(pad / 100) * 3e6 } } };
    things[2 * pad + 2] = { pad: { node: 2 * pad + 1, shape: "circle", size: 1_500_000, layer: "top" } };
  }
  return JSON.stringify({ annulus_drawing: 1, name: "large", things });
}

/** Visits the screens by keys and pointer. */
async function tour(page) {
  const press = async (key, times = 1) => {
    for (let time = 0; time < times; time += 1) {
      await page.keyboard.press(key);
      await page.waitForTimeout(120);
    }
  };
  for (const screen of ["Draw", "Board", "CAM", "Simulate", "Machine", "Lab", "Settings"]) {
    await show(page, screen);
    await press("Tab", 4);
    await page.waitForTimeout(300);
  }
  await tab(page, "CAM").click();
  await page.getByRole("button", { name: /1 Isolate/ }).click();
  await page.getByRole("slider", { name: "Passes" }).focus();
  await press("ArrowRight", 2);
  await press("ArrowLeft", 2);
  for (const box of await page.getByRole("checkbox", { name: /^Do / }).all()) {
    for (const round of [1, 2]) {
      await box.click();
      await page.waitForTimeout(100 * round);
    }
  }
  await planned(page);
  await tab(page, "Simulate").click();
  await page.getByRole("slider", { name: "Time", exact: true }).focus();
  await press("ArrowRight", 6);
  await press("End");
  await press("Home");
  await tab(page, "Board").click();
  const box = await page.locator("canvas").first().boundingBox();
  for (const [x, y] of [[0.3, 0.3], [0.5, 0.5], [0.6, 0.4]]) await page.mouse.click(box.x + box.width * x, box.y + box.height * y);
}

/** Drags the pad in the middle of a `drawing`; returns the time from each move to the next frame. */
async function dragged(page) {
  await page.keyboard.press("v");
  const canvas = page.locator("canvas").first();
  const [box, zoom, centre] = await Promise.all([canvas.boundingBox(), canvas.getAttribute("data-zoom"), canvas.getAttribute("data-centre")]);
  const [from_x, from_y] = centre.split(" ").map((at) => (3 * Math.round(at / 3) - at) * zoom);
  const at = [box.x + box.width / 2 + from_x, box.y + box.height / 2 - from_y];
  await page.mouse.click(...at);
  await page.evaluate(() => {
    const canvas = document.querySelector("canvas");
    globalThis.annulusMoves = [];
    const heard = ({ timeStamp }) => {
      const frames = canvas.dataset.frames;
      const look = () => (canvas.dataset.frames === frames ? requestAnimationFrame(look) : globalThis.annulusMoves.push(performance.now() - timeStamp));
      requestAnimationFrame(look);
    };
    addEventListener("pointermove", heard, true);
  });
  await page.mouse.down();
  for (let step = 1; step <= 40; step += 1) {
    await page.mouse.move(at[0] + 2 * step, at[1] + step);
    await page.waitForTimeout(40);
  }
  await page.mouse.up();
  return page.evaluate(() => globalThis.annulusMoves);
}

const GROUPS = {
  sizes() {
    const packed = (name) => (existsSync(join(www, `${name}.br`)) ? readFileSync(join(www, `${name}.br`)) : brotliCompressSync(readFileSync(join(www, name)))).length;
    const sum = (names) => kB(names.reduce((sum, name) => sum + packed(name), 0));
    const styles = readdirSync(join(www, "style")).filter((name) => name.endsWith(".css"));
    row("HTML, CSS and start script, brotli", "30 kB", "45 kB", sum(["index.html", "boot.js", ...styles.map((name) => `style/${name}`)]));
    row("Page, brotli", "450 kB", "600 kB", sum(["page_bg.wasm", "page.js"]));
    row("What draws by WebGPU and WebGL2, brotli", "900 kB", "1200 kB", sum(["painter_bg.wasm", "painter.js"]));
    row("Engine of the workers, brotli", "500 kB", "700 kB", sum(["engine_bg.wasm", "engine.js", "worker.js"]));
  },

  async first() {
    const server = await serve();
    const { page, context, told, received, slower } = await opened(server.url, { slow: 4, net: 10e6 });
    const sample = page.getByRole("button", { name: /Sample board/ });
    const ready = async () => {
      await sample.waitFor();
      await page.waitForTimeout(1000);
      const { history, paints } = await told();
      return [history.find((one) => one.ready)?.at - (await page.evaluate(() => performance.timeOrigin)), paints];
    };
    const [interactive, paints] = await ready();
    row("First paint at 10 Mbit/s on a processor 4 times slower", "1.0 s", "1.5 s", ms(paints["first-contentful-paint"]));
    row("Largest paint, likewise", "2.0 s", "2.5 s", ms(paints.largest));
    row("Interactive, likewise", "2.5 s", "3.5 s", ms(interactive));
    await sample.click();
    await page.getByText(/^Planned .* m,/).waitFor();
    row("First visit to usable Board, received", "1400 kB", "1900 kB", kB(received()));
    await until(() => page.evaluate(() => navigator.serviceWorker.controller !== null), "a site that is kept");
    await slower(1);
    await page.goto(server.url);
    row("Interactive, second visit, no slow-down", "0.7 s", "–", ms((await ready())[0]));
    await context.close();
    server.stop();
  },

  async boards() {
    for (const [name, targets] of [["sample", ["– / 1 s", "–"]], ["LimeSDR", ["1.0 s / –", "8 s"]]]) {
      if (name in BOARDS && !corpus()) return row(name, ...targets, "skipped: no corpus");
      const one = await fresh();
      const seen = await board(one, name);
      row(`${name}: first layer / whole picture / toolpaths`, targets[0], "–", `${ms(seen.layer)} / ${ms(seen.picture)} / ${ms(seen.toolpaths)}`);
      row(`${name}: proved and timed`, targets[1], "–", `${ms(seen.all)}, processor ${ms(seen.processor)}`);
      row(`${name}: memory of the page's process`, "400 MB", "600 MB", `${Math.round(own(seen.pid) / 1e6)} MB`);
      await one.context.close();
    }
  },

  async slider() {
    if (!corpus()) return row("Slider to new paths, multivibrator", "50 ms", "–", "skipped: no corpus");
    const one = await fresh();
    const { page, told } = one;
    await board(one, "multivibrator");
    await tab(page, "CAM").click();
    await page.getByRole("button", { name: /1 Isolate/ }).click();
    const took = [];
    const before = await taken();
    for (const key of ["ArrowRight", "ArrowLeft"]) {
      for (let press = 0; press < 4; press += 1) {
        await page.getByRole("slider", { name: "Passes" }).focus();
        await planned(page);
        const [lines] = (await told()).history.slice(-1).map((now) => now.lines);
        const began = Date.now();
        await page.keyboard.press(key);
        const changed = async () => (await told()).history.find((now) => now.at >= began && now.lines !== lines);
        took.push((await until(changed, "other toolpaths")).at - began);
      }
      // Another depth, so that no cached plan applies.
      await page.getByRole("slider", { name: /Depth/ }).first().focus();
      await page.keyboard.press("ArrowRight");
    }
    const [processor] = await since(before);
    row("Slider to new paths, multivibrator", "50 ms", "–", `${spread(took)}, processor ${ms(processor / (took.length + 2))} a step with proof and times`);
    return one.context.close();
  },

  async scrub() {
    for (const name of corpus() ? ["sample", "multivibrator"] : ["sample"]) {
      const one = await fresh();
      const { page } = one;
      await board(one, name);
      await tab(page, "Simulate").click();
      for (const flat of [true, false]) {
        const box = page.getByRole("checkbox", { name: "2D view" });
        await until(() => box.isEnabled(), "a board in space");
        if ((await box.isChecked()) !== flat) await box.click();
        await page.waitForTimeout(2000);
        const [before, from] = [await taken(), await one.now()];
        const took = await scrubbed(page.getByRole("slider", { name: "Time", exact: true }));
        const [processor] = await since(before);
        const measured = `${spread(took)}, processor ${ms(processor / took.length)}, longest task ${ms(await one.longest(from))}`;
        row(`Scrub to the next frame, ${name}, ${flat ? "flat" : "in space"}`, "33 ms", "–", measured);
      }
      await one.context.close();
    }
  },

  async connected() {
    const one = await fresh();
    const { page } = one;
    await board(one, "sample");
    await drillOnly(page);
    const { start } = await startJob(page);
    const [before, from] = [await taken(), await one.now()];
    await start.click();
    const go_on = page.getByRole("button", { name: "Start spindle and continue" });
    await until(async () => {
      if (await go_on.isVisible().catch(() => false)) await go_on.click().catch(() => {});
      return page.getByText(/The job is done/).isVisible();
    }, "the end of the job");
    const seconds = ((await one.now()) - from) / 1000;
    const [processor] = await since(before);
    row("Longest task while a job runs", "none over 50 ms", "–", `${ms(await one.longest(from))} in ${seconds.toFixed(0)} s, processor ${((processor / seconds) * 0.1).toFixed(0)} %`);
    await one.context.close();
  },

  async tour() {
    const one = await fresh();
    await board(one, "sample");
    await tour(one.page);
    await tour(one.page);
    const longest = new Map();
    for (const [id, took, what] of (await one.told()).events) if (took > (longest.get(id)?.[0] ?? 0)) longest.set(id, [took, what]);
    const all = [...longest.values()].sort((a, b) => a[0] - b[0]);
    const [took, what] = all.at(-1) ?? [];
    row("Interaction to next paint on a tour", "100 ms", "200 ms", `p75 ${ms(at(all.map(([took]) => took), 0.75))}, worst ${ms(took)} (${what}), ${all.length} of 16 ms and more`);
    await one.context.close();
  },

  async undo() {
    for (const count of [5_000, 10_000]) {
      const { page, context } = await fresh();
      await page.route("**/drawings/robot.json", (route) => route.fulfill({ contentType: "application/json", body: drawing(count) }));
      await page.getByRole("button", { name: /Draw a board/ }).click();
      await page.getByRole("button", { name: "Open the example" }).click();
      const things = async () => Number(/: (\d+) objects?$/.exec((await page.locator("canvas").first().getAttribute("aria-label")) ?? "")?.[1] ?? -1);
      await until(async () => (await things()) === count, "the drawing");
      const box = await page.locator("canvas").first().boundingBox();
      await page.keyboard.press("p");
      const took = [];
      const before = await taken();
      for (let round = 0; round < 6; round += 1) {
        await page.mouse.click(box.x + box.width * (0.4 + 0.03 * round), box.y + box.height * 0.5);
        await until(async () => (await things()) > count, "a pad more");
        await page.waitForTimeout(500);
        took.push(
          await page.evaluate(async () => {
            const canvas = document.querySelector("canvas");
            const [frames, began] = [canvas.dataset.frames, performance.now()];
            document.body.dispatchEvent(new KeyboardEvent("keydown", { key: "z", code: "KeyZ", ctrlKey: true, bubbles: true }));
            while (canvas.dataset.frames === frames && performance.now() - began < 5000) await new Promise((next) => requestAnimationFrame(next));
            return performance.now() - began;
          }),
        );
        await until(async () => (await things()) === count, "a pad less");
      }
      const [processor] = await since(before);
      row(`Undo at ${count} objects to the next frame`, "50 ms", "150 ms", `${spread(took)}, processor ${ms(processor / took.length)} for a pad and back`);
      const still = await taken();
      const drags = await dragged(page);
      const [moving] = await since(still);
      row(`A pad dragged among ${count} objects, move to the next frame`, "16 ms", "–", `${spread(drags)}, processor ${ms(moving / drags.length)} a move`);
      await context.close();
    }
  },
};

const asked = process.argv.slice(2);
const wrong = asked.filter((name) => !(name in GROUPS));
const busy = [loadavg()[0]];
try {
  if (wrong.length > 0) throw new Error(`No group is called ${wrong.join(", ")}; there are ${Object.keys(GROUPS).join(", ")}.`);
  for (const [name, measure] of Object.entries(GROUPS).filter(([name]) => asked.length === 0 || asked.includes(name))) {
    console.error(`▸ ${name}`);
    await Promise.resolve().then(measure).catch((error) => row(name, "–", "–", `NOT MEASURED: ${String(error).split("\n")[0]}`));
    busy.push(loadavg()[0]);
  }
  const waiting = `${Math.min(...busy).toFixed(1)} to ${Math.max(...busy).toFixed(1)} programs at a time`;
  console.log(`${cpus().length} × ${cpus()[0].model}, ${waiting}; Chromium ${browser.version()}, WebGL2 drawn by the processor\n`);
  const widths = rows[0].map((_, column) => Math.max(...rows.map((line) => line[column].length)));
  for (const line of rows) console.log(line.map((cell, column) => cell.padEnd(widths[column])).join(" | ").trimEnd());
} finally {
  await browser.close();
  await bridge.stop();
}
