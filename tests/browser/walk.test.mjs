// The complete way of a board through the page with the real bridge: open, look, play, home, drill, done.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { after, before } from "node:test";
import { corpus, data, drillOnly, openBrowser, openPage, PATIENCE_MS, picture, planned as settled, startBridge, startJob, tab, test, until } from "./harness.mjs";

let browser;
before(async () => (browser = await openBrowser()));
after(async () => browser?.close());

const canvas = (page) => page.locator("canvas").first();

/** Opens the sample and waits until it is planned. */
async function openSample(page) {
  await page.getByRole("button", { name: /Sample board/ }).click();
  await until(async () => Number(await data(page, "holes")) > 0, "holes in the picture");
  await planned(page);
}

/** Waits until the plan is shown next to the picture. */
async function planned(page) {
  await page.getByText(/^Planned .* m,/).waitFor();
  await drillOnly(page);
}

/** Confirms every tool change until `done`. */
async function changeBits(page, done) {
  return until(async () => {
    const go_on = page.getByRole("button", { name: "Start spindle and continue" });
    if (await go_on.isVisible().catch(() => false)) await go_on.click().catch(() => {});
    return done();
  }, "the end of the job", 2 * PATIENCE_MS);
}

test("the sample goes from the welcome to drilled holes", async () => {
  const bridge = await startBridge({ speed: 60 });
  const { page, problems, context } = await openPage(browser, bridge.url);
  try {
    await page.getByRole("heading", { name: /Drop the files/ }).waitFor();
    assert.equal(new URL(page.url()).hash.includes("t="), false, "the token left the address");
    await page.screenshot({ path: picture("welcome-1440") });
    await openSample(page);
    const holes = Number(await data(page, "holes"));
    await page.screenshot({ path: picture("board-1440") });

    await tab(page, "Simulate").click();
    await page.getByRole("button", { name: "Play" }).click();
    await until(async () => Number(await data(page, "done")) > 3, "holes done in the playback");
    await page.screenshot({ path: picture("simulate-1440") });
    const time = page.getByRole("slider", { name: "Time", exact: true });
    await time.focus();
    await page.keyboard.press("End");
    await until(async () => Number(await data(page, "done")) === holes, "all holes done at the end of the playback");

    const { start } = await startJob(page);
    await page.screenshot({ path: picture("preflight-1440") });
    await start.click();
    await changeBits(page, async () => Number(await data(page, "done")) > holes / 4);
    await page.screenshot({ path: picture("drilling-1440") });
    await changeBits(page, () => page.getByText(/The job is done/).isVisible());
    await page.screenshot({ path: picture("done-1440") });
    assert.equal(Number(await data(page, "done")), holes);
    assert.deepEqual(problems, [], "nothing was said on the console");
  } finally {
    await context.close();
    await bridge.stop();
  }
});

test("a real board of the corpus is read, planned and drilled", async (t) => {
  const folder = corpus();
  if (!folder) return t.skip("no corpus");
  const bridge = await startBridge({ speed: 400 });
  const { page, context } = await openPage(browser, bridge.url, { width: 1024, height: 768 });
  try {
    const heading = page.getByRole("heading", { name: /Drop the files/ });
    await heading.waitFor();
    await page.screenshot({ path: picture("welcome-1024") });
    const chooser = page.waitForEvent("filechooser");
    await page.getByRole("button", { name: "Open files…" }).click();
    await (await chooser).setFiles([
      join(folder, "kicad/6.0-herovco-front/herovco_front.drl"),
      join(folder, "kicad/6.0-herovco-front/herovco_front-EdgeCuts.gm1"),
    ]);
    await until(async () => Number(await data(page, "holes")) > 0, "holes in the picture");
    const expected = JSON.parse(
      readFileSync(join(folder, "expected/kicad/6.0-herovco-front/herovco_front.drl.json"), "utf8"),
    ).expected.totals;
    assert.ok(Number(await data(page, "holes")) >= expected.hits, "every hit is in the picture");
    await planned(page);
    // Now no operation mills the slots: an error, and the job can't start before it is accepted.
    const seen = page.getByRole("checkbox", { name: /Accept/ });
    await seen.first().check();
    await planned(page);
    await page.screenshot({ path: picture("board-1024") });
    await tab(page, "Simulate").click();
    await page.screenshot({ path: picture("simulate-1024") });
    const { start } = await startJob(page);
    await start.click();
    await changeBits(page, async () => Number(await data(page, "done")) > 5);
    await page.screenshot({ path: picture("drilling-1024") });
    await changeBits(page, () => page.getByText(/The job is done/).isVisible());
  } finally {
    await context.close();
    await bridge.stop();
  }
});

test("of a board that was milled and drilled everything is done in the picture, of a page that came in the middle too", async () => {
  const bridge = await startBridge({ speed: 400 });
  const { page, context } = await openPage(browser, bridge.url);
  const seen = page.getByRole("button", { name: "Accept all" });
  try {
    await page.getByRole("button", { name: /Sample board/ }).click();
    await page.getByText(/^Planned .* m,/).waitFor();
    await tab(page, "CAM").click();
    await page.getByRole("heading", { name: "Operations" }).waitFor();
    await settled(page);
    if (await seen.isEnabled()) await seen.click();
    const { start } = await startJob(page);
    await start.click();
    await page.getByRole("button", { name: "Start spindle and continue" }).waitFor();
    await page.reload();
    await page.locator("main[data-screen=machine]").waitFor();
    await changeBits(page, () => page.getByText(/The job is done/).isVisible());
    await until(async () => (await data(page, "done")) === (await data(page, "holes")), "a picture in which every hole is done");
    assert.ok(Number(await data(page, "holes")) > 0);
    assert.ok(Number(await data(page, "layers")) > 0, "the copper of the board is on the map");
    const told = await page.getByRole("region", { name: "Job", exact: true }).locator(".big").innerText();
    assert.match(told, /^Toolpath (\d+) of \1, hole (\d+) of \2\s+100 %$/);
    await page.screenshot({ path: picture("milled-1440") });
  } finally {
    await context.close();
    await bridge.stop();
  }
});

test("a hole in the picture and its row in the list choose each other", async () => {
  const bridge = await startBridge();
  const { page, context } = await openPage(browser, bridge.url);
  try {
    await page.getByRole("heading", { name: /Drop the files/ }).waitFor();
    await openSample(page);
    assert.equal(await data(page, "selected"), "0");
    const list = page.getByRole("listbox", { name: "Holes in order of drilling" });
    await list.getByRole("option").first().click();
    await until(async () => (await data(page, "selected")) === "1", "the hole chosen in the picture");
    // And back: a click on the mounting hole in the lower left corner, where the camera shows it.
    let seen;
    await until(async () => {
      const now = `${await data(page, "zoom")} ${await data(page, "centre")}`;
      const still = now === seen;
      seen = now;
      await page.waitForTimeout(400);
      return still;
    }, "a camera at rest");
    const [x, y] = (await data(page, "centre")).split(" ").map(Number);
    const zoom = (Number(await data(page, "zoom")) * 96) / 25.4; // zoom 1 is actual size
    const box = await canvas(page).boundingBox();
    const at = { x: box.width / 2 + (3.81 - x) * zoom, y: box.height / 2 - (3.81 - y) * zoom };
    await canvas(page).click({ position: at });
    const chosen = list.getByRole("option", { selected: true });
    await until(async () => /3\.810\s*3\.810/.test(await chosen.innerText().catch(() => "")), "the row of the hole clicked");
  } finally {
    await context.close();
    await bridge.stop();
  }
});
