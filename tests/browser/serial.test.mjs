// A GRBL machine, or a drill with the USB step adapter, at a port of this computer, driven by the page alone
// with Web Serial and without a bridge. Checks the step pins of the firmware.

import assert from "node:assert/strict";
import { after, before } from "node:test";
import { firmware, renumbered, startAdapter } from "./adapter.mjs";
import { STEPS, instrument, plugInto, startBoard } from "./grbl.mjs";
import { mayStart, openBrowser, openPage, PATIENCE_MS, picture, pictures, planned, preflight, press, serveFiles, startBridge, tab, test, until } from "./harness.mjs";
import { HOLES, SPEED, begin, connect, digits, drillFile, goOn, home, isZero, moveTo, opened, ready, shown, touchOff } from "./mill.mjs";

/** Two tool sizes with six holes each. */
const DRILL = drillFile({ 0.8: HOLES.slice(0, 6), "1.0": HOLES.slice(6) });

const tools = instrument();
let browser;
before(async () => (browser = await openBrowser("none")));
after(async () => browser?.close());

test("the page alone connects a GRBL mill, moves it and makes a board of two tools, over STOP and a pulled cable", async (t) => {
  if (!tools) return t.skip("no GRBL");
  const [server, board] = [await serveFiles(), await startBoard(tools, SPEED)];
  const { page, context, problems } = await opened(browser, server, board, DRILL);
  try {
    await press(page, connect(page));
    await shown(page, /^GRBL 1\.1h/);
    await page.getByText("Its settings").click();
    await shown(page, /^\$110 = 5000 mm\/min/);
    await home(page);
    for (const axis of ["X", "Y", "Z"]) await moveTo(page, axis, -21);
    await press(page, page.getByRole("button", { name: /^Set work zero here/ }));
    await until(async () => isZero(await digits(page, "X")), "zero of X");
    // The job can't start before the height of the board is set, and the state says that.
    await shown(page, "No Z zero");
    await planned(page);
    await press(page, page.getByRole("button", { name: "Start…" }));
    await shown(page, /height of the board was not set/);
    await page.getByRole("dialog").getByRole("button", { name: "Cancel" }).click();
    await press(page, page.getByRole("button", { name: /^Set Z zero here/ }));
    await until(async () => isZero(await digits(page, "Z")), "zero of Z");
    const zero = await board.steps();
    // Shows only what such a board reports.
    assert.deepEqual(await page.getByRole("region", { name: "Sensors" }).getByRole("listitem").locator("span:first-of-type").allInnerTexts(), ["X switch", "Y switch", "Z switch", "Contact sensor"]);
    assert.equal(await page.getByText(/^(Bottom of stroke|XY released|Phases)$/).count(), 0);
    await pictures(page, "serial-ready");
    const rows = await begin(page, page.getByRole("button", { name: "Start…" }), "Start the job");
    assert.ok(rows.some((row) => /plans its own motion/.test(row)) && rows.some((row) => /Keep this page open/.test(row)), rows.join("\n"));
    // The first tool is the one that was in the spindle when the height was set.
    const change = page.getByRole("alertdialog");
    await change.getByRole("button", { name: /^Start spindle/ }).click();
    await shown(page, /^Hole [2-5] of 6/);
    await page.keyboard.press("Control+Shift+E");
    await shown(page, /^You stopped it/);
    const stopped = await board.steps();
    await new Promise((later) => setTimeout(later, 1000));
    assert.deepEqual(await board.steps(), stopped, "nothing moves after STOP");
    await begin(page, page.getByRole("button", { name: /Resume where it stopped/ }), "Resume the job");
    // The tool can be another one than before, so it is touched off before it cuts.
    await change.getByRole("button", { name: /^Start spindle/ }).click();
    await change.getByRole("button", { name: "Jog first" }).click();
    await shown(page, /was not touched off/);
    await page.getByRole("button", { name: "Close", exact: true }).click();
    await moveTo(page, "Z", 0);
    await press(page, page.getByRole("button", { name: /^Set Z zero here/ }));
    await page.screenshot({ path: picture("serial-touched-1440") });
    await goOn(page);
    // The second tool has another length.
    await touchOff(page);
    await shown(page, /^Hole [2-5] of 6/);
    // The page would now ask before closing.
    await board.replug();
    await shown(page, /The cable was pulled/);
    await pictures(page, "serial-pulled");
    await board.replug();
    await page.evaluate(() => navigator.serial.dispatchEvent(new Event("connect")));
    await shown(page, "The position is not known. Home first.");
    await page.getByRole("button", { name: "Close", exact: true }).click();
    await home(page);
    await begin(page, page.getByRole("button", { name: /Resume where it stopped/ }), "Resume the job");
    await touchOff(page);
    await shown(page, /^The job is done\./);
    await pictures(page, "serial-done");
    // After disconnecting, the page has its virtual drill again and remembers the port.
    await press(page, page.getByRole("button", { name: "Disconnect" }));
    await page.getByRole("button", { name: "Connect the one used before" }).waitFor();
    await shown(page, "The position is not known. Home first.");
    const dips = await board.end(zero[2] - 10);
    for (const [index, [x, y]] of HOLES.entries()) {
      const here = dips.filter(({ at }) => Math.abs(at[0] - zero[0] - x * STEPS) < 8 && Math.abs(at[1] - zero[1] - y * STEPS) < 8);
      assert.ok(here.length === 1 || here.length === 2, `hole ${index + 1} was made ${here.length} times`);
      assert.ok(here.some(({ lowest }) => lowest <= zero[2] - 1.6 * STEPS), `hole ${index + 1} goes through`);
    }
    const elsewhere = dips.filter(({ at, moved }) => moved || !HOLES.some(([x, y]) => Math.abs(at[0] - zero[0] - x * STEPS) < 8 && Math.abs(at[1] - zero[1] - y * STEPS) < 8));
    assert.deepEqual(elsewhere, [], "and nothing else");
    assert.ok(dips.length <= HOLES.length + 2, "at most the two that were in work are made twice");
    assert.deepEqual(problems, []);
  } finally {
    await context.close();
    server.stop();
    board.kill();
  }
});

test("a page without Web Serial drives the mill of the bridge, and the job continues while it is away", async (t) => {
  if (!tools) return t.skip("no GRBL");
  const board = await startBoard(tools, SPEED);
  const server = await startBridge({ speed: SPEED, args: ["--serial-port", board.path] });
  const { page, context, problems } = await openPage(browser, "about:blank");
  try {
    await context.addInitScript(() => Object.defineProperty(navigator, "serial", { value: undefined }));
    await page.goto(server.url);
    const chooser = page.waitForEvent("filechooser");
    await page.getByRole("button", { name: "Open files…" }).click();
    await (await chooser).setFiles({ name: "twelve.drl", mimeType: "text/plain", buffer: Buffer.from(drillFile({ 0.8: HOLES })) });
    await page.getByText(/^Planned .* m,/).waitFor();
    await tab(page, "Machine").click();
    await shown(page, /^GRBL 1\.1h/);
    // The port belongs to the bridge.
    assert.equal(await connect(page).count(), 0);
    assert.equal(await page.getByRole("button", { name: "Disconnect" }).count(), 0);
    await home(page);
    const zero = await ready(page, board);
    await planned(page);
    const rows = await begin(page, page.getByRole("button", { name: "Start…" }), "Start the job");
    assert.ok(rows.some((row) => /you may close this page/.test(row)) && !rows.some((row) => /Keep this page open/.test(row)), rows.join("\n"));
    await page.getByRole("alertdialog").getByRole("button", { name: /^Start spindle/ }).click();
    await shown(page, /^Hole [2-4] of 12/);
    await page.goto("about:blank");
    const left = await board.steps();
    await new Promise((later) => setTimeout(later, 2000));
    assert.notDeepEqual(await board.steps(), left, "the job continues");
    await page.goto(server.origin);
    await tab(page, "Machine").click();
    await shown(page, /^Hole \d+ of 12/);
    await shown(page, /^The job is done\./);
    await server.stop();
    const dips = await board.end(zero[2] - 10);
    assert.equal(dips.length, HOLES.length, "each hole once, and nothing else");
    assert.deepEqual(problems, []);
  } finally {
    await context.close();
    await server.stop();
    board.kill();
  }
});

test("a board that lies askew is touched from the page, its map is seen, and the job follows it", async (t) => {
  if (!tools) return t.skip("no GRBL");
  // The surface rises 20 µm per millimetre in X; at the work zero it is where the tip will touch it.
  const [server, board] = [await serveFiles(), await startBoard(tools, SPEED, "-20.58,0.02,0")];
  const { page, context, problems } = await opened(browser, server, board, DRILL);
  try {
    await press(page, connect(page));
    await shown(page, /^GRBL 1\.1h/);
    await home(page);
    for (const axis of ["X", "Y", "Z"]) await moveTo(page, axis, -21);
    await press(page, page.getByRole("button", { name: /^Set work zero here/ }));
    await until(async () => isZero(await digits(page, "X")), "zero of X");
    await planned(page);
    await press(page, page.getByRole("button", { name: "Height map…" }));
    const map = page.getByRole("dialog", { name: "Height map of the board" });
    const touch = map.getByRole("button", { name: "Probe the height map" });
    // Not before the height is known; the message is visible in the dialog.
    await press(page, touch);
    await map.getByText(/height of the board was not set/).waitFor();
    await map.getByRole("button", { name: "Close", exact: true }).click();
    await press(page, page.getByRole("button", { name: /^Set Z zero here/ }));
    await until(async () => isZero(await digits(page, "Z")), "zero of Z");
    const zero = await board.steps();
    await press(page, page.getByRole("button", { name: "Height map…" }));
    await map.getByRole("button", { name: "5 mm", exact: true }).click();
    await map.getByText(/^6 positions to probe/).waitFor();
    await press(page, touch);
    await map.getByText(/^[12] of 6 probed/).waitFor();
    await map.getByRole("button", { name: "Pause" }).click();
    await press(page, map.getByRole("button", { name: "Continue" }));
    await map.getByText(/^From .* mm; the largest correction is 0\.(1|2)/).waitFor();
    assert.equal(await map.locator("circle.touched").count(), 6);
    assert.equal(await map.locator("rect").count(), 2);
    await pictures(page, "level");
    await map.getByRole("button", { name: "Close", exact: true }).click();
    const rows = await begin(page, page.getByRole("button", { name: "Start…" }), "Start the job");
    assert.ok(rows.some((row) => /Depth follows the height map/.test(row)), rows.join("\n"));
    const change = page.getByRole("alertdialog");
    await change.getByRole("button", { name: /^Start spindle/ }).click();
    await shown(page, /^Hole [2-5] of 6/);
    await change.getByRole("button", { name: "Jog first" }).waitFor();
    await page.keyboard.press("Control+Shift+E");
    await shown(page, /^You stopped it/);
    const deep = (await board.end(zero[2] - 250)).filter(({ lowest }) => lowest < zero[2] - 1.2 * STEPS);
    assert.equal(deep.length, 6, "the holes of the first tool");
    const lowest = (x) => deep.find(({ at }) => Math.abs(at[0] - zero[0] - x * STEPS) < 8).lowest;
    assert.ok(Math.abs(lowest(10) - lowest(0) - 0.2 * STEPS) < 6, `${lowest(0)} and ${lowest(10)}`);
    assert.deepEqual(problems, []);
  } finally {
    await context.close();
    server.stop();
    board.kill();
  }
});

test("feed, spindle and rapids are as the controller reports them, and it reads the job before the start without a step", async (t) => {
  if (!tools) return t.skip("no GRBL");
  const [server, board] = [await serveFiles(), await startBoard(tools, SPEED)];
  const { page, context, port, problems } = await opened(browser, server, board, DRILL);
  const menu = (name) => page.getByRole("combobox", { name });
  const chosen = (name) => menu(name).evaluate((menu) => menu.selectedOptions[0]?.textContent);
  const became = (name, wanted) => until(async () => (await chosen(name)) === wanted, `${name} at ${wanted}`);
  try {
    // Our own drill has only the first of them.
    await menu("Feed override").waitFor();
    assert.equal(await menu("Spindle override").count(), 0);
    await press(page, connect(page));
    await shown(page, /^GRBL 1\.1h/);
    await home(page);
    await menu("Spindle override").selectOption("50");
    await menu("Rapid override").selectOption("25");
    await until(() => port.heard.filter((byte) => byte === 0x9b).length === 5 && port.heard.includes(0x97), "the steps to 50 %, and 25 %");
    // Changes made at the machine are shown too, once the values requested here are reported.
    await new Promise((later) => setTimeout(later, 3000));
    await page.evaluate(() => globalThis.boardHears([0x9b, 0x96]));
    await became("Spindle override", "40 %");
    await became("Rapid override", "50 %");
    await page.screenshot({ path: picture("serial-overrides-1440") });
    for (const axis of ["X", "Y", "Z"]) await moveTo(page, axis, -21);
    await press(page, page.getByRole("button", { name: /^Set work zero here/ }));
    await until(async () => isZero(await digits(page, "X")), "zero of X");
    await planned(page);
    await press(page, page.getByRole("button", { name: /^Set Z zero here/ }));
    await until(async () => isZero(await digits(page, "Z")), "zero of Z");
    const before = await board.steps();
    const dialog = await preflight(page, page.getByRole("button", { name: "Start…" }));
    await press(page, dialog.getByRole("button", { name: "Let the machine read it" }));
    await dialog.getByText(/^The controller has read all \d+ lines and accepts them/).waitFor();
    await page.screenshot({ path: picture("serial-checked-1440") });
    assert.deepEqual(await board.steps(), before, "nothing has moved");
    // The board has reset, and the job is still the one that was compared.
    await became("Spindle override", "100 %");
    await (await mayStart(dialog)).click();
    await page.getByRole("alertdialog").getByRole("button", { name: /^Start spindle/ }).click();
    await shown(page, /^Hole [2-5] of 6/);
    await page.keyboard.press("Control+Shift+E");
    await shown(page, /^You stopped it/);
    assert.deepEqual(problems, []);
  } finally {
    await context.close();
    server.stop();
    board.kill();
  }
});

test("a reload has the controller again without a dialog; a page of the bridge has it too, and goes back to the bridge", async (t) => {
  if (!tools) return t.skip("no GRBL");
  const [bridge, board] = [await startBridge(), await startBoard(tools, 1)];
  const { page, context } = await openPage(browser, "about:blank");
  try {
    await plugInto(context, board);
    await page.goto(bridge.url);
    await tab(page, "Machine").click();
    await press(page, connect(page));
    await shown(page, /^GRBL 1\.1h/);
    await page.reload();
    await tab(page, "Machine").click();
    await shown(page, /^GRBL 1\.1h/);
    await home(page);
    await press(page, page.getByRole("button", { name: "Disconnect" }));
    await shown(page, "The position is not known. Home first.");
    await connect(page).waitFor();
  } finally {
    await context.close();
    await bridge.stop();
    board.kill();
  }
});

/** Steps per millimetre of the default drill: XY and Z; the board's position from the top of Z, mm. */
const [PLANE, HEIGHT, BOARD] = [80, 400, -30];
/** Only two holes, mm from the work zero, because the emulator is slow. */
const TWO = [[0, 0], [2, 0]];
/** Limit for operations that take the adapter seconds: the emulator is seventeen times slower next to a page,
 *  and more on a busy computer. */
const EMULATED_MS = 4 * PATIENCE_MS;

test("the page alone drills a board through the USB step adapter, over a pulled cable", async (t) => {
  const built = firmware();
  if (!built) return t.skip("no firmware");
  const [server, board] = [await serveFiles(), await startAdapter(built)];
  const { page, context, problems } = await openPage(browser, "about:blank");
  try {
    await plugInto(context, board);
    await page.goto(server.url);
    const chooser = page.waitForEvent("filechooser");
    await page.getByRole("button", { name: "Open files…" }).click();
    const drill = ["M48", "METRIC", "T1C0.8", "%", "T1", ...TWO.map(([x, y]) => `X${x}.0Y${y}.0`), "M30", ""].join("\n");
    await (await chooser).setFiles({ name: "two.drl", mimeType: "text/plain", buffer: Buffer.from(drill) });
    await page.getByText(/^Planned .* m,/).waitFor();
    await tab(page, "Machine").click();
    await press(page, connect(page));
    await shown(page, /it sends the steps to the USB step adapter/);
    await shown(page, "The position is not known. Home first.");
    await page.screenshot({ path: picture("adapter-connected-1440") });
    await home(page, EMULATED_MS);
    assert.equal(await page.getByText(/other firmware/).count(), 0, "the firmware is that of these sources");
    const origin = board.place();
    await press(page, page.getByRole("button", { name: /^Set work zero here/ }));
    await page.getByText(/Zero at/).waitFor();
    await planned(page);
    const rows = await begin(page, page.getByRole("button", { name: "Start…" }), "Start the job");
    assert.ok(rows.some((row) => /same steps/i.test(row)), `page and adapter play the same steps: ${rows.join("\n")}`);
    const bit = page.getByRole("button", { name: "Start spindle and continue" });
    const bottom = origin[2] + HEIGHT * (BOARD + 1 - 1.6);
    const deep = board.below(bottom);
    await press(page, bit);
    await shown(page, /^Hole 1 of 2/);
    await deep;
    board.replug();
    // The page waits twenty seconds of real time for the adapter: emulate no more than needed.
    await until(() => !board.spindle(), "the spindle off: nobody is heard");
    const [rests, rest] = [board.steps(), board.place()];
    await board.passed(0.05);
    assert.equal(board.steps(), rests, "at rest on its path");
    board.replug();
    await page.evaluate(() => navigator.serial.dispatchEvent(new Event("connect")));
    await shown(page, /The adapter got no path in time/);
    await page.screenshot({ path: picture("adapter-ran-dry-1440") });
    assert.deepEqual(board.place().slice(0, 2), rest.slice(0, 2), "nothing but the bit, which is lifted, moves by itself");
    const dry = page.getByText(/The adapter got no path in time/).first();
    const done = page.getByText(/^The job is done\./).first();
    const ready = page.getByText("At rest, position known.").first();
    // A computer too busy to feed the adapter in time stops the job again; the user resumes it each time.
    let resumed = 0;
    for (; !(await done.isVisible()); resumed += 1) {
      assert.ok(resumed < 5, "resumed five times without an end");
      // While Z is being raised, the alarm can't be acknowledged, and the page reports that.
      await until(async () => {
        if (await ready.isVisible()) return true;
        await page.getByRole("button", { name: "Acknowledge" }).click({ timeout: 2000 }).catch(() => {});
        return false;
      }, "the alarm acknowledged");
      await begin(page, page.getByRole("button", { name: /Resume where it stopped/ }), "Resume the job");
      await press(page, bit);
      await until(async () => (await done.isVisible()) || (await dry.isVisible()), "the job done or stopped", EMULATED_MS);
    }
    await page.screenshot({ path: picture("adapter-done-1440") });
    const made = board.holes(bottom);
    for (const [x, y] of TWO) {
      const here = made.filter(({ at }) => Math.abs(at[0] - origin[0] - x * PLANE) <= 2 && Math.abs(at[1] - origin[1] - y * PLANE) <= 2);
      assert.ok(here.length >= 1, `a hole at ${x}, ${y}: ${JSON.stringify(made)}`);
    }
    assert.ok(made.length <= TWO.length + resumed, `each stop makes at most one hole twice: ${JSON.stringify(made)}`);
    assert.ok(made.every(({ turned }) => turned), "no hole without the spindle");
    assert.deepEqual(problems, []);
  } finally {
    await context.close();
    server.stop();
    board.kill();
  }
});

test("a page says that the adapter has another firmware, and how its own comes into it, until that is closed", async (t) => {
  const built = firmware();
  if (!built) return t.skip("no firmware");
  const [server, board] = [await serveFiles(), await startAdapter(renumbered(built))];
  const { page, context, problems } = await openPage(browser, "about:blank");
  try {
    await plugInto(context, board);
    await page.goto(server.url);
    await tab(page, "Machine").click();
    await press(page, connect(page));
    await shown(page, /^The adapter has other firmware/);
    const notice = page.locator(".notice", { hasText: "other firmware" });
    assert.match(await notice.textContent(), /annulus firmware flash/);
    await page.screenshot({ path: picture("adapter-other-firmware-1440") });
    await press(page, notice.getByRole("button", { name: "Close", exact: true }));
    await notice.waitFor({ state: "detached" });
    // A second of reports from the same adapter.
    await board.passed(1);
    assert.equal(await notice.count(), 0, "what was read is not told again");
    assert.deepEqual(problems, []);
  } finally {
    await context.close();
    server.stop();
    board.kill();
  }
});

test("the filter of a sensor is set by the page, and touches that were shorter are shown in the Lab", async (t) => {
  const built = firmware();
  if (!built) return t.skip("no firmware");
  const [server, board] = [await serveFiles(), await startAdapter(built)];
  const { page, context, problems } = await openPage(browser, "about:blank");
  try {
    await plugInto(context, board);
    await page.goto(server.url);
    await tab(page, "Machine").click();
    await press(page, connect(page));
    await shown(page, /it sends the steps to the USB step adapter/);
    await shown(page, "The position is not known. Home first.");
    await tab(page, "Lab").click();
    await page.getByRole("tab", { name: "Inputs and outputs" }).click();
    const column = page.getByRole("columnheader", { name: "Short touches" });
    await page.getByRole("columnheader", { name: "Last change" }).waitFor();
    assert.equal(await column.count(), 0, "nothing is filtered, nothing is counted");
    await tab(page, "Settings").click();
    await page.getByRole("button", { name: "Card or adapter", exact: true }).click();
    await page.locator("#setting-adapter-filters").fill("0 200 0 0 0 0 0");
    await press(page, page.getByRole("button", { name: "Apply" }));
    await page.getByRole("button", { name: "Apply" }).waitFor({ state: "detached" });
    await tab(page, "Lab").click();
    await page.getByRole("tab", { name: "Inputs and outputs" }).click();
    await column.waitFor();
    for (let count = 0; count < 3; count++) board.touch(1, 150);
    await page.getByRole("cell", { name: /^3 \(longest 15\d µs\)$/ }).waitFor();
    await page.screenshot({ path: picture("adapter-touches-1440") });
    assert.deepEqual(problems, []);
  } finally {
    await context.close();
    server.stop();
    board.kill();
  }
});

test("a browser without serial ports says so, with what to do", async () => {
  const server = await serveFiles();
  const { page, context } = await openPage(browser, "about:blank");
  try {
    await context.addInitScript(() => Object.defineProperty(navigator, "serial", { value: undefined }));
    await page.goto(server.url);
    await tab(page, "Machine").click();
    await shown(page, /This browser gives no page a serial port/);
    assert.equal(await connect(page).count(), 0);
  } finally {
    await context.close();
    server.stop();
  }
});
