// The layouts: a tablet upright does not scroll, a phone has STOP at its foot and the job first, whoever stands at the machine
// has it alone and large; help and commands by keys; colours that the system chooses.

import assert from "node:assert/strict";
import { join } from "node:path";
import { test } from "node:test";
import { SCREENS, atRest, findings, picture, root, show, stand, tab, until } from "./harness.mjs";

const { opened } = stand("none");
/** What sticks out of the window to the right and cannot be scrolled into it. */
const cutOff = (page) =>
  page.evaluate(() => {
    const found = [];
    const scrolls = (one) => one && (/auto|scroll/.test(getComputedStyle(one).overflowX) || scrolls(one.parentElement));
    for (const one of document.querySelectorAll("main *, header *, footer *, dialog[open] *")) {
      if (!one.checkVisibility({ visibilityProperty: true }) || one.closest(".unseen")) continue;
      const box = one.getBoundingClientRect();
      if (box.width > 0 && box.right > innerWidth + 1 && !scrolls(one.parentElement)) {
        found.push(`${one.tagName}.${one.className} to ${box.right.toFixed(0)} of ${innerWidth}`);
      }
    }
    return found;
  });

test("nothing is cut off on the right, from a phone to a desktop, in the import review too", async () => {
  const { page, context } = await opened();
  try {
    const found = [];
    for (const screen of SCREENS) {
      await show(page, screen);
      for (const [width, height] of [[320, 568], [360, 225], [390, 844], [720, 450], [820, 1180], [1440, 900]]) {
        await page.setViewportSize({ width, height });
        await atRest(page);
        found.push(...(await cutOff(page)).map((one) => `${screen}, ${width}: ${one}`));
        if (width >= 390 && width !== 720) await page.screenshot({ path: picture(`${screen.toLowerCase()}-${width}`) });
      }
    }
    const chooser = page.waitForEvent("filechooser");
    await page.keyboard.press("Control+o");
    const folder = join(root, "tests/data/synthetic");
    await (await chooser).setFiles([join(folder, "x30-zip-path-traversal.zip"), join(folder, "d01-metric-decimal.drl")]);
    await page.getByRole("button", { name: /Use this board/ }).waitFor();
    for (const width of [320, 390, 820]) {
      await page.setViewportSize({ width, height: 844 });
      await atRest(page);
      found.push(...(await cutOff(page)).map((one) => `review, ${width}: ${one}`));
      await page.screenshot({ path: picture(`review-${width}`) });
    }
    assert.deepEqual(found, []);
  } finally {
    await context.close();
  }
});

test("on a tablet upright the machine is one screen that does not scroll, with the screens at its foot", async () => {
  const { page, context } = await opened({ width: 820, height: 1180 });
  try {
    await show(page, "Machine");
    const rest = await page.evaluate(() => {
      const over = (one) => one.scrollHeight - one.clientHeight > 1;
      const panels = [...document.querySelectorAll("main > .panel")].filter(over);
      return [over(document.documentElement), ...panels.map((panel) => panel.className)];
    });
    assert.deepEqual(rest, [false], "nothing to be scrolled");
    const foot = await tab(page, "Machine").boundingBox();
    assert.ok(foot.y > 1100 && foot.y + foot.height <= 1180, `the screens at the foot: ${foot.y}`);
  } finally {
    await context.close();
  }
});

test("on a phone STOP is at the foot on the right, and moving by hand is asked for first", async () => {
  const { page, context } = await opened({ width: 390, height: 844 });
  try {
    await show(page, "Machine");
    const stop = await page.locator("header.top-bar").getByRole("button", { name: "STOP", exact: true }).boundingBox();
    assert.ok(stop.y > 844 - 90 && stop.x + stop.width > 390 - 30, JSON.stringify(stop));
    const home = page.getByRole("button", { name: "Home", exact: true });
    assert.ok(!(await home.isVisible()), "set-up is put away");
    await page.getByRole("button", { name: "Operate from this phone" }).click();
    assert.ok(await home.isVisible(), "and comes when it is asked for");
    assert.deepEqual(await findings(page), []);
  } finally {
    await context.close();
  }
});

test("the large view is the machine alone, by its button and by its address", async () => {
  const { page, context } = await opened();
  try {
    await show(page, "Machine");
    await page.getByRole("button", { name: "Large view" }).click();
    await until(() => page.url().endsWith("#/machine?view=operator"), "its address");
    assert.ok(!(await tab(page, "Board").isVisible()), "no other screens");
    for (const name of ["Start…", "Pause", "Stop after hole"]) {
      const box = await page.getByRole("button", { name, exact: true }).boundingBox();
      assert.ok(box.height >= 64, `${name} is ${box.height} px high`);
    }
    assert.deepEqual(await findings(page), []);
    await page.screenshot({ path: picture("operator-1440") });
    await page.getByRole("button", { name: "All of it" }).click();
    assert.ok(await tab(page, "Board").isVisible());
  } finally {
    await context.close();
  }
});

test("help by F1 and ?, commands by Ctrl+K: found by their words, done by Enter", async () => {
  const { page, context } = await opened();
  try {
    await page.evaluate(() => document.activeElement?.blur());
    for (const key of ["F1", "?"]) {
      await page.keyboard.press(key);
      const help = page.getByRole("dialog", { name: "Help" });
      await help.waitFor();
      assert.deepEqual(await findings(page), [], "help");
      await page.screenshot({ path: picture("help-1440") });
      await page.keyboard.press("Escape");
      await help.waitFor({ state: "hidden" });
    }
    await page.keyboard.press("Control+k");
    const commands = page.getByRole("dialog", { name: "Commands" });
    await commands.waitFor();
    await commands.getByRole("combobox").fill("show sim");
    assert.equal(await commands.getByRole("option").count(), 1);
    assert.deepEqual(await findings(page), [], "commands");
    await page.keyboard.press("Enter");
    await until(async () => (await tab(page, "Simulate").getAttribute("aria-current")) === "page", "the screen that was chosen");
    await commands.waitFor({ state: "hidden" });
  } finally {
    await context.close();
  }
});

test("with the system's colours buttons that matter are told apart, and no text is lost", async () => {
  const { page, context } = await opened({ forcedColors: "active" });
  try {
    for (const screen of SCREENS) {
      await show(page, screen);
      await page.screenshot({ path: picture(`${screen.toLowerCase()}-forced`) });
      const found = await page.evaluate(() => {
        const light = (text) => {
          const [r, g, b] = text.match(/[\d.]+/g).map(Number).map((one) => (one /= 255) <= 0.04045 ? one / 12.92 : ((one + 0.055) / 1.055) ** 2.4);
          return 0.2126 * r + 0.7152 * g + 0.0722 * b;
        };
        const rows = [];
        for (const one of document.querySelectorAll("button.primary:not(:disabled), button[aria-pressed=true], button.stop")) {
          if (!one.checkVisibility()) continue;
          const probe = document.createElement("canvas").getContext("2d");
          const flat = (colour) => ((probe.fillStyle = colour), probe.fillRect(0, 0, 1, 1), `rgb(${[...probe.getImageData(0, 0, 1, 1).data].slice(0, 3)})`);
          const style = getComputedStyle(one);
          const [a, b] = [light(flat(style.color)), light(flat(style.backgroundColor))].sort((x, y) => y - x);
          const contrast = (a + 0.05) / (b + 0.05);
          if (contrast < 4.5) rows.push(`${one.className}: ${style.color} on ${style.backgroundColor}, ${contrast.toFixed(2)}`);
          if (one.classList.contains("stop") && parseFloat(style.borderTopWidth) < 2) rows.push("STOP without a border");
        }
        return rows;
      });
      assert.deepEqual(found, [], screen);
    }
  } finally {
    await context.close();
  }
});
