// The machine profile of a GRBL controller and what is compared with it; where drill strokes ended, as a map
// of the holes.

import assert from "node:assert/strict";
import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before } from "node:test";
import { instrument, startBoard } from "./grbl.mjs";
import { drillOnly, openBrowser, openPage, picture, preflight, press, serveFiles, startBridge, startJob, tab, test, until } from "./harness.mjs";
import { SPEED, connect, drillFile, HOLES, home, opened, shown } from "./mill.mjs";

const tools = instrument();
let browser;
before(async () => (browser = await openBrowser("none")));
after(async () => browser?.close());

test("a controller that is set up for another mill than it is said to be is told of before a job; the choice is kept", async (t) => {
  if (!tools) return t.skip("no GRBL");
  const [server, board] = [await serveFiles(), await startBoard(tools, SPEED)];
  const { page, context, problems } = await opened(browser, server, board, drillFile({ 0.8: HOLES.slice(0, 3) }));
  try {
    await press(page, connect(page));
    await shown(page, /^GRBL 1\.1h/);
    await home(page);
    await tab(page, "Settings").click();
    const mill = page.getByRole("combobox", { name: /^Machine model/ });
    assert.equal(await mill.inputValue(), "");
    await mill.selectOption("shapeoko-3");
    await press(page, page.getByRole("button", { name: "Apply" }));
    await page.getByText("The machine has the new settings.").waitFor();
    await page.screenshot({ path: picture("mills-settings") });
    await tab(page, "Machine").click();
    await press(page, page.getByRole("button", { name: /^Set work zero here/ }));
    const dialog = await preflight(page, page.getByRole("button", { name: "Start…" }));
    await dialog.getByText(/^The board would have the wrong size: steps per mm of X \(\$100\) are 250, 40 on a Shapeoko 3\./).waitFor();
    await page.screenshot({ path: picture("mills-preflight") });
    await dialog.getByRole("button", { name: "Cancel" }).click();
    await page.reload();
    await tab(page, "Machine").click();
    await shown(page, /^GRBL 1\.1h/);
    await tab(page, "Settings").click();
    await until(async () => (await mill.inputValue()) === "shapeoko-3", "the mill that was chosen");
    assert.deepEqual(problems, []);
  } finally {
    await context.close();
    server.stop();
    board.kill();
  }
});

test("strokes that end on their sensor are a map of the holes, and a table with the furthest off first", async () => {
  const folder = mkdtempSync(join(tmpdir(), "annulus-machine-"));
  const file = join(folder, "machine.toml");
  writeFileSync(file, 'schema = 1\n[rack]\nchange = "unattended"\n[stroke]\nend = "sensor"\n[overlap]\non = "no"\n');
  const bridge = await startBridge({ speed: 200, args: ["--machine", file] });
  const { page, context, problems } = await openPage(browser, bridge.url, { width: 1024, height: 768 });
  try {
    await page.getByRole("button", { name: /Sample board/ }).click();
    await page.getByText(/^Planned .* m,/).waitFor();
    await drillOnly(page);
    const { start } = await startJob(page);
    const block = page.locator("details.contacts");
    assert.equal(await block.count(), 0, "no stroke has ended yet");
    await start.click();
    await block.waitFor();
    await page.getByText(/^The job is done/).first().waitFor();
    await block.locator("summary").click();
    const rings = await block.locator("circle").count();
    await block.getByText(new RegExp(`^${rings} holes; the middle one ended at −?-?\\d`)).waitFor();
    assert.ok(rings > 3, `${rings} rings`);
    const off = await block.locator("tbody tr td:last-child").allInnerTexts();
    const far = off.map((text) => Math.abs(Number(text.replace("−", "-"))));
    assert.equal(off.length, Math.min(rings, 12));
    assert.ok(far.every((mm, row) => row === 0 || mm <= far[row - 1]), off.join(" "));
    await page.screenshot({ path: picture("contacts") });
    assert.deepEqual(problems, []);
  } finally {
    await context.close();
    await bridge.stop();
    rmSync(folder, { recursive: true, force: true });
  }
});
