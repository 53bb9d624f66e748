// A job at human pace: the user reads, changes tools, closes the page and reopens it. Waiting has no time
// limit.
//
// These tests mostly sleep, so they run concurrently.

import assert from "node:assert/strict";
import { describe } from "node:test";
import { data, drillOnly, openBrowser, openPage, PATIENCE_MS, press, rounds, show, startBridge, startJob, test, until } from "./harness.mjs";

/** Time that a user takes for a step. */
const PERSON_MS = 30_000;
/** A small window needs less CPU for software rendering. */
const SMALL = { width: 1024, height: 768 };

/** A bridge, a browser and a page of one user. */
async function begun(speed) {
  const bridge = await startBridge({ speed });
  const browser = await openBrowser("none");
  const { page } = await openPage(browser, bridge.url, SMALL);
  const end = async () => {
    await browser.close();
    await bridge.stop();
  };
  return { page, end };
}

const wait = (ms) => new Promise((later) => setTimeout(later, ms));
const go_on = (page) => page.getByRole("button", { name: "Start spindle and continue" });
/** The tool that the page asks for, if any. */
const asked = async (page) => {
  const shown = await page.locator("dialog .change .bit").last().innerText({ timeout: 1000 }).catch(() => "");
  return (await go_on(page).isVisible().catch(() => false)) ? shown : "";
};
const alarms = (page) => page.locator(".alarm-bar").allInnerTexts();

/** The planned sample with drilling only, on the Machine screen, with the pre-flight accepted. */
async function preflight(page) {
  await page.getByRole("button", { name: /Sample board/ }).click();
  await page.getByText(/^Planned .* m,/).waitFor();
  await drillOnly(page);
  const holes = Number(await data(page, "holes"));
  const { start } = await startJob(page);
  return { holes, start };
}

/** Reloads the page; its URL selects the Machine screen. */
async function again(page) {
  await page.reload();
  await page.locator("main[data-screen=machine]").waitFor();
}

/** Continues with the new tool; takes control back first if the page has lost it. */
async function bitIsIn(page) {
  if (!(await go_on(page).isEnabled())) {
    await page.getByRole("button", { name: "Jog first" }).click();
    const take = page.getByRole("button", { name: "Take control" });
    await until(async () => !(await take.isVisible()) || (await take.click(), false), "control of the machine");
    await page.getByRole("button", { name: "Back to tool change", exact: true }).click();
    await until(() => go_on(page).isEnabled(), "a page that may go on");
  }
  await go_on(page).click();
}

describe("a person", { concurrency: true }, () => {
  test("takes half a minute at a tool change and loads the page again in between", async () => {
    const { page, end } = await begun(60);
    try {
      const { holes, start } = await preflight(page);
      await start.click();
      let changes = 0;
      const done = page.getByText(/The job is done/);
      const step = async () => {
        assert.deepEqual(await alarms(page), [], "no alarm");
        if (await go_on(page).isVisible().catch(() => false)) {
          changes += 1;
          if (changes <= rounds(1, 100)) {
            await wait(PERSON_MS / 2);
            await again(page);
            await go_on(page).waitFor();
            await wait(PERSON_MS / 2);
            assert.deepEqual(await alarms(page), [], "no alarm after half a minute");
          }
          const bit = await until(() => asked(page), "the bit that is asked for");
          await bitIsIn(page);
          // The next tool can be requested before a poll sees the change; if the same one is still requested
          // after a while, press again.
          const taken = async () => (await asked(page)) !== bit;
          await until(taken, "the bit taken", 20_000).catch(() => bitIsIn(page));
          await until(taken, "the bit taken");
        }
        return done.isVisible();
      };
      await until(step, "the end of the job", 2 * PATIENCE_MS);
      assert.ok(changes >= 2, `${changes} tool changes`);
      const said = await done.innerText();
      assert.match(said, new RegExp(`Holes drilled: ${holes}\\b`), "every hole");
    } finally {
      await end();
    }
  });

  test("stops in a tool change, and is told that it was her or him", async () => {
    const { page, end } = await begun(60);
    try {
      const { start } = await preflight(page);
      await start.click();
      await go_on(page).waitFor();
      await wait(5000);
      await page.getByRole("alertdialog").getByRole("button", { name: "STOP", exact: true }).dispatchEvent("pointerdown");
      const told = page.getByText(/^You stopped it\. Holes drilled/).first();
      await told.waitFor();
      await wait(3000);
      // On another screen, the end of the job is shown too, until it is closed.
      await show(page, "Board");
      await told.waitFor();
      await page.getByRole("button", { name: "Close", exact: true }).last().click();
      await told.waitFor({ state: "detached" });
      assert.deepEqual(await alarms(page), [], "a STOP is no alarm");
    } finally {
      await end();
    }
  });

  test("reads the pre-flight for half a minute, and pauses for half a minute with the page closed", async () => {
    const { page, end } = await begun(2);
    try {
      const { start } = await preflight(page);
      await wait(PERSON_MS);
      await start.click();
      await go_on(page).click();
      await until(async () => Number(await data(page, "done")) > 0, "the first hole");
      await press(page, page.getByRole("button", { name: "Pause", exact: true }));
      const resume = page.getByRole("button", { name: "Resume", exact: true });
      await resume.waitFor();
      await wait(PERSON_MS / 2);
      await again(page);
      await wait(PERSON_MS / 2);
      const before = Number(await data(page, "done"));
      await press(page, resume);
      await until(async () => Number(await data(page, "done")) > before, "more holes");
      assert.deepEqual(await alarms(page), [], "no alarm");
    } finally {
      await end();
    }
  });
});
