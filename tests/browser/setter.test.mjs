// A tool setter at a machine driven by the page: selected in the settings, mentioned before the start, each
// step shown during a measurement. Runs the unmodified GRBL firmware with the setter as its probe's surface;
// checks its step pins.

import assert from "node:assert/strict";
import { after, before } from "node:test";
import { STEPS, instrument, startBoard } from "./grbl.mjs";
import { openBrowser, picture, pictures, planned, press, serveFiles, tab, test, until } from "./harness.mjs";
import { HOLES, SPEED, begin, connect, drillFile, home, opened, ready, shown } from "./mill.mjs";

const tools = instrument();
let browser;
before(async () => (browser = await openBrowser("none")));
after(async () => browser?.close());

/** Waits until the tip moves down to the setter. */
async function goesDown(page) {
  const change = page.getByRole("alertdialog");
  const step = change.locator('.measurement [aria-current="step"]');
  await until(async () => (await step.allTextContents()).join() === "Down until the probe input closes", "the tip on its way down");
  assert.equal(await change.getByRole("button", { name: /^Start spindle/ }).isEnabled(), false, "there is nothing to continue meanwhile");
}

/** Continues the tool change, and waits until the tool is measured. */
async function measured(page) {
  const change = page.getByRole("alertdialog");
  await press(page, change.getByRole("button", { name: /^Start spindle/ }));
  await goesDown(page);
  await pictures(page, "setter-measures");
  await change.waitFor({ state: "hidden" });
}

test("a tool setter is chosen once, said before the start, and measures each tool step by step", async (t) => {
  if (!tools) return t.skip("no GRBL");
  const [server, board] = [await serveFiles(), await startBoard(tools, SPEED, "-10,0,0")];
  const drill = drillFile({ 0.8: HOLES.slice(0, 2), 1.0: HOLES.slice(2, 4) });
  const { page, context, problems } = await opened(browser, server, board, drill);
  try {
    await press(page, connect(page));
    await shown(page, /^GRBL 1\.1h/);
    await home(page);
    await tab(page, "Settings").click();
    await page.getByRole("button", { name: "Probing", exact: true }).click();
    const how = page.getByRole("combobox", { name: "Tool length source" });
    assert.equal(await how.inputValue(), "board");
    await page.screenshot({ path: picture("setter-board") });
    await how.selectOption("setter");
    await press(page, page.getByRole("button", { name: "Use current position" }));
    const field = (name) => page.getByLabel(name);
    const apply = page.getByRole("button", { name: "Apply" });
    await until(async () => (await field("Position, X").inputValue()) === "-1", "the place of the head");
    await field("Probe depth at most").fill("nothing");
    await shown(page, /^A tool setter cannot have these numbers/);
    assert.ok(await apply.isDisabled(), "wrong numbers are not applied");
    await field("Probe depth at most").fill("15");
    await press(page, apply);
    await page.getByText("The machine has the new settings.").waitFor();
    await pictures(page, "setter-settings");
    await tab(page, "Machine").click();
    const zero = await ready(page, board);
    await planned(page);
    const rows = await begin(page, page.getByRole("button", { name: "Start…" }), "Start the job");
    assert.ok(rows.some((row) => /over the tool setter at X -1\.000 Y -1\.000, and down to measure the tool/.test(row)), rows.join("\n"));
    // The tool with which Z zero was set is measured first, before any tool change.
    await goesDown(page);
    await measured(page);
    await page.getByRole("alertdialog").getByRole("button", { name: /^Start spindle/ }).waitFor();
    await measured(page);
    await shown(page, /^The job is done\./);
    const dips = await board.end(zero[2] - 10);
    assert.ok(dips.length === 4 && dips.every(({ moved }) => !moved), JSON.stringify(dips));
    for (const [x, y] of HOLES.slice(0, 4)) {
      const here = ({ at }) => Math.abs(at[0] - zero[0] - x * STEPS) < 8 && Math.abs(at[1] - zero[1] - y * STEPS) < 8;
      assert.ok(dips.find(here).lowest <= zero[2] - 1.6 * STEPS, `the hole at ${x}, ${y} goes through`);
    }
    assert.deepEqual(problems, []);
  } finally {
    await context.close();
    server.stop();
    board.kill();
  }
});
