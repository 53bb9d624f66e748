// How long a frame of the simulation takes, flat and in space, played and scrubbed, in both graphics interfaces. `cargo xtask bench`
// runs it. The interfaces draw in software here: on a graphics card a frame takes a small part of that.
//
// Comes in: the sample, and boards of the corpus where there is one. Goes out: lines on standard output. Judges nothing.

import { join } from "node:path";
import { readdirSync } from "node:fs";
import { corpus, data, openBrowser, openLinked, show, startBridge, until } from "./harness.mjs";

const BOARDS = ["kicad/4.0-multivibrator", "eagle/arduino-uno"];
const WATCHED_MS = 4000;

async function open(page, folder) {
  if (!folder) return page.getByRole("button", { name: /Sample board/ }).click();
  const chooser = page.waitForEvent("filechooser");
  await page.getByRole("button", { name: "Open files…" }).click();
  await (await chooser).setFiles(readdirSync(folder).map((name) => join(folder, name)));
  const use = page.getByRole("button", { name: /Use this board/ });
  await until(async () => (await use.isVisible()) || Number(await data(page, "holes")) > 0, "the board");
  if (await use.isVisible()) await use.click();
}

/** Times between frames while `act` is done at every frame, in ms, ascending. */
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

const folder = corpus();
const bridge = await startBridge();
for (const gpu of ["webgl2", "webgpu"]) {
  for (const board of [null, ...(folder ? BOARDS : [])]) {
    const browser = await openBrowser(gpu);
    const { page } = await openLinked(browser, bridge);
    await open(page, board && join(folder, board));
    await page.getByText(/^Planned .* m,/).waitFor();
    await show(page, "Simulate");
    await page.getByRole("button", { name: "From above (T)" }).waitFor();
    await page.waitForTimeout(5000);
    const backend = await data(page, "backend");
    for (const flat of [false, true]) {
      if (flat) await page.keyboard.press("Alt+3");
      const name = `frame/${(board ?? "sample").split("/").pop()}, ${flat ? "flat" : "in space"}`.padEnd(44);
      await page.keyboard.press("Home");
      await page.keyboard.press("Space");
      console.log(`${name} played   ${told(await frames(page, false))}  (${backend})`);
      await page.keyboard.press("Space");
      console.log(`${name} scrubbed ${told(await frames(page, true))}  (${backend})`);
    }
    await browser.close();
  }
}
await bridge.stop();
