// Grouped problems of the proof, with the fix for the whole board before those of single positions; the files
// of both sides in one zip with the run sheet; choosing among several boards.

import assert from "node:assert/strict";
import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after } from "node:test";
import { atRest, data, downloaded, exportPanel, findings, picture, planned, root, stand, test, until } from "./harness.mjs";

const { fresh } = stand("none");
const folder = mkdtempSync(join(tmpdir(), "annulus-groups-"));
after(() => rmSync(folder, { recursive: true, force: true }));

const um = (mm) => Math.round(mm * 1000);

/** A layer of square pads of 1 mm at the given positions. */
function layer(name, side, places) {
  const flashes = places.map(([x, y]) => `X${um(x)}Y${um(y)}D03*`).join("\n");
  const text = `%FSLAX33Y33*%\n%MOMM*%\n%TF.FileFunction,Copper,${side}*%\n%ADD10R,1X1*%\nD10*\n${flashes}\nM02*\n`;
  writeFileSync(join(folder, name), text);
  return join(folder, name);
}

function drill(name, places) {
  const text = `M48\nMETRIC\nT1C0.500\n%\nG90\nT1\n${places.map(([x, y]) => `X${x.toFixed(3)}Y${y.toFixed(3)}`).join("\n")}\nM30\n`;
  writeFileSync(join(folder, name), text);
  return join(folder, name);
}

/** Pads in a row with these gaps, mm. */
function row(y, gaps) {
  let x = 1;
  return [[x, y], ...gaps.map((gap) => [(x += 1 + gap), y])];
}

async function opened(page, files) {
  const chooser = page.waitForEvent("filechooser");
  await page.getByRole("button", { name: "Open files…" }).click();
  await (await chooser).setFiles(files);
  await until(async () => Number(await data(page, "layers")) > 0, "copper in the picture");
  await atRest(page);
  const use = page.getByRole("button", { name: "Use this board" });
  if (await use.isVisible()) await use.click();
}

async function toJob(page) {
  await page.keyboard.press("2");
  await page.getByRole("heading", { name: "Operations" }).waitFor();
  await planned(page);
  await page.getByText(/Problems \(\d+\)/).waitFor();
}

test("gaps are told as one group, and one button cures the whole before single places are", async () => {
  const { page, problems, context } = await fresh();
  try {
    // The cut is 0.143 mm wide, and 0.127 mm at the smallest depth.
    const places = [...row(2, Array(8).fill(0.135)), ...row(5, [0.11, 0.11, 0.11, 0.11])];
    await opened(page, [layer("gaps-F_Cu.gbr", "L1,Top", places), drill("gaps.drl", [places[0], places[9]])]);
    await toJob(page);
    const list = page.getByRole("region", { name: "Problems" });
    const group = list.getByText(/Your cut is 0\.143 mm wide; narrower gaps that stay closed: 12\./);
    await group.waitFor();
    const places_ = list.getByRole("button", { name: "12 positions" });
    assert.equal(await places_.getAttribute("aria-expanded"), "false");
    assert.equal(await list.getByRole("button", { name: /mm at X/ }).count(), 0, "a group of many is closed");
    await places_.click();
    assert.equal(await list.getByRole("button", { name: /mm at X/ }).count(), 12);
    assert.deepEqual(await findings(page), [], "accessible");
    await page.screenshot({ path: picture("cam-groups-1440") });
    const zoom = await data(page, "zoom");
    await list.getByRole("button", { name: /0\.110 mm at X/ }).first().click();
    await until(async () => (await data(page, "zoom")) !== zoom, "the place close by");
    assert.equal(await list.locator(".place[aria-current=true]").count(), 1);
    await page.keyboard.press("F8");
    await until(async () => (await list.locator(".place[aria-current=true]").count()) === 1, "the next place");
    // First the whole board: a smaller depth opens eight gaps, a finer tip the rest.
    const whole = list.locator(".whole-cure").getByRole("button");
    assert.equal(await whole.count(), 1, "one choice");
    await list.getByText(/opens 8 of 12 gaps/).waitFor();
    await whole.click();
    await planned(page);
    await until(async () => /tip/.test(await whole.textContent()), "the next choice");
    await whole.click();
    await planned(page);
    await until(async () => (await list.getByText(/gaps that stay closed/).count()) === 0, "no gap left");
    assert.equal(await whole.count(), 0);
    await page.getByRole("button", { name: "Undo" }).click();
    await planned(page);
    await list.getByText(/gaps that stay closed: 4\./).waitFor();
    // Accept the group.
    await list.getByRole("checkbox", { name: "Accept" }).first().check();
    const panel = await exportPanel(page);
    await until(() => panel.getByRole("button", { name: "Export files" }).isEnabled(), "an export that is allowed");
    assert.deepEqual(problems, [], "nothing was said on the console");
  } finally {
    await context.close();
  }
});

test("both sides come in one zip, numbered in the order of running, with a run sheet to print", async () => {
  const { page, context } = await fresh();
  try {
    const places = row(2, [4, 4]);
    const layers = [layer("both-F_Cu.gbr", "L1,Top", places), layer("both-B_Cu.gbr", "L2,Bot", places)];
    await opened(page, [...layers, drill("both.drl", places)]);
    await toJob(page);
    const save = page.getByRole("button", { name: "Export files" });
    const seen = page.getByRole("button", { name: "Accept all" });
    if (await seen.isEnabled()) await seen.click();
    await exportPanel(page);
    await until(() => save.isEnabled(), "an export that is allowed");
    const files = await downloaded(page, save);
    const names = [...files.keys()];
    assert.equal(names.at(-1), "run-sheet.html");
    const programs = names.slice(0, -1);
    programs.forEach((name, at) => assert.ok(name.startsWith(`${String(at + 1).padStart(2, "0")}-`), `${programs}`));
    assert.ok(programs.some((name) => /-top-/.test(name)) && programs.some((name) => /-bottom-/.test(name)), `${programs}`);
    await page.getByText("Saved, in the order of running:").waitFor();
    await page.getByRole("button", { name: "Run sheet…" }).click();
    const sheet = page.getByRole("dialog", { name: "Run sheet" });
    for (const name of programs) await sheet.getByText(name, { exact: true }).waitFor();
    await sheet.getByText(/Flip the board/).waitFor();
    assert.ok(await sheet.getByRole("button", { name: /STOP/ }).isVisible(), "STOP is in the dialog");
    assert.deepEqual(await findings(page), [], "accessible");
    await page.screenshot({ path: picture("run-sheet-1440") });
    await page.emulateMedia({ media: "print" });
    const shown = (words) => page.getByText(words).first().isVisible();
    assert.ok(await sheet.getByText(programs[0], { exact: true }).isVisible(), "the sheet is printed");
    assert.equal(await shown("Operations"), false, "and nothing else");
    await page.emulateMedia({ media: null });
    // Problems of the side that is down, not yet accepted, block the whole export.
    await sheet.getByRole("button", { name: "Close" }).click();
    await page.getByRole("group", { name: "Side that is up" }).getByRole("button", { name: /Bottom/ }).click();
    await planned(page);
    await page.getByRole("button", { name: /\d Isolate/ }).click();
    const depth = page.getByRole("textbox", { name: /^Depth/ }).first();
    await depth.fill("0.02");
    await depth.press("Enter");
    await planned(page);
    await page.getByRole("group", { name: "Side that is up" }).getByRole("button", { name: /Top/ }).click();
    await planned(page);
    if (await seen.isEnabled()) await seen.click();
    await exportPanel(page);
    await until(() => save.isEnabled(), "a top that is read");
    await save.click();
    await page.getByText(/Bottom: \d+ problems? not accepted yet/).waitFor();
    await page.getByRole("button", { name: "Show Bottom" }).click();
    await until(async () => (await page.getByText(/do not go through the copper/).count()) > 0, "the problem of the other side");
  } finally {
    await context.close();
  }
});

test("of several boards the person chooses one", async () => {
  const { page, context } = await fresh();
  try {
    const places = row(2, [4, 4]);
    const files = ["left", "right"].flatMap((name, at) => [
      layer(`${name}-F_Cu.gbr`, "L1,Top", places.slice(at)),
      drill(`${name}.drl`, places.slice(at)),
    ]);
    const chooser = page.waitForEvent("filechooser");
    await page.getByRole("button", { name: "Open files…" }).click();
    await (await chooser).setFiles(files);
    await page.getByText("These files are of 2 boards", { exact: true }).waitFor();
    const use = page.getByRole("button", { name: "Use this board" });
    assert.equal(await use.isEnabled(), false, "not before one is chosen");
    assert.deepEqual(await findings(page), [], "accessible");
    await page.screenshot({ path: picture("boards-1440") });
    const right = page.getByRole("button", { name: /^right/ });
    await right.click();
    await until(async () => (await right.getAttribute("aria-pressed")) === "true", "the board that was chosen");
    await until(() => use.isEnabled(), "one board");
    await use.click();
    await until(async () => Number(await data(page, "holes")) === 2, "the holes of one board");
  } finally {
    await context.close();
  }
});

/** The number of drawn pixels of each picture. */
const painted = (pictures) =>
  pictures.evaluateAll((all) =>
    all.map((one) => {
      const { data } = one.getContext("2d").getImageData(0, 0, one.width, one.height);
      return data.filter((value, at) => at % 4 === 3 && value > 0).length;
    }),
  );

test("in the review every layer has a picture of its own, and so has the other way to read the numbers", async () => {
  const { page, context } = await fresh();
  try {
    const places = [[10, 10], [20, 10], [30, 15], [12, 22], [25, 24]];
    const flashes = places.map(([x, y]) => `X${um(x)}Y${um(y)}D03*`).join("\n");
    const gerber = (name, role, body) => {
      writeFileSync(join(folder, name), `%FSLAX33Y33*%\n%MOMM*%\n%TF.FileFunction,${role}*%\n%ADD10C,2*%\nD10*\n${body}\nM02*\n`);
      return join(folder, name);
    };
    const edge = "G01*\nX0Y0D02*\nX40000Y0D01*\nX40000Y30000D01*\nX0Y30000D01*\nX0Y0D01*";
    const digits = (mm) => String(um(mm)).padStart(6, "0");
    const drilled = `%\nT01\n${places.map(([x, y]) => `X${digits(x)}Y${digits(y)}`).join("\n")}\nM30\n`;
    writeFileSync(join(folder, "silent.drl"), drilled);
    const files = [
      gerber("l-F_Cu.gbr", "Copper,L1,Top", flashes),
      gerber("l-B_Cu.gbr", "Copper,L2,Bot", flashes),
      gerber("l-F_Mask.gbr", "Soldermask,Top", flashes),
      gerber("l-F_Silk.gbr", "Legend,Top", "X5000Y5000D02*\nX35000Y5000D01*"),
      gerber("l-Edge.gbr", "Profile,NP", edge),
      join(folder, "silent.drl"),
      join(root, "tests/data/synthetic/x10-html-error-page.drl"),
    ];
    const chooser = page.waitForEvent("filechooser");
    await page.getByRole("button", { name: "Open files…" }).click();
    await (await chooser).setFiles(files);
    await page.getByRole("button", { name: "Use this board" }).waitFor();
    const row = (name) => page.locator(".review tbody tr").filter({ hasText: name });
    for (const name of ["l-F_Cu", "l-B_Cu", "l-F_Mask", "l-F_Silk", "l-Edge", "silent.drl"]) {
      const [drawn] = await painted(row(name).locator("td > canvas.preview"));
      assert.ok(drawn > 50, `${name}: ${drawn} pixels`);
    }
    const rival = row("silent.drl").locator("figure.rival canvas");
    const [other] = await painted(rival);
    assert.ok(other > 5, `the other reading: ${other} pixels`);
    assert.equal(await row("x10-html-error-page.drl").locator("canvas").count(), 0, "what is no layer has none");
    await page.screenshot({ path: picture("review-thumbnails-1440") });
  } finally {
    await context.close();
  }
});

/** The shares of the picture that are copper, and green like solder mask. */
async function shares(page) {
  const shot = (await page.locator("canvas").first().screenshot()).toString("base64");
  return page.evaluate(async (shot) => {
    const bytes = Uint8Array.from(atob(shot), (sign) => sign.charCodeAt(0));
    const image = await createImageBitmap(new Blob([bytes], { type: "image/png" }));
    const whole = new OffscreenCanvas(image.width, image.height).getContext("2d");
    whole.drawImage(image, 0, 0);
    const { data } = whole.getImageData(0, 0, image.width, image.height);
    let [copper, mask] = [0, 0];
    for (let at = 0; at < data.length; at += 4) {
      const [red, green, blue] = data.subarray(at, at + 3);
      if (red > green + 50 && red > blue + 80) copper += 1;
      if (green > red + 40 && green > blue + 20) mask += 1;
    }
    return { copper: (400 * copper) / data.length, mask: (400 * mask) / data.length };
  }, shot);
}

test("a board as it is made is copper under a mask that is open where it is soldered, from the side that is looked at", async () => {
  const { page, context } = await fresh();
  try {
    const gerber = (name, role, size, body) => {
      writeFileSync(join(folder, name), `%FSLAX33Y33*%\n%MOMM*%\n%TF.FileFunction,${role}*%\n%ADD10C,${size}*%\nD10*\n${body}\nM02*\n`);
      return join(folder, name);
    };
    const pads = "X10000Y15000D03*\nX30000Y15000D03*";
    const edge = "G01*\nX0Y0D02*\nX40000Y0D01*\nX40000Y30000D01*\nX0Y30000D01*\nX0Y0D01*";
    await opened(page, [
      gerber("m-F_Cu.gbr", "Copper,L1,Top", 4, `${pads}\nG01*\nX10000Y15000D02*\nX30000Y15000D01*`),
      gerber("m-B_Cu.gbr", "Copper,L2,Bot", 8, "X20000Y15000D03*"),
      gerber("m-F_Mask.gbr", "Soldermask,Top", 4, pads),
      gerber("m-B_Mask.gbr", "Soldermask,Bot", 6, "X20000Y15000D03*"),
      gerber("m-Edge.gbr", "Profile,NP", 0.1, edge),
      drill("m.drl", [[10, 15], [30, 15]]),
    ]);
    const layers = page.getByRole("region", { name: "Layers" });
    const seen = async (name) => {
      await layers.getByRole("button", { name, exact: true }).click();
      await atRest(page);
      return shares(page);
    };
    const drawn = await seen("Copper");
    const made = await seen("Realistic view");
    await page.screenshot({ path: picture("as-made-1440") });
    assert.ok(drawn.mask < 1 && made.mask > 20, `the board is covered: ${drawn.mask} % and ${made.mask} %`);
    const told = `${drawn.copper} % drawn, ${made.copper} % bare`;
    assert.ok(made.copper > 0.2 * drawn.copper, `pads are bare: ${told}`);
    assert.ok(made.copper < 0.6 * drawn.copper, `a track is covered: ${told}`);
    const again = await seen("Copper");
    assert.ok(again.mask < 1, `another group is as it was: ${again.mask} %`);
    await seen("Realistic view");
    await layers.getByRole("group", { name: "Seen from" }).getByRole("button", { name: "Bottom" }).click();
    await atRest(page);
    const under = await shares(page);
    await page.screenshot({ path: picture("as-made-below-1440") });
    assert.ok(under.mask > 20 && under.copper > 0.2 * made.copper, `the other side: ${JSON.stringify(under)}`);
  } finally {
    await context.close();
  }
});
