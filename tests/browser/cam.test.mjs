// From a set of files to a proved job: layers, operations, toolpaths, problems, and export.

import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { mkdtempSync, readdirSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { atRest, closeExport, corpus, data, downloaded, exportPanel, findings, picture, planned, program, root, show, stand, test, until } from "./harness.mjs";

const { fresh } = stand("none");

/** Opens the sample and waits until its job is planned and proved. */
async function job(page) {
  await page.getByRole("button", { name: /Sample board/ }).click();
  await until(async () => Number(await data(page, "layers")) > 0, "copper in the picture");
  await page.keyboard.press("2");
  await page.getByRole("heading", { name: "Operations" }).waitFor();
  await page.getByText(/Problems \(\d+\)/).waitFor();
  await planned(page);
}

const lines = async (page) => Number(await data(page, "lines"));

for (const scheme of ["dark", "light"]) {
  test(`the job of a board is accessible, ${scheme}`, async () => {
    const { page, problems, context } = await fresh({ scheme });
    try {
      await page.emulateMedia({ colorScheme: scheme, reducedMotion: "reduce" });
      await job(page);
      await page.screenshot({ path: picture(`cam-1440-${scheme}`) });
      assert.deepEqual(await findings(page), [], "CAM");
      await page.setViewportSize({ width: 1024, height: 768 });
      await atRest(page);
      await page.screenshot({ path: picture(`cam-1024-${scheme}`) });
      const panel = await exportPanel(page);
      assert.deepEqual(await findings(page), [], "export panel");
      await panel.getByRole("button", { name: "Template…" }).click();
      await page.getByText("No errors.", { exact: true }).waitFor();
      await page.screenshot({ path: picture(`template-${scheme}`) });
      assert.deepEqual(await findings(page), [], "template editor");
      assert.deepEqual(problems, [], "nothing was said on the console");
    } finally {
      await context.close();
    }
  });
}

test("more passes mean more toolpaths, by keyboard, and are taken back", async () => {
  const { page, context } = await fresh();
  try {
    await job(page);
    await page.getByRole("button", { name: /1 Isolate/ }).click();
    const before = await lines(page);
    assert.ok(before > 100, `${before} lines are drawn`);
    await page.getByRole("slider", { name: "Passes" }).focus();
    await page.keyboard.press("ArrowRight");
    await until(async () => (await lines(page)) > before, "more toolpaths");
    await planned(page);
    await page.getByRole("button", { name: "Undo" }).click();
    await until(async () => (await lines(page)) === before, "the toolpaths of before");
    await page.getByRole("button", { name: /1 Isolate/ }).focus();
    await page.keyboard.press("Alt+ArrowDown");
    await page.getByRole("button", { name: /2 Isolate/ }).waitFor();
  } finally {
    await context.close();
  }
});

test("problems are shown and seen before anything is exported", async () => {
  const { page, context } = await fresh();
  try {
    await job(page);
    const save = page.getByRole("button", { name: "Export files" });
    const seen = page.getByRole("button", { name: "Accept all" });
    if (await seen.isEnabled()) {
      const panel = await exportPanel(page);
      assert.equal(await save.isEnabled(), false, "no export with unread problems");
      await closeExport(panel);
      const zoom = await data(page, "zoom");
      await page.keyboard.press("F8");
      await until(async () => (await data(page, "zoom")) !== zoom, "the problem close by");
      await page.screenshot({ path: picture("cam-problem") });
      await seen.click();
    }
    await exportPanel(page);
    await until(() => save.isEnabled(), "an export that is allowed");
    const files = await downloaded(page, save);
    assert.ok(files.delete("run-sheet.html"), "a file for every tool, and the run sheet with them");
    assert.ok(files.size > 1, `${[...files.keys()]}`);
    for (const [name, text] of files) {
      assert.match(name, /^\d\d-top-/);
      assert.match(text.toString("utf8"), /^G21/m);
      assert.match(text.toString("utf8"), /^M2$/m);
    }
  } finally {
    await context.close();
  }
});

/** Opens files by the button, and waits until their job is planned and proved. */
async function opened(page, files) {
  const chooser = page.waitForEvent("filechooser");
  await page.getByRole("button", { name: "Open files…" }).click();
  await (await chooser).setFiles(files);
  await until(async () => Number(await data(page, "layers")) > 0, "copper in the picture");
  // With warnings, the import review comes first.
  await atRest(page);
  const use = page.getByRole("button", { name: "Use this board" });
  if (await use.isVisible()) await use.click();
  await page.keyboard.press("2");
  await page.getByRole("heading", { name: "Operations" }).waitFor();
  await planned(page);
}

test("what the page exports is what the command line writes", async () => {
  const { page, context } = await fresh();
  const folder = mkdtempSync(join(tmpdir(), "annulus-cam-"));
  try {
    const files = ["sensor.drl", "sensor-outline.gbr", "sensor-top.gbr"].map((name) => join(root, "www/examples", name));
    await opened(page, files);
    const seen = page.getByRole("button", { name: "Accept all" });
    if (await seen.isEnabled()) await seen.click();
    const panel = await exportPanel(page);
    const save = panel.getByRole("button", { name: "Export files" });
    for (const target of ["grbl", "fanuc"]) {
      await panel.getByRole("combobox", { name: "Controller" }).selectOption(target);
      await until(() => save.isEnabled(), "an export that is allowed");
      const exported = await downloaded(page, save);
      const out = join(folder, target);
      const flags = ["--to", target, "-o", out, "--accept", "proof.gap,proof.sliver,proof.lost"];
      const cam = spawnSync(program, ["cam", ...files, ...flags], { encoding: "utf8" });
      assert.equal(cam.status, 0, cam.stdout + cam.stderr);
      const written = readdirSync(out).filter((name) => exported.size > 1 || !name.endsWith(".html"));
      assert.deepEqual([...exported.keys()].sort(), written.sort(), target);
      for (const [name, text] of exported) assert.equal(text.toString("utf8"), readFileSync(join(out, name), "utf8"), name);
    }
  } finally {
    await context.close();
    rmSync(folder, { recursive: true });
  }
});

test("a saved project opens as it was, and the command line takes it", async () => {
  const first = await fresh();
  const folder = mkdtempSync(join(tmpdir(), "annulus-project-"));
  const saved = join(folder, "sensor.annulus");
  try {
    await job(first.page);
    await first.page.getByRole("button", { name: /1 Isolate/ }).click();
    const passes = first.page.getByRole("slider", { name: "Passes" });
    const before = Number(await passes.inputValue());
    await passes.focus();
    await first.page.keyboard.press("ArrowRight");
    await planned(first.page);
    const download = first.page.waitForEvent("download");
    await (await exportPanel(first.page)).getByRole("button", { name: "Save project" }).click();
    await (await download).saveAs(saved);
    const second = await fresh();
    try {
      await opened(second.page, [saved]);
      await second.page.getByRole("button", { name: /1 Isolate/ }).click();
      assert.equal(Number(await second.page.getByRole("slider", { name: "Passes" }).inputValue()), before + 1);
    } finally {
      await second.context.close();
    }
    const flags = ["--to", "grbl", "-o", join(folder, "out"), "--save-job", join(folder, "job.toml"), "--accept", "gap,sliver"];
    const cam = spawnSync(program, ["cam", saved, ...flags], { encoding: "utf8" });
    assert.equal(cam.status, 0, cam.stdout + cam.stderr);
    assert.match(readFileSync(join(folder, "job.toml"), "utf8"), new RegExp(`^passes = ${before + 1}$`, "m"));
  } finally {
    await first.context.close();
    rmSync(folder, { recursive: true });
  }
});

test("real boards of the corpus are painted, planned and proved", async (t) => {
  const folder = corpus();
  if (!folder) return t.skip("no corpus");
  for (const name of ["kicad/4.0-multivibrator", "easyeda/easytrace-tht", "kicad/2013-clockblock"]) {
    const { page, context, problems } = await fresh();
    try {
      const files = readdirSync(join(folder, name)).map((file) => join(folder, name, file));
      await opened(page, files);
      await page.getByText(/Problems \(\d+\)/).waitFor();
      await until(async () => (await lines(page)) > 100, `the toolpaths of ${name}`);
      await atRest(page);
      await page.screenshot({ path: picture(`cam-${name.split("/")[1]}`) });
      const side = await page.locator(".side-badge").innerText();
      assert.ok(["Bottom (mirrored)", "Top"].includes(side) && (side !== "Top" || !name.includes("easytrace")), `${name}: ${side}`);
      await show(page, "Machine");
      assert.equal(await page.locator(".side-badge").innerText(), side, "the machine tells the side as well");
      assert.deepEqual(problems, [], "nothing was said on the console");
    } finally {
      await context.close();
    }
  }
});

test("a misspelt parameter is a fault with its line, and a hint is put in by its button", async () => {
  const { page, context } = await fresh();
  try {
    await job(page);
    await (await exportPanel(page)).getByRole("button", { name: "Template…" }).click();
    const area = page.getByRole("textbox", { name: "Postprocessor as text" });
    const text = await area.inputValue();
    const wrong = text.replace("G0 X@X@ Y@Y@\nG0 Z@A@", "G0 X@XX@ Y@Y@\nG0 Z@A@");
    assert.notEqual(wrong, text);
    await area.fill(wrong);
    const line = wrong.split("\n").findIndex((one) => one.includes("@XX@")) + 1;
    await page.getByRole("button", { name: `Line ${line}`, exact: true }).click();
    await area.fill(text);
    await page.getByText("No errors.", { exact: true }).waitFor();
  } finally {
    await context.close();
  }
});
