// Starts the real bridge and the real browser for a test, and stops both.
//
// Comes in: ANNULUS_BIN (the program), ANNULUS_CHROMIUM (the browser). Nothing is mocked: real sockets, real disk,
// real time. Every bridge gets a home folder of its own that is removed afterwards.

import { spawn, spawnSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, existsSync, mkdirSync } from "node:fs";
import { createServer } from "node:http";
import { createRequire } from "node:module";
import { after, before } from "node:test";
import { tmpdir } from "node:os";
import { dirname, extname, join, normalize, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { inflateRawSync } from "node:zlib";
import { chromium } from "playwright-core";

const here = dirname(fileURLToPath(import.meta.url));
const axe = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");

/** How long anything is waited for: far more than a machine ten times slower than usual takes. */
export const PATIENCE_MS = Number(process.env.ANNULUS_PATIENCE_MS ?? 240_000);

/** Sizes and times of the long run: `rounds(short, long)` by ANNULUS_LONG. */
export const rounds = (short, long) => (process.env.ANNULUS_LONG ? long : short);

/** The root of the repository. */
export const root = resolve(here, "../..");

/** The program under test. */
export const program = process.env.ANNULUS_BIN ?? join(root, "target/debug/annulus");

/** The corpus of real boards, or null (then the test is skipped; with ANNULUS_NOTHING_SKIPPED it fails). */
export function corpus() {
  const folder = process.env.ANNULUS_CORPUS ?? resolve(root, "../shared/corpus");
  if (existsSync(folder)) return folder;
  if (process.env.ANNULUS_NOTHING_SKIPPED) throw new Error(`no corpus at ${folder}`);
  return null;
}

const common = [
  "--headless",
  "--no-sandbox",
  "--disable-quic",
  "--no-first-run",
  "--disable-background-networking",
  "--disable-component-update",
  "--disable-sync",
];

/** Flags under which WebGL2 draws in software. */
const webgl2 = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader"];

/** Flags under which WebGPU draws in software; without them the page falls back to WebGL2. */
const webgpu = [
  "--enable-unsafe-webgpu",
  "--ignore-gpu-blocklist",
  "--enable-gpu",
  "--enable-features=Vulkan",
  "--use-vulkan=swiftshader",
];

/** Flags under which a graphics card draws, by Vulkan: `ANNULUS_CARD=1`, for measuring only. */
const card = ["--use-angle=vulkan", "--use-vulkan=native", "--enable-features=Vulkan", "--ignore-gpu-blocklist", "--enable-gpu"];

/** Whether a graphics card draws. */
export const onCard = Boolean(process.env.ANNULUS_CARD);

/** Flags by what draws; with "none" the page has a plain canvas, as on a computer whose graphics card is not trusted. */
const GPUS = {
  webgpu: onCard ? [...card, "--enable-unsafe-webgpu"] : [...webgl2, ...webgpu],
  webgl2: onCard ? [...card, "--disable-features=WebGPU,WebGPUService"] : webgl2,
  none: ["--disable-gpu", "--disable-software-rasterizer"],
};

/** A browser in which "webgpu", "webgl2" or "none" draws, with more flags. */
export async function openBrowser(gpu = "webgl2", more = []) {
  const args = [...common, ...GPUS[gpu], ...more];
  return chromium.launch({ executablePath: process.env.ANNULUS_CHROMIUM ?? "/usr/bin/chromium", args });
}

/** A running bridge with its address. */
export async function startBridge({ home, speed = 50, args = [], port = 0 } = {}) {
  const own = home ?? mkdtempSync(join(tmpdir(), "annulus-test-"));
  const child = spawn(
    program,
    ["serve", "--port", String(port), "--no-open", "--speed", String(speed), ...args],
    { env: { ...process.env, ANNULUS_HOME: own }, stdio: ["ignore", "pipe", "pipe"] },
  );
  let errors = "";
  child.stderr.on("data", (data) => (errors += data));
  const url = await new Promise((found, failed) => {
    let seen = "";
    child.stdout.on("data", (data) => {
      seen += data;
      const match = seen.match(/http:\/\/\S+/);
      if (match) found(match[0]);
    });
    child.on("exit", (code) => failed(new Error(`the bridge ended with ${code}: ${errors}`)));
    setTimeout(() => failed(new Error(`no address in time: ${seen} ${errors}`)), PATIENCE_MS).unref();
  });
  const ended = new Promise((done) => child.on("exit", done));
  return {
    url,
    origin: new URL(url).origin,
    home: own,
    pid: child.pid,
    errors: () => errors,
    /** Holds the whole program, or lets it go on. */
    freeze: (held) => child.kill(held ? "SIGSTOP" : "SIGCONT"),
    kill: async (signal = "SIGKILL") => {
      child.kill(signal);
      await ended;
    },
    stop: async () => {
      child.kill("SIGTERM");
      await Promise.race([ended, new Promise((late) => setTimeout(late, 3000))]);
      child.kill("SIGKILL");
      await ended;
      if (!home) rmSync(own, { recursive: true, force: true });
    },
  };
}

/**
 * A page of the bridge, with what its console said. Nothing moves on it by itself (reduced motion), so that a look at it
 * never falls into a transition. `ANNULUS_SLOW=6` gives it a processor six times slower.
 */
export async function openPage(browser, url, { width = 1440, height = 900, scheme = "dark", ...more } = {}) {
  const context = await browser.newContext({
    viewport: { width, height },
    colorScheme: scheme,
    reducedMotion: "reduce",
    ...more,
  });
  context.setDefaultTimeout(PATIENCE_MS);
  // Files are chosen as where the browser has no picker of its own: a field for files can be answered from here.
  await context.addInitScript(() => delete window.showOpenFilePicker);
  const page = await context.newPage();
  const slow = Number(process.env.ANNULUS_SLOW ?? 1);
  if (slow > 1) {
    const session = await context.newCDPSession(page);
    await session.send("Emulation.setCPUThrottlingRate", { rate: slow });
  }
  const problems = [];
  page.on("console", (message) => {
    if (message.type() === "error") problems.push(message.text());
  });
  page.on("pageerror", (error) => problems.push(String(error)));
  // Choosers are caught from the beginning: whoever waits for one and opens it at once may be too early otherwise.
  page.on("filechooser", () => {});
  await page.goto(url);
  return { page, context, problems };
}

/** Another page of a running bridge, by a link of its own. */
export async function openLinked(browser, bridge, options) {
  const env = { ...process.env, ANNULUS_HOME: bridge.home };
  const link = spawnSync(program, ["link"], { env, encoding: "utf8" });
  const url = link.stdout.match(/http:\/\/\S+/)?.[0];
  if (!url) throw new Error(`annulus link printed no address: ${link.stdout}${link.stderr}`);
  return openPage(browser, url, options);
}

/** One browser and one bridge for all tests of a file. What is not about pictures takes half the time with no `gpu` at all. */
export function stand(gpu = "webgl2") {
  const held = {
    browser: undefined,
    bridge: undefined,
    /** A page of the bridge. */
    fresh: (options) => openLinked(held.browser, held.bridge, options),
    /** A page with the sample open and planned. */
    opened: async (options) => {
      const fresh = await held.fresh(options);
      await fresh.page.getByRole("button", { name: /Sample board/ }).click();
      await fresh.page.getByText(/^Planned .* m,/).waitFor();
      return fresh;
    },
  };
  before(async () => {
    held.browser = await openBrowser(gpu);
    held.bridge = await startBridge();
  });
  after(async () => {
    await held.browser?.close();
    await held.bridge?.stop();
  });
  return held;
}

/** The site as it was built. */
export const site = process.env.ANNULUS_SITE ?? join(root, "target/site");

const kinds = { ".html": "text/html", ".js": "text/javascript", ".wasm": "application/wasm", ".css": "text/css", ".svg": "image/svg+xml" };

/** A server of files that knows nothing of Annulus; `changed` gives other bytes for a file. */
export async function serveFiles(changed = () => null) {
  const asked = [];
  const server = createServer((request, response) => {
    const path = decodeURIComponent(new URL(request.url, "http://x").pathname);
    asked.push(`${request.method} ${path}`);
    const name = path.startsWith("/boards/here/") ? normalize(path.slice("/boards/here/".length) || "index.html") : "..";
    try {
      if (name.startsWith("..")) throw new Error(name);
      const bytes = changed(name) ?? readFileSync(join(site, name));
      response.writeHead(200, { "content-type": kinds[extname(name)] ?? "application/octet-stream" }).end(bytes);
    } catch {
      response.writeHead(404).end();
    }
  });
  await new Promise((listening) => server.listen(0, "127.0.0.1", listening));
  const url = `http://127.0.0.1:${server.address().port}/boards/here/`;
  return { url, asked, stop: () => (server.closeAllConnections(), server.close()) };
}

/** Waits until `look` gives something true, and gives that. */
export async function until(look, what, limit_ms = PATIENCE_MS) {
  const end = Date.now() + limit_ms;
  let last;
  while (Date.now() < end) {
    last = await look();
    if (last) return last;
    await new Promise((next) => setTimeout(next, 50));
  }
  throw new Error(`waited ${limit_ms} ms for ${what}; last seen: ${JSON.stringify(last)}`);
}

/** Waits until the page is drawn as it stands: nothing moves, and two frames have passed. */
export async function atRest(page) {
  await until(
    () =>
      page.evaluate(async () => {
        for (let frame = 0; frame < 2; frame += 1) await new Promise((drawn) => requestAnimationFrame(drawn));
        const moving = (one) => one.playState === "running" && Number.isFinite(one.effect?.getComputedTiming().endTime);
        return !document.getAnimations().some(moving);
      }),
    "a page at rest",
  );
}

/** What axe leaves open and what is a fault all the same: a name where none is allowed, with text under it by chance. */
const faultsAnyway = ["aria-prohibited-attr"];

/** What axe finds on the page as it stands, once it is at rest. */
export async function findings(page) {
  await atRest(page);
  await page.evaluate(axe);
  const types = ["violations", "incomplete"];
  const found = await page.evaluate((resultTypes) => globalThis.axe.run(document, { resultTypes }), types);
  const open = found.incomplete.filter((one) => faultsAnyway.includes(one.id));
  return [...found.violations, ...open].map((one) => `${one.id}: ${one.nodes.map((node) => node.target).join(" ")}`);
}

/** Waits until what `look` gives has not changed for `still_ms`, and gives it. */
export async function settled(look, what, still_ms = 1000) {
  let last;
  let since = 0;
  await until(async () => {
    const now = await look();
    if (now !== last) [last, since] = [now, Date.now()];
    return Date.now() - since >= still_ms;
  }, what);
  return last;
}

/** Names and contents of the members of a zip. */
export function unzipped(bytes) {
  const found = new Map();
  for (let at = 0; bytes.readUInt32LE(at) === 0x04034b50; ) {
    const [method, packed, name, more] = [bytes.readUInt16LE(at + 8), bytes.readUInt32LE(at + 18), bytes.readUInt16LE(at + 26), bytes.readUInt16LE(at + 28)];
    const data = at + 30 + name + more;
    const own = bytes.subarray(data, data + packed);
    found.set(bytes.toString("utf8", at + 30, at + 30 + name), method === 8 ? inflateRawSync(own) : own);
    at = data + packed;
  }
  return found;
}

/** What a press of `button` downloads: the names of the files in it with what they say. */
export async function downloaded(page, button) {
  const download = page.waitForEvent("download");
  await button.click();
  const file = await download;
  const bytes = readFileSync(await file.path());
  const name = file.suggestedFilename();
  return name.endsWith(".zip") ? unzipped(bytes) : new Map([[name, bytes]]);
}

/** Where screenshots go. */
export function picture(name) {
  const folder = process.env.ANNULUS_PICTURES ?? join(root, "target/pictures");
  mkdirSync(folder, { recursive: true });
  return join(folder, `${name}.png`);
}

/** Pictures of what is on show on a desk, a tablet upright and a phone; the page is as wide as on a desk again afterwards. */
export async function pictures(page, name) {
  for (const [width, height] of [[820, 1180], [390, 844], [1440, 900]]) {
    await page.setViewportSize({ width, height });
    await page.screenshot({ path: picture(`${name}-${width}`) });
  }
}

/** `error` with what the page said then, and a picture of it called `name`: elsewhere only the text of a failure is kept. */
export async function failed(page, name, error) {
  await page.screenshot({ path: picture(name) });
  const alerts = await page.locator("[role=alert], [role=status], dialog[open], .machine-top").filter({ visible: true }).allInnerTexts();
  const short = alerts.map((text) => text.replace(/\s+/g, " ").trim()).filter(Boolean).join(" | ");
  error.message += `\nIts banners: ${short}\nThe page said: ${await page.locator("main").innerText()}`;
  return error;
}

/** The button of a screen. */
export const tab = (page, name) => page.getByRole("navigation", { name: "Screens" }).getByRole("button", { name });

/** The screens, in the order of their keys. */
export const SCREENS = ["Draw", "Board", "CAM", "Simulate", "Machine", "Lab", "Settings"];

/** Goes to a screen by its key, whatever has the focus. A key under a dialog is nobody's: one that was answered is gone first. */
export async function show(page, screen) {
  await until(async () => (await page.locator("dialog[open]").count()) === 0, "the dialog's end");
  await page.evaluate(() => document.activeElement?.blur());
  await page.keyboard.press(String(SCREENS.indexOf(screen)));
  await until(async () => (await tab(page, screen).getAttribute("aria-current")) === "page", screen);
}

/** What the picture says of itself, once whatever was asked of it is painted: on a busy computer a frame takes seconds. */
export const data = (page, name) =>
  page.locator("canvas").first().evaluate(async (canvas, name) => {
    const painted = new Promise((next) => requestAnimationFrame(() => setTimeout(next)));
    // A page that is not on show paints nothing.
    await Promise.race([painted, new Promise((next) => setTimeout(next, 5000))]);
    return canvas.getAttribute(`data-${name}`);
  }, name);

/** Presses a button as soon as it may be pressed. A page that was silent for three seconds, as on a busy computer, has lost
 * control: then it is taken back first, as a person would. */
export async function press(page, button) {
  const take = page.getByRole("button", { name: "Take control" });
  await until(async () => {
    if (await button.isEnabled().catch(() => false)) return true;
    if ((await page.locator("dialog[open]").count()) === 0 && (await take.isVisible())) await take.click().catch(() => {});
    return false;
  }, "a button that may be pressed");
  await button.click();
}

/** Homes, sets the work zero and starts the planned job. */
export async function startJob(page) {
  await tab(page, "Machine").click();
  const operate = page.getByRole("button", { name: "Operate from this phone" });
  if (await operate.isVisible()) await operate.click();
  await press(page, page.getByRole("button", { name: "Home", exact: true }));
  await page.getByText("At rest, position known.").waitFor();
  await press(page, page.getByRole("button", { name: /^Set work zero here/ }));
  await page.getByText(/Zero at/).waitFor();
  await press(page, page.getByRole("button", { name: "Start…" }));
  const dialog = page.getByRole("dialog", { name: "Before the start" });
  const start = dialog.getByRole("button", { name: "Start the job" });
  await until(async () => {
    for (const tick of await dialog.getByRole("checkbox").all()) if (!(await tick.isChecked())) await tick.check();
    return start.isEnabled();
  }, "a pre-flight that lets the job start");
  return { dialog, start };
}

/** Waits until the plan is that of the job as it stands, or nobody works on one. */
export async function planned(page) {
  const waiting = page.locator("main[data-stale], footer progress");
  await until(async () => (await waiting.count()) === 0, "a plan of the job as it stands");
}

/** Leaves of the job on the CAM screen only the drilling, sees its problems, and goes back to the Board. */
export async function drillOnly(page) {
  await page.getByText(/^Planned .* m,/).waitFor();
  await tab(page, "CAM").click();
  await page.getByRole("heading", { name: "Operations" }).waitFor();
  for (const box of await page.getByRole("checkbox", { name: /^Do (?!Drill)/ }).all()) await box.uncheck();
  await planned(page);
  const seen = page.getByRole("button", { name: "All seen" });
  if (await seen.isEnabled()) await seen.click();
  await tab(page, "Board").click();
}
