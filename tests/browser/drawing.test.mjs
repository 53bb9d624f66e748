// The board editor: drawing by mouse, keys and numbers; undo; restoring after a reload; making a board.

import assert from "node:assert/strict";
import { data, downloaded, findings, picture, planned, settled, show, stand, tab, test, until } from "./harness.mjs";

const { fresh, opened } = stand();

/** A page on the Draw screen. */
async function draw(options) {
  const opened = await fresh(options);
  await opened.page.getByRole("button", { name: /Draw a board/ }).click();
  await opened.page.getByRole("heading", { name: "Objects" }).waitFor();
  // Wait until the sheet is fitted: it is to the right of the origin and above it.
  await until(async () => ((await data(opened.page, "centre")) ?? "0").split(" ").every((mm) => Number(mm) > 0), "the sheet in the picture");
  return opened;
}

/** The number of things in the drawing, from its description. */
const things = async (page) => {
  const words = await page.locator("canvas").first().getAttribute("aria-label");
  return Number(/: (\d+) objects?$/.exec(words ?? "")?.[1] ?? -1);
};

/** Waits until this many things are drawn. */
const drawn = (page, count, what) =>
  until(async () => (await things(page)) === count, what).catch(async (error) => {
    throw new Error(`${error.message}; ${await things(page)} objects instead of ${count}`);
  });

/** Window position of a point in the drawing. */
async function at(page, x, y) {
  const canvas = page.locator("canvas").first();
  const box = await canvas.boundingBox();
  const [cx, cy] = (await data(page, "centre")).split(" ").map(Number);
  const px = (Number(await data(page, "zoom")) * 96) / 25.4;
  return [box.x + box.width / 2 + (x - cx) * px, box.y + box.height / 2 - (y - cy) * px];
}

async function press(page, x, y) {
  await page.mouse.move(...(await at(page, x, y)));
  await page.mouse.down();
  await page.mouse.up();
}

const field = (page, name) => page.getByRole("textbox", { name: new RegExp(`^${name}`) });

test("a board is drawn by mouse and keys, taken back, kept over a reload, and milled", async () => {
  const { page, context, problems } = await draw();
  try {
    const place = () => page.locator("canvas").first().boundingBox();
    const before = await place();
    await page.keyboard.press("p");
    await press(page, 20, 20);
    await press(page, 40, 20);
    await drawn(page, 6, "two pads with holes");
    await page.getByRole("button", { name: /^Ring / }).waitFor();
    assert.deepEqual(await place(), before, "the picture stays where it is under the pointer");
    await page.keyboard.press("x");
    await press(page, 20, 20);
    await press(page, 40, 20);
    await page.keyboard.press("End");
    await drawn(page, 7, "a track on their nodes");
    // The edge by typed coordinates.
    await page.getByRole("group", { name: "Layer" }).getByRole("button", { name: "Edge" }).click();
    await page.keyboard.press("c");
    for (const place of ["x 10 y 10", "@40 0", "@0 20", "@-40 0", "10 10"]) {
      await page.keyboard.type(place);
      await page.keyboard.press("Enter");
    }
    await page.keyboard.press("Escape");
    await page.keyboard.press("End");
    await drawn(page, 15, "an edge of four tracks");
    await page.getByRole("button", { name: /^Track 0.6/ }).waitFor();
    await page.screenshot({ path: picture("draw-1440-dark") });
    assert.deepEqual(await findings(page), [], "Draw");
    // Undo everything, then redo.
    const all = 7;
    for (let step = 0; step < all; step += 1) await page.keyboard.press("Control+z");
    await drawn(page, 0, "an empty sheet");
    for (let step = 0; step < all; step += 1) await page.keyboard.press("Control+y");
    await drawn(page, 15, "all of it again");
    await page.keyboard.press("Control+z");
    await page.reload();
    await drawn(page, 14, "the drawing after a reload");
    await page.keyboard.press("Control+y");
    await drawn(page, 15, "an edit from before the reload");
    await page.getByRole("button", { name: "Use this board" }).click();
    await page.getByRole("heading", { name: "Operations" }).waitFor();
    await planned(page);
    await tab(page, "Board").click();
    await until(async () => (await data(page, "holes")) === "2", "both holes on the board");
    assert.deepEqual(problems, [], "nothing was said on the console");
  } finally {
    await context.close();
  }
});

test("the picture stays where it is while the sheet grows, also after all of it was looked at", async () => {
  const { page, context } = await draw();
  try {
    await page.keyboard.press("Shift+1");
    const look = async () => `${await data(page, "zoom")} at ${await data(page, "centre")}`;
    const before = await settled(look, "all of the sheet");
    await page.keyboard.press("p");
    await press(page, 99, 79);
    await drawn(page, 3, "a pad at the corner");
    await press(page, 20, 20);
    await drawn(page, 6, "a pad where it was aimed at");
    await page.getByRole("option", { name: /^Pad 2, Top\s+20 20/ }).waitFor();
    assert.equal(await settled(look, "a picture at rest"), before);
    await page.keyboard.press("Shift+1");
    await until(async () => (await look()) !== before, "all of the larger sheet");
  } finally {
    await context.close();
  }
});

test("while Space is held a drag moves the picture and draws nothing", async () => {
  const { page, context } = await draw();
  try {
    const box = await page.locator("canvas").first().boundingBox();
    const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
    const centre = async () => (await data(page, "centre")).split(" ").map(Number);
    const drag = async () => {
      await page.mouse.move(x, y);
      await page.mouse.down();
      await page.mouse.move(x + 60, y + 20, { steps: 4 });
      await page.mouse.up();
    };
    const before = await centre();
    const mm = 25.4 / (Number(await data(page, "zoom")) * 96);
    await page.keyboard.press("x");
    await page.keyboard.down("Space");
    await drag();
    await page.keyboard.up("Space");
    const wanted = [before[0] - 60 * mm, before[1] + 20 * mm];
    await until(async () => (await centre()).every((at, axis) => Math.abs(at - wanted[axis]) < 0.1), "a picture that went along");
    assert.equal(await things(page), 0, "nothing is drawn");
    // Without Space, the same drag doesn't move the picture.
    await drag();
    assert.deepEqual((await centre()).map((at) => at.toFixed(1)), wanted.map((at) => at.toFixed(1)));
  } finally {
    await context.close();
  }
});

test("drawn by keys alone, and the numbers of what is chosen are typed", async () => {
  const { page, context } = await draw();
  try {
    await page.keyboard.press("x");
    for (const key of ["Shift+ArrowRight", "Enter", "Shift+ArrowRight", "Shift+ArrowUp", "Enter", "End"]) await page.keyboard.press(key);
    await drawn(page, 3, "a track");
    await page.keyboard.press("v");
    await page.keyboard.press("Control+a");
    await field(page, "Track width").waitFor();
    await page.keyboard.press("e");
    assert.equal(await field(page, "From X").evaluate((one) => one === document.activeElement), true, "E goes to the numbers");
    await field(page, "To X").fill("12,5");
    await page.keyboard.press("Enter");
    await page.getByRole("option", { name: /→ 12.5 5/ }).waitFor();
    await field(page, "Track width").fill("20mil");
    await page.keyboard.press("Enter");
    await page.getByRole("button", { name: "Track 0.508 mm" }).waitFor();
    await field(page, "Track width").fill("wide");
    await page.keyboard.press("Enter");
    assert.equal(await field(page, "Track width").getAttribute("aria-invalid"), "true");
    await page.getByRole("button", { name: "Array…" }).click();
    const dialog = page.getByRole("dialog", { name: "Repeat the selection" });
    await dialog.getByRole("textbox", { name: "Rows" }).fill("3");
    await dialog.getByRole("button", { name: "Repeat" }).click();
    await drawn(page, 36, "twelve tracks");
    const files = await downloaded(page, page.getByRole("button", { name: "Gerber and Excellon" }));
    assert.deepEqual([...files.keys()], ["board-top.gbr"]);
  } finally {
    await context.close();
  }
});

test("the example of the manual becomes a job that is planned", async () => {
  const { page, context } = await draw();
  try {
    await page.getByRole("button", { name: "Open the example" }).click();
    await drawn(page, 87, "the example");
    await page.getByRole("button", { name: "Use this board" }).click();
    await page.getByRole("heading", { name: "Operations" }).waitFor();
    await planned(page);
    await page.getByText(/^Planned .* m,|Problems \(\d+\)/).first().waitFor();
    await page.screenshot({ path: picture("draw-example-cam") });
  } finally {
    await context.close();
  }
});

test("a drawing that is opened fills the picture, and the one before comes back", async () => {
  const { page, context } = await draw();
  try {
    await page.keyboard.press("p");
    await press(page, 20, 20);
    await drawn(page, 3, "a pad");
    await page.getByRole("button", { name: "Open the example" }).click();
    await drawn(page, 87, "the example");
    const middle = async () => ((await data(page, "centre")) ?? "").split(" ").map(Number);
    await until(async () => {
      const [x, y] = await middle();
      return Math.abs(x - 21.59) < 1 && Math.abs(y - 12.7) < 1;
    }, "the board of the example in the middle");
    const box = await page.locator("canvas").first().boundingBox();
    const [left] = await at(page, 0, 0);
    const [right] = await at(page, 43.18, 0);
    assert.ok(right - left > box.width * 0.7 && left > box.x && right < box.x + box.width, `${left} to ${right} in ${box.width}`);
    await page.getByRole("button", { name: "Back to it" }).click();
    await drawn(page, 3, "the pad");
    await page.keyboard.press("Control+z");
    await drawn(page, 0, "its edits");
  } finally {
    await context.close();
  }
});

test("a drawing that another tab has is opened as a copy, and both are kept", async () => {
  const { page, context } = await draw();
  try {
    const pads = async (page, ...places) => {
      await page.keyboard.press("p");
      await page.keyboard.press("c");
      for (const place of places) {
        await page.keyboard.type(place);
        await page.keyboard.press("Enter");
      }
      await page.keyboard.press("Escape");
      await page.keyboard.press("Escape");
    };
    await pads(page, "20 20");
    await drawn(page, 3, "a pad with its hole");
    await page.waitForTimeout(1500);
    const other = await context.newPage();
    await other.goto(new URL(page.url()).origin);
    await other.getByRole("button", { name: /Draw a board/ }).click();
    const line = other.getByRole("list", { name: "Earlier drawings" }).getByRole("listitem").filter({ hasText: "In another tab" });
    await line.waitFor();
    assert.equal(await line.getByRole("button", { name: "Forget" }).count(), 0, "the other tab keeps it");
    await line.getByRole("button", { name: "Open" }).click();
    await other.getByText("This drawing is open in another tab.").waitFor();
    await drawn(other, 3, "the copy");
    await pads(other, "30 20", "40 20");
    await drawn(other, 9, "the copy with more");
    await pads(page, "20 30");
    await drawn(page, 6, "the drawing with another");
    await page.waitForTimeout(1500);
    for (const [tab, count] of [[other, 9], [page, 6]]) {
      await tab.reload();
      await drawn(tab, count, "as this tab left it");
    }
  } finally {
    await context.close();
  }
});

test("in the tree things go into groups and out of them, by pointer and by keys, and are renamed", async () => {
  const { page, context } = await draw();
  try {
    await page.keyboard.press("o");
    for (const x of [20, 40, 60]) await press(page, x, 20);
    await drawn(page, 6, "three holes");
    await page.keyboard.press("v");
    await press(page, 20, 20);
    await page.keyboard.press("Control+g");
    const group = page.getByRole("option", { name: /Group 1/ });
    await group.waitFor();
    await page.keyboard.press("F2");
    await page.keyboard.type("Corner");
    await page.keyboard.press("Enter");
    const corner = page.getByRole("option", { name: /Corner/ });
    await corner.waitFor();
    const hole = (x) => page.getByRole("option", { name: new RegExp(`^\\s*Hole .* ${x} 20$`) });
    await hole(40).dragTo(corner);
    const depth = (line) => line.evaluate((one) => Number.parseFloat(getComputedStyle(one).paddingInlineStart));
    const top = await depth(hole(60));
    await until(async () => (await depth(hole(40))) > top, "the hole in the group");
    await hole(60).click();
    await page.getByRole("listbox", { name: "Objects" }).focus();
    await page.keyboard.press("Alt+ArrowRight");
    await until(async () => (await depth(hole(60))) > top, "the other hole in the group");
    await page.keyboard.press("Alt+ArrowLeft");
    await until(async () => (await depth(hole(60))) === top, "out of it again");
    // Arrows walk through the list and select.
    const chosen = page.getByRole("listbox", { name: "Objects" }).locator("[aria-selected=true]");
    await hole(60).click();
    const before = await chosen.innerText();
    await page.keyboard.press("ArrowUp");
    await until(async () => (await chosen.count()) > 0 && (await chosen.first().innerText()) !== before, "the line before it");
    await page.keyboard.press("ArrowDown");
    await until(async () => (await chosen.innerText()) === before, "the line again");
    assert.deepEqual(await findings(page), [], "Draw");
  } finally {
    await context.close();
  }
});

test("what the open files draw is chosen by keys from a list, by kind, and a locked layer is left alone", async () => {
  const { page, context } = await opened();
  try {
    await show(page, "Draw");
    const block = page.getByRole("region", { name: "Objects of the files" });
    await block.waitFor();
    const chosen = block.getByRole("listbox").getByRole("option", { selected: true });
    const list = (name) => block.getByRole("listbox", { name });
    const taken = page.getByRole("option", { name: /^\s*Taken out: / });
    await list("Holes").focus();
    await page.keyboard.press("ArrowDown");
    await page.keyboard.press("ArrowDown");
    await until(async () => /^Hole /.test((await chosen.allInnerTexts()).join().trim()), "a hole");
    await page.getByRole("heading", { name: "1 selected" }).waitFor();
    assert.deepEqual(await findings(page), [], "Draw");
    await page.screenshot({ path: picture("draw-files-1440") });
    await page.keyboard.press("Delete");
    await taken.first().waitFor();
    assert.equal(await taken.count(), 1, "it is taken out");
    await page.keyboard.press("Control+z");
    await until(async () => (await taken.count()) === 0, "and there again");
    await block.getByRole("combobox", { name: "Which of them" }).selectOption({ label: "Pads" });
    await list("Pads").focus();
    await page.keyboard.press("PageDown");
    await until(async () => /^Pad [\d.]+/.test((await chosen.allInnerTexts()).join().trim()), "a pad");
    // Locked holes can be selected neither here nor on the board, and not deleted.
    await show(page, "Board");
    await page.getByRole("button", { name: "Lock Holes" }).click();
    const unlock = page.getByRole("button", { name: "Unlock Holes" });
    await unlock.waitFor();
    const said = page.locator(".stage > .unseen[role=status]");
    await page.locator("canvas").first().focus();
    await page.keyboard.press("ArrowRight");
    await show(page, "Draw");
    await block.getByRole("combobox", { name: "Which of them" }).selectOption({ label: "Holes" });
    await list("Holes").focus();
    await page.keyboard.press("ArrowDown");
    await page.keyboard.press("Delete");
    await page.getByText(/^That is on a locked layer/).waitFor();
    assert.equal(await taken.count(), 0);
    await show(page, "Board");
    assert.equal(await said.innerText(), "", "no hole was chosen in the picture");
    assert.deepEqual(await findings(page), [], "Board");
    await unlock.click();
    await page.locator("canvas").first().focus();
    await page.keyboard.press("ArrowRight");
    await until(async () => /^Hole \d+/.test(await said.innerText()), "a hole in words");
  } finally {
    await context.close();
  }
});

test("what the open files draw is copied, turned, lined up and saved, and there after a reload", async () => {
  const { page, context } = await opened();
  try {
    await show(page, "Draw");
    const block = page.getByRole("region", { name: "Objects of the files" });
    await block.waitFor();
    const list = (name) => block.getByRole("listbox", { name });
    const line = (words) => page.getByRole("listbox", { name: "Objects", exact: true }).getByRole("option", { name: words });
    const lines = (words, count, what) => until(async () => (await line(words).count()) === count, what);
    await block.getByRole("combobox", { name: "Which of them" }).selectOption({ label: "Pads" });
    await list("Pads").focus();
    await page.keyboard.press("ArrowDown");
    await page.getByRole("heading", { name: "1 selected" }).waitFor();
    const push = (name) => page.getByRole("button", { name, exact: true }).click();
    await push("Duplicate");
    await lines(/Copy from: /, 1, "a copy in the tree");
    // The copy is selected; typed coordinates move it.
    await field(page, "X").fill("12.5");
    await page.keyboard.press("Enter");
    await line(/Copy from: .* 12.5 /).waitFor();
    // The original in the file and its copy.
    await list("Pads").focus();
    await page.keyboard.press("ArrowDown");
    await page.keyboard.press("ArrowUp");
    await line(/Copy from: /).click({ modifiers: ["Shift"] });
    await page.getByRole("heading", { name: "2 selected" }).waitFor();
    await page.getByRole("group", { name: "Align" }).getByRole("button", { name: "Left", exact: true }).click();
    await lines(/Moved: |Copy from: /, 2, "one of them moved to the other");
    await page.keyboard.press("Control+z");
    await lines(/Moved: /, 0, "back by one step");
    await page.locator("canvas").first().focus();
    await page.keyboard.press("r");
    await lines(/Turned: |Copy from: /, 2, "both turned by a key");
    assert.deepEqual(await findings(page), [], "Draw");
    const files = await downloaded(page, page.getByRole("button", { name: "Gerber and Excellon" }));
    assert.equal(files.size, 1, [...files.keys()].join());
    assert.match([...files.values()][0].toString(), /%LR90\*%/);
    await page.waitForTimeout(1500);
    await page.reload();
    await show(page, "Draw");
    await lines(/Turned: |Copy from: /, 2, "both after a reload");
    await page.keyboard.press("Control+z");
    await lines(/Turned: /, 0, "an edit from before the reload is taken back");
  } finally {
    await context.close();
  }
});

for (const [width, height] of [[390, 844], [820, 1180], [1440, 900]]) {
  test(`the editor at ${width} is accessible and no wider than the window`, async () => {
    const { page, context } = await draw({ width, height, scheme: "light" });
    try {
      await page.getByRole("button", { name: "Open the example" }).click();
      await drawn(page, 87, "the example");
      await page.locator(".draw-line").first().click();
      await page.screenshot({ path: picture(`draw-${width}-light`), fullPage: true });
      assert.deepEqual(await findings(page), [], "Draw");
      const wide = await page.evaluate(() => document.documentElement.scrollWidth);
      assert.ok(wide <= width, `${wide} px in ${width}`);
    } finally {
      await context.close();
    }
  });
}

test("everything that the open files draw is chosen with nothing chosen before, and goes into a group", async () => {
  const { page, context } = await opened();
  try {
    await show(page, "Draw");
    const block = page.getByRole("region", { name: "Objects of the files" });
    await block.waitFor();
    const push = (name) => page.getByRole("button", { name, exact: true }).click();
    assert.ok(await page.getByRole("button", { name: "Group", exact: true }).isDisabled(), "nothing to group");
    await push("Select all");
    await page.getByRole("heading", { name: /^\d{2,} selected$/ }).waitFor();
    await page.keyboard.press("Escape");
    await block.getByRole("listbox", { name: "Holes" }).focus();
    await page.keyboard.press("ArrowDown");
    await page.getByRole("heading", { name: "1 selected" }).waitFor();
    await push("Group");
    const group = page.getByRole("option", { name: /Group 1/ });
    await group.waitFor();
    await page.getByRole("region", { name: "Objects", exact: true }).getByRole("button", { name: "Open", exact: true }).click();
    await page.getByRole("option", { name: /^\s*As in the file: / }).waitFor();
    assert.deepEqual(await findings(page), [], "Draw");
  } finally {
    await context.close();
  }
});
