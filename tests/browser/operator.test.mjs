// The operator's view during a job, after a fault, and during recovery, with the real bridge. Short-lived
// states are recorded inside the page, because polling could miss them.

import assert from "node:assert/strict";
import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before } from "node:test";
import { atRest, drillOnly, openBrowser, openPage, picture, planned, press, show, startBridge, startJob, tab, test, until } from "./harness.mjs";

let browser;
before(async () => (browser = await openBrowser("none")));
after(async () => browser?.close());

const SMALL = { width: 1024, height: 768 };
const go_on = (page) => page.getByRole("button", { name: "Start spindle and continue" });

/** A page of a bridge with these machine settings and faults; `end` stops both. */
async function at(settings, faults = [], speed = 200) {
  const folder = mkdtempSync(join(tmpdir(), "annulus-machine-"));
  const file = join(folder, "machine.toml");
  writeFileSync(file, `schema = 1\n${settings}`);
  const bridge = await startBridge({ speed, args: ["--machine", file, ...faults.flatMap((fault) => ["--fault", fault])] });
  const { page, context, problems } = await openPage(browser, bridge.url, SMALL);
  const end = async () => {
    await context.close();
    await bridge.stop();
    rmSync(folder, { recursive: true, force: true });
  };
  return { page, problems, end };
}

async function sample(page) {
  await page.getByRole("button", { name: /Sample board/ }).click();
  await page.getByText(/^Planned .* m,/).waitFor();
}

/** Confirms every tool change until `done`. */
async function fetching(page, done, what) {
  await until(async () => {
    if (await go_on(page).isVisible().catch(() => false)) await go_on(page).click({ timeout: 2000 }).catch(() => {});
    return done();
  }, what);
}

/** Records every distinct result of `look` after changes of the page; `noted` returns them. */
async function note(page, look) {
  await page.evaluate((look) => {
    const noted = new Set();
    const find = new Function(look);
    const seen = () => {
      const found = find();
      if (found) noted.add(JSON.stringify(found));
    };
    new MutationObserver(seen).observe(document.body, { subtree: true, childList: true, characterData: true, attributes: true });
    globalThis.noted = noted;
  }, look);
  return () => page.evaluate(() => [...globalThis.noted].map((text) => JSON.parse(text)));
}

/** The elements shown below the tabs during an alarm: bars, banners, notices, green ticks. */
const WHILE_ALARMED = `
  const count = (what) => [...document.querySelectorAll(what)].filter((one) => one.getClientRects().length > 0).length;
  if (count(".alarm-bar") === 0) return null;
  return [count(".alarm-bar"), count(".banner"), count(".notice"), count(":is(.notice, .banner, .alarm-bar).tone-run")];`;

test("an alarm in mid-job is one bar on every screen, with no other word and no green tick; the log has the rest", async () => {
  const { page, problems, end } = await at("[stroke]\ncontact_tolerance = 0.1\n", ["contact-early@3"], 60);
  try {
    await sample(page);
    await drillOnly(page);
    const { start } = await startJob(page);
    const noted = await note(page, WHILE_ALARMED);
    await start.click();
    const bar = page.locator(".alarm-bar");
    await fetching(page, () => bar.isVisible(), "the alarm");
    await bar.getByText("control.early_contact").waitFor();
    // The alarm has ended the job and stopped the spindle: no separate message about these.
    await page.getByText("0 rpm", { exact: true }).waitFor();
    for (const screen of ["Board", "CAM", "Simulate", "Machine"]) {
      await show(page, screen);
      await atRest(page);
      assert.equal(await bar.count(), 1, screen);
    }
    assert.deepEqual(await noted(), [[1, 0, 0, 0]], "bars, banners, notices and ticks whenever an alarm stood");
    await page.screenshot({ path: picture("alarm-1024") });
    await show(page, "Lab");
    await page.getByRole("tab", { name: "Log" }).click();
    const log = page.getByRole("tabpanel").or(page.locator("main")).first();
    await log.getByText(/Ended by an alarm\. Holes drilled: \d+/).first().waitFor();
    await log.getByText(/The tool touched something 0\.2\d mm above/).first().waitFor();
    assert.deepEqual(problems, []);
  } finally {
    await end();
  }
});

test("the way back leads from an alarm to Resume by its own buttons; a bit that is low again is out before the job goes on", async () => {
  const { page, problems, end } = await at("[stroke]\ncontact_tolerance = 0.1\n", ["contact-early@3"], 60);
  try {
    await sample(page);
    await drillOnly(page);
    const { start } = await startJob(page);
    await start.click();
    await fetching(page, () => page.locator(".alarm-bar").isVisible(), "the alarm");
    const way = page.getByRole("region", { name: "Recovery" });
    const step = (words) => way.getByRole("listitem").filter({ hasText: words });
    const mark = (words) => step(words).getAttribute("class");
    await step("Read the alarm").getByRole("button", { name: "I have read it" }).click();
    const tool = step("Check the tool");
    await tool.getByRole("button", { name: "I have checked it" }).waitFor();
    assert.deepEqual([await mark("Read the alarm"), await mark("Lift the tool out"), await mark("Resume the job")], ["done", "done", "now"]);
    // The tip is jogged down, so it must be raised before anything else.
    const hand = page.getByRole("region", { name: "Jog", exact: true });
    await hand.getByRole("button", { name: "10", exact: true }).click();
    const up = step("Lift the tool out").getByRole("button", { name: "Move Z up" });
    await until(async () => {
      if (await up.isVisible()) return true;
      await hand.getByRole("button", { name: "Move Z down" }).click({ timeout: 2000 }).catch(() => {});
      return false;
    }, "the tip in the board");
    assert.equal(await mark("Resume the job"), "later");
    await page.screenshot({ path: picture("way-back-1024") });
    await until(async () => {
      if ((await mark("Lift the tool out")) === "done") return true;
      // A press within a second after something moved has no effect.
      await up.click({ timeout: 2000 }).catch(() => {});
      return false;
    }, "the bit out of the board");
    await press(page, tool.getByRole("button", { name: "I have checked it" }));
    await until(async () => (await mark("Check the tool")) === "done", "the bit looked at");
    assert.equal(await mark("Resume the job"), "now");
    assert.deepEqual(problems, []);
  } finally {
    await end();
  }
});

/** What the page shows about the running job: part, hole or toolpath, and the marked stage. */
const IN_WORK = `
  const text = (what) => document.querySelector(what)?.textContent ?? "";
  const stage = text('.stage-chip[aria-current="step"]');
  return stage ? [text(".job-progress strong"), text(".job-progress p"), stage] : null;`;

test("a job with isolation says that it mills, which operation of how many, and which toolpath of it", async () => {
  const { page, problems, end } = await at("", [], 20);
  try {
    await sample(page);
    await tab(page, "CAM").click();
    await page.getByRole("heading", { name: "Operations" }).waitFor();
    await planned(page);
    const seen = page.getByRole("button", { name: "Accept all" });
    if (await seen.isEnabled()) await seen.click();
    const { start } = await startJob(page);
    const noted = await note(page, IN_WORK);
    await start.click();
    const said = async () => (await noted()).filter(([part]) => /^\d+ of \d+: Isolate/.test(part));
    const milling = async () => (await said()).filter(([, , stage]) => stage === "Milling");
    await fetching(page, async () => (await milling()).length > 2, "milling that is told");
    const told = await milling();
    for (const [part, within] of told) {
      assert.match(part, /^1 of [2-9]: Isolate/, part);
      assert.match(within, /^Toolpath \d+ of \d+$/, within);
    }
    const numbers = told.map(([, within]) => Number(within.match(/\d+/)[0]));
    assert.ok(Math.max(...numbers) > Math.min(...numbers), `it goes on: ${numbers}`);
    await page.screenshot({ path: picture("milling-1024") });
    assert.deepEqual(problems, []);
  } finally {
    await end();
  }
});

test("each of several spindles has its depth and its time to the board, and what lets X and Y go on", async () => {
  const { page, problems, end } = await at("[machine]\nspindles = 3\n[spindle]\ndeeper = [0.0, 0.0, 0.3]\nenabled = [1, 0, 1]\n");
  try {
    await sample(page);
    await tab(page, "Machine").click();
    const table = page.getByRole("table", { name: "Spindles in this hole" });
    await table.waitFor();
    const row = async (name) => (await table.getByRole("row", { name }).innerText()).replaceAll(/\s+/g, " ");
    const numbers = async (name) => (await row(name)).match(/^Z\d ([\d.]+) mm ([\d.]+) ms$/).slice(1).map(Number);
    const [deep, ms] = await numbers("Z1");
    const [deeper, its_ms] = await numbers("Z3");
    assert.ok(deep > 1 && Math.abs(deeper - deep - 0.3) < 0.002 && ms > 1 && its_ms > 1, `${deep} ${ms}, ${deeper} ${its_ms}`);
    assert.equal(await row("Z2"), "Z2 stays up");
    await page.getByText(/not before the contact sensor opens/).waitFor();
    await page.screenshot({ path: picture("spindles-1024") });
    assert.deepEqual(problems, []);
  } finally {
    await end();
  }
});

test("the clamp of a magazine whose change stopped is opened from the page, asked first with what falls out", async () => {
  const { page, problems, end } = await at('[rack]\nchange = "magazine"\n', ["clamp-stuck@2"]);
  try {
    await sample(page);
    await drillOnly(page);
    await tab(page, "Machine").click();
    await press(page, page.getByRole("button", { name: "Home", exact: true }));
    await page.getByText("At rest, position known.").waitFor();
    const magazine = page.getByRole("region", { name: "Magazine" });
    await magazine.getByText("Set magazine contents").click();
    const fill = magazine.getByRole("button", { name: "Slots hold the job's tools" });
    const none = magazine.getByRole("button", { name: "All slots are empty" });
    const [one, other] = [await fill.boundingBox(), await none.boundingBox()];
    const apart = Math.max(other.x - one.x - one.width, other.y - one.y - one.height);
    assert.ok(apart >= 4, `two buttons that touch: ${apart} px between them`);
    await press(page, fill);
    const { start } = await startJob(page);
    await start.click();
    await page.locator(".alarm-bar").getByText("magazine.clamp_closed").waitFor();
    await until(async () => {
      await page.getByRole("button", { name: "Acknowledge" }).click({ timeout: 1000 }).catch(() => {});
      return (await page.locator(".alarm-bar").count()) === 0;
    }, "the alarm acknowledged");
    await press(page, magazine.getByRole("button", { name: "Open the clamp…" }));
    await magazine.getByText(/^The spindle must be stopped\. Hold T\d+ /).waitFor();
    await magazine.getByRole("button", { name: "Leave it closed" }).click();
    await press(page, magazine.getByRole("button", { name: "Open the clamp…" }));
    await page.screenshot({ path: picture("clamp-1024") });
    await press(page, magazine.getByRole("button", { name: "I hold it: open the clamp" }));
    await magazine.getByText(/^Where is the tool T\d+/).waitFor();
    await press(page, magazine.getByRole("button", { name: "I took it out, spindle empty" }));
    await magazine.getByText("Spindle empty", { exact: true }).waitFor();
    await magazine.getByText(/it continues with step 11/).waitFor();
    assert.equal(await magazine.getByRole("button", { name: "Open the clamp…" }).count(), 0, "nothing is in it");
    assert.deepEqual(problems, []);
  } finally {
    await end();
  }
});

test("a worn tool is taken out of the clamp and a new one put in by its dialog; meanwhile nobody goes on", async () => {
  const { page, problems, end } = await at('[rack]\nchange = "magazine"\ntools = ["T1 drill 0.4 life 3"]\n');
  try {
    await sample(page);
    await drillOnly(page);
    await tab(page, "Machine").click();
    const magazine = page.getByRole("region", { name: "Magazine" });
    await magazine.getByText("Set magazine contents").click();
    await press(page, magazine.getByRole("button", { name: "Slots hold the job's tools" }));
    const { start } = await startJob(page);
    await start.click();
    const dialog = page.getByRole("alertdialog");
    await dialog.getByText(/T1 .* has drilled 3 holes of 3/).or(dialog.getByText(/T1/)).first().waitFor();
    await until(() => go_on(page).isEnabled(), "a job that may go on");
    // Rejected while the spindle stops; allowed after waiting.
    const falls = dialog.getByText(/^The spindle must be stopped\. Hold T1 /);
    const open = dialog.getByText(/^The clamp is open\./);
    await until(async () => {
      const first = dialog.getByRole("button", { name: "Open the clamp…" });
      if (await first.isVisible()) await first.click({ timeout: 2000 }).catch(() => {});
      if (await falls.isVisible()) await dialog.getByRole("button", { name: "I hold it: open the clamp" }).click({ timeout: 2000 }).catch(() => {});
      return open.isVisible();
    }, "an open clamp");
    assert.equal(await go_on(page).isEnabled(), false, "with the clamp open the job does not go on");
    await page.screenshot({ path: picture("worn-in-magazine-1024") });
    await press(page, dialog.getByRole("button", { name: "Close the clamp" }));
    await until(() => go_on(page).isEnabled(), "a tool that is held");
    await go_on(page).click();
    await page.getByText(/^Hole [4-9] of/).first().waitFor();
    assert.deepEqual(problems, []);
  } finally {
    await end();
  }
});
