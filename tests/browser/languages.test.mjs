// The languages of the page: selected by the URL, switched without a reload, saved, and no text cut off in
// its control.

import assert from "node:assert/strict";
import { atRest, data, openPage, picture, stand, startBridge, test, until } from "./harness.mjs";

const held = stand("none");

const inPolish = (address) => address.replace("/#", "/?lang=pl#");
const language = (page) => page.evaluate(() => document.documentElement.lang);
const menu = (page) => page.locator("select:visible", { has: page.locator("option[value=zh]") }).first();

/** Buttons, tabs, labels and headings with text wider than themselves. The class `cut` marks elements that
 *  may scroll or end in dots, such as the user's own names. A menu shows only as much as fits. */
const cutOff = (page) =>
  page.evaluate(() => {
    const one = "button, .tab, label > span, h2, h3, th, dt, summary";
    const scrolls = (element) => /auto|scroll/.test(getComputedStyle(element).overflowX);
    return [...document.querySelectorAll(one)]
      .filter((element) => element.checkVisibility() && !element.closest(".cut, .unseen") && element.innerText?.trim() && !scrolls(element))
      .filter((element) => {
        const box = element.getBoundingClientRect();
        const words = document.createTreeWalker(element, NodeFilter.SHOW_TEXT, (node) =>
          node.textContent.trim() && !node.parentElement.closest(".cut, .unseen") ? NodeFilter.FILTER_ACCEPT : NodeFilter.FILTER_REJECT,
        );
        const range = document.createRange();
        while (words.nextNode()) {
          range.selectNodeContents(words.currentNode);
          if ([...range.getClientRects()].some((line) => line.left < box.left - 1 || line.right > box.right + 1)) return true;
        }
        return false;
      })
      .map((element) => `${element.tagName.toLowerCase()}.${element.className}: ${element.innerText.trim().slice(0, 60)}`);
  });

/** Panels that would need horizontal scrolling. */
const sideways = (page) =>
  page.evaluate(() =>
    [...document.querySelectorAll("main > .panel, main > .bottom")]
      .filter((panel) => panel.checkVisibility() && panel.scrollWidth > panel.clientWidth + 1)
      .map((panel) => `${panel.className} is ${panel.scrollWidth} wide, ${panel.clientWidth} to be seen`),
  );

/** Elements of the top bar that have wrapped to a second row. */
const secondRow = (page) =>
  page.evaluate(() => {
    const bar = document.querySelector(".top-bar").getBoundingClientRect();
    return bar.height > 60 ? [`the top bar is ${bar.height} px high`] : [];
  });

test("a word that sticks out of its button is found", async () => {
  const { page, context } = await openLinkedInPolish({});
  try {
    await page.getByRole("heading", { name: "Upuść tutaj pliki płytki" }).waitFor();
    assert.deepEqual(await cutOff(page), []);
    await page.evaluate(() => {
      const narrow = document.body.appendChild(document.createElement("button"));
      narrow.style.cssText = "position: fixed; inset: 0 auto auto 0; width: 40px; white-space: nowrap";
      narrow.textContent = "Konstantynopolitańczykowianeczka";
    });
    assert.deepEqual(await cutOff(page), ["button.: Konstantynopolitańczykowianeczka"]);
  } finally {
    await context.close();
  }
});

for (const [width, height] of [
  [1440, 900],
  [390, 844],
]) {
  test(`no Polish word is cut off in its control, ${width} px wide`, async () => {
    const options = { width, height };
    const { page, context } = await openLinkedInPolish(options);
    try {
      await page.getByRole("button", { name: /Płytka przykładowa/ }).click();
      await until(async () => Number(await data(page, "holes")) > 0, "holes in the picture");
      const wrong = [];
      for (const [number, name] of ["board", "cam", "simulate", "machine", "lab", "settings"].entries()) {
        await page.keyboard.press(String(number + 1));
        await atRest(page);
        await page.screenshot({ path: picture(`${name}-pl-${width}`) });
        wrong.push(...(await cutOff(page)).map((found) => `${name}: ${found}`));
        wrong.push(...(await sideways(page)).map((found) => `${name}: ${found}`));
        if (width > 1000) wrong.push(...(await secondRow(page)).map((found) => `${name}: ${found}`));
      }
      assert.deepEqual([...new Set(wrong)], []);
    } finally {
      await context.close();
    }
  });
}

async function openLinkedInPolish(options) {
  const opened = await held.fresh({ ...options, locale: "pl-PL" });
  await until(async () => (await language(opened.page)) === "pl", "a page in Polish");
  return opened;
}

test("the language is that of the browser, then the one that was chosen, and it changes without a reload", async () => {
  const { page, context } = await openLinkedInPolish({});
  try {
    await page.getByRole("heading", { name: "Upuść tutaj pliki płytki" }).waitFor();
    await page.evaluate(() => (globalThis.here = true));
    await menu(page).selectOption("zh");
    await page.getByRole("heading", { name: "把电路板文件拖放到这里" }).waitFor();
    assert.equal(await language(page), "zh-Hans");
    await page.screenshot({ path: picture("welcome-zh") });
    assert.equal(await page.evaluate(() => globalThis.here), true, "no reload");
    await page.reload();
    await page.getByRole("heading", { name: "把电路板文件拖放到这里" }).waitFor();
    await menu(page).selectOption("en");
    await page.getByRole("heading", { name: "Drop the files of a board here" }).waitFor();
    assert.equal(await language(page), "en");
  } finally {
    await context.close();
  }
});

test("bits, units and numbers of the job are in the language too", async () => {
  const { page, context } = await openLinkedInPolish({});
  try {
    await page.getByRole("button", { name: /Płytka przykładowa/ }).click();
    await until(async () => Number(await data(page, "holes")) > 0, "holes in the picture");
    await page.keyboard.press("2");
    await page.getByText("obr/min").first().waitFor();
    await until(async () => (await page.locator("#cam-bit option:checked").innerText()) === "frez V 30°, ostrze 0,1", "the bit in Polish");
    assert.match(await page.locator("#cam-width").inputValue(), /^\d+,\d+$/);
    const text = await page.locator("main").innerText();
    assert.doesNotMatch(text, /V-bit|end mill|\brpm\b/);
    await page.getByRole("button", { name: /^Wirtualna wiertarka/ }).waitFor();
  } finally {
    await context.close();
  }
});

test("the address can ask for a language, and numbers have its decimal mark", async () => {
  const own = await startBridge({ speed: 50 });
  const { page, context, problems } = await openPage(held.browser, inPolish(own.url));
  try {
    await page.getByRole("button", { name: /Płytka przykładowa/ }).click();
    await until(async () => Number(await data(page, "holes")) > 0, "holes in the picture");
    await page.keyboard.press("6");
    await page.getByRole("button", { name: "Wrzeciono", exact: true }).waitFor();
    await page.getByRole("button", { name: "Ruch", exact: true }).click();
    const thickness = page.locator("#setting-stroke-board_thickness");
    assert.match(await thickness.inputValue(), /^\d+,\d+$/, "a comma is shown");
    await thickness.fill("1,234.5");
    await page.getByText(/więcej niż jeden znak dziesiętny/).waitFor();
    await thickness.fill("1.8");
    await page.getByText(/więcej niż jeden znak dziesiętny/).waitFor({ state: "detached" });
    assert.deepEqual(problems, [], "nothing was said on the console");
  } finally {
    await context.close();
    await own.stop();
  }
});
