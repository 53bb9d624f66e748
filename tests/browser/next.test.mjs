// The line at the foot of the page leads from the files to the saved programs: proof, number of problems, next
// step, export. Files are shown while they are read; a chosen operation is lit in the picture.

import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { atRest, downloaded, findings, picture, planned, program, root, SCREENS, show, stand, tab, test, until } from "./harness.mjs";

const { fresh, opened } = stand("none");

const line = (page) => page.locator("#status");
const proof = (page) => line(page).locator(".proof [role=status]");
const next = (page) => line(page).getByRole("button", { name: /^Next: / });
const isOn = (page, screen) => until(async () => (await tab(page, screen).getAttribute("aria-current")) === "page", screen);

test("the line leads from the board to the saved files, and Export takes two presses", async () => {
  const { page, problems, context } = await opened();
  try {
    await planned(page);
    assert.equal(await next(page).innerText(), "Next: check problems");
    await next(page).click();
    await isOn(page, "CAM");
    await until(() => page.evaluate(() => document.activeElement.id === "problems"), "the list of problems in focus");
    await page.getByRole("button", { name: "Accept all" }).click();
    await until(async () => (await next(page).innerText()) === "Next: simulate", "the next step");
    assert.match(await proof(page).innerText(), /^Proved: \d+ of \d+ nets isolated, smallest gap \d\.\d\d mm$/);
    await next(page).focus();
    await page.keyboard.press("Enter");
    await isOn(page, "Simulate");
    await until(async () => (await next(page).innerText()) === "Next: run", "the next step");
    assert.ok(await next(page).evaluate((one) => one === document.activeElement), "the button keeps the focus");
    await line(page).getByRole("button", { name: "Export…" }).click();
    const panel = page.getByRole("dialog", { name: "Export", exact: true });
    const files = await downloaded(page, panel.getByRole("button", { name: "Export files" }));
    assert.ok(files.has("run-sheet.html"));
    const answer = panel.getByText("Saved, in the order of running:");
    await answer.waitFor();
    const [box, height] = [await answer.boundingBox(), page.viewportSize().height];
    assert.ok(box.y > 0 && box.y + box.height < height, `the answer is in sight: ${JSON.stringify(box)}`);
    await page.screenshot({ path: picture("export-1440") });
    await page.keyboard.press("Escape");
    await panel.waitFor({ state: "hidden" });
    await next(page).click();
    await isOn(page, "Machine");
    assert.deepEqual(problems, [], "nothing was said on the console");
  } finally {
    await context.close();
  }
});

test("the sentence about the proof is that of the command line", async () => {
  const { page, context } = await opened();
  const folder = mkdtempSync(join(tmpdir(), "annulus-next-"));
  try {
    await planned(page);
    await show(page, "CAM");
    await page.getByRole("button", { name: "Accept all" }).click();
    await until(async () => (await proof(page).innerText()).startsWith("Proved: "), "the proof");
    const files = ["sensor.drl", "sensor-outline.gbr", "sensor-top.gbr"].map((name) => join(root, "www/examples", name));
    const flags = ["--to", "grbl", "-o", join(folder, "out"), "--accept", "proof.gap,proof.sliver,proof.lost"];
    const cam = spawnSync(program, ["cam", ...files, ...flags], { encoding: "utf8" });
    assert.equal(cam.status, 0, cam.stdout + cam.stderr);
    const said = await proof(page).innerText();
    assert.ok(cam.stdout.includes(said), `${said}\n${cam.stdout}`);
  } finally {
    await context.close();
    rmSync(folder, { recursive: true });
  }
});

test("problems have one number on all screens", async () => {
  const { page, context } = await fresh();
  try {
    const chooser = page.waitForEvent("filechooser");
    await page.getByRole("button", { name: "Open files…" }).click();
    const synthetic = (name) => join(root, "tests/data/synthetic", name);
    await (await chooser).setFiles([synthetic("x10-html-error-page.drl"), join(root, "www/examples/sensor.drl"), join(root, "www/examples/sensor-top.gbr")]);
    const use = page.getByRole("button", { name: /Use this board/ });
    await use.waitFor();
    for (const accept of await page.getByRole("checkbox", { name: /Accept/ }).all()) await accept.check();
    await until(() => use.isEnabled(), "a board that may be used");
    await use.click();
    await planned(page);
    const number = async (locator) => Number(/\d+/.exec(await locator.innerText())[0]);
    const all = await number(line(page).getByRole("button", { name: /^Problems: / }));
    assert.ok(all > 1, `${all} problems`);
    await show(page, "Board");
    assert.equal(await number(page.getByRole("heading", { name: /^Problems: / })), all, "Board");
    await show(page, "CAM");
    assert.equal(await number(page.getByRole("heading", { name: /^Problems \(/ })), all, "CAM");
    await page.getByRole("button", { name: "Show on Board" }).click();
    await isOn(page, "Board");
  } finally {
    await context.close();
  }
});

test("the line is low, is accessible and can be pressed, on every screen and on a phone", async () => {
  const { page, context } = await opened();
  try {
    await planned(page);
    for (const screen of SCREENS) {
      await show(page, screen);
      for (const [width, height] of [[1280, 800], [1024, 768], [820, 1180], [390, 800]]) {
        await page.setViewportSize({ width, height });
        await atRest(page);
        const box = await line(page).boundingBox();
        assert.ok(box.height <= (width < 768 ? 110 : 40), `${screen}, ${width}: ${box.height} px`);
        if (width === 390) assert.ok(box.y + box.height <= 800, `${screen}: in sight on a phone, at ${box.y}`);
        for (const button of await line(page).getByRole("button").all()) {
          const { height: own, x, width: wide } = await button.boundingBox();
          assert.ok(own >= 24, `${screen}, ${width}: a button of ${own} px`);
          assert.ok(x >= 0 && x + wide <= width, `${screen}, ${width}: a button from ${x} to ${x + wide}`);
        }
      }
      assert.deepEqual(await findings(page), [], `${screen} on a phone`);
      await page.screenshot({ path: picture(`line-${screen.toLowerCase()}-390`) });
    }
  } finally {
    await context.close();
  }
});

test("fingers get targets of 44 px in the line", async () => {
  const { page, context } = await opened({ width: 820, height: 1180, hasTouch: true, isMobile: true });
  try {
    await planned(page);
    for (const target of await line(page).locator("button, a").all()) {
      if (await target.isVisible()) assert.ok((await target.boundingBox()).height >= 44, await target.innerText());
    }
  } finally {
    await context.close();
  }
});

test("files are shown as soon as they are dropped", async () => {
  const { page, context } = await fresh();
  try {
    await page.getByRole("heading", { name: /Drop the files/ }).waitFor();
    // Reading starts only when the test lets it.
    await page.evaluate(() => {
      const read = Blob.prototype.arrayBuffer;
      globalThis.let = new Promise((go) => (globalThis.go = go));
      Blob.prototype.arrayBuffer = async function () {
        await globalThis.let;
        return read.call(this);
      };
    });
    const took = await page.evaluate(async () => {
      const data = new DataTransfer();
      for (let at = 0; at < 12; at += 1) data.items.add(new File(["M48\nMETRIC\nT1C0.8\n%\nT1\nX1.0Y1.0\nM30\n"], `part-${at}.drl`));
      const began = performance.now();
      document.body.dispatchEvent(new DragEvent("drop", { dataTransfer: data, bubbles: true, cancelable: true }));
      while (!/^Reading 12 files…/.test(document.querySelector(".drop h2").textContent)) {
        if (performance.now() - began > 5000) return document.querySelector(".drop").textContent;
        await new Promise((later) => setTimeout(later, 5));
      }
      return performance.now() - began;
    });
    assert.ok(took < 1000, `shown after ${took} ms`);
    assert.deepEqual(await findings(page), []);
    await page.screenshot({ path: picture("reading-1440") });
    await page.evaluate(() => globalThis.go());
    await page.locator(".drop").waitFor({ state: "hidden" });
  } finally {
    await context.close();
  }
});

/** The number of pixels in the full colour of an isolation cut, as rendered without a GPU. */
const bright = (page) =>
  page.locator("canvas").first().evaluate((canvas) => {
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    let count = 0;
    for (let at = 0; at < data.length; at += 4) {
      const off = [125, 127, 78].map((value, part) => Math.abs(data[at + part] - value));
      if (Math.max(...off) <= 20) count += 1;
    }
    return count;
  });

test("a chosen operation is lit and the others are dimmed, until it is chosen again", async () => {
  const { page, context } = await opened();
  try {
    await show(page, "CAM");
    await planned(page);
    const all = await until(() => bright(page), "isolation in the picture");
    const cut = page.getByRole("button", { name: /\d Cut out/ });
    await cut.click();
    await until(async () => (await bright(page)) < all / 4, "isolation that is dimmed");
    await page.screenshot({ path: picture("lit-cut-out-1440") });
    await cut.focus();
    await page.keyboard.press("Enter");
    await until(async () => (await bright(page)) > all * 0.9, "all toolpaths");
    await page.getByRole("button", { name: /\d Isolate/ }).click();
    await until(async () => (await bright(page)) > all * 0.9, "isolation that is lit");
    const legend = page.getByRole("list", { name: "Colours of the operations" });
    assert.ok((await legend.innerText()).includes("Isolate"));
    await show(page, "Machine");
    assert.equal(await legend.count(), 0, "where the toolpaths are not all of it, there is no legend");
  } finally {
    await context.close();
  }
});

test("Board begins with a summary", async () => {
  const { page, context } = await opened();
  try {
    await show(page, "Board");
    await planned(page);
    const summary = page.getByRole("region", { name: "This board" });
    const text = await summary.innerText();
    for (const part of [/Size\s+[\d.]+ × [\d.]+ mm/, /Copper\s+Top/, /Nets, side that is up\s+\d+/, /Holes\s+\d+: \d+ × [\d.]+/, /Slots\s+none/]) {
      assert.match(text, part);
    }
    assert.ok(await summary.evaluate((one) => one.parentElement.firstElementChild === one), "before all else");
  } finally {
    await context.close();
  }
});
