// What was open is offered again after a reload, is opened only when somebody says so, and loses nothing.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { data, findings, openBrowser, openPage, picture, startBridge, until } from "./harness.mjs";

let browser;
before(async () => (browser = await openBrowser("none")));
after(async () => browser?.close());

const offer = (page) => page.getByText(/was open in this browser until/);
const holes = async (page) => Number(await data(page, "holes").catch(() => 0));

/** The job that the browser keeps at a place, as text. */
const kept = (page, place) =>
  page.evaluate(
    (key) =>
      new Promise((found) => {
        const opening = indexedDB.open("annulus", 1);
        opening.onerror = () => found("");
        opening.onupgradeneeded = () => opening.transaction.abort();
        opening.onsuccess = () => {
          const asked = opening.result.transaction("projects").objectStore("projects").get(key);
          asked.onsuccess = () => found(asked.result?.[2] ?? "");
          asked.onerror = () => found("");
          opening.result.close();
        };
      }),
    `${place}/job`,
  );

/** Opens the sample and waits until it lies in the picture. */
async function openSample(page) {
  await page.getByRole("button", { name: /Sample board/ }).click();
  await until(async () => (await holes(page)) > 0, "holes in the picture");
}

/** Loads the page again and waits for the empty sheet. */
async function again(page) {
  await page.reload();
  await page.getByRole("heading", { name: /Drop the files/ }).waitFor();
}

test("a board that was open is offered after a reload, with its job as it was", async () => {
  const bridge = await startBridge();
  const { page, problems, context } = await openPage(browser, bridge.url);
  try {
    await page.getByRole("heading", { name: /Drop the files/ }).waitFor();
    assert.equal(await offer(page).count(), 0, "nothing was open yet");
    await openSample(page);
    await page.keyboard.press("2");
    await page.getByRole("button", { name: /1 Isolate/ }).click();
    await page.getByRole("slider", { name: "Passes" }).focus();
    await page.keyboard.press("ArrowRight");
    await until(async () => /passes = 3/.test(await kept(page, 0)), "the changed job in the store");

    await again(page);
    await offer(page).waitFor();
    assert.equal(await holes(page), 0, "nothing is opened unasked");
    assert.deepEqual(await findings(page), [], "the offer is accessible");
    await page.screenshot({ path: picture("kept-1440") });
    await page.getByRole("button", { name: "Restore" }).click();
    await until(async () => (await holes(page)) > 0, "the board in the picture again");
    await page.keyboard.press("2");
    await page.getByRole("button", { name: /1 Isolate/ }).click();
    await until(async () => (await page.getByRole("slider", { name: "Passes" }).inputValue()) === "3", "the job as it was");

    await again(page);
    await page.getByRole("button", { name: "Discard" }).click();
    await until(async () => (await offer(page).count()) === 0, "no offer any more");
    await again(page);
    await page.waitForTimeout(1000);
    assert.equal(await offer(page).count(), 0, "what was discarded is gone");
    assert.deepEqual(problems, [], "nothing was said on the console");
  } finally {
    await context.close();
    await bridge.stop();
  }
});

test("another board does not push out the one that is on offer", async () => {
  const bridge = await startBridge();
  const { page, context } = await openPage(browser, bridge.url);
  try {
    await page.getByRole("heading", { name: /Drop the files/ }).waitFor();
    await openSample(page);
    await until(async () => (await kept(page, 0)) !== "", "the first board in the store");
    await again(page);
    await offer(page).waitFor();
    await openSample(page);
    await until(async () => (await kept(page, 1)) !== "", "the second board beside it");
    await again(page);
    await page.getByRole("button", { name: "Discard" }).click();
    await until(async () => (await kept(page, 1)) === "", "the second board forgotten");
    await offer(page).waitFor();
    assert.notEqual(await kept(page, 0), "", "the first is still there, and offered");
  } finally {
    await context.close();
    await bridge.stop();
  }
});
