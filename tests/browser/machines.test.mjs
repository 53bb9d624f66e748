// The machine of a job: asked once, chosen in the top bar or by the address, used by plan, export and virtual
// drill.

import assert from "node:assert/strict";
import { after, before } from "node:test";
import { closeExport, downloaded, drillOnly, exportPanel, findings, openBrowser, openPage, picture, planned, SCREENS, serveFiles, show, stand, startJob, tab, test, until } from "./harness.mjs";

const held = stand("none");

let browser;
before(async () => (browser = await openBrowser("none")));
after(async () => browser?.close());

const chip = (page) => page.locator("header.top-bar").getByRole("button", { name: /^Planned for: / });
const dialog = (page) => page.getByRole("dialog", { name: "Machine of this job" });

/** Waits until the job is planned for the machine `name`. */
const isFor = (page, name) => until(async () => (await chip(page).getAttribute("aria-label")) === `Planned for: ${name}`, name);

/** The programs of the job as one text. */
async function exported(page) {
  await tab(page, "CAM").click();
  await planned(page);
  const panel = await exportPanel(page);
  const save = panel.getByRole("button", { name: "Export files" });
  await until(() => save.isEnabled(), "an export that is allowed");
  const files = await downloaded(page, save);
  await closeExport(panel);
  return [...files.values()].map((bytes) => bytes.toString()).join("\n");
}

test("the welcome asks once for the machine, and plan, export and virtual drill follow it", async () => {
  const server = await serveFiles();
  const { page, problems, context } = await openPage(browser, `${server.url}?speed=20`);
  try {
    const question = page.getByRole("region", { name: "Which machine do you have?" });
    await question.waitFor();
    const names = await question.getByRole("button").allInnerTexts();
    assert.deepEqual([names[0], names[1], names.at(-1)], ["Just try: virtual drill", "3018 router", "Another machine…"]);
    await isFor(page, "Virtual drill");
    await page.screenshot({ path: picture("machines-question-1440") });
    assert.deepEqual(await findings(page), []);
    await question.getByRole("button", { name: "3018 router", exact: true }).click();
    await isFor(page, "3018 router");
    assert.equal(await question.count(), 0, "asked once");

    await page.getByRole("button", { name: /Sample board/ }).click();
    await drillOnly(page);
    const text = await exported(page);
    assert.ok(/S10000\b/.test(text) && !/S30000\b/.test(text), "the spindle speed of the 3018");
    for (const screen of SCREENS) {
      await show(page, screen);
      assert.ok(await chip(page).isVisible(), `on ${screen}`);
    }

    // The page's virtual drill plays the chosen machine, so the job may start on it.
    const { start } = await startJob(page);
    assert.ok(await start.isEnabled());
    await page.getByRole("dialog", { name: "Before the start" }).getByRole("button", { name: "Cancel" }).click();

    await page.reload();
    await isFor(page, "3018 router");
    assert.equal(await question.count(), 0, "and not at the next visit");
    assert.deepEqual(problems, []);
  } finally {
    await context.close();
    server.stop();
  }
});

test("another machine plans the board again, lists what changed and can be undone", async () => {
  const server = await serveFiles();
  const { page, problems, context } = await openPage(browser, server.url);
  try {
    await page.getByRole("button", { name: /Sample board/ }).click();
    await page.getByText(/^Planned .* m,/).waitFor();
    await chip(page).focus();
    await page.keyboard.press("Enter");
    await dialog(page).waitFor();
    assert.deepEqual(await findings(page), []);
    await page.screenshot({ path: picture("machines-dialog-1440") });
    await page.keyboard.press("Escape");
    await dialog(page).waitFor({ state: "hidden" });
    await chip(page).click();
    await dialog(page).getByRole("button", { name: /^Shapeoko 3 ?4/ }).click();
    await isFor(page, "Shapeoko 3");
    const told = page.locator(".toast").filter({ hasText: /Planned again for Shapeoko 3\. Values changed: [1-9]/ });
    await told.getByRole("button", { name: "Undo" }).click();
    await isFor(page, "Virtual drill");
    await page.getByRole("button", { name: "Show changes" }).last().click();
    await dialog(page).getByText(/^Values changed with the machine: /).click();
    await dialog(page).getByText(/^Drill · .*: .* → .*/).first().waitFor();
    await dialog(page).getByRole("button", { name: "Close" }).click();

    // A copy is a machine of one's own, with its settings open.
    await chip(page).click();
    await dialog(page).getByRole("button", { name: "Copy and change" }).click();
    await isFor(page, "Virtual drill, copy");
    assert.equal(await tab(page, "Settings").getAttribute("aria-current"), "page");
    await chip(page).click();
    await dialog(page).getByRole("button", { name: "Delete this machine" }).click();
    await dialog(page).getByRole("button", { name: "Close" }).click();
    await isFor(page, "Virtual drill");
    assert.deepEqual(problems, []);
  } finally {
    await context.close();
    server.stop();
  }
});

test("a link names the machine for one visit", async () => {
  const server = await serveFiles();
  const { page, context } = await openPage(browser, `${server.url}?machine=six`);
  try {
    await isFor(page, "Six spindles");
    assert.match(await chip(page).getAttribute("title"), /Chosen by the link/);
    await page.goto(server.url);
    await isFor(page, "Virtual drill");
    await page.getByRole("region", { name: "Which machine do you have?" }).waitFor();
    await page.goto(`${server.url}?machine=missing`);
    await page.getByText("There is no machine called missing.").waitFor();
  } finally {
    await context.close();
    server.stop();
  }
});

test("on a phone the chip and its dialog fit", async () => {
  const server = await serveFiles();
  const { page, context } = await openPage(browser, server.url, { width: 390, height: 844 });
  try {
    await chip(page).click();
    await dialog(page).waitFor();
    assert.deepEqual(await findings(page), []);
    assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), "no sideways scrolling");
    await page.screenshot({ path: picture("machines-dialog-390") });
  } finally {
    await context.close();
    server.stop();
  }
});

test("a bridge owns its machine: the chip names it and nothing is chosen", async () => {
  const { page, context } = await held.opened();
  try {
    await isFor(page, "Virtual drill");
    await chip(page).click();
    await dialog(page).getByText(/The connected machine\./).waitFor();
    assert.equal(await dialog(page).getByRole("button", { name: /3018/ }).count(), 0);
  } finally {
    await context.close();
  }
});
