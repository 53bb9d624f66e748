// Checks for all screens: no accessibility problem, both graphics APIs, bad files in red rows, keyboard use.

import assert from "node:assert/strict";
import { join } from "node:path";
import { after, before } from "node:test";
import { atRest, backend, data, drillOnly, findings, openBrowser, openLinked, picture, root, SCREENS, startBridge, startJob, tab, test, until } from "./harness.mjs";

let bridge;
before(async () => (bridge = await startBridge({ speed: 50 })));
after(async () => bridge?.stop());

const fresh = (browser, options) => openLinked(browser, bridge, options);

for (const gpu of ["webgpu", "webgl2"]) {
  test(`the board is drawn by ${gpu}`, async () => {
    const browser = await openBrowser(gpu);
    const { page } = await fresh(browser);
    try {
      await page.getByRole("button", { name: /Sample board/ }).click();
      await until(async () => Number(await data(page, "holes")) > 0, "holes in the picture");
      await until(async () => Number(await data(page, "frames")) > 0, "a frame");
      assert.match((await backend(page)).toLowerCase(), new RegExp(gpu));
      await page.screenshot({ path: picture(`board-${gpu}`) });
    } finally {
      await browser.close();
    }
  });
}

for (const scheme of ["dark", "light"]) {
  test(`every screen is accessible, ${scheme}`, async () => {
    const browser = await openBrowser();
    const { page } = await fresh(browser, { scheme });
    try {
      await page.getByRole("heading", { name: /Drop the files/ }).waitFor();
      assert.deepEqual(await findings(page), [], "welcome");
      await page.getByRole("button", { name: /Sample board/ }).click();
      await page.getByText(/^Planned .* m,/).waitFor();
      for (const screen of SCREENS) {
        await tab(page, screen).click();
        await until(async () => (await tab(page, screen).getAttribute("aria-current")) === "page", screen);
        await atRest(page);
        await page.screenshot({ path: picture(`${screen.toLowerCase()}-${scheme}`) });
        assert.deepEqual(await findings(page), [], screen);
      }
    } finally {
      await browser.close();
    }
  });
}

test("the screens are reached by their numbers, and no key starts anything", async () => {
  const browser = await openBrowser();
  const { page } = await fresh(browser);
  try {
    await page.getByRole("button", { name: /Sample board/ }).click();
    await page.getByText(/^Planned .* m,/).waitFor();
    for (const [number, screen] of SCREENS.entries()) {
      await page.keyboard.press(String(number));
      await until(async () => (await tab(page, screen).getAttribute("aria-current")) === "page", screen);
    }
    await page.keyboard.press("4");
    await page.getByText("Home first", { exact: false }).first().waitFor();
    for (const key of ["Enter", "Space", "s", "h", "r"]) await page.keyboard.press(key);
    await page.waitForTimeout(500);
    assert.ok(await page.getByText("Home first", { exact: false }).first().isVisible(), "nothing moved");
  } finally {
    await browser.close();
  }
});

test("bad files are red rows with a sentence; the good ones open", async () => {
  const folder = join(root, "tests/data/synthetic");
  const browser = await openBrowser();
  const { page } = await fresh(browser);
  try {
    await page.getByRole("heading", { name: /Drop the files/ }).waitFor();
    const chooser = page.waitForEvent("filechooser");
    await page.getByRole("button", { name: "Open files…" }).click();
    await (await chooser).setFiles([
      join(folder, "x30-zip-path-traversal.zip"),
      join(folder, "x10-html-error-page.drl"),
      join(folder, "d01-metric-decimal.drl"),
    ]);
    const review = page.getByRole("button", { name: /Use this board/ });
    await review.waitFor();
    await page.screenshot({ path: picture("review-1440") });
    for (const seen of [/x10-html-error-page\.drl/, /d01-metric-decimal\.drl/, /Refused/]) {
      await until(async () => seen.test(await page.locator("body").innerText()), `${seen} in the review`);
    }
    assert.deepEqual(await findings(page), [], "import review");
  } finally {
    await browser.close();
  }
});

test("every state of a job is accessible, in three themes", async () => {
  const browser = await openBrowser("none");
  const { page } = await fresh(browser, {});
  const found = [];
  const look = async (state) => {
    for (const theme of ["light", "dark", "contrast"]) {
      await page.evaluate((theme) => (document.documentElement.dataset.theme = theme), theme);
      found.push(...(await findings(page)).map((one) => `${state}, ${theme}: ${one}`));
    }
    await page.screenshot({ path: picture(`state-${state.replaceAll(" ", "-")}`) });
  };
  try {
    await page.getByRole("button", { name: /Sample board/ }).click();
    await drillOnly(page);
    for (const screen of SCREENS) {
      await tab(page, screen).click();
      await until(async () => (await tab(page, screen).getAttribute("aria-current")) === "page", screen);
      await look(`screen ${screen}`);
    }
    await page.keyboard.press("F1");
    await look("help");
    await page.keyboard.press("Escape");
    const { start } = await startJob(page);
    await look("pre-flight");
    await start.click();
    await page.getByRole("alertdialog").waitFor();
    await look("tool change");
    await page.getByRole("alertdialog").getByRole("button", { name: "STOP", exact: true }).click();
    await page.getByText(/^You stopped/).waitFor();
    await look("stopped");
    assert.deepEqual(found, []);
  } finally {
    await browser.close();
  }
});
