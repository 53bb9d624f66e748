// The settings: groups, search, folded settings, the drawing, and one way to apply and undo everything.

import assert from "node:assert/strict";
import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { findings, openPage, pictures, press, show, stand, startBridge, tab, test, until } from "./harness.mjs";

const held = stand("none");

const nav = (page) => page.getByRole("navigation", { name: "Sections" });
const group = (page, name) => nav(page).getByRole("button", { name, exact: true });
const search = (page) => page.getByRole("searchbox", { name: "Search settings" });
const field = (page, key) => page.locator(`#setting-${key.replace(".", "-")}`);
const apply = (page) => page.getByRole("button", { name: "Apply" });

/** A page that may apply settings, on its Settings screen. */
async function opened(bridge, options) {
  const { page, context, problems } = await openPage(held.browser, bridge.url, options);
  await tab(page, "Settings").click();
  await group(page, "Motion").waitFor();
  return { page, context, problems };
}

test("settings are in groups, advanced ones and what the machine lacks are folded", async () => {
  const bridge = await startBridge();
  const { page, context, problems } = await opened(bridge);
  try {
    assert.deepEqual(await nav(page).getByRole("button").allInnerTexts(), ["Machine", "Motion", "Spindle", "Tools", "Probing", "Card or adapter", "Page"]);
    assert.equal(await group(page, "Machine").getAttribute("aria-current"), "true");
    await field(page, "x.max_speed").waitFor();
    assert.equal(await field(page, "x.gear_up").isVisible(), false, "folded");
    await page.getByText("Advanced", { exact: true }).nth(1).click();
    await field(page, "x.gear_up").waitFor();
    assert.deepEqual(await findings(page), []);
    await pictures(page, "settings-machine");
    await group(page, "Tools").click();
    assert.equal(await field(page, "magazine.x").isVisible(), false, "no magazine");
    await page.getByText("Not in use on this machine: Magazine").click();
    await field(page, "magazine.x").waitFor();
    await group(page, "Motion").click();
    await group(page, "Tools").click();
    await field(page, "rack.change").selectOption("magazine");
    await page.getByText("Not in use on this machine: Magazine").click();
    await field(page, "magazine.x").waitFor();
    await page.getByRole("columnheader", { name: "Magazine slot" }).waitFor();
    await page.getByRole("button", { name: "Discard" }).click();
    await group(page, "Spindle").click();
    await field(page, "spindle.speed").waitFor();
    assert.equal(await field(page, "spindle.deeper").count(), 0, "one spindle");
    assert.deepEqual(problems, []);
  } finally {
    await context.close();
    await bridge.stop();
  }
});

test("the search finds names, keys and help, and Escape clears it", async () => {
  const bridge = await startBridge();
  const { page, context, problems } = await opened(bridge);
  try {
    await search(page).fill("x.max_speed");
    await page.getByText("1 setting found.").waitFor();
    await page.getByText("Machine › X axis").waitFor();
    await field(page, "x.max_speed").waitFor();
    await search(page).fill("rapid height");
    await field(page, "stroke.safe_height").waitFor();
    await search(page).fill("clamps screws");
    await field(page, "stroke.safe_height").waitFor();
    await search(page).fill("probing speed");
    await field(page, "stroke.touch_speed").fill("0.5");
    await apply(page).waitFor();
    assert.equal(await field(page, "stroke.touch_speed").inputValue(), "0.5", "a found field is typed in");
    assert.deepEqual(await findings(page), []);
    await search(page).fill("zzz");
    await page.getByText(/^No setting matches "zzz"/).waitFor();
    await search(page).press("Escape");
    assert.equal(await search(page).inputValue(), "");
    await page.getByRole("heading", { name: "Machine", exact: true }).first().waitFor();
    await search(page).fill("language");
    await page.getByRole("button", { name: /^Page › / }).first().click();
    await page.getByRole("heading", { name: "Page", exact: true }).waitFor();
    assert.equal(await search(page).inputValue(), "");
    assert.deepEqual(problems, []);
  } finally {
    await context.close();
    await bridge.stop();
  }
});

test("applied settings can be undone, and the drawing follows what is typed", async () => {
  const bridge = await startBridge();
  const { page, context, problems } = await opened(bridge);
  try {
    const high = field(page, "x.max");
    const before = await high.inputValue();
    const width = () => page.getByRole("figure", { name: "Working area" }).locator("dd").first().innerText();
    const drawn = await width();
    await high.fill("150");
    await until(async () => (await width()) !== drawn && (await width()).includes("150"), "the drawing of 150 mm");
    await page.getByRole("group", { name: "Changes" }).getByText("X axis: Highest position").waitFor();
    await press(page, apply(page));
    await page.getByText("The machine has the new settings.").waitFor();
    assert.equal(await high.inputValue(), "150");
    await page.locator(".toast").getByRole("button", { name: "Undo" }).click();
    await page.getByText("The machine has its earlier settings again.").waitFor();
    await until(async () => (await high.inputValue()) === before, "the value of before");
    // Leaving the screen takes the offer away.
    await high.fill("150");
    await press(page, apply(page));
    await page.getByText("The machine has the new settings.").waitFor();
    await show(page, "Board");
    await page.getByText("The machine has the new settings.").waitFor({ state: "detached" });
    assert.deepEqual(problems, []);
  } finally {
    await context.close();
    await bridge.stop();
  }
});

test("each of six spindles has a checkbox", async () => {
  const folder = mkdtempSync(join(tmpdir(), "annulus-machine-"));
  const file = join(folder, "machine.toml");
  writeFileSync(file, "schema = 1\n[machine]\nspindles = 6\n");
  const bridge = await startBridge({ args: ["--machine", file] });
  const { page, context, problems } = await opened(bridge);
  try {
    await group(page, "Spindle").click();
    const all = page.getByRole("group", { name: "Spindles that drill" }).getByRole("checkbox");
    assert.equal(await all.count(), 6);
    await page.getByRole("checkbox", { name: "Z3", exact: true }).uncheck();
    await page.getByText("1 1 1 1 1 1 → 1 1 0 1 1 1").waitFor();
    assert.deepEqual(await findings(page), []);
    assert.deepEqual(problems, []);
  } finally {
    await context.close();
    await bridge.stop();
    rmSync(folder, { recursive: true, force: true });
  }
});

for (const [width, height] of [
  [1280, 800],
  [390, 800],
]) {
  test(`every group fits, ${width} px wide, and is reached by keyboard`, async () => {
    const { page, context } = await held.fresh({ width, height });
    try {
      await show(page, "Settings");
      for (const name of ["Machine", "Motion", "Spindle", "Tools", "Probing", "Card or adapter", "Page"]) {
        await group(page, name).focus();
        await page.keyboard.press("Enter");
        await page.getByRole("heading", { name, exact: true }).first().waitFor();
        const wide = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
        assert.ok(wide <= 0, `${name} is ${wide} px too wide`);
        assert.deepEqual(await findings(page), [], name);
        const small = await page.locator(".settings").evaluate((all) =>
          [...all.querySelectorAll("button, input, select, summary, textarea")]
            .filter((one) => one.checkVisibility() && one.type !== "checkbox" && one.getBoundingClientRect().height < 24)
            .map((one) => one.outerHTML.slice(0, 80)),
        );
        assert.deepEqual(small, [], name);
      }
      if (width > 1000) {
        await group(page, "Tools").click();
        const scroll = page.getByRole("region", { name: "Tools", exact: true });
        const [seen, all] = await scroll.evaluate((one) => [one.clientWidth, one.scrollWidth]);
        assert.ok(all <= seen + 1, `the tool table is ${all} px wide, ${seen} are seen`);
      }
    } finally {
      await context.close();
    }
  });
}
