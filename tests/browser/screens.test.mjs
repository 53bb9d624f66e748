// Layouts: a tablet in portrait doesn't scroll; a phone has STOP at the bottom and the job first; the
// operator view shows only the machine, large. Help and commands by keys; colours by the system's preference.

import assert from "node:assert/strict";
import { join } from "node:path";
import { atRest, data, drillOnly, findings, openLinked, picture, planned, root, SCREENS, show, stand, startBridge, startJob, tab, test, until } from "./harness.mjs";

const held = stand("none");
const { opened } = held;
/** Elements that extend beyond the right edge of the window and can't be scrolled into view, or beyond the
 *  left edge of a dialog. */
const cutOff = (page) =>
  page.evaluate(() => {
    const found = [];
    const scrolls = (one) => one && (/auto|scroll/.test(getComputedStyle(one).overflowX) || scrolls(one.parentElement));
    for (const one of document.querySelectorAll("main *, header *, footer *, dialog[open] *")) {
      if (!one.checkVisibility({ visibilityProperty: true }) || one.closest(".unseen")) continue;
      const box = one.getBoundingClientRect();
      const left = one.closest("dialog[open]")?.getBoundingClientRect().left ?? -Infinity;
      const out = box.left < left - 1 || (box.right > innerWidth + 1 && !scrolls(one.parentElement));
      if (box.width > 0 && out) {
        found.push(`${one.tagName}.${one.className} from ${box.left.toFixed(0)} to ${box.right.toFixed(0)} of ${innerWidth}`);
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
      const over = await page.locator(".whole:has(.review)").evaluate((whole) => whole.scrollWidth - whole.clientWidth);
      if (over > 1) found.push(`review, ${width}: ${over} px to be scrolled sideways`);
      await page.screenshot({ path: picture(`review-${width}`) });
    }
    assert.deepEqual(found, []);
  } finally {
    await context.close();
  }
});

test("every button of the height map is on a phone's screen", async () => {
  const { page, context } = await opened({ width: 390, height: 844 });
  try {
    await show(page, "Machine");
    await page.getByRole("button", { name: "Operate from this phone" }).click();
    await page.getByRole("button", { name: "Height map…" }).click();
    const found = [];
    for (const width of [320, 390]) {
      await page.setViewportSize({ width, height: 844 });
      await atRest(page);
      found.push(...(await cutOff(page)).map((one) => `${width}: ${one}`));
      await page.screenshot({ path: picture(`height-map-${width}`) });
    }
    assert.deepEqual(found, []);
    await page.getByRole("dialog").getByRole("button", { name: "Close", exact: true }).click({ timeout: 5000 });
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
    // A fitted board is 36 px from the edge of the canvas.
    const [canvas, tools] = [page.locator("canvas").first(), page.getByRole("toolbar", { name: "View" })];
    const [at, over] = [await canvas.boundingBox(), await tools.boundingBox()];
    assert.ok(over.y >= at.y + at.height - 36, `buttons from ${over.y} on, a board down to ${at.y + at.height - 36}`);
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
    const rows = await page.locator("header.top-bar :is(.tab, .top-tools > *)").evaluateAll((all) =>
      all.filter((one) => one.checkVisibility()).map((one) => Math.round((one.getBoundingClientRect().top + one.getBoundingClientRect().bottom) / 2)));
    assert.equal(new Set(rows).size, 2, `rows of the head: ${rows}`);
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
    await page.getByRole("button", { name: "Full view" }).click();
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
        // A colour dot needs a visible border and a word next to it.
        for (const one of document.querySelectorAll(".swatch, .chip .dot, .layer input[type=color], .lamp i")) {
          if (!one.checkVisibility()) continue;
          const style = getComputedStyle(one);
          const isSeen = parseFloat(style.borderTopWidth) >= 1 && style.borderTopStyle !== "none";
          const name = `${one.tagName}.${one.className} in ${one.parentElement.className}`;
          if (!isSeen) rows.push(`${name} without a border`);
          if (!one.parentElement.textContent.trim() && !one.ariaLabel) rows.push(`${name} without a word`);
        }
        for (const on of document.querySelectorAll(".phase-cell.on > span")) {
          const [own, around] = [on, on.parentElement].map((one) => getComputedStyle(one).backgroundColor);
          if (own === around) rows.push("a phase that is on looks like one that is off");
        }
        return [...new Set(rows)];
      });
      assert.deepEqual(found, [], screen);
    }
  } finally {
    await context.close();
  }
});

/** Converts a key from the help's notation to the browser's. */
function pressedAs(written) {
  const signs = { "↑": "ArrowUp", "↓": "ArrowDown", "→": "ArrowRight", "←": "ArrowLeft", Esc: "Escape", Ctrl: "Control", "'": "Quote", ",": "Comma", ".": "Period", "-": "Minus" };
  const words = written.replace(/ \+ \+$/, "+Equal").split(/\s*\+\s*/);
  const alone = (word) => (/^[A-Z]$/.test(word) ? word.toLowerCase() : word);
  return words.map((word) => signs[word] ?? alone(word)).join("+");
}

test("every key that the help lists is taken by the page on its screen, and the palette finds what may be searched", async () => {
  const { page, context } = await opened();
  try {
    await page.keyboard.press("F1");
    const help = page.getByRole("dialog", { name: "Help" });
    await help.waitFor();
    const groups = await help.locator(".key-groups section").evaluateAll((sections) =>
      sections.map((one) => [one.querySelector("h3").textContent, [...one.querySelectorAll("kbd")].map((kbd) => kbd.textContent)]),
    );
    await page.keyboard.press("Escape");
    assert.ok(groups.flatMap(([, keys]) => keys).length > 80, JSON.stringify(groups));
    await page.evaluate(() => addEventListener("keydown", (event) => (globalThis.taken = event.defaultPrevented)));
    const silent = [];
    assert.deepEqual(
      groups.map(([name]) => name),
      ["Everywhere", ...SCREENS.filter((screen) => screen !== "Settings"), "Jog with the keys"],
    );
    // The last group, the jog keys, needs a machine and is tested with one.
    for (const [name, keys] of groups.slice(0, -1)) {
      const screen = SCREENS.includes(name) ? name : "Board";
      for (const written of keys.filter((written) => written !== "Esc")) {
        await page.keyboard.press("Escape");
        await show(page, screen);
        if (screen === "Board" && written === "→") await page.locator("canvas").first().focus();
        else await page.evaluate(() => document.activeElement?.blur());
        await page.keyboard.press(pressedAs(written));
        if (!(await page.evaluate(() => globalThis.taken))) silent.push(`${name}: ${written}`);
      }
    }
    assert.deepEqual(silent, []);
  } finally {
    await context.close();
  }
});

test("keys of one letter can be turned off, and stay off; the others stay", async () => {
  const { page, context } = await opened();
  try {
    await show(page, "Settings");
    await page.getByRole("button", { name: "Page", exact: true }).click();
    await page.getByLabel("Single-key shortcuts").uncheck();
    await page.reload();
    await page.getByRole("button", { name: "Settings" }).waitFor();
    await page.evaluate(() => document.activeElement?.blur());
    const now = () => page.getByRole("navigation", { name: "Screens" }).locator("[aria-current=page]").innerText();
    const before = await now();
    for (const key of ["2", "3", "?", "f"]) await page.keyboard.press(key);
    assert.equal(await now(), before);
    assert.equal(await page.getByRole("dialog").count(), 0);
    await page.keyboard.press("Control+,");
    await until(async () => (await now()) === "Settings", "the settings by Ctrl+,");
    await page.getByRole("button", { name: "Page", exact: true }).click();
    await page.getByLabel("Single-key shortcuts").check();
    await page.evaluate(() => document.activeElement?.blur());
    await page.keyboard.press("2");
    await until(async () => (await now()) === "CAM", "CAM by its number again");
  } finally {
    await context.close();
  }
});

test("a single key is moved to another, stays moved, is written so in the help, and goes back", async () => {
  const { page, context } = await opened();
  const now = () => page.getByRole("navigation", { name: "Screens" }).locator("[aria-current=page]").innerText();
  const leave = () => page.evaluate(() => document.activeElement?.blur());
  try {
    await show(page, "Settings");
    await page.getByRole("button", { name: "Page", exact: true }).click();
    await page.getByText("Keys of your own").click();
    const field = page.getByRole("textbox", { name: "Show CAM" });
    await field.fill("3");
    await field.press("Tab");
    await page.getByText("3 is in use: Show Simulate.").waitFor();
    assert.equal(await field.inputValue(), "2", "what could not be had is not left there");
    await field.fill("q");
    await field.press("Tab");
    await until(async () => (await field.inputValue()) === "Q", "Q shows CAM");
    assert.deepEqual(await findings(page), []);
    await page.reload();
    await page.getByRole("button", { name: "Settings" }).waitFor();
    await leave();
    await page.keyboard.press("2");
    assert.equal(await now(), "Settings", "its old key is free");
    await page.keyboard.press("q");
    await until(async () => (await now()) === "CAM", "CAM by its new key");
    await page.keyboard.press("F1");
    await page.getByRole("dialog").getByRole("listitem").filter({ hasText: "Show CAM" }).getByText("Q", { exact: true }).waitFor();
    await page.keyboard.press("Escape");
    await show(page, "Settings");
    await page.getByRole("button", { name: "Page", exact: true }).click();
    await page.getByText("Keys of your own").click();
    await page.getByRole("button", { name: "Restore default keys" }).click();
    await leave();
    await page.keyboard.press("2");
    await until(async () => (await now()) === "CAM", "CAM by its number again");
  } finally {
    await context.close();
  }
});

test("holes are reached in the picture by Tab and arrows, said, and shown in the list", async () => {
  const { page, context } = await opened();
  try {
    await show(page, "Board");
    await page.locator("#work").focus();
    await page.keyboard.press("Tab");
    assert.equal(await page.evaluate(() => document.activeElement.tagName), "CANVAS", "the picture is next behind the frame");
    await page.keyboard.press("ArrowRight");
    const said = page.locator(".stage > .unseen[role=status]");
    await until(async () => /^Hole \d+: [\d.]+ mm, at X [\d.-]+ Y [\d.-]+ mm$/.test(await said.innerText()), "the hole in words");
    const first = await said.innerText();
    await until(async () => (await page.locator(".virtual .line[aria-selected=true]").count()) === 1, "the hole in the list");
    await page.keyboard.press("ArrowUp");
    await until(async () => (await said.innerText()) !== first, "the hole above");
    const height = (text) => Number(/Y ([\d.-]+)/.exec(text)[1]);
    assert.ok(height(await said.innerText()) > height(first), "it lies above");
    assert.deepEqual(await findings(page), []);
  } finally {
    await context.close();
  }
});

test("rulers count along the picture, and what is large enough bears its size", async () => {
  const { page, context } = await opened();
  try {
    await show(page, "Board");
    const numbers = (which) => page.locator(`.ruler.${which} > span`).allInnerTexts();
    const along = (await numbers("across")).map(Number);
    assert.ok(along.length >= 3 && along.includes(0), `${along}`);
    assert.deepEqual(along, along.toSorted((a, b) => a - b));
    await page.keyboard.press("Control+u");
    await until(async () => (await numbers("across")).some((text) => /\.\d/.test(text)), "inches");
    await page.keyboard.press("Control+u");
    const words = async () => [...new Set((await page.locator(".labels > span").allInnerTexts()).map((text) => text.trim()))];
    assert.deepEqual(await words(), ["3.2"], "from afar only the large holes bear words");
    await page.locator("canvas").first().focus();
    await page.keyboard.press("ArrowRight");
    await page.keyboard.press("Shift+2");
    await until(async () => (await words()).some((text) => ["0.4", "0.8", "1.0"].includes(text)), "the size of a small hole");
    await page.screenshot({ path: picture("labels-1440") });
    await page.setViewportSize({ width: 390, height: 844 });
    assert.ok(!(await page.locator(".ruler").first().isVisible()), "no rulers on a phone");
  } finally {
    await context.close();
  }
});

/** The bounding boxes of the pixels in two colours, as rendered without a GPU: copper, and the cut of the
 *  first operation. */
const painted = (page) =>
  page.locator("canvas").first().evaluate((canvas) => {
    const { data, width } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    const near = (at, [r, g, b], off) => Math.abs(data[at] - r) <= off && Math.abs(data[at + 1] - g) <= off && Math.abs(data[at + 2] - b) <= off;
    const box = (colour, off) => {
      const found = [Infinity, Infinity, -Infinity, -Infinity];
      for (let at = 0; at < data.length; at += 4) {
        if (!near(at, colour, off)) continue;
        const [x, y] = [(at / 4) % width, Math.floor(at / 4 / width)];
        [found[0], found[1], found[2], found[3]] = [Math.min(found[0], x), Math.min(found[1], y), Math.max(found[2], x), Math.max(found[3], y)];
      }
      return found;
    };
    return { copper: box([217, 106, 58], 2), cut: box([125, 127, 78], 20) };
  });

test("on Board the toolpaths lie about the copper of a board without outline, pins beside it or none", async () => {
  const { page, context } = await held.fresh();
  try {
    await page.getByRole("heading", { name: /Drop the files/ }).waitFor();
    const chooser = page.waitForEvent("filechooser");
    await page.keyboard.press("Control+o");
    const copper = "%FSLAX33Y33*%\n%MOMM*%\n%TF.FileFunction,Copper,L1,Top*%\n%ADD10R,4X3*%\nD10*\nX5000Y5000D03*\nX25000Y9000D03*\nM02*\n";
    await (await chooser).setFiles([{ name: "l-F_Cu.gbr", mimeType: "text/plain", buffer: Buffer.from(copper) }]);
    await page.getByText("The board has no outline").first().waitFor();
    const use = page.getByRole("button", { name: /Use this board/ });
    if (await use.isVisible()) await use.click();
    const around = async (what) => {
      await show(page, "Board");
      await until(async () => Number.isFinite((await painted(page)).cut[0]), `toolpaths ${what}`);
      const { copper, cut } = await painted(page);
      const beside = [copper[0] - cut[0], copper[1] - cut[1], cut[2] - copper[2], cut[3] - copper[3]];
      assert.ok(beside.every((px) => px > 0 && px < 12), `${what}: cut ${cut}, copper ${copper}`);
    };
    await around("without pins");
    await show(page, "CAM");
    await page.getByText("Flip, panel, pins").click();
    const pairs = page.getByRole("textbox", { name: "Pairs of pins" });
    await pairs.fill("1");
    await pairs.press("Tab");
    await planned(page);
    await until(async () => Number(await data(page, "holes")) === 2, "the pins at CAM");
    await around("with pins");
  } finally {
    await context.close();
  }
});

test("the screen stays lit from the pre-flight to the end of the job, and it is said where a browser cannot", async () => {
  const own = await startBridge({ speed: 2 });
  const { page, context } = await openLinked(held.browser, own);
  try {
    await page.getByRole("button", { name: /Sample board/ }).click();
    await drillOnly(page);
    await page.evaluate(() => {
      globalThis.lit = [];
      const request = async (kind) => (lit.push(kind), { released: false, release: async () => lit.push("released"), set onrelease(act) {} });
      Object.defineProperty(navigator, "wakeLock", { value: { request }, configurable: true });
    });
    const { dialog, start } = await startJob(page);
    await dialog.getByText("This computer stays awake while this page is in front.").waitFor();
    await start.click();
    await page.getByRole("button", { name: "Start spindle and continue" }).click();
    assert.equal(await page.evaluate(() => globalThis.lit.at(-1)), "screen", "held while the job runs");
    await page.keyboard.press("Control+Shift+E");
    await until(async () => (await page.evaluate(() => globalThis.lit.at(-1))) === "released", "let go of at the end");
    await page.evaluate(() => Object.defineProperty(navigator, "wakeLock", { value: undefined, configurable: true }));
    const again = await startJob(page);
    await again.dialog.getByText(/^This browser can't keep the computer awake/).waitFor();
  } finally {
    await context.close();
    await own.stop();
  }
});

test("a wrong board that was dropped is left again for the one before, with its job", async () => {
  const { page, context } = await opened();
  try {
    await show(page, "CAM");
    await page.getByLabel("Do Cut out").uncheck();
    const chooser = page.waitForEvent("filechooser");
    await page.keyboard.press("Control+o");
    const folder = join(root, "tests/data/synthetic");
    await (await chooser).setFiles([join(folder, "x10-html-error-page.drl"), join(folder, "d01-metric-decimal.drl")]);
    await page.getByRole("button", { name: "Back to sensor" }).click();
    await show(page, "CAM");
    assert.ok(!(await page.getByLabel("Do Cut out").isChecked()), "its job as it was");
    await page.getByRole("button", { name: "Undo" }).click();
    assert.ok(await page.getByLabel("Do Cut out").isChecked(), "and what can be taken back");
    await page.getByText(/^Planned .* m,|7 min/).first().waitFor();
  } finally {
    await context.close();
  }
});
