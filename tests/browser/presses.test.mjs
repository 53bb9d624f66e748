// A control that moves the machine has no effect within a second after it appeared or moved; the jog pad has
// a fixed position.

import assert from "node:assert/strict";
import { after, before } from "node:test";
import { openBrowser, openLinked, press, settled, startBridge, tab, test, until } from "./harness.mjs";

let browser;
before(async () => (browser = await openBrowser("none")));
after(async () => browser?.close());

const digits = async (page, axis) => Number(await page.locator(`.digits[data-axis=${axis}]`).innerText());
const still = (page, axis) => settled(() => digits(page, axis), `${axis} at rest`, 700);

/** On the Machine screen, homed; returns the middle of the button that jogs X. */
async function homed(page) {
  await tab(page, "Machine").click();
  await press(page, page.getByRole("button", { name: "Home", exact: true }));
  await page.getByText("At rest, position known.").waitFor();
  const button = page.getByRole("button", { name: "Move X to the right" });
  await until(() => button.isEnabled(), "a pad that may be pressed");
  const box = await button.boundingBox();
  return { button, at: [box.x + box.width / 2, box.y + box.height / 2] };
}

test("a jog button that appears under a resting pointer moves nothing", async () => {
  const bridge = await startBridge({ speed: 1 });
  const { page, context } = await openLinked(browser, bridge, { width: 1280, height: 900 });
  try {
    const { button, at } = await homed(page);
    const start = await still(page, "X");
    await tab(page, "Board").click();
    await page.mouse.move(...at);
    // A key changes the screen while the pointer is where the pad will appear.
    await page.keyboard.press("4");
    await button.waitFor();
    await page.mouse.down();
    await page.mouse.up();
    await page.getByText("The page changed just before your press").waitFor();
    assert.equal(await still(page, "X"), start, "nothing moved");
    await until(() => button.isEnabled(), "a pad that has been there for a second");
    await page.mouse.down();
    await page.mouse.up();
    await until(async () => (await digits(page, "X")) !== start, "a step");
    await page.getByText("The page changed just before your press").waitFor({ state: "hidden" });
  } finally {
    await context.close();
    await bridge.stop();
  }
});

test("a double click that ends on the pad moves nothing", async () => {
  const bridge = await startBridge({ speed: 1 });
  const { page, context } = await openLinked(browser, bridge, { width: 1280, height: 900 });
  try {
    const { at } = await homed(page);
    const start = await still(page, "X");
    // Something covers the pad, like a panel that closes when it is pressed.
    await page.evaluate(([x, y]) => {
      const over = document.createElement("button");
      over.style.cssText = `position: fixed; left: ${x - 40}px; top: ${y - 40}px; width: 80px; height: 80px; z-index: 999`;
      over.addEventListener("click", () => over.remove());
      document.body.append(over);
    }, at);
    await page.mouse.dblclick(...at);
    assert.equal(await still(page, "X"), start, "the second half of the double click moved nothing");
  } finally {
    await context.close();
    await bridge.stop();
  }
});

test("a banner that opens leaves the pad where it is", async () => {
  const bridge = await startBridge({ speed: 50 });
  const { page, context } = await openLinked(browser, bridge, { width: 1280, height: 900 });
  try {
    const { button } = await homed(page);
    const before = await button.boundingBox();
    // Once Z is at the top, the refusal appears as a banner above the panels.
    await page.getByRole("button", { name: "10", exact: true }).click();
    const up = page.getByRole("button", { name: "Move Z up" });
    await until(async () => {
      await press(page, up);
      return page.getByRole("alert").first().isVisible();
    }, "a refusal");
    assert.deepEqual(await button.boundingBox(), before);
    assert.ok(await button.isEnabled(), "and it can be pressed");
  } finally {
    await context.close();
    await bridge.stop();
  }
});
