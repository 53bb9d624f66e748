// Measures frame times of the simulation in 2D and 3D view, playing and scrubbing, with both graphics APIs.
// Run by `cargo xtask bench`.
//
// Rendering is in software; a graphics card needs a small part of that time. With ANNULUS_CARD=1 a card
// renders, with unlimited frame rate. Uses the sample and boards of the corpus; or, as arguments, numbers of
// straight segments to route (125000 make a million segments, because the tool plunges in eight steps).
// Prints lines; sets no limits.

import { join } from "node:path";
import { readdirSync } from "node:fs";
import { backend, corpus, data, onCard, openBrowser, openLinked, show, startBridge, until } from "./harness.mjs";

const BOARDS = ["kicad/4.0-multivibrator", "eagle/arduino-uno"];
const WATCHED_MS = 4000;
const UNTHROTTLED = onCard ? ["--disable-frame-rate-limit", "--disable-gpu-vsync"] : [];

/** An Excellon file that routes this many straight segments in rows over 100 mm × 80 mm, slightly zigzag so
 *  that none can be merged. */
function routed(segments) {
  const [rows, paths] = [Math.ceil(segments / 2000), []];
  for (let row = 0, left = segments; row < rows; row += 1, left -= 2000) {
    const place = (at) => `X${((row % 2 ? 2000 - at : at) / 20).toFixed(3)}Y${((row + 0.5) * (80 / rows) + (at % 2 ? 0.02 : -0.02)).toFixed(3)}`;
    paths.push(`G00${place(0)}`, "M15");
    for (let at = 1; at <= Math.min(2000, left); at += 1) paths.push(`G01${place(at)}`);
    paths.push("M16");
  }
  return ["M48", "METRIC,TZ", "T1C0.800", "%", "G90", "T1", ...paths, "M30", ""].join("\n");
}

async function open(page, board) {
  if (!board) return page.getByRole("button", { name: /Sample board/ }).click();
  const chooser = page.waitForEvent("filechooser");
  await page.getByRole("button", { name: "Open files…" }).click();
  const folder = typeof board === "number" ? null : join(corpus(), board);
  const files = folder
    ? readdirSync(folder).map((name) => join(folder, name))
    : [{ name: `routed-${board}.drl`, mimeType: "text/plain", buffer: Buffer.from(routed(board)) }];
  await (await chooser).setFiles(files);
  const use = page.getByRole("button", { name: /Use this board/ });
  const planned = page.getByText(/^Planned .* m,/);
  await until(async () => (await use.isVisible()) || (await planned.isVisible()), "the board");
  if (await use.isVisible()) await use.click();
}

/** Times between frames in ms, ascending, with `act` run in every frame. */
const frames = (page, scrub) =>
  page.evaluate(
    async ([watched_ms, scrub]) => {
      const slider = document.querySelector(".scrub input[type=range]");
      const times = [];
      const began = performance.now();
      for (let last = began, at = 0.37; last - began < watched_ms; ) {
        if (scrub) {
          at = (at + 0.618) % 1;
          slider.value = String(Number(slider.max) * at);
          slider.dispatchEvent(new Event("input", { bubbles: true }));
        }
        const now = await new Promise((drawn) => requestAnimationFrame(() => setTimeout(() => drawn(performance.now()))));
        times.push(now - last);
        last = now;
      }
      return times.sort((a, b) => a - b);
    },
    [WATCHED_MS, scrub],
  );

const told = (times) => {
  const share = (part) => times[Math.min(times.length - 1, Math.floor(part * times.length))].toFixed(0).padStart(5);
  return `${share(0.5)} ms median ${share(0.95)} ms of 95 % ${share(1)} ms longest`;
};

const segments = process.argv.slice(2).map(Number);
const boards = segments.length > 0 ? segments : [null, ...(corpus() ? BOARDS : [])];
const bridge = await startBridge();
for (const gpu of ["webgl2", "webgpu"]) {
  for (const board of boards) {
    const browser = await openBrowser(gpu, UNTHROTTLED);
    const { page } = await openLinked(browser, bridge);
    await open(page, board);
    await page.getByText(/^Planned .* m,/).waitFor();
    await show(page, "Simulate");
    await page.getByRole("button", { name: "From above (T)" }).waitFor();
    await page.waitForTimeout(5000);
    const drawn = `${await backend(page)}, ${await data(page, "lines")} segments`;
    for (const flat of [false, true]) {
      if (flat) await page.keyboard.press("Alt+3");
      const name = `frame/${String(board ?? "sample").split("/").pop()}, ${flat ? "flat" : "in space"}`.padEnd(44);
      await page.keyboard.press("Home");
      await page.keyboard.press("Space");
      console.log(`${name} played   ${told(await frames(page, false))}  (${drawn})`);
      await page.keyboard.press("Space");
      console.log(`${name} scrubbed ${told(await frames(page, true))}  (${drawn})`);
    }
    await browser.close();
  }
}
await bridge.stop();
