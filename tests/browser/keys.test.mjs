// Keys that something else uses: a dialog, a menu, a slider; keyboards of other scripts; regions by F6;
// commands without keys.

import assert from "node:assert/strict";
import { data, settled, show, stand, tab, test, until } from "./harness.mjs";

const { fresh, opened } = stand("none");

const screenNow = (page) => page.getByRole("navigation", { name: "Screens" }).locator("[aria-current=page]").innerText();
const operations = (page) => page.getByRole("checkbox", { name: /^Do / }).count();

/** A key as sent by a keyboard of another layout. */
const sent = (page, press) =>
  page.evaluate((press) => {
    const at = document.activeElement ?? document.body;
    at.dispatchEvent(new KeyboardEvent("keydown", { bubbles: true, cancelable: true, ...press }));
  }, press);

test("behind a dialog no key of the page does anything, but for Escape, STOP and the help", async () => {
  const { page, context } = await opened();
  try {
    await show(page, "CAM");
    const count = await operations(page);
    assert.ok(count > 2);
    await page.getByRole("button", { name: /^1 / }).first().click();
    await page.keyboard.press("Alt+ArrowDown");
    const undo = page.getByRole("button", { name: "Undo" });
    await until(() => undo.isEnabled(), "something to be taken back");
    await page.keyboard.press("F1");
    const help = page.getByRole("dialog", { name: "Help" });
    await help.waitFor();
    for (const key of ["Delete", "3", "4", "a", "s", "Control+z", "Control+,", "F8"]) await page.keyboard.press(key);
    await page.evaluate(() => addEventListener("keydown", (event) => (globalThis.taken = event.defaultPrevented)));
    for (const key of ["Control+o", "Control+s", "Control+k"]) {
      await page.keyboard.press(key);
      assert.ok(await page.evaluate(() => globalThis.taken), `${key} does not save the page nor leave it`);
    }
    assert.equal(await screenNow(page), "CAM");
    assert.ok(await help.isVisible() && (await page.getByRole("dialog").count()) === 1, "the help alone");
    await page.keyboard.press("Escape");
    await help.waitFor({ state: "hidden" });
    assert.deepEqual([await operations(page), await undo.isEnabled()], [count, true], "nothing was taken out or back");
    await page.keyboard.press("Delete");
    await until(async () => (await operations(page)) === count - 1, "and then the key takes it out again");
  } finally {
    await context.close();
  }
});

test("what is typed in a menu chooses in it, and Delete on a slider takes nothing out", async () => {
  const { page, context } = await opened();
  try {
    await show(page, "CAM");
    const count = await operations(page);
    const menu = page.locator("#cam-bit");
    await menu.focus();
    for (const key of ["0", "a", "s", "3", "f", "Delete"]) await page.keyboard.press(key);
    assert.equal(await screenNow(page), "CAM");
    assert.ok(await menu.evaluate((one) => one === document.activeElement), "the focus stays in it");
    const slider = page.getByRole("slider").first();
    await slider.focus();
    await page.keyboard.press("Delete");
    assert.equal(await operations(page), count);
    await page.keyboard.press("3");
    await until(async () => (await screenNow(page)) === "Simulate", "a slider types nothing: numbers are the page's");
    await show(page, "Draw");
    const pad = page.getByRole("button", { name: /^Pad/ }).first();
    await page.locator("main select:visible").first().focus();
    await page.keyboard.press("p");
    assert.equal(await pad.getAttribute("aria-pressed"), "false", "no tool is taken from a menu");
  } finally {
    await context.close();
  }
});

test("Shift+2 shows what is chosen where one draws too, and Shift+C types a place from the last one", async () => {
  const { page, context } = await fresh();
  try {
    await page.getByRole("button", { name: /Draw a board/ }).click();
    await page.getByRole("heading", { name: "Objects" }).waitFor();
    // Wait until the sheet is fitted.
    await until(async () => ((await data(page, "centre")) ?? "0").split(" ").every((mm) => Number(mm) > 0), "the sheet in the picture");
    await page.keyboard.press("o");
    await page.keyboard.press("c");
    for (const place of ["10 10", "12 10"]) {
      await page.keyboard.type(place);
      await page.keyboard.press("Enter");
    }
    await until(async () => /: 4 objects$/.test((await page.locator("canvas").first().getAttribute("aria-label")) ?? ""), "two holes on their nodes");
    await page.keyboard.press("Escape");
    await page.keyboard.press("v");
    await page.keyboard.press("Control+a");
    await page.getByRole("heading", { name: /^\d+ selected$/ }).waitFor();
    const look = () => data(page, "zoom");
    const before = Number(await settled(look, "a picture at rest"));
    // The positions of the selected holes are known once they are drawn.
    await until(async () => {
      await page.keyboard.press("Shift+2");
      return Number(await look()) > 1.5 * before;
    }, "what is chosen, close by");
    await page.keyboard.press("Shift+c");
    assert.equal(await page.locator("#draw-place").inputValue(), "@");
  } finally {
    await context.close();
  }
});

test("letters work on a Cyrillic and on a Greek keyboard", async () => {
  const { page, context } = await opened();
  try {
    await show(page, "CAM");
    await page.getByRole("button", { name: /^1 / }).first().click();
    await page.keyboard.press("Alt+ArrowDown");
    const undo = page.getByRole("button", { name: "Undo" });
    await until(() => undo.isEnabled(), "something to be taken back");
    await sent(page, { key: "я", code: "KeyZ", ctrlKey: true });
    await until(async () => !(await undo.isEnabled()), "taken back by Ctrl+Я");
    await page.evaluate(() => document.activeElement.blur());
    await sent(page, { key: "σ", code: "KeyS" });
    await until(async () => (await screenNow(page)) === "Simulate", "the simulation by Σ");
    await sent(page, { key: "л", code: "KeyK", ctrlKey: true });
    await page.getByRole("dialog", { name: "Commands" }).waitFor();
  } finally {
    await context.close();
  }
});

test("an edit of the job is taken back on Board and Simulate too, and an operation is left out with the Command key", async () => {
  const { page, context } = await opened();
  try {
    await show(page, "CAM");
    const box = page.getByLabel("Do Cut out");
    await page.locator("li.operation", { has: box }).getByRole("button").click({ modifiers: ["Meta"] });
    await until(async () => !(await box.isChecked()), "left out");
    for (const screen of ["Board", "Simulate"]) {
      await show(page, screen);
      await page.keyboard.press("Control+z");
      await page.keyboard.press("Control+y");
      await page.keyboard.press("Control+z");
      await show(page, "CAM");
      await until(() => box.isChecked(), `taken back on ${screen}`);
      await page.keyboard.press("Control+Shift+z");
      await until(async () => !(await box.isChecked()), "and made again");
    }
  } finally {
    await context.close();
  }
});

/** The region with the focus, by its class. */
const region = (page) =>
  page.evaluate(() => ["top-bar", "top", "left", "stage", "under", "right", "bottom", "whole", "status-bar"].find((one) => document.activeElement.classList.contains(one)));

test("F6 goes round all the regions of a screen, and Shift+F6 the other way", async () => {
  const { page, context } = await opened();
  try {
    const rings = {
      Board: ["left", "right", "stage", "status-bar", "top-bar"],
      CAM: ["left", "right", "stage", "status-bar", "top-bar", "under"],
      Simulate: ["bottom", "right", "stage", "status-bar", "top-bar"],
      Machine: ["left", "right", "stage", "status-bar", "top", "top-bar"],
      Lab: ["status-bar", "top-bar", "whole"],
    };
    for (const [screen, ring] of Object.entries(rings)) {
      await show(page, screen);
      const walk = async (key) => {
        const found = [];
        for (let step = 0; step < ring.length; step += 1) {
          await page.keyboard.press(key);
          found.push(await region(page));
        }
        return found;
      };
      const round = await walk("F6");
      assert.deepEqual(round.toSorted(), ring, screen);
      // From the last region backwards through all, and around to the last again.
      assert.deepEqual(await walk("Shift+F6"), [...round.slice(0, -1).reverse(), round.at(-1)], `${screen} backwards`);
    }
    await page.setViewportSize({ width: 390, height: 844 });
    await show(page, "Machine");
    const seen = [];
    for (let step = 0; step < 6; step += 1) {
      await page.keyboard.press("F6");
      seen.push(await region(page));
    }
    assert.ok(seen.includes("right") && seen.includes("status-bar"), `what is put away does not hold the focus: ${seen}`);
  } finally {
    await context.close();
  }
});

test("commands without a key are found by their words on their screens", async () => {
  const { page, context } = await opened();
  try {
    const commands = page.getByRole("dialog", { name: "Commands" });
    const found = async (screen, words) => {
      await show(page, screen);
      await page.keyboard.press("Control+k");
      await commands.waitFor();
      await commands.getByRole("combobox").fill(words);
    };
    const are = (names, what) => until(async () => JSON.stringify(await commands.getByRole("option").allInnerTexts()) === JSON.stringify(names), what);
    const rows = [
      ["Board", "new exports", "New exports…"],
      ["Board", "close board", "Close the board"],
      ["Machine", "height map", "Height map…"],
      ["Machine", "large", "Large view"],
    ];
    for (const [screen, words, name] of rows) {
      await found(screen, words);
      await are([name], `${words} on ${screen}`);
      await page.keyboard.press("Escape");
    }
    await found("CAM", "export");
    await are([], "nothing is exported before the problems were seen");
    await page.keyboard.press("Escape");
    await page.getByRole("button", { name: "Accept all" }).click();
    await found("CAM", "export");
    await are(["Export files"], "and then it is");
    await page.keyboard.press("Escape");
    await found("CAM", "redo");
    await until(async () => (await commands.getByRole("option").count()) === 1, "two keys of one command are one row");
    await page.keyboard.press("Escape");
    await found("Machine", "large");
    await page.keyboard.press("Enter");
    await until(() => page.url().endsWith("view=operator"), "the large view");
    await page.keyboard.press("Control+k");
    await commands.getByRole("combobox").fill("full view");
    await page.keyboard.press("Enter");
    await until(() => tab(page, "Board").isVisible(), "and back");
    await found("Machine", "height map");
    await page.keyboard.press("Enter");
    await page.getByRole("dialog", { name: "Height map of the board" }).waitFor();
  } finally {
    await context.close();
  }
});
