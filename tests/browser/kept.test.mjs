// Saved projects are offered after a reload, opened only on request, and lose nothing: with two tabs, a full
// disk, damaged, very many or very large files. New exports of the open board are compared with it.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { after, before } from "node:test";
import { data, downloaded, findings, openBrowser, openPage, picture, root, startBridge, tab, test, until } from "./harness.mjs";

let browser;
before(async () => (browser = await openBrowser("none")));
after(async () => browser?.close());

const offer = (page) => page.getByText(/was open in this browser until/);
const holes = async (page) => Number(await data(page, "holes").catch(() => 0));

/** The job that the browser has saved at a place, as text. */
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

/** Opens the sample and waits until it is shown. */
async function openSample(page) {
  await page.getByRole("button", { name: /Sample board/ }).click();
  await until(async () => (await holes(page)) > 0, "holes in the picture");
}

/** Also waits until the browser has saved it. */
async function keptSample(page) {
  await openSample(page);
  await until(async () => (await kept(page, 0)) !== "", "the board in the store");
}

/** Reloads the page and waits for the empty page. */
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
    await page.getByRole("button", { name: "Discard", exact: true }).click();
    await until(async () => (await offer(page).count()) === 0, "no offer any more");
    await page.getByRole("button", { name: "Undo discard" }).click();
    await offer(page).waitFor();
    await page.getByRole("button", { name: "Discard", exact: true }).click();
    await until(async () => (await kept(page, 0)) === "", "forgotten when its word has gone");
    await again(page);
    await page.waitForTimeout(1000);
    assert.equal(await offer(page).count(), 0, "what was discarded is gone");
    assert.deepEqual(problems, [], "nothing was said on the console");
  } finally {
    await context.close();
    await bridge.stop();
  }
});

test("what is kept is listed in the settings, and all that is not open is deleted once its word is typed", async () => {
  const bridge = await startBridge();
  const { page, problems, context } = await openPage(browser, bridge.url);
  try {
    await keptSample(page);
    await again(page);
    await tab(page, "Settings").click();
    await page.getByRole("button", { name: "Page", exact: true }).click();
    await page.getByText(/The browser uses [\d.]+ MB/).waitFor();
    await offer(page).waitFor();
    assert.deepEqual(await findings(page), []);
    const remove = page.getByRole("button", { name: "Delete boards and drawings" });
    assert.ok(await remove.isDisabled());
    await page.getByRole("textbox", { name: /^Type DELETE/ }).fill("delete");
    await remove.click();
    await page.getByText("No board is saved except the open one.").waitFor();
    await until(async () => (await kept(page, 0)) === "", "an empty store");
    await page.getByText("Free software: MIT or Apache-2.0, as you choose.").waitFor();
    assert.deepEqual(await findings(page), []);
    assert.deepEqual(problems, []);
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
    await keptSample(page);
    await again(page);
    await offer(page).waitFor();
    await openSample(page);
    await until(async () => (await kept(page, 1)) !== "", "the second board beside it");
    await again(page);
    const discard = page.getByRole("button", { name: "Discard", exact: true });
    const press = async (clickCount) => {
      const { x, y, width, height } = await discard.boundingBox();
      await page.mouse.move(x + width / 2, y + height / 2);
      await page.mouse.down({ clickCount });
      await page.mouse.up({ clickCount });
    };
    await press(1);
    await until(async () => (await kept(page, 1)) === "", "the second board forgotten");
    // Both boards are offered until the page has listed again.
    await until(async () => (await offer(page).count()) === 1, "one offer");
    // The second press of a double click hits the other board, which has moved there.
    await press(2);
    await page.waitForTimeout(500);
    assert.notEqual(await kept(page, 0), "", "the first is still there, and offered");
  } finally {
    await context.close();
    await bridge.stop();
  }
});

test("a board that another one took the place of is among the earlier ones at once, and is opened again from there", async () => {
  const bridge = await startBridge();
  const { page, context } = await openPage(browser, bridge.url);
  try {
    await page.getByRole("heading", { name: /Drop the files/ }).waitFor();
    await keptSample(page);
    const chosen = page.waitForEvent("filechooser");
    await page.keyboard.press("Control+o");
    await (await chosen).setFiles([{ name: "other.drl", mimeType: "text/plain", buffer: Buffer.from("M48\nMETRIC,TZ\nT1C0.8\n%\nT1\nX1.0Y1.0\nX9.0Y9.0\nM30\n") }]);
    await page.locator(".brand").getByText("other").waitFor();
    await page.getByText(/^Earlier boards/).click();
    await page.locator(".others").getByRole("button", { name: "Restore" }).first().click();
    await page.locator(".brand").getByText("sensor").waitFor();
  } finally {
    await context.close();
    await bridge.stop();
  }
});

/** Changes the number of isolation passes once. */
async function morePasses(page) {
  await page.keyboard.press("2");
  await page.getByRole("button", { name: /1 Isolate/ }).click();
  await page.getByRole("slider", { name: "Passes" }).focus();
  await page.keyboard.press("ArrowRight");
}

test("of two tabs on one project one writes, the other says so and keeps a copy", async () => {
  const bridge = await startBridge();
  const { page, context } = await openPage(browser, bridge.url);
  try {
    await keptSample(page);
    const before = await kept(page, 0);
    const other = await context.newPage();
    await other.goto(bridge.origin);
    await other.getByText("sensor is open in another tab, which saves it.").waitFor();
    assert.equal(await other.getByRole("button", { name: "Discard" }).count(), 0, "what another tab has is not thrown away");
    assert.deepEqual(await findings(other), []);
    await other.screenshot({ path: picture("kept-elsewhere-1440") });
    await other.getByRole("button", { name: "Open a copy" }).click();
    await until(async () => (await holes(other)) > 0, "the copy in the picture");
    await other.getByText(/open in another tab too/).waitFor();
    await morePasses(other);
    await until(async () => /passes = 3/.test(await kept(other, 1)), "the copy at a place of its own");
    assert.equal(await kept(page, 0), before, "the first tab's is as it was");
    const third = await context.newPage();
    await third.goto(bridge.origin);
    await third.getByText("sensor is open in another tab, which saves it.").first().waitFor();
    await third.getByText("Earlier boards: 1").click();
    assert.equal(await third.getByRole("button", { name: "Restore" }).count(), 0);
    await page.close();
    await third.getByRole("button", { name: "Restore" }).waitFor();
    await again(other);
    await other.getByRole("button", { name: "Restore" }).first().waitFor();
    await other.getByText("Earlier boards: 1").click();
    assert.equal(await other.getByRole("button", { name: "Restore" }).count(), 2, "both are there, and neither is open elsewhere now");
  } finally {
    await context.close();
    await bridge.stop();
  }
});

test("edits that never rest are kept while they go on, and one made just before the page is left", async () => {
  const bridge = await startBridge();
  const { page, context } = await openPage(browser, bridge.url);
  try {
    await keptSample(page);
    await morePasses(page);
    const passes = async () => Number((await kept(page, 0)).match(/passes = (\d+)/)?.[1] ?? 0);
    let up = true;
    await until(async () => {
      await page.keyboard.press(up ? "ArrowRight" : "ArrowLeft");
      up = !up;
      return (await passes()) >= 3;
    }, "a change in the store while others follow");
    await page.keyboard.press("End");
    const last = Number(await page.getByRole("slider", { name: "Passes" }).inputValue());
    await page.goto("about:blank");
    await page.goto(bridge.origin);
    await page.getByRole("button", { name: "Restore" }).click();
    await until(async () => (await holes(page)) > 0, "the board in the picture again");
    await page.keyboard.press("2");
    await page.getByRole("button", { name: /1 Isolate/ }).click();
    await until(async () => Number(await page.getByRole("slider", { name: "Passes" }).inputValue()) === last, `${last} passes, the last edit`);
  } finally {
    await context.close();
    await bridge.stop();
  }
});

test("a full store is told and stays told, the project can be saved, and what is kept later is all of it", async () => {
  const bridge = await startBridge();
  const { page, context } = await openPage(browser, bridge.url);
  try {
    await page.getByRole("heading", { name: /Drop the files/ }).waitFor();
    const session = await context.newCDPSession(page);
    await session.send("Storage.overrideQuotaForOrigin", { origin: bridge.origin, quotaSize: 1 });
    await openSample(page);
    await page.getByText(/The browser is full/).first().waitFor();
    const unkept = page.getByRole("button", { name: "Not saved: save the project" });
    await unkept.waitFor();
    assert.equal(await kept(page, 0), "");
    assert.deepEqual(await findings(page), []);
    const files = await downloaded(page, unkept);
    assert.ok(files.size > 0, "it can be saved all the same");
    await session.send("Storage.overrideQuotaForOrigin", { origin: bridge.origin });
    await morePasses(page);
    await until(async () => /passes = 3/.test(await kept(page, 0)), "the board and its job in the store");
    await until(async () => (await unkept.count()) === 0, "nothing to be told any more");
    await again(page);
    await page.getByRole("button", { name: "Restore" }).click();
    await until(async () => (await holes(page)) > 0, "its files too");
  } finally {
    await context.close();
    await bridge.stop();
  }
});

/** The files of the sample board. */
const sample = (name) => ({ name, mimeType: "application/octet-stream", buffer: readFileSync(join(root, "www/examples", name)) });
const SAMPLE = ["sensor.drl", "sensor-top.gbr", "sensor-outline.gbr"].map(sample);

/** The drill file with a change. */
const drill = (change) => ({ ...SAMPLE[0], buffer: Buffer.from(change(SAMPLE[0].buffer.toString())) });
const oneMore = (text) => text.replace("T1\nX14.", "T1\nX12.345Y6.789\nX14.");

/** Chooses these files by `button`. */
async function choose(page, button, files) {
  const chooser = page.waitForEvent("filechooser");
  await button.click();
  await (await chooser).setFiles(files);
}

/** Drops files on the page. */
const drop = (page, files) =>
  page.evaluate((files) => {
    const data = new DataTransfer();
    for (const { name, bytes } of files) data.items.add(new File([Uint8Array.from(atob(bytes), (letter) => letter.charCodeAt(0))], name));
    window.dispatchEvent(new DragEvent("drop", { dataTransfer: data, bubbles: true, cancelable: true }));
  }, files.map(({ name, buffer }) => ({ name, bytes: buffer.toString("base64") })));

test("a file exported anew takes the place of its namesake, what changed is shown, and there is a way back", async () => {
  const bridge = await startBridge();
  const { page, context, problems } = await openPage(browser, bridge.url);
  try {
    await choose(page, page.getByRole("button", { name: "Open files…" }), SAMPLE);
    await until(async () => (await holes(page)) > 0, "holes in the picture");
    const before = await holes(page);
    await page.getByText(/^Planned .* m,/).waitFor();
    await morePasses(page);
    await drop(page, [drill(oneMore)]);
    const panel = page.getByRole("region", { name: "New exports of this board" });
    await panel.getByText("1 hole added").waitFor();
    assert.equal(await holes(page), before + 1);
    await panel.getByText(/Exported again: sensor\.drl/).waitFor();
    await panel.getByRole("button", { name: /^Added: X 12/ }).click();
    assert.deepEqual(await findings(page), []);
    for (const [width, height] of [[1440, 900], [820, 1180], [390, 844]]) {
      await page.setViewportSize({ width, height });
      await page.screenshot({ path: picture(`anew-${width}`) });
    }
    await page.setViewportSize({ width: 1440, height: 900 });
    await page.keyboard.press("2");
    await page.getByRole("button", { name: /1 Isolate/ }).click();
    assert.equal(await page.getByRole("slider", { name: "Passes" }).inputValue(), "3", "the job is the person's");
    await tab(page, "Board").click();
    await panel.getByRole("button", { name: "Back to the files before" }).click();
    await until(async () => (await holes(page)) === before, "the files from before");
    await page.getByText(/^Planned .* m,/).waitFor();
    // Under any name, if the user states that they belong to this board.
    const other = { ...drill(oneMore), name: "sensor-v2.drl" };
    await choose(page, page.getByRole("button", { name: "New exports…" }), [other, ...SAMPLE.slice(1)]);
    await panel.getByText("1 hole added").waitFor();
    await panel.getByRole("button", { name: "Open as another board" }).click();
    await until(async () => (await panel.count()) === 0, "a board by itself");
    await until(async () => (await holes(page)) === before + 1, "with its own holes");
    assert.deepEqual(problems, []);
  } finally {
    await context.close();
    await bridge.stop();
  }
});

test("the way back from a review leads to the board before at its place, which no other tab takes meanwhile", async () => {
  const bridge = await startBridge();
  const { page, context } = await openPage(browser, bridge.url);
  try {
    await keptSample(page);
    await drop(page, [{ name: "other.drl", buffer: Buffer.from("M48\nMETRIC\nT1C0.8\n%\nT1\nX1.0Y5.0\nHELLO\nM30\n") }]);
    const back = page.getByRole("button", { name: /^Back to sensor/ });
    await back.waitFor();
    await until(async () => (await kept(page, 1)) !== "", "what is looked over has a place of its own");
    const other = await context.newPage();
    await other.goto(bridge.origin);
    await other.getByText("Earlier boards: 1").click();
    await other.getByText("sensor is open in another tab, which saves it.").waitFor();
    await other.close();
    await back.click();
    await morePasses(page);
    await until(async () => /passes = 3/.test(await kept(page, 0)), "the board is kept where it was");
    assert.equal(await kept(page, 2), "", "and nowhere else");
  } finally {
    await context.close();
    await bridge.stop();
  }
});

/** Writes a file in the browser's private file system, and returns what `give` makes of its handle. */
const write = (page, file, give) =>
  page.evaluate(
    async ([name, text, give]) => {
      const folder = await navigator.storage.getDirectory();
      const handle = await folder.getFileHandle(name, { create: true });
      const out = await handle.createWritable();
      await out.write(text);
      await out.close();
      if (give === "launch") window.launchQueue.take({ files: [handle] });
      if (give === "pick") window.picked = [handle];
    },
    [file.name, file.buffer.toString(), give],
  );

/** Brings the page to the front: it offers files written meanwhile, and reads them. */
async function followed(page) {
  await until(async () => (await holes(page)) > 0, "the holes of the file");
  const before = await holes(page);
  await page.evaluate(() => window.dispatchEvent(new Event("focus")));
  const take = page.getByRole("button", { name: "Load and compare" });
  await page.waitForTimeout(500);
  assert.equal(await take.count(), 0, "nothing was written");
  await write(page, drill(oneMore));
  await page.evaluate(() => window.dispatchEvent(new Event("focus")));
  await take.waitFor();
  assert.equal(await holes(page), before, "nothing is taken in unasked");
  await take.click();
  await page.getByRole("region", { name: "New exports of this board" }).getByText("1 hole added").waitFor();
  assert.equal(await holes(page), before + 1);
}

test("files that the system opened with the page are followed: written anew, they are offered when the page is looked at", async () => {
  const bridge = await startBridge();
  const { page, context } = await openPage(browser, "about:blank");
  try {
    await page.addInitScript(() => {
      const queue = { setConsumer: (take) => (queue.take = take) };
      Object.defineProperty(window, "launchQueue", { value: queue });
    });
    await page.goto(bridge.url);
    await page.getByRole("heading", { name: /Drop the files/ }).waitFor();
    await write(page, SAMPLE[0], "launch");
    await followed(page);
  } finally {
    await context.close();
    await bridge.stop();
  }
});

test("files of the browser's own picker are followed too; where it may not be used, a field for files opens", async () => {
  const bridge = await startBridge();
  const { page, context, problems } = await openPage(browser, "about:blank");
  try {
    await page.addInitScript(() => {
      window.refusal = "AbortError";
      window.showOpenFilePicker = async (options) => {
        if (!options.multiple) throw new Error("one file is no board");
        if (!window.picked) throw new DOMException("not now", window.refusal);
        return window.picked;
      };
    });
    await page.goto(bridge.url);
    const open = page.getByRole("button", { name: "Open files…" });
    await open.click();
    await open.click();
    await page.evaluate(() => (window.refusal = "SecurityError"));
    const chooser = page.waitForEvent("filechooser");
    await open.click();
    await chooser;
    await write(page, SAMPLE[0], "pick");
    await open.click();
    await followed(page);
    assert.deepEqual(problems, []);
  } finally {
    await context.close();
    await bridge.stop();
  }
});

test("damaged projects, two hundred files and a layer of 100 MB are told of, and what was open stays or is there again", async () => {
  const bridge = await startBridge();
  const { page, context } = await openPage(browser, bridge.url);
  try {
    await openSample(page);
    const before = await holes(page);
    const open = async (files) => {
      await page.keyboard.press("Escape");
      const chooser = page.waitForEvent("filechooser");
      await page.keyboard.press("Control+o");
      await (await chooser).setFiles(files);
    };
    await open([{ name: "broken.annulus", mimeType: "application/zip", buffer: Buffer.from("PK\u0003\u0004 nothing") }]);
    await page.locator(".toast").first().waitFor();
    assert.equal(await holes(page), before, "what was open stays");
    const many = Array.from({ length: 200 }, (_, at) => ({
      name: `many-${at}.drl`,
      buffer: Buffer.from(`M48\nMETRIC\nT1C0.8\n%\nT1\nX${at}.0Y5.0\nM30\n`),
    }));
    await drop(page, many);
    await page.getByRole("heading", { name: "These files are of 200 boards" }).waitFor();
    await page.screenshot({ path: picture("many-1440") });
    await page.getByRole("button", { name: "Close the board" }).click();
    await page.getByRole("button", { name: "Restore" }).first().waitFor();
    // 100 MB of flashes, generated in the page because messages from the test are limited.
    await page.evaluate(() => {
      const line = "X0010000Y0010000D03*\n".repeat(50_000);
      const parts = ["%FSLAX36Y36*%%MOMM*%%ADD10C,1*%D10*\n", ...Array(100).fill(line), "M02*\n"];
      const data = new DataTransfer();
      data.items.add(new File(parts, "huge-F_Cu.gbr"));
      window.dispatchEvent(new DragEvent("drop", { dataTransfer: data, bubbles: true, cancelable: true }));
    });
    await page.getByText(/Nothing in these files can be drilled or milled/).first().waitFor();
    await page.screenshot({ path: picture("huge-1440") });
    await page.getByRole("button", { name: "Close the board" }).click();
    await page.getByRole("button", { name: "Restore" }).first().waitFor();
    const earlier = page.getByText(/^Earlier boards: /);
    if (await earlier.isVisible()) await earlier.click();
    await page.getByRole("region", { name: "Previous board" }).filter({ hasText: /^sensor was/ }).getByRole("button", { name: "Restore" }).click();
    await until(async () => (await holes(page)) > 0, "a board again");
    await morePasses(page);
    await until(async () => /passes = 3/.test(await kept(page, 0)), "and it is kept, whatever there was to be written before");
  } finally {
    await context.close();
    await bridge.stop();
  }
});
