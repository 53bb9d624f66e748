// Navigation: URLs and what they select, Back between screens, counts on the tabs, widths of the panels.

import assert from "node:assert/strict";
import { join } from "node:path";
import { findings, picture, planned, root, show, stand, tab, test, until } from "./harness.mjs";

const { fresh, opened } = stand("none");

const addressOf = (page) => new URL(page.url()).hash;

/** Waits until the URL's hash is `wanted`. */
const isAt = (page, wanted) => until(() => addressOf(page) === wanted, wanted).catch((error) => Promise.reject(new Error(`${error.message}; ${addressOf(page)}`)));

const screenNow = (page) => page.getByRole("navigation", { name: "Screens" }).locator("[aria-current=page]").innerText();

const operation = (page, number) => page.getByRole("button", { name: new RegExp(`^${number} `) });

const isChosen = (page, number) => until(async () => (await operation(page, number).getAttribute("aria-current")) === "true", `operation ${number}`);

const second = (page) => page.getByRole("slider", { name: "Time", exact: true }).evaluate((one) => Number(one.value));

test("what is on show has an address, an address shows what it names, and Back goes from screen to screen", async () => {
  const { page, context } = await opened();
  try {
    await isAt(page, "#/board");
    await show(page, "CAM");
    await isAt(page, "#/cam/op/1");
    await operation(page, 2).click();
    await isAt(page, "#/cam/op/2");
    await show(page, "Settings");
    await isAt(page, "#/settings/machine");
    await page.getByRole("navigation", { name: "Sections" }).getByRole("button", { name: "Tools" }).click();
    await isAt(page, "#/settings/tools");
    await page.goBack();
    await isAt(page, "#/cam/op/2");
    assert.equal(await screenNow(page), "CAM", "one step back, past the other section");
    await isChosen(page, 2);
    await page.goForward();
    await isAt(page, "#/settings/tools");
    await page.getByRole("heading", { name: "Tools" }).first().waitFor();
    await page.evaluate(() => (location.hash = "#/cam/op/3"));
    await isChosen(page, 3);
    await page.evaluate(() => (location.hash = "#/cam/op/77"));
    await isAt(page, "#/cam/op/3");
    await planned(page);
    await page.evaluate(() => (location.hash = "#/simulate?t=12.5"));
    await until(async () => (await screenNow(page)) === "Simulate" && (await second(page)) === 12.5, "the second of the address");
    await page.getByRole("slider", { name: "Time", exact: true }).focus();
    await page.keyboard.press("Home");
    await isAt(page, "#/simulate");
    await page.keyboard.press("End");
    await until(() => /^#\/simulate\?t=\d{3,}/.test(addressOf(page)), "the end in the address");
    const end = addressOf(page);
    await show(page, "CAM");
    await page.goBack();
    await isAt(page, end);
  } finally {
    await context.close();
  }
});

test("a page that is loaded again shows what its address names as soon as the board is back", async () => {
  const { page, context } = await opened();
  try {
    await show(page, "CAM");
    await operation(page, 3).click();
    await isAt(page, "#/cam/op/3");
    await planned(page);
    await page.waitForTimeout(1500);
    await page.reload();
    await page.getByRole("button", { name: "Restore" }).click();
    await isChosen(page, 3);
    await isAt(page, "#/cam/op/3");
    await planned(page);
    await page.evaluate(() => (location.hash = "#/simulate?t=21"));
    await until(async () => (await second(page)) === 21, "the second of the address");
    await page.reload();
    await page.getByRole("button", { name: "Restore" }).click();
    await until(async () => (await page.getByRole("slider", { name: "Time", exact: true }).count()) > 0 && (await second(page)) === 21, "that second again");
    await isAt(page, "#/simulate?t=21");
  } finally {
    await context.close();
  }
});

/** The count on a tab, as drawn, and in its name for screen readers. */
const counted = (page, screen) =>
  tab(page, screen).evaluate((one) => [getComputedStyle(one, "::before").content.replaceAll('"', ""), one.ariaLabel]);

test("a tab with something to look at says how much, until it was seen", async () => {
  const { page, context } = await opened();
  try {
    await show(page, "CAM");
    await planned(page);
    const [number, words] = await until(async () => {
      const found = await counted(page, "CAM");
      return found[1] && found;
    }, "a count");
    assert.match(words, new RegExp(`^CAM: ${number} problems? to look at$`));
    assert.deepEqual(await counted(page, "Board"), ["none", null]);
    assert.deepEqual(await findings(page), []);
    await page.screenshot({ path: picture("counts-1440") });
    await page.getByRole("button", { name: "Accept all" }).click();
    await until(async () => (await counted(page, "CAM"))[1] === null, "nothing more");
  } finally {
    await context.close();
  }
});

test("errors of the files are counted on Board", async () => {
  const { page, context } = await fresh();
  try {
    const chooser = page.waitForEvent("filechooser");
    await page.getByRole("button", { name: "Open files…" }).click();
    const folder = join(root, "tests/data/synthetic");
    await (await chooser).setFiles([join(folder, "x30-zip-path-traversal.zip"), join(folder, "x10-html-error-page.drl"), join(folder, "d01-metric-decimal.drl")]);
    await page.getByRole("button", { name: /Use this board/ }).waitFor();
    await until(async () => /^Board: \d+ problems? to look at$/.test((await counted(page, "Board"))[1] ?? ""), "errors that nobody saw");
  } finally {
    await context.close();
  }
});

test("panels are drawn wider and narrower by pointer and keys, stay so screen by screen, and go back", async () => {
  const { page, context } = await opened();
  try {
    await show(page, "CAM");
    const width = (side) => page.locator(`main > .panel.${side}`).evaluate((one) => one.getBoundingClientRect().width);
    const usual = [await width("left"), await width("right")];
    const edge = (side) => page.getByRole("separator", { name: `Width of the ${side} panel` });
    const box = await edge("left").boundingBox();
    await page.mouse.move(box.x + box.width / 2, box.y + 200);
    await page.mouse.down();
    await page.mouse.move(box.x + box.width / 2 + 60, box.y + 210, { steps: 4 });
    await page.mouse.up();
    await until(async () => Math.abs((await width("left")) - usual[0] - 60) <= 1, "60 px more");
    const canvas = await page.locator("canvas").first().boundingBox();
    assert.ok(Math.abs(canvas.x - (await width("left"))) < 3, "the picture goes with it");
    await edge("right").focus();
    await page.keyboard.press("ArrowLeft");
    await page.keyboard.press("ArrowLeft");
    await until(async () => (await width("right")) === usual[1] + 32, "two steps");
    assert.equal(await edge("right").getAttribute("aria-valuenow"), String(usual[1] + 32));
    assert.deepEqual(await findings(page), []);
    await page.screenshot({ path: picture("panels-1440") });
    await show(page, "Board");
    assert.equal(await edge("left").count(), 1);
    await page.reload();
    await page.getByRole("button", { name: "Restore" }).click();
    await page.locator("main > .panel.holes").waitFor();
    await show(page, "CAM");
    await until(async () => Math.abs((await width("left")) - usual[0] - 60) <= 1 && (await width("right")) === usual[1] + 32, "as they were drawn");
    await edge("right").focus();
    await page.keyboard.press("Enter");
    await until(async () => (await width("right")) === usual[1], "its own width");
    await edge("left").dblclick();
    await until(async () => (await width("left")) === usual[0], "its own width");
    await page.setViewportSize({ width: 820, height: 1180 });
    assert.equal(await page.getByRole("separator").filter({ visible: true }).count(), 0, "where panels lie under the picture there is nothing to draw");
  } finally {
    await context.close();
  }
});
