// STOP is visible and can be pressed: on every screen, in every dialog, at every size, zoomed, and in
// high-contrast colours; everything else can be reached by scrolling.

import assert from "node:assert/strict";
import { atRest, broken, data, drillOnly, exportPanel, findings, openLinked, picture, rounds, SCREENS, show, stand, startBridge, startJob, test, until } from "./harness.mjs";

/** Window sizes in px: phones in portrait and landscape, tablets, a desktop at 200 % and 400 %, and the
 *  limits of the layouts. */
const SIZES = [
  [320, 256], [320, 568], [360, 225], [360, 740], [390, 844], [480, 320], [640, 400], [700, 450], [720, 450], [768, 1024], [820, 1180], [926, 428],
  [1023, 700], [1024, 768], [1280, 360], [1280, 800], [1400, 900],
];
const EVERY = [256, 480, 768, 1200].flatMap((height) =>
  Array.from({ length: 28 }, (_, step) => [320 + step * 40, height]),
);

const held = stand("none");

const { opened } = held;
/** The container of the STOP that can be pressed: an open dialog makes the rest of the page inert. */
async function within(page) {
  const dialog = page.locator("dialog[open]");
  return (await dialog.count()) > 0 ? dialog : page.locator("header.top-bar");
}

const pressed = async (page) => (await within(page)).getByRole("button", { name: "STOP", exact: true });

/** Problems of STOP on the current page. */
async function wrong(page) {
  const stop = await pressed(page);
  assert.equal(await stop.count(), 1, "one STOP");
  return stop.evaluate((button) => {
    const box = button.getBoundingClientRect();
    const seen = globalThis.visualViewport;
    const scale = seen.scale;
    const inside =
      box.left >= seen.offsetLeft - 0.5 && box.top >= seen.offsetTop - 0.5 &&
      box.right <= seen.offsetLeft + seen.width + 0.5 && box.bottom <= seen.offsetTop + seen.height + 0.5;
    const found = [];
    const at = [box.left, box.top, box.right, box.bottom].map((edge) => edge.toFixed(1)).join(" ");
    if (!inside) found.push(`not in the window: ${at} of ${innerWidth} × ${innerHeight}`);
    if (box.height * scale < 44 || box.width * scale < 96) found.push(`too small: ${box.width} × ${box.height}`);
    for (const x of [0.03, 0.5, 0.97]) {
      for (const y of [0.06, 0.5, 0.94]) {
        const top = document.elementFromPoint(box.left + x * box.width, box.top + y * box.height);
        if (top !== button) found.push(`covered at ${x} ${y} by ${top?.tagName}.${top?.className}`);
      }
    }
    if (document.documentElement.scrollWidth > innerWidth) found.push(`${document.documentElement.scrollWidth} px wide`);
    const style = getComputedStyle(button);
    if (matchMedia("(forced-colors: active)").matches) {
      if (parseFloat(style.borderTopWidth) < 2 || style.borderTopStyle !== "solid") found.push("no border");
      if (style.borderTopColor === style.backgroundColor) found.push(`a border of ${style.borderTopColor} on the same`);
    }
    return found;
  });
}

/** Checks STOP at all `sizes`, and names the problems. */
async function looked(page, what, sizes) {
  const found = [];
  for (const [width, height] of sizes) {
    await page.setViewportSize({ width, height });
    for (const one of await wrong(page)) found.push(`${what}, ${width} × ${height}: ${one}`);
  }
  return found;
}

/** Checks STOP in the page's colours and in the system's. */
async function lookedInAllColours(page, what, sizes) {
  const found = await looked(page, what, sizes);
  await page.emulateMedia({ forcedColors: "active" });
  found.push(...(await looked(page, `${what}, forced colours`, sizes)));
  await page.emulateMedia({ forcedColors: "none" });
  return found;
}

test("STOP is in the window and on top, on every screen at every size", async () => {
  const { page, context } = await held.fresh();
  try {
    await (await pressed(page)).waitFor();
    const sizes = rounds(SIZES, EVERY);
    const found = await looked(page, "welcome", sizes);
    await page.getByRole("button", { name: /Sample board/ }).click();
    await page.getByText(/^Planned .* m,/).waitFor();
    for (const screen of SCREENS) {
      await show(page, screen);
      found.push(...(await looked(page, screen, sizes)));
      await page.evaluate(() => scrollTo(0, document.documentElement.scrollHeight));
      found.push(...(await looked(page, `${screen}, at its end`, sizes.slice(0, 4))));
    }
    await show(page, "CAM");
    const panel = await exportPanel(page);
    found.push(...(await lookedInAllColours(page, "export panel", sizes)));
    await panel.getByRole("button", { name: "Template…" }).click();
    found.push(...(await lookedInAllColours(page, "template editor", sizes)));
    await page.keyboard.press("Escape");
    await show(page, "Machine");
    await page.setViewportSize({ width: 1280, height: 800 });
    await page.getByRole("button", { name: "Large view" }).click();
    found.push(...(await lookedInAllColours(page, "large view", sizes)));
    assert.deepEqual(found, []);
  } finally {
    await context.close();
  }
});

test("STOP is in the window and on top in a dialog, and stops from there", async () => {
  const own = await startBridge({ speed: 50 });
  const { page, context } = await openLinked(held.browser, own);
  try {
    await page.getByRole("button", { name: /Sample board/ }).click();
    await drillOnly(page);
    const { start } = await startJob(page);
    const found = await lookedInAllColours(page, "pre-flight", SIZES);
    await page.setViewportSize({ width: 768, height: 1024 });
    await page.screenshot({ path: picture("preflight-768") });
    await start.click();
    await page.getByRole("alertdialog").waitFor();
    found.push(...(await lookedInAllColours(page, "tool change", SIZES)));
    for (const width of [320, 768]) {
      await page.setViewportSize({ width, height: 700 });
      await page.screenshot({ path: picture(`change-${width}`) });
    }
    assert.deepEqual(found, []);
    const box = await (await pressed(page)).boundingBox();
    await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
    await page.mouse.down();
    await page.getByText(/^You stopped it\. Holes drilled/).waitFor();
    await page.mouse.up();
  } finally {
    await context.close();
    await own.stop();
  }
});

test("a STOP that nobody answers is shouted, over a dialog too", async () => {
  const own = await startBridge({ speed: 50 });
  const { page, context } = await openLinked(held.browser, own, { width: 640, height: 700 });
  try {
    await page.getByRole("button", { name: /Sample board/ }).click();
    await drillOnly(page);
    await startJob(page);
    own.freeze(true);
    await (await pressed(page)).dispatchEvent("pointerdown");
    const shout = (await within(page)).getByRole("alert").filter({ hasText: "STOP NOT CONFIRMED" });
    await shout.waitFor();
    const onTop = await shout.evaluate((one) => {
      const box = one.getBoundingClientRect();
      const top = document.elementFromPoint(box.left + 8, box.top + box.height / 2);
      return one === top && box.left >= 0 && box.right <= innerWidth && box.bottom <= innerHeight;
    });
    assert.ok(onTop, "the shout is in the window and over the dialog");
    assert.deepEqual(await wrong(page), [], "and STOP beside it");
    await page.screenshot({ path: picture("not-confirmed-640") });
    own.freeze(false);
    await until(async () => (await shout.count()) === 0, "the answer");
  } finally {
    own.freeze(false);
    await context.close();
    await own.stop();
  }
});

for (const forced of ["active", "none"]) {
  test(`STOP at twice the density and for fingers, forced colours ${forced}`, async () => {
    const options = { deviceScaleFactor: 2, hasTouch: true, forcedColors: forced, width: 640, height: 400 };
    const { page, context } = await opened(options);
    try {
      const found = [];
      for (const screen of SCREENS) {
        await show(page, screen);
        found.push(...(await looked(page, screen, [[320, 256], [640, 400], [700, 450], [1280, 800]])));
      }
      if (forced === "active") {
        await page.setViewportSize({ width: 640, height: 400 });
        await page.screenshot({ path: picture("machine-forced-640") });
      }
      assert.deepEqual(found, []);
    } finally {
      await context.close();
    }
  });
}

test("STOP stays in the corner of what is seen while two fingers magnify the page", async () => {
  const { page, context } = await opened({ isMobile: true, hasTouch: true, width: 768, height: 1024 });
  try {
    await show(page, "Machine");
    const session = await context.newCDPSession(page);
    for (const scale of [1, 2, 3.5, 1]) {
      await session.send("Emulation.setPageScaleFactor", { pageScaleFactor: scale });
      await until(() => page.evaluate((wanted) => Math.abs(visualViewport.scale - wanted) < 0.1, scale), `scale ${scale}`);
      await atRest(page);
      assert.deepEqual(await wrong(page), [], `magnified ${scale} times`);
    }
  } finally {
    await context.close();
  }
});

/** Controls that scrolling can't bring into the window and to the front. */
const unreachable = (page) =>
  page.evaluate(() => {
    const found = [];
    for (const one of document.querySelectorAll("button, select, input, textarea, summary, a[href]")) {
      if (!one.checkVisibility({ visibilityProperty: true }) || one.closest("[inert]")) continue;
      one.scrollIntoView({ block: "center", inline: "center" });
      const box = one.getBoundingClientRect();
      const [x, y] = [box.left + box.width / 2, box.top + box.height / 2];
      const top = document.elementFromPoint(x, y);
      const hit = top && (one.contains(top) || top.contains(one) || top.closest("label")?.contains(one));
      const name = one.getAttribute("aria-label") ?? one.textContent.slice(0, 40);
      if (!hit) found.push(`${one.tagName} ${name} at ${x.toFixed(0)} ${y.toFixed(0)}, under ${top?.tagName}.${top?.className}`);
    }
    return found;
  });

test("on a narrow window everything is reached by scrolling, and nothing is inaccessible", async () => {
  const { page, context } = await opened();
  try {
    const found = [];
    for (const screen of SCREENS) {
      for (const [width, height] of [[320, 568], [640, 400], [768, 1024]]) {
        await show(page, screen);
        await page.setViewportSize({ width, height });
        await atRest(page);
        found.push(...(await unreachable(page)).map((one) => `${screen}, ${width} × ${height}: ${one}`));
        await page.evaluate(() => scrollTo(0, 0));
        await page.screenshot({ path: picture(`${screen.toLowerCase()}-${width}`), fullPage: width < 800 });
      }
      found.push(...(await findings(page)).map((one) => `${screen}: ${one}`));
    }
    assert.deepEqual(found, []);
    assert.ok(Number(await data(page, "holes")) > 0, "the board is still in the picture");
  } finally {
    await context.close();
  }
});

/** The sample is being drilled, and the first tool is requested. */
async function started(page) {
  await page.getByRole("button", { name: /Sample board/ }).click();
  await drillOnly(page);
  const { start } = await startJob(page);
  await start.click();
}

test("on a phone that shows another screen a STOP is told in sight, however far it is scrolled", async () => {
  const own = await startBridge({ speed: 2 });
  const { page, context } = await openLinked(held.browser, own, { width: 390, height: 844 });
  try {
    await started(page);
    await page.getByRole("button", { name: "Start spindle and continue" }).click();
    await show(page, "Settings");
    await page.evaluate(() => scrollTo(0, document.body.scrollHeight));
    await (await pressed(page)).click();
    const told = page.getByText(/^You stopped/);
    await told.waitFor();
    const box = await told.boundingBox();
    assert.ok(box.y >= 0 && box.y + box.height <= 844, `in sight: ${JSON.stringify(box)}`);
    assert.deepEqual(await wrong(page), []);
    assert.deepEqual(await findings(page), []);
  } finally {
    await context.close();
    await own.stop();
  }
});

test("a page whose program broke says so above every dialog, and its own STOP still stops the machine", async () => {
  const own = await startBridge({ speed: 2 });
  const { page, context } = await openLinked(held.browser, own, { width: 390, height: 844 });
  try {
    await started(page);
    await page.getByRole("button", { name: "Start spindle and continue" }).waitFor();
    const fallen = await broken(page);
    await page.keyboard.press("Escape");
    assert.ok(await fallen.isVisible(), "it stays");
    const stop = fallen.getByRole("button", { name: "STOP", exact: true });
    const box = await stop.boundingBox();
    assert.ok(box.y > 422 && box.y + box.height <= 844 && box.height >= 44, `where STOP is on a phone: ${JSON.stringify(box)}`);
    await stop.click();
    await fallen.getByText(/^STOP was sent\./).waitFor();
    const { page: other, context: elsewhere } = await openLinked(held.browser, own);
    await show(other, "Machine");
    await other.getByText(/Stopped by another page|was stopped|was interrupted/).first().waitFor();
    await elsewhere.close();
    await fallen.getByRole("button", { name: "Reload the page" }).click();
    await page.getByRole("heading", { level: 1 }).first().waitFor({ state: "attached" });
    assert.ok(!(await fallen.isVisible()), "the page is there again");
    // A closed line accepts a STOP without an error: the page must not show it as sent.
    await (await pressed(page)).waitFor();
    await own.stop();
    await page.waitForTimeout(1000);
    await (await broken(page)).getByRole("button", { name: "STOP", exact: true }).click();
    await page.getByText(/^STOP could not be sent/).waitFor();
  } finally {
    await context.close();
    await own.stop();
  }
});
