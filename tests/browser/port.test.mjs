// Port faults of a GRBL machine driven by the page: a pulled cable, a page that hangs, is hidden or closed,
// line errors, wrong ports. Runs the unmodified GRBL firmware; checks its step pins.

import assert from "node:assert/strict";
import { after, before } from "node:test";
import { STEPS, instrument, startBoard } from "./grbl.mjs";
import { openBrowser, picture, planned, press, serveFiles, test, until } from "./harness.mjs";
import { HOLES, SPEED, WAYS, begin, connect, drillFile, home, opened, ready, shown, touchOff } from "./mill.mjs";

/** One tool, six holes. */
const DRILL = drillFile({ 0.8: HOLES.slice(0, 6) });

const tools = instrument();
let browser;
before(async () => (browser = await openBrowser("none")));
after(async () => browser?.close());

/** A test of a page with a GRBL machine at its port, connected and homed. */
function mill(name, act, { speed = SPEED, drill = DRILL } = {}) {
  test(name, async (t) => {
    if (!tools) return t.skip("no GRBL");
    const [server, board] = [await serveFiles(), await startBoard(tools, speed)];
    const { page, context, problems, port } = await opened(browser, server, board, drill, speed);
    try {
      await act({ page, context, board, port, problems });
      assert.deepEqual(problems, []);
    } finally {
      await context.close();
      server.stop();
      board.kill();
    }
  });
}

async function connected(page) {
  await press(page, connect(page));
  await shown(page, /^GRBL 1\.1h/);
  await home(page);
}

/** A job of one tool, at its second hole. */
async function drilling(page, board) {
  const zero = await ready(page, board);
  await planned(page);
  await begin(page, page.getByRole("button", { name: "Start…" }), "Start the job");
  await page.getByRole("alertdialog").getByRole("button", { name: /^Start spindle/ }).click();
  await shown(page, /^Hole [2-4] of 6/);
  return zero;
}

/** Waits until the board has stopped; returns its steps. */
async function rests(board) {
  let before = "";
  return until(async () => {
    const now = JSON.stringify(await board.steps());
    const is = now === before;
    before = now;
    if (!is) await new Promise((later) => setTimeout(later, 300));
    return is && JSON.parse(now);
  }, "a board at rest");
}

/** Holds a jog button until the axis has moved this far. Presses again if a busy page ended the jog early, or
 *  if the board counted as lost for a moment. */
async function hold(page, board, axis, up, mm) {
  const button = page.getByRole("button", { name: WAYS[axis][up ? 1 : 0], exact: true });
  const steps = async () => (await board.steps())["XYZ".indexOf(axis)];
  for (let again = 0; again < 5; again++) {
    // Waits until the page, too, has left the previous state, such as a hang.
    await shown(page, "At rest, position known.");
    const from = await steps();
    await button.scrollIntoViewIfNeeded();
    await button.hover();
    await page.mouse.down();
    for (const end = Date.now() + 20_000; Date.now() < end && (await steps()) === from; ) await new Promise((later) => setTimeout(later, 100));
    for (let before = from, now = await steps(); now !== before; before = now, now = await steps()) {
      if (Math.abs(now - from) > mm * STEPS) return;
      await new Promise((later) => setTimeout(later, 300));
    }
    await page.mouse.up();
  }
  assert.fail(`no hold of ${mm} mm in five`);
}

/** Resumes a job whenever it is held, until it is done. */
async function resumed(page) {
  const resume = page.getByRole("button", { name: "Resume", exact: true });
  const take = page.getByRole("button", { name: "Take control" });
  const done = page.getByText(/^The job is done\./).first();
  const soon = { timeout: 2000 };
  await until(async () => {
    if (await take.isVisible()) await take.click(soon).catch(() => {});
    if (await resume.isVisible()) {
      await resume.click(soon).catch(() => {});
      await resume.waitFor({ state: "hidden", ...soon }).catch(() => {});
    }
    return done.isVisible();
  }, "the end of the job");
}

/** Checks that every hole was drilled once, up to `twice` holes a second time after a disturbance, and
 *  nothing else. */
async function judged(board, zero, twice = 0) {
  const dips = await board.end(zero[2] - 10);
  const at = ([x, y]) => dips.filter(({ at }) => Math.abs(at[0] - zero[0] - x * STEPS) < 8 && Math.abs(at[1] - zero[1] - y * STEPS) < 8);
  for (const hole of HOLES.slice(0, 6)) {
    assert.ok(at(hole).some(({ lowest }) => lowest <= zero[2] - 1.6 * STEPS), `the hole at ${hole} goes through`);
  }
  assert.ok(dips.length <= 6 + twice && dips.every(({ moved }) => !moved), JSON.stringify(dips));
}

mill("a hold goes evenly, ends when it is let go, and soon when the cable is out or the page hangs", async ({ page, board }) => {
  await connected(page);
  await page.getByRole("button", { name: "1", exact: true }).click();
  await hold(page, board, "X", false, 25);
  await page.mouse.up();
  await rests(board);
  // A hanging page sends nothing: the board only executes what it has already received.
  await hold(page, board, "Y", false, 10);
  const hangs = board.steps().then(async (begins) => [begins, await rests(board)]);
  await page.evaluate(() => {
    for (const end = Date.now() + 4000; Date.now() < end; );
  });
  const [begins, ends] = await hangs;
  const hung = (begins[1] - ends[1]) / STEPS;
  await page.mouse.up();
  await rests(board);
  await hold(page, board, "Z", false, 4);
  const before = (await board.steps())[2];
  await board.replug();
  const went = (before - (await rests(board))[2]) / STEPS;
  await page.mouse.up();
  await board.off();
  console.log(`went on for ${hung.toFixed(2)} mm when the page hung, for ${went.toFixed(2)} mm from before the cable was pulled`);
  // From the check of the pins until the hang or the unplugging, the board kept moving too.
  assert.ok(hung < 20 && went < 8, `${hung} ${went}`);
  // At full speed from 1 mm after the start to 1 mm before the end: a step time every 0.1 mm.
  const [span, moves] = [STEPS / 10, board.moves("X").filter(([, to]) => to < -2 * STEPS)];
  const firsts = moves.flatMap(([s], at) => (at === 0 || s - moves[at - 1][0] > 0.3 ? [at] : []));
  const ways = firsts.map((from, at) => moves.slice(from, firsts[at + 1]));
  const way = ways.reduce((a, b) => (b.length > a.length ? b : a)).slice(STEPS, -STEPS);
  const speeds = way.slice(span).map(([s], at) => 0.1 / (s - way[at][0]));
  const slow = speeds.filter((mm_per_s) => mm_per_s < 0.97 * (1000 / 60)).length;
  console.log(`${slow} of ${speeds.length} places slower than 1000 mm/min`);
  assert.ok(speeds.length > 10 * STEPS && slow * 4 < speeds.length, `${slow} of ${speeds.length} places slow`);
}, { speed: 1 });

mill("a page that stood still for seconds has its job held, with its place, and it goes on where it was", async ({ page, board }) => {
  await connected(page);
  const zero = await drilling(page, board);
  await page.evaluate(() => {
    for (const end = Date.now() + 7000; Date.now() < end; );
  });
  await shown(page, /stalled for 4 s or longer/);
  await page.screenshot({ path: picture("port-stood-1440") });
  await resumed(page);
  await judged(board, zero);
});

mill("whoever is asked whether to leave, and thinks it over, keeps the job", async ({ page, board }) => {
  await connected(page);
  const zero = await drilling(page, board);
  const asked = new Promise((told) => page.once("dialog", told));
  await page.evaluate(() => setTimeout(() => location.reload()));
  const dialog = await asked;
  assert.equal(dialog.type(), "beforeunload");
  await new Promise((later) => setTimeout(later, 7000));
  await dialog.dismiss();
  const resume = page.getByRole("button", { name: "Resume", exact: true });
  const done = page.getByText(/^The job is done\./).first();
  await until(async () => (await resume.isVisible()) || (await done.isVisible()), "a job that is held, or done");
  console.log(`while it asked, the page stood still: ${await resume.isVisible()}`);
  await resumed(page);
  await judged(board, zero);
});

mill("a page that is left in mid-job: the next one offers the rest, and leaves no hole out", async ({ page, board }) => {
  await connected(page);
  const zero = await drilling(page, board);
  page.once("dialog", (dialog) => dialog.accept());
  await page.evaluate(() => setTimeout(() => location.reload()));
  // The browser may or may not still send the feed hold; without it, the board drills what it has: three
  // holes or four. The record of drilled holes is saved; the port is opened again, and the board resets.
  await shown(page, "The position is not known. Home first.");
  await home(page);
  await begin(page, page.getByRole("button", { name: /Resume where it stopped/ }), "Resume the job");
  await touchOff(page);
  await shown(page, /^The job is done\./);
  await judged(board, zero, 4);
});

mill("a page that is told to be hidden makes its job to the end, and what moves by hand ends", async ({ page, board }) => {
  await connected(page);
  // A headless browser hides no page, so fake the event.
  const hide = (hidden) =>
    page.evaluate((hidden) => {
      Object.defineProperty(document, "hidden", { value: hidden, configurable: true });
      Object.defineProperty(document, "visibilityState", { value: hidden ? "hidden" : "visible", configurable: true });
      document.dispatchEvent(new Event("visibilitychange"));
    }, hidden);
  await hold(page, board, "X", false, 10);
  await hide(true);
  const at = await rests(board);
  await page.mouse.up();
  assert.ok(at[0] > -150 * STEPS, "it did not go to the end of the travel");
  await hide(false);
  const zero = await drilling(page, board);
  await hide(true);
  await until(() => page.getByText(/^The job is done\./).first().isVisible(), "the end of the job");
  await judged(board, zero);
});

mill("a line that is disturbed is no cable that is out: it is said once, and the job goes on", async ({ page, board, port }) => {
  await page.evaluate(() => navigator.serial.disturb("BreakError"));
  await connected(page);
  assert.equal(await page.getByText(/The cable is disturbed/).count(), 0, "what was before anybody was there is not told");
  const zero = await drilling(page, board);
  const notice = page.getByText(/The cable is disturbed: FramingError, \d+× so far/);
  await page.evaluate(() => navigator.serial.disturb("FramingError"));
  await notice.first().waitFor();
  for (const name of ["ParityError", "BufferOverrunError"]) await page.evaluate((name) => navigator.serial.disturb(name), name);
  await shown(page, /The cable is disturbed: BufferOverrunError, 4× so far/);
  await page.screenshot({ path: picture("port-disturbed-1440") });
  // One notice at a time: the end of the job is shown before this one.
  await shown(page, /^The job is done\./);
  await page.getByRole("button", { name: "Close", exact: true }).first().click();
  await shown(page, /The cable is disturbed: BufferOverrunError, 4× so far/);
  assert.equal(port.opens, 1, "the port was never opened anew");
  await judged(board, zero);
});

mill("plugged in again it is the port of before that is opened, and among several a person is asked", async ({ page, board, port }) => {
  const strange = (info) => page.evaluate((info) => navigator.serial.strange(info), info);
  const opens = () => page.evaluate(() => navigator.serial.strange_opens);
  await connected(page);
  // Another port of this site with another USB id; the browser creates a new object for the first one.
  await strange({ usbVendorId: 0x2341, usbProductId: 0x43 });
  const replug = async () => {
    await board.replug();
    await until(() => page.evaluate(() => navigator.serial.getPorts().then((ports) => !ports.some(({ readable }) => readable))), "a cable that is out");
    await page.evaluate(() => navigator.serial.anew());
    await board.replug();
    await page.evaluate(() => navigator.serial.dispatchEvent(new Event("connect")));
  };
  await replug();
  await shown(page, "The position is not known. Home first.");
  await shown(page, /^GRBL 1\.1h/);
  assert.deepEqual([port.opens, await opens()], [2, 0]);
  // And one with the same USB id: these two can't be distinguished.
  await strange({ usbVendorId: 0x1a86, usbProductId: 0x7523 });
  await replug();
  await shown(page, /Several ports may be the one/);
  await page.screenshot({ path: picture("port-several-1440") });
  assert.deepEqual([port.opens, await opens()], [2, 0]);
  await press(page, connect(page));
  await shown(page, /^GRBL 1\.1h/);
  assert.equal(port.opens, 3, "the one that the person chose");
});
