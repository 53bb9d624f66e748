// The Machine screen under stress with the real bridge: stop, pause, a closed page, a second page, a killed
// bridge.

import assert from "node:assert/strict";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before } from "node:test";
import { data, drillOnly, mayStart, openBrowser, openLinked, openPage, picture, pictures, preflight, press, SCREENS, settled, show, startBridge, startJob, tab, test, until } from "./harness.mjs";

/** A small window needs less CPU for software rendering, next to a machine in real time. */
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

/** Confirms the tool change. */
async function bit(page) {
  await page.getByRole("button", { name: "Start spindle and continue" }).click();
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

test("where Start is not to be had, a button leads to the screen that cures it; a lost line is told on every screen", async () => {
  const bridge = await startBridge();
  const { page, context } = await openPage(browser, bridge.url, SMALL);
  try {
    await page.getByRole("button", { name: /Sample board/ }).click();
    await page.getByText(/^Planned .* m,/).waitFor();
    await show(page, "Machine");
    await press(page, page.getByRole("button", { name: "Home", exact: true }));
    await page.getByText("At rest, position known.").waitFor();
    const job = page.getByRole("region", { name: "Job", exact: true });
    assert.ok(await job.getByRole("button", { name: "Start…" }).isDisabled(), "problems of the job are not read yet");
    await job.getByRole("button", { name: "CAM", exact: true }).click();
    await until(async () => (await tab(page, "CAM").getAttribute("aria-current")) === "page", "CAM, where they are read");
    bridge.freeze(true);
    for (const screen of SCREENS) {
      await show(page, screen);
      await page.getByText("Link lost", { exact: true }).and(page.locator("strong")).waitFor();
    }
  } finally {
    bridge.freeze(false);
    await context.close();
    await bridge.stop();
  }
});

test("pause holds between holes, nothing resumes by itself, resume goes on", async () => {
  const bridge = await startBridge({ speed: 1 });
  const { page, context } = await openPage(browser, bridge.url, SMALL);
  try {
    await drilling(page);
    await press(page, page.getByRole("button", { name: "Pause", exact: true }));
    await page.getByRole("button", { name: "Resume", exact: true }).waitFor();
    const done = Number(await settled(() => data(page, "done"), "a picture that has followed the machine", 3000));
    await new Promise((later) => setTimeout(later, 1500));
    assert.equal(Number(await data(page, "done")), done, "a pause is a pause");
    await press(page, page.getByRole("button", { name: "Resume", exact: true }));
    // On a slow computer the job may reach a tool change first.
    const change = page.getByRole("button", { name: "Start spindle and continue" });
    await press(page, page.getByRole("button", { name: "Stop after hole" }), async () => {
      if (await change.isVisible()) await change.click({ timeout: 2000 }).catch(() => {});
    });
    await page.getByText(/Stopped after the hole/).waitFor();
    await until(async () => Number(await data(page, "done")) > done, "more holes");
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
    // On a slow computer the job has meanwhile reached a tool change: postpone its dialog.
    const later = second.page.getByRole("button", { name: "Jog first" });
    await until(async () => {
      if (await later.isVisible()) await later.click().catch(() => {});
      return tab(second.page, "Machine").click({ timeout: 2000 }).then(() => true, () => false);
    }, "the machine in the second page");
    const pace = second.page.getByLabel("Feed override", { exact: true });
    await until(async () => (await pace.inputValue()) === "150", "the pace that the first page ordered");
    const seen = await until(async () => Number(await data(second.page, "done")) || null, "the job in the second page");
    const waits = second.page.getByText("The machine waits for you.");
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
    // Once the picture is stable, it has caught up with the bridge's last message.
    const done = Number(await settled(() => data(first.page, "done"), "a picture that has heard everything"));
    await first.context.close();
    bridge = await startBridge({ speed: 60, home });
    second = await openPage(browser, bridge.url, SMALL);
    await tab(second.page, "Machine").click();
    const offer = second.page.getByRole("button", { name: /Resume where it stopped/ });
    await offer.waitFor();
    const told = await second.page.getByText(/was interrupted\. Holes drilled: \d+ of/).textContent();
    const made = Number(told.match(/drilled: (\d+)/)[1]);
    assert.ok(made >= done - 1 && made <= done + 1, `${made} are told after ${done} were seen done`);
  } finally {
    await second?.context.close();
    await bridge.stop();
    rmSync(home, { recursive: true, force: true });
  }
});

/** The sample planned for drilling, on the Machine screen, homed and with its zero. */
async function based(page) {
  await page.getByRole("button", { name: /Sample board/ }).click();
  await page.getByText(/^Planned .* m,/).waitFor();
  await drillOnly(page);
  await tab(page, "Machine").click();
  await press(page, page.getByRole("button", { name: "Home", exact: true }));
  await page.getByText("At rest, position known.").waitFor();
  await press(page, page.getByRole("button", { name: /^Set work zero here/ }));
}

test("a board that bows is touched by the drill itself, and the job follows it with the same steps here and there", async () => {
  const bridge = await startBridge({ speed: 200, args: ["--fault", "board-not-flat"] });
  const { page, context, problems } = await openPage(browser, bridge.url, SMALL);
  try {
    await based(page);
    await press(page, page.getByRole("button", { name: "Height map…" }));
    const map = page.getByRole("dialog", { name: "Height map of the board" });
    await map.getByRole("button", { name: "20 mm" }).click();
    await press(page, map.getByRole("button", { name: "Probe the height map" }));
    await map.getByText(/the largest correction is/).waitFor();
    assert.ok((await map.locator("circle.touched").count()) > 3);
    await page.screenshot({ path: picture("level-own") });
    await map.getByRole("button", { name: "Close" }).click();
    const dialog = await preflight(page, page.getByRole("button", { name: "Start…" }));
    await dialog.getByText(/Depth follows the height map/).waitFor();
    await dialog.getByText(/Page and machine computed the same steps/).waitFor();
    await mayStart(dialog);
    await dialog.getByRole("button", { name: "Cancel" }).click();
    // Another zero: the map shows it before anything moves.
    await press(page, page.getByRole("button", { name: "Move X to the right" }));
    await page.getByText("At rest, position known.").waitFor();
    await press(page, page.getByRole("button", { name: /^Set work zero here/ }));
    await press(page, page.getByRole("button", { name: "Height map…" }));
    await map.getByText(/from where it was when the height map was measured/).waitFor();
    assert.deepEqual(problems, []);
  } finally {
    await context.close();
    await bridge.stop();
  }
});

test("holes are taken under the crosshair of a camera; without one it is said, and the tip remains", async () => {
  const bridge = await startBridge({ speed: 200 });
  const seeing = await openBrowser("none", ["--use-fake-device-for-media-stream", "--use-fake-ui-for-media-stream"]);
  const { page, context, problems } = await openPage(seeing, bridge.url, SMALL);
  let blind;
  try {
    await based(page);
    await page.getByText("Second side…").click();
    const side = page.locator("details.second-side");
    await side.getByRole("button", { name: "Use a camera" }).click();
    await until(() => side.locator("video").evaluate((video) => video.videoWidth > 0 && !video.paused), "a picture");
    const crosshair = side.getByRole("button", { name: "The crosshair is on it" }).first();
    assert.ok(await crosshair.isDisabled(), "nobody knows yet where it looks");
    await side.getByRole("button", { name: "Dot made here" }).click();
    await press(page, page.getByRole("button", { name: "Move X to the right" }));
    await page.getByText("At rest, position known.").waitFor();
    await side.getByRole("button", { name: "Crosshair on the dot" }).click();
    await side.getByText(/^The crosshair is X -/).waitFor();
    await pictures(page, "second-side");
    // By the picture, then by keyboard: both holes at one position, which is impossible for a board.
    await side.locator("button.camera").click();
    await side.getByText(/: found/).first().waitFor();
    await crosshair.focus();
    await page.keyboard.press("Enter");
    await side.getByText(/do not fit the planned ones/).waitFor();
    assert.ok(await side.getByRole("checkbox").isDisabled());
    await side.getByRole("button", { name: "Camera off" }).click();
    await until(async () => !(await side.locator("button.camera").isVisible()), "no picture");
    assert.deepEqual(problems, []);
    await context.close();
    // A browser that denies the camera, or has none.
    blind = await openLinked(browser, bridge, SMALL);
    await blind.page.getByRole("button", { name: /Sample board/ }).click();
    await blind.page.getByText(/^Planned .* m,/).waitFor();
    await tab(blind.page, "Machine").click();
    await blind.page.getByText("Second side…").click();
    const other = blind.page.locator("details.second-side");
    await other.getByRole("button", { name: "Use a camera" }).click();
    await other.getByText(/does not let this page use a camera|This page found no camera/).waitFor();
    await other.getByRole("button", { name: "Tool is over the hole" }).click();
    await other.getByText(/: found/).first().waitFor();
  } finally {
    await blind?.context.close();
    await seeing.close();
    await bridge.stop();
  }
});
