// The simulation for users: program lines next to it, the side that was milled before, and the carved board
// with both graphics APIs, compared pixel by pixel with stored pictures (ANNULUS_BLESS=1 accepts a change).

import assert from "node:assert/strict";
import { existsSync, mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { atRest, backend, data, findings, openBrowser, openLinked, picture, root, settled, show, stand, startBridge, test, until } from "./harness.mjs";

const held = stand();

const list = (page) => page.getByRole("listbox", { name: "Program" });
const marked = (page) => list(page).getByRole("option", { selected: true });
const clock = async (page) => (await page.locator(".timeline .clock").innerText()).split("/")[0].trim();

async function lines(page) {
  await show(page, "Simulate");
  // Software rendering of the 3D view would use all CPU time.
  await page.getByRole("checkbox", { name: "2D view" }).check();
  await page.getByRole("button", { name: "Program", exact: true }).click();
  await until(async () => (await list(page).getByRole("option").count()) > 10, "lines of the program");
}

test("a line leads to its second, a second to its line, and so does a press in the picture", async () => {
  const { page, context, problems } = await held.opened();
  try {
    await lines(page);
    const rows = list(page).getByRole("option");
    assert.match(await rows.first().innerText(), /\.nc/, "a file begins with its name");
    const began = await clock(page);
    await page.getByRole("slider", { name: "Time", exact: true }).focus();
    await page.keyboard.press("End");
    await until(async () => (await clock(page)) !== began, "the end");
    await until(async () => /M2|M30|G0/.test((await marked(page).allInnerTexts()).join(" ")), "the last lines are marked");
    await page.screenshot({ path: picture("simulate-lines-1440") });
    const last = (await marked(page).allInnerTexts()).join("\n");
    // Press a line near the middle.
    await list(page).evaluate((element) => (element.scrollTop = element.scrollHeight / 2));
    // Scrolling rebuilds rows: read the text from the same row that is pressed.
    const text = await until(async () => {
      const row = await list(page).evaluateHandle((box) => {
        const { top, bottom } = box.getBoundingClientRect();
        const isSeen = (one) => one.getBoundingClientRect().top > top && one.getBoundingClientRect().bottom < bottom;
        return [...box.querySelectorAll("[role=option]")].find((one) => isSeen(one) && /X\d/.test(one.innerText)) ?? null;
      });
      const seen = row.asElement();
      const said = await seen?.innerText().catch(() => "");
      return (await seen?.click({ timeout: 5000 }).then(() => said.trim(), () => "")) || false;
    }, "a line that goes somewhere");
    await until(async () => (await marked(page).allInnerTexts()).some((one) => one.trim() === text), "the line pressed is marked");
    const then = await clock(page);
    assert.notEqual((await marked(page).allInnerTexts()).join("\n"), last);
    // The playback follows: the marked line advances and stays in view.
    await page.getByRole("button", { name: "Play", exact: true }).click();
    await until(async () => (await clock(page)) !== then, "time goes on");
    await until(async () => !(await marked(page).allInnerTexts()).some((one) => one.trim() === text), "another line");
    await page.getByRole("button", { name: "Hold", exact: true }).click();
    assert.ok((await marked(page).count()) > 0, "the line in work is in sight");
    assert.deepEqual(await findings(page), []);
    assert.deepEqual(problems, []);
  } finally {
    await context.close();
  }
});

test("a graphics card that is lost again and again leaves a flat picture that says so, and is zoomed and moved", async () => {
  const { page, context } = await held.opened();
  try {
    await show(page, "Simulate");
    await until(async () => (await data(page, "solid")) !== "", "the board in space");
    for (let loss = 1; loss <= 4; loss += 1) {
      await page.locator("canvas").first().evaluate((canvas) => canvas.getContext("webgl2").getExtension("WEBGL_lose_context").loseContext());
      await until(async () => Number(await data(page, "losses")) === loss, `a new picture after loss ${loss}`);
    }
    assert.equal(await backend(page), "2D");
    await page.locator("footer").getByText("2D", { exact: false }).waitFor();
    const look = async () => `${await data(page, "zoom")} at ${await data(page, "centre")}`;
    const before = await settled(look, "the flat picture");
    const box = await page.locator("canvas").first().boundingBox();
    await page.mouse.move(box.x + box.width / 3, box.y + box.height / 3);
    await page.mouse.wheel(0, -300);
    await until(async () => Number.parseFloat(await look()) > Number.parseFloat(before), "the wheel zooms it");
    const near = await settled(look, "the flat picture close by");
    await page.mouse.down();
    await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2, { steps: 4 });
    await page.mouse.up();
    await until(async () => (await look()) !== near, "a drag moves it");
  } finally {
    await context.close();
  }
});

test("WebGPU that is lost again and again leaves WebGL2, and that leaves a flat picture", async () => {
  const browser = await openBrowser("webgpu");
  try {
    const { page } = await openLinked(browser, held.bridge);
    await page.getByRole("button", { name: /Sample board/ }).click();
    await page.getByText(/^Planned .* m,/).waitFor();
    await until(async () => Number(await data(page, "frames")) > 0, "a picture");
    const drawn = [];
    for (let loss = 1; loss <= 8; loss += 1) {
      drawn.push(await backend(page));
      await page.locator("canvas").first().dispatchEvent("webglcontextlost");
      await until(async () => Number(await data(page, "losses")) === loss, `a new picture after loss ${loss}`);
    }
    drawn.push(await backend(page));
    assert.deepEqual(drawn, [...Array(4).fill("WebGPU"), ...Array(4).fill("WebGL2"), "2D"]);
  } finally {
    await browser.close();
  }
});

test("what draws on the graphics card is fetched by itself: without it there is a flat picture, and the next page has it", async () => {
  const { page, context, problems } = await held.fresh();
  try {
    let asked = 0;
    await page.route("**/painter_bg.wasm", (route) => ((asked += 1), route.abort()));
    await page.reload();
    await page.getByRole("button", { name: /Sample board/ }).click();
    await page.getByText(/^Planned .* m,/).waitFor();
    await until(async () => Number(await data(page, "frames")) > 0, "a picture");
    assert.equal(await backend(page), "2D");
    assert.ok(asked > 0, "it was asked for");
    await page.screenshot({ path: picture("simulate-no-painter-1440") });
    await page.unroute("**/painter_bg.wasm");
    problems.length = 0;
    await page.reload();
    await until(async () => (await data(page, "backend")) === "WebGL2", "the graphics card draws");
    assert.deepEqual(problems, []);
  } finally {
    await context.close();
  }
});

test("the operations with their times are a menu, and choosing one goes to its beginning", async () => {
  const { page, context } = await held.opened();
  try {
    await show(page, "Simulate");
    await page.getByRole("checkbox", { name: "2D view" }).check();
    const menu = page.getByRole("combobox", { name: "Operation" });
    const rows = await until(async () => {
      const found = await menu.locator("option").allTextContents();
      return found.length > 2 && found;
    }, "operations");
    for (const row of rows) assert.match(row, /^.+, \d+:\d\d to \d+:\d\d$/);
    const begins = (row) => / (\d+:\d\d) to /.exec(row)[1];
    await menu.focus();
    await page.keyboard.press("ArrowDown");
    await until(async () => (await clock(page)) === begins(rows[1]), "the second one, from its beginning");
    await menu.selectOption({ index: rows.length - 1 });
    await until(async () => (await clock(page)) === begins(rows.at(-1)), "the last one");
    // The current operation is the selected one.
    await page.getByRole("slider", { name: "Time", exact: true }).focus();
    await page.keyboard.press("Home");
    await until(async () => (await menu.evaluate((one) => one.selectedIndex)) === 0, "the first one");
    assert.deepEqual(await findings(page), []);
  } finally {
    await context.close();
  }
});

/** Copper on both sides and two holes. */
function twoSided() {
  const copper = (side) => ({
    name: `b-${side}.gbr`,
    mimeType: "text/plain",
    buffer: Buffer.from(
      `%FSLAX33Y33*%%MOMM*%%TF.FileFunction,Copper,${side}*%%ADD10C,2*%D10*X1000Y1000D03*X9000Y1000D03*X9000Y5000D03*M02*`,
    ),
  });
  const drill = { name: "b.drl", mimeType: "text/plain", buffer: Buffer.from("M48\nMETRIC\nT1C0.800\n%\nG90\nT1\nX1.0Y1.0\nX9.0Y1.0\nM30\n") };
  return [copper("L1,Top"), copper("L2,Bot"), drill];
}

test("the side that was done before lies carved under the one that is up", async () => {
  const { page, context } = await held.fresh();
  try {
    const chooser = page.waitForEvent("filechooser");
    await page.getByRole("button", { name: "Open files…" }).click();
    await (await chooser).setFiles(twoSided());
    const use = page.getByRole("button", { name: /Use this board/ });
    await until(async () => (await use.isVisible()) || Number(await data(page, "holes")) > 0, "the board");
    if (await use.isVisible()) await use.click();
    await page.getByText(/^Planned .* m,/).waitFor();
    const shades = {};
    for (const side of ["Bottom", "Top"]) {
      await show(page, "CAM");
      const wanted = page.getByRole("group", { name: "Side" }).getByRole("button", { name: side });
      await wanted.click();
      await until(async () => (await wanted.getAttribute("aria-pressed")) === "true", `the ${side} side`);
      await show(page, "Simulate");
      await until(async () => (await data(page, "solid")) !== "", "the board in space");
      await page.keyboard.press("h");
      await page.keyboard.press("f");
      shades[side] = await still(page);
      await page.screenshot({ path: picture(`simulate-under-${side.toLowerCase()}`) });
    }
    const sides = Object.values(shades);
    const off = distance(sides[0], sides[1]);
    assert.ok(off.most > 12, `one side is uncut from below, the other is not: ${JSON.stringify(off)}`);
  } finally {
    await context.close();
  }
});

/** The canvas as a grid: the mean colour of each cell. */
async function grid(page, columns = 96, rows = 60) {
  const shot = (await page.locator("canvas").first().screenshot()).toString("base64");
  const blank = await page.context().newPage();
  try {
    return await blank.evaluate(
      async ([shot, columns, rows]) => {
        const image = new Image();
        image.src = `data:image/png;base64,${shot}`;
        await image.decode();
        const whole = new OffscreenCanvas(image.width, image.height).getContext("2d");
        whole.drawImage(image, 0, 0);
        const pixels = whole.getImageData(0, 0, image.width, image.height).data;
        const found = [];
        for (let row = 0; row < rows; row += 1) {
          let text = "";
          for (let column = 0; column < columns; column += 1) {
            const sum = [0, 0, 0];
            let count = 0;
            for (let y = Math.floor((row * image.height) / rows); y < Math.floor(((row + 1) * image.height) / rows); y += 1)
              for (let x = Math.floor((column * image.width) / columns); x < Math.floor(((column + 1) * image.width) / columns); x += 1) {
                for (let part = 0; part < 3; part += 1) sum[part] += pixels[4 * (y * image.width + x) + part];
                count += 1;
              }
            text += sum.map((one) => Math.round(one / count).toString(16).padStart(2, "0")).join("");
          }
          found.push(text);
        }
        return found;
      },
      [shot, columns, rows],
    );
  } finally {
    await blank.close();
  }
}

/** Difference of two grids: mean and maximum per colour, 0 to 255. */
function distance(one, other) {
  const colours = (rows) => rows.join("").match(/../g).map((two) => parseInt(two, 16));
  const [a, b] = [colours(one), colours(other)];
  assert.equal(a.length, b.length);
  const off = a.map((value, at) => Math.abs(value - b[at]));
  return { mean: off.reduce((sum, value) => sum + value, 0) / off.length, most: Math.max(...off) };
}

/** The picture once it no longer changes: a board is planned and then carved frame by frame. */
async function still(page) {
  await atRest(page);
  let last = "";
  let alike = 0;
  await until(async () => {
    const now = (await grid(page)).join("\n");
    alike = now === last ? alike + 1 : 0;
    last = now;
    if (alike < 3) await page.waitForTimeout(500);
    return alike >= 3;
  }, "a picture that stays");
  return last.split("\n");
}

for (const gpu of ["webgl2", "webgpu"]) {
  test(`the carved sample looks as it did, drawn by ${gpu}`, async () => {
    const [browser, bridge] = [await openBrowser(gpu), await startBridge()];
    const { page } = await openLinked(browser, bridge);
    try {
      await page.getByRole("button", { name: /Sample board/ }).click();
      await page.getByText(/^Planned .* m,/).waitFor();
      await show(page, "Simulate");
      assert.match((await backend(page)).toLowerCase(), new RegExp(gpu));
      await page.getByRole("button", { name: "From above (T)" }).waitFor();
      await page.getByRole("slider", { name: "Time", exact: true }).focus();
      await page.keyboard.press("End");
      await page.evaluate(() => document.activeElement.blur());
      for (const [view, key] of [["home", "h"], ["above", "t"], ["below", "f"]]) {
        await page.keyboard.press(key);
        const last = await still(page);
        const golden = join(root, `tests/browser/golden/carved-${view}.json`);
        if (process.env.ANNULUS_BLESS && gpu === "webgl2") {
          mkdirSync(dirname(golden), { recursive: true });
          writeFileSync(golden, `${JSON.stringify(last, null, 1)}\n`);
        }
        assert.ok(existsSync(golden), golden);
        const off = distance(last, JSON.parse(readFileSync(golden, "utf8")));
        // Software rendering is identical with both APIs; other versions can round edges differently.
        assert.ok(off.mean < 0.25 && off.most < 12, `${view} by ${gpu}: ${JSON.stringify(off)}`);
        await page.screenshot({ path: picture(`carved-${view}-${gpu}`) });
      }
    } finally {
      await browser.close();
      await bridge.stop();
    }
  });
}
