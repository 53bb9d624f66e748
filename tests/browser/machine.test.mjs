// The machine screen under stress, against the real bridge: stop, pause, a closed page, a second page, a killed bridge.

import assert from "node:assert/strict";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { data, drillOnly, openBrowser, openLinked, openPage, press, settled, startBridge, startJob, tab, until } from "./harness.mjs";

/** A small window: few pixels to paint in software beside a machine that runs in real time. */
const SMALL = { width: 1024, height: 768 };

let browser;
before(async () => (browser = await openBrowser("none")));
after(async () => browser?.close());

async function drilling(page) {
  await page.getByRole("button", { name: /Sample board/ }).click();
  await page.getByText(/^Planned .* m,/).waitFor();
  await drillOnly(page);
  const { start } = await startJob(page);
  await start.click();
  await bit(page);
  await until(async () => Number(await data(page, "done")) > 1, "the first holes");
}

/** Puts the bit in that is asked for. */
async function bit(page) {
  await page.getByRole("button", { name: "Continue: the bit is in" }).click();
}

test("STOP stops at once, from the keyboard too, and the position stays known", async () => {
  const bridge = await startBridge({ speed: 2 });
  const { page, context } = await openPage(browser, bridge.url, SMALL);
  try {
    await drilling(page);
    await page.keyboard.press("Control+Shift+E");
    await page.getByText(/^You stopped it\. Holes drilled/).waitFor();
    const done = await settled(() => data(page, "done"), "a picture that has followed the machine");
    await new Promise((later) => setTimeout(later, 1500));
    assert.equal(await data(page, "done"), done, "nothing was drilled after STOP");
  } finally {
    await context.close();
    await bridge.stop();
  }
});

test("pause holds between holes, nothing resumes by itself, resume goes on", async () => {
  const bridge = await startBridge({ speed: 1 }); // slow enough to stay within the first bit
  const { page, context } = await openPage(browser, bridge.url, SMALL);
  try {
    await drilling(page);
    await press(page, page.getByRole("button", { name: "Pause", exact: true }));
    await page.getByRole("button", { name: "Resume", exact: true }).waitFor();
    const done = Number(await settled(() => data(page, "done"), "a picture that has followed the machine", 3000));
    await new Promise((later) => setTimeout(later, 1500));
    assert.equal(Number(await data(page, "done")), done, "a pause is a pause");
    await press(page, page.getByRole("button", { name: "Resume", exact: true }));
    await until(async () => Number(await data(page, "done")) > done, "more holes");
    await press(page, page.getByRole("button", { name: "Stop after hole" }));
    await page.getByText(/Stopped after the hole/).waitFor();
  } finally {
    await context.close();
    await bridge.stop();
  }
});

test("a closed page leaves the job running; another page watches it and may stop it", async () => {
  const bridge = await startBridge({ speed: 1 });
  const first = await openPage(browser, bridge.url, SMALL);
  let second;
  try {
    await drilling(first.page);
    // Faster than planned: other feeds from the next hole on.
    await first.page.getByLabel("Feed override", { exact: true }).selectOption("150");
    await new Promise((later) => setTimeout(later, 500));
    await first.context.close();
    second = await openLinked(browser, bridge, SMALL);
    // On a slow computer the job has come to a tool change meanwhile: its dialog is put off.
    const later = second.page.getByRole("button", { name: "Not yet" });
    await until(async () => {
      if (await later.isVisible()) await later.click().catch(() => {});
      return tab(second.page, "Machine").click({ timeout: 2000 }).then(() => true, () => false);
    }, "the machine in the second page");
    const pace = second.page.getByLabel("Feed override", { exact: true });
    await until(async () => (await pace.inputValue()) === "150", "the pace that the first page ordered");
    const seen = await until(async () => Number(await data(second.page, "done")) || null, "the job in the second page");
    const waits = second.page.getByText("Waiting for a person.");
    await until(async () => Number(await data(second.page, "done")) > seen || (await waits.isVisible()), "more holes");
    await second.page.getByRole("button", { name: /STOP/ }).first().dispatchEvent("pointerdown");
    await second.page.getByText(/^You stopped it\. Holes drilled/).waitFor();
  } finally {
    await second?.context.close();
    await bridge.stop();
  }
});

test("a button pressed as slowly as people press them does what it says while a job runs", async () => {
  const bridge = await startBridge({ speed: 1 });
  const { page, context } = await openPage(browser, bridge.url, SMALL);
  try {
    await drilling(page);
    const slowly = async (name, then) => {
      const box = await until(() => page.getByRole("button", { name, exact: true }).boundingBox(), name);
      await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
      await page.mouse.down();
      await new Promise((later) => setTimeout(later, 300));
      await page.mouse.up();
      await page.getByRole("button", { name: then, exact: true }).waitFor({ timeout: 5000 });
    };
    await page.getByRole("button", { name: "Release control" }).waitFor();
    await slowly("Release control", "Take control");
    assert.equal(await page.getByText("No page has control.").count(), 1, "who has control is said once");
    await slowly("Take control", "Release control");
  } finally {
    await context.close();
    await bridge.stop();
  }
});

test("after a killed bridge the job is offered again at the right hole", async () => {
  const home = mkdtempSync(join(tmpdir(), "annulus-test-"));
  let bridge = await startBridge({ speed: 5, home });
  const first = await openPage(browser, bridge.url, SMALL);
  let second;
  try {
    await drilling(first.page);
    await bridge.kill("SIGKILL");
    // What the picture has caught up with is all that the bridge ever said.
    const done = Number(await settled(() => data(first.page, "done"), "a picture that has heard everything"));
    await first.context.close();
    bridge = await startBridge({ speed: 60, home });
    second = await openPage(browser, bridge.url, SMALL);
    await tab(second.page, "Machine").click();
    const offer = second.page.getByRole("button", { name: /Resume where it stopped/ });
    await offer.waitFor();
    const told = await second.page.getByText(/was broken off\. Holes drilled: \d+ of/).textContent();
    const made = Number(told.match(/drilled: (\d+)/)[1]);
    assert.ok(made >= done - 1 && made <= done + 1, `${made} are told after ${done} were seen done`);
  } finally {
    await second?.context.close();
    await bridge.stop();
    rmSync(home, { recursive: true, force: true });
  }
});
