// Starts the real bridge and a real browser for a test, and stops both. Needs ANNULUS_BIN (the program) and
// ANNULUS_CHROMIUM (the browser). Nothing is mocked: real sockets, real disk, real time. Every bridge has a
// separate home folder, which is removed afterwards.

import { spawn, spawnSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, existsSync, mkdirSync } from "node:fs";
import { createServer } from "node:http";
import { createRequire } from "node:module";
import { after, before, test as nodeTest } from "node:test";
import { tmpdir } from "node:os";
import { dirname, extname, join, normalize, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { inflateRawSync } from "node:zlib";
import { chromium } from "playwright-core";

const here = dirname(fileURLToPath(import.meta.url));
const axe = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");

/** Maximum time to wait for anything: far more than a machine ten times slower than usual needs. */
export const PATIENCE_MS = Number(process.env.ANNULUS_PATIENCE_MS ?? 240_000);

/** Sizes and durations, short or long: `rounds(short, long)`, long with ANNULUS_LONG. */
export const rounds = (short, long) => (process.env.ANNULUS_LONG ? long : short);

/** The root of the repository. */
export const root = resolve(here, "../..");

/** What the pages of the current test showed when they were closed. */
let shown = [];

/** A test whose failure tells what its pages showed: a test log keeps only text. */
export function test(name, ...rest) {
  const body = rest.pop();
  return nodeTest(name, ...rest, async (t) => {
    shown = [];
    try {
      await body(t);
    } catch (error) {
      error.message += shown.map((text) => `\nA page showed: ${text}`).join("");
      throw error;
    }
  });
}

/** The texts of a page: dialogs and notices first. A page that does not answer gives none. */
async function textsOf(page) {
  const told = page.locator("[role=alert], [role=status], dialog[open], .machine-top").filter({ visible: true });
  const read = Promise.all([told.allInnerTexts(), page.locator("main").innerText({ timeout: 2000 })]);
  const late = new Promise((none) => setTimeout(none, 3000, [[], "no answer"]));
  const [notices, main] = await Promise.race([read, late]).catch((error) => [[], String(error)]);
  return [...notices, main].map((text) => text.replace(/\s+/g, " ").trim()).filter(Boolean).join(" | ").slice(0, 3000);
}

/** The program under test. */
export const program = process.env.ANNULUS_BIN ?? join(root, "target/debug/annulus");

/** The corpus of real boards, or null: then the test is skipped (an error with ANNULUS_NOTHING_SKIPPED). */
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

/** Flags for WebGL2 in software. */
const webgl2 = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader"];

/** Flags for WebGPU in software; without them the page falls back to WebGL2. */
const webgpu = [
  "--enable-unsafe-webgpu",
  "--ignore-gpu-blocklist",
  "--enable-gpu",
  "--enable-features=Vulkan",
  "--use-vulkan=swiftshader",
];

/** Flags for a graphics card with Vulkan: `ANNULUS_CARD=1`, only for measuring. */
const card = ["--use-angle=vulkan", "--use-vulkan=native", "--enable-features=Vulkan", "--ignore-gpu-blocklist", "--enable-gpu"];

/** True if a graphics card renders. */
export const onCard = Boolean(process.env.ANNULUS_CARD);

/** Flags by renderer. "none" leaves a 2D canvas, as on a computer whose graphics card is blocked. */
const GPUS = {
  webgpu: onCard ? [...card, "--enable-unsafe-webgpu"] : [...webgl2, ...webgpu],
  webgl2: onCard ? [...card, "--disable-features=WebGPU,WebGPUService"] : webgl2,
  none: ["--disable-gpu", "--disable-software-rasterizer"],
};

/** A browser with "webgpu", "webgl2" or "none" for rendering, and more flags. */
export async function openBrowser(gpu = "webgl2", more = []) {
  const args = [...common, ...GPUS[gpu], ...more];
  return chromium.launch({ executablePath: process.env.ANNULUS_CHROMIUM ?? "/usr/bin/chromium", args });
}

/** Starts a bridge and returns its address. */
export async function startBridge({ home, speed = 50, args = [], port = 0 } = {}) {
  const own = home ?? mkdtempSync(join(tmpdir(), "annulus-test-"));
  const child = spawn(
    program,
    ["serve", "--port", String(port), "--no-open", "--time-scale", String(speed), ...args],
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
    /** Suspends the program, or continues it. */
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

/** Opens a page of the bridge and records its console. Reduced motion, so that no check happens during a
 *  transition. `ANNULUS_SLOW=6` makes its CPU six times slower. */
export async function openPage(browser, url, { width = 1440, height = 900, scheme = "dark", ...more } = {}) {
  const context = await browser.newContext({
    viewport: { width, height },
    colorScheme: scheme,
    reducedMotion: "reduce",
    ...more,
  });
  context.setDefaultTimeout(PATIENCE_MS);
  // Remove the file picker API: the fallback file input can be controlled from here.
  await context.addInitScript(() => delete window.showOpenFilePicker);
  const close = context.close.bind(context);
  context.close = async () => {
    shown.push(...(await Promise.all(context.pages().map(textsOf))));
    await close();
  };
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
  // Register a listener from the start, because a chooser can open before a test waits for it.
  page.on("filechooser", () => {});
  await page.goto(url);
  return { page, context, problems };
}

/** Opens another page of a running bridge with a new link. */
export async function openLinked(browser, bridge, options) {
  const env = { ...process.env, ANNULUS_HOME: bridge.home };
  const link = spawnSync(program, ["link"], { env, encoding: "utf8" });
  const url = link.stdout.match(/http:\/\/\S+/)?.[0];
  if (!url) throw new Error(`annulus link printed no address: ${link.stdout}${link.stderr}`);
  return openPage(browser, url, options);
}

/** One browser and one bridge for all tests of a file. Tests that don't look at the picture take half the
 *  time with `gpu` "none". */
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

/** The built site. */
export const site = process.env.ANNULUS_SITE ?? join(root, "target/site");

const kinds = { ".html": "text/html", ".js": "text/javascript", ".wasm": "application/wasm", ".css": "text/css", ".svg": "image/svg+xml" };

/** A static file server; `changed` can replace a file's bytes. */
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

/** Waits until `look` returns something true, and returns that. */
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

/** Waits until the page is drawn: nothing moves, and two frames have passed. */
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

/** Rules that axe reports as incomplete but that are errors here: a name on an element that allows none,
 *  which happens to have text. */
const faultsAnyway = ["aria-prohibited-attr"];

/** The problems that axe finds, once the page is stable. */
export async function findings(page) {
  await atRest(page);
  await page.evaluate(axe);
  const types = ["violations", "incomplete"];
  const found = await page.evaluate((resultTypes) => globalThis.axe.run(document, { resultTypes }), types);
  const open = found.incomplete.filter((one) => faultsAnyway.includes(one.id));
  return [...found.violations, ...open].map((one) => `${one.id}: ${one.nodes.map((node) => node.target).join(" ")}`);
}

/** Waits until the result of `look` hasn't changed for `still_ms`, and returns it. */
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

/** Presses `button` and returns the downloaded files by name with their contents. */
export async function downloaded(page, button) {
  const download = page.waitForEvent("download");
  await button.click();
  const file = await download;
  const bytes = readFileSync(await file.path());
  const name = file.suggestedFilename();
  return name.endsWith(".zip") ? unzipped(bytes) : new Map([[name, bytes]]);
}

/** The panel of a page whose program has crashed, triggered from outside by freeing memory that was never
 *  allocated. */
export async function broken(page) {
  await page.evaluate(async () => {
    const program = await (await import(new URL("page.js", document.baseURI).href)).default();
    setTimeout(() => program.__wbindgen_free(0xfffffff0, 64, 4));
  });
  const fallen = page.getByRole("dialog", { name: "This page crashed" });
  await fallen.waitFor();
  return fallen;
}

/** The path of a screenshot. */
export function picture(name) {
  const folder = process.env.ANNULUS_PICTURES ?? join(root, "target/pictures");
  mkdirSync(folder, { recursive: true });
  return join(folder, `${name}.png`);
}

/** Screenshots in desktop, tablet and phone size; restores the desktop size. */
export async function pictures(page, name) {
  for (const [width, height] of [[820, 1180], [390, 844], [1440, 900]]) {
    await page.setViewportSize({ width, height });
    await page.screenshot({ path: picture(`${name}-${width}`) });
  }
}

/** The button of a screen. */
export const tab = (page, name) => page.getByRole("navigation", { name: "Screens" }).getByRole("button", { name });

/** The screens, in the order of their keys. */
export const SCREENS = ["Draw", "Board", "CAM", "Simulate", "Machine", "Lab", "Settings"];

/** Switches to a screen by its key, whatever has the focus. Dialogs swallow keys, so waits until an answered
 *  one is gone. */
export async function show(page, screen) {
  await until(async () => (await page.locator("dialog[open]").count()) === 0, "the dialog's end");
  await page.evaluate(() => document.activeElement?.blur());
  await page.keyboard.press(String(SCREENS.indexOf(screen)));
  await until(async () => (await tab(page, screen).getAttribute("aria-current")) === "page", screen);
}

/** An attribute of the canvas, after the last request is painted: on a busy computer a frame takes seconds. */
export const data = (page, name) =>
  page.locator("canvas").first().evaluate(async (canvas, name) => {
    const painted = new Promise((next) => requestAnimationFrame(() => setTimeout(next)));
    // A hidden page paints nothing.
    await Promise.race([painted, new Promise((next) => setTimeout(next, 5000))]);
    return canvas.getAttribute(`data-${name}`);
  }, name);

/** Name of the renderer, once it has drawn: it is loaded after the page. */
export async function backend(page) {
  let name = null;
  await until(async () => (name = await data(page, "backend")), "a first picture");
  return name;
}

/** Presses a button once it is enabled and uncovered; `clear` removes what may cover it. If the page lost
 *  control because it was silent for three seconds, as on a busy computer, takes control back first. */
export async function press(page, button, clear = async () => {}) {
  const take = page.getByRole("button", { name: "Take control" });
  // The guard of moving buttons checks ten times a second: a button that just moved can still look enabled.
  const ready = async () => (await button.isEnabled()) && (await page.waitForTimeout(150), await button.isEnabled());
  await until(async () => {
    await clear();
    if (await ready().catch(() => false)) return button.click({ timeout: 30_000 }).then(() => true, () => false);
    if ((await page.locator("dialog[open]").count()) === 0 && (await take.isVisible())) await take.click().catch(() => {});
    return false;
  }, "a button that may be pressed");
}

/** Opens the pre-flight by `button` and waits for its rows. On a busy computer the press may be refused, because
 *  the page just changed, or the check, because the page lost control: then it is pressed again. */
export async function preflight(page, button) {
  const dialog = page.getByRole("dialog", { name: "Before the start" });
  let presses = 0;
  await until(async () => {
    if (!(await dialog.isVisible())) {
      presses += 1;
      if (presses > 3) throw new Error("three presses opened no pre-flight with rows");
      await press(page, button);
    }
    await dialog.waitFor({ timeout: 10_000 }).catch(() => {});
    await dialog.getByText("Annulus is checking the program…").waitFor({ state: "hidden" });
    if (await dialog.locator("ul.preflight").isVisible()) return true;
    if (await dialog.isVisible()) await dialog.getByRole("button", { name: "Cancel" }).click();
    return false;
  }, "a pre-flight with its rows");
  return dialog;
}

/** Ticks the warnings of the pre-flight until its button `name` can be pressed; returns the button. */
export async function mayStart(dialog, name = "Start the job") {
  const start = dialog.getByRole("button", { name });
  await until(async () => {
    for (const tick of await dialog.getByRole("checkbox").all()) if (!(await tick.isChecked())) await tick.check();
    return start.isEnabled();
  }, "a pre-flight that lets the job start");
  return start;
}

/** Homes, sets the work zero and opens the pre-flight of the planned job. */
export async function startJob(page) {
  await tab(page, "Machine").click();
  const operate = page.getByRole("button", { name: "Operate from this phone" });
  if (await operate.isVisible()) await operate.click();
  await press(page, page.getByRole("button", { name: "Home", exact: true }));
  await page.getByText("At rest, position known.").waitFor();
  await press(page, page.getByRole("button", { name: /^Set work zero here/ }));
  await page.getByText(/Zero at/).waitFor();
  const dialog = await preflight(page, page.getByRole("button", { name: "Start…" }));
  return { dialog, start: await mayStart(dialog) };
}

/** The export panel, opened from the line at the foot of the page. */
export async function exportPanel(page) {
  const panel = page.getByRole("dialog", { name: "Export", exact: true });
  if (!(await panel.isVisible())) await page.locator("#status").getByRole("button", { name: "Export…" }).click();
  await panel.waitFor();
  return panel;
}

/** Closes the export panel. */
export async function closeExport(panel) {
  await panel.getByRole("button", { name: "Close", exact: true }).click();
  await panel.waitFor({ state: "hidden" });
}

/** Waits until the plan matches the job, or no planning is in progress. */
export async function planned(page) {
  const waiting = page.locator("main[data-stale], footer progress");
  await until(async () => (await waiting.count()) === 0, "a plan of the job as it stands");
}

/** Leaves only drilling in the job, accepts its problems, and returns to Board. */
export async function drillOnly(page) {
  await page.getByText(/^Planned .* m,/).waitFor();
  await tab(page, "CAM").click();
  await page.getByRole("heading", { name: "Operations" }).waitFor();
  for (const box of await page.getByRole("checkbox", { name: /^Do (?!Drill)/ }).all()) await box.uncheck();
  await planned(page);
  const seen = page.getByRole("button", { name: "Accept all" });
  if (await seen.isEnabled()) await seen.click();
  await tab(page, "Board").click();
}
