// The page as a static site, in a folder of any server: no bridge, and no network after the first visit.

import assert from "node:assert/strict";
import { createHash } from "node:crypto";
import { readFileSync } from "node:fs";
import { createServer } from "node:http";
import { join } from "node:path";
import { after, before } from "node:test";
import { broken, closeExport, data, downloaded, drillOnly, exportPanel, mayStart, openBrowser, openPage, picture, preflight, press, root, serveFiles, site, startJob, tab, test, until } from "./harness.mjs";

/** Waits until the service worker controls the page. */
const kept = (page) => until(() => page.evaluate(() => navigator.serviceWorker.controller !== null), "a site that is kept");

async function openSample(page) {
  await page.getByRole("button", { name: /Sample board/ }).click();
  await until(async () => Number(await data(page, "holes")) > 0, "holes in the picture");
  await page.getByText(/^Planned .* m,/).waitFor();
}

let browser;
before(async () => (browser = await openBrowser()));
after(async () => browser?.close());

test("without a bridge and with the network cut, a board is opened, planned, proved, simulated and exported", async () => {
  const server = await serveFiles();
  const { page, problems, context } = await openPage(browser, server.url);
  try {
    await page.getByRole("heading", { name: /Drop the files/ }).waitFor();
    await kept(page);
    await page.getByText("Works offline", { exact: true }).waitFor();
    await context.setOffline(true);
    await page.getByText("Offline", { exact: true }).waitFor();
    server.stop();
    await page.reload();
    await page.getByRole("heading", { name: /Drop the files/ }).waitFor();
    await openSample(page);
    await drillOnly(page);
    await tab(page, "CAM").click();
    const panel = await exportPanel(page);
    const save = panel.getByRole("button", { name: "Export files" });
    await until(() => save.isEnabled(), "an export that is allowed");
    const files = await downloaded(page, save);
    await panel.getByText(/^Saved/).waitFor();
    await closeExport(panel);
    assert.ok([...files.values()].some((text) => /X\s*-?\d/.test(text.toString())), "a program with places in it");
    await page.screenshot({ path: picture("alone-cam-1440") });
    await tab(page, "Simulate").click();
    const holes = Number(await data(page, "holes"));
    await page.getByRole("slider", { name: "Time", exact: true }).focus();
    await page.keyboard.press("End");
    await until(async () => Number(await data(page, "done")) === holes, "all holes done in the playback");
    await tab(page, "Machine").click();
    await page.getByText("The position is not known. Home first.").waitFor();
    await page.screenshot({ path: picture("alone-machine-1440") });
    assert.deepEqual(server.asked.filter((one) => !one.startsWith("GET /boards/here/")), [], "nothing but files of the site");
    assert.deepEqual(problems, []);
  } finally {
    await context.close();
    server.stop();
  }
});

/** The holes that the virtual drill has drilled, from its own record. */
const drilled = (page) =>
  page.evaluate(async () => {
    const folder = await (await navigator.storage.getDirectory()).getDirectoryHandle("annulus-drill");
    const file = await (await folder.getFileHandle("drilled.txt")).getFile();
    return (await file.text()).split("\n").filter(Boolean);
  });

/** The number of holes within 0.1 mm of another one. */
const twice = (holes) => holes.length - new Set(holes.map((line) => line.split(" ").slice(0, 2).map((mm) => Math.round(Number(mm) * 10)).join())).size;

const bit = (page) => page.getByRole("button", { name: "Start spindle and continue" });

/** Starts the sample board on the page's virtual drill, drilling only. */
async function started(page) {
  await openSample(page);
  await drillOnly(page);
  const { start } = await startJob(page);
  await start.click();
}

/** Confirms every tool change until the job is done. */
async function toTheEnd(page) {
  const done = page.getByText(/^The job is done\./);
  await until(async () => {
    if (await bit(page).isVisible()) await bit(page).click({ timeout: 2000 }).catch(() => {});
    return done.isVisible();
  }, "a job that is done");
}

test("with the network cut the virtual drill of the page drills the board, and waits half a minute for a bit", async () => {
  const server = await serveFiles();
  const { page, problems, context } = await openPage(browser, `${server.url}?speed=20`);
  try {
    await kept(page);
    await context.setOffline(true);
    server.stop();
    await page.reload();
    await started(page);
    const holes = Number(await data(page, "holes"));
    await bit(page).waitFor();
    await new Promise((later) => setTimeout(later, 30_000));
    await page.screenshot({ path: picture("alone-bit-1440") });
    assert.deepEqual(await drilled(page), [], "nothing moves while a bit is asked for");
    await toTheEnd(page);
    await page.screenshot({ path: picture("alone-done-1440") });
    const made = await drilled(page);
    assert.deepEqual([made.length, twice(made)], [holes, 0], "every hole once");
    assert.equal(await page.getByText(/not as programmed|missing\.|drilled twice/).count(), 0, "and each where the program has it");
    assert.deepEqual(problems, []);
  } finally {
    await context.close();
    server.stop();
  }
});

test("STOP stops the virtual drill of the page in mid-job, and the job is taken up", async () => {
  const server = await serveFiles();
  const { page, context } = await openPage(browser, `${server.url}?speed=3`);
  try {
    await started(page);
    await bit(page).click();
    await until(async () => Number(await data(page, "done")) > 2, "the first holes");
    // From another tab, which has no drill.
    const other = await context.newPage();
    await other.goto(server.url);
    await other.getByRole("button", { name: "STOP", exact: true }).click();
    await until(async () => (await other.getByText(/STOP NOT CONFIRMED/).count()) === 0, "a STOP that was heard");
    await other.close();
    const told = page.getByText(/^STOP was pressed\. Holes drilled: \d+/).first();
    const done = Number((await told.innerText()).match(/drilled: (\d+)/)[1]);
    // After a stop during a retract, the hole is drilled but not counted as done, so it is drilled again.
    const made = (await drilled(page)).length;
    assert.ok(made === done || made === done + 1, `${made} made, ${done} done`);
    await new Promise((later) => setTimeout(later, 1500));
    assert.equal((await drilled(page)).length, made, "nothing was drilled after STOP");
    // The notice about the stop offers the rest. Its pre-flight counts only the rest, and a restart is marked
    // as such.
    const holes = Number(await data(page, "holes"));
    const planned = async (button) => {
      const before = await preflight(page, page.getByRole("button", { name: button }));
      const row = before.getByText(/^\d+ holes? in about \d+ min \d+ s\.$/);
      const found = [Number((await row.textContent()).match(/^\d+/)[0]), await before.getByText(/Part of this job is already done/).count()];
      await before.getByRole("button", { name: "Cancel" }).click();
      return found;
    };
    assert.deepEqual(await planned(/Resume where it stopped/), [holes - done, 0]);
    assert.deepEqual(await planned("Start…"), [holes, 1]);
    await page.getByRole("button", { name: "Close", exact: true }).click();
    await page.getByRole("button", { name: /Resume where it stopped/ }).waitFor();
  } finally {
    await context.close();
    server.stop();
  }
});

test("a page whose program broke still stops its own drill", async () => {
  const server = await serveFiles();
  const { page, context } = await openPage(browser, `${server.url}?speed=3`);
  try {
    await started(page);
    await bit(page).click();
    await until(async () => (await drilled(page)).length > 1, "the first holes");
    const fallen = await broken(page);
    const before = (await drilled(page)).length;
    await until(async () => (await drilled(page)).length > before, "a drill that goes on without its page");
    // The job can reach a tool change: its dialog must not cover this STOP.
    await page.evaluate(() => {
      const late = document.querySelector(".shell").appendChild(document.createElement("dialog"));
      late.style = "inset: 0; width: 100%; height: 100%";
      late.showModal();
    });
    await fallen.getByRole("button", { name: "STOP", exact: true }).click();
    await fallen.getByText(/^STOP was sent\./).waitFor();
    await new Promise((later) => setTimeout(later, 1000));
    const made = (await drilled(page)).length;
    await new Promise((later) => setTimeout(later, 3000));
    assert.equal((await drilled(page)).length, made, "nothing was drilled after STOP");
    assert.ok(made < Number(await data(page, "holes")), "the job was not done");
    await fallen.getByRole("button", { name: "Reload the page" }).click();
    await tab(page, "Machine").click();
    await page.getByRole("button", { name: /Resume where it stopped/ }).waitFor();
  } finally {
    await context.close();
    server.stop();
  }
});

test("a page that is closed in mid-job is opened again, and the job goes on: no hole left out, at most one made twice", async () => {
  const server = await serveFiles();
  const { page, context } = await openPage(browser, `${server.url}?speed=5`);
  try {
    await started(page);
    const holes = Number(await data(page, "holes"));
    await bit(page).click();
    await until(async () => Number(await data(page, "done")) > 5, "holes");
    await page.close();
    const again = await context.newPage();
    await again.goto(`${server.url}?speed=20`);
    await tab(again, "Machine").click();
    const offer = again.getByRole("button", { name: /Resume where it stopped/ });
    await offer.waitFor();
    const other = await context.newPage();
    await other.goto(server.url);
    await tab(other, "Machine").click();
    await other.getByText(/is open in another tab/).first().waitFor();
    assert.ok(await other.getByRole("button", { name: "STOP", exact: true }).isVisible(), "any page may stop");
    await other.close();
    await again.getByRole("button", { name: "Home", exact: true }).click();
    await again.getByText("At rest, position known.").waitFor();
    const start = await mayStart(await preflight(again, offer), "Resume the job");
    await start.click();
    await toTheEnd(again);
    const made = await drilled(again);
    assert.ok(made.length - twice(made) === holes, `${made.length} holes made, ${twice(made)} of them twice, ${holes} wanted`);
    assert.ok(twice(made) <= 1, `${twice(made)} made twice`);
  } finally {
    await context.close();
    server.stop();
  }
});

test("a reload in mid-job is asked about; Machine names the job, offers its board and shows it there", async () => {
  const server = await serveFiles();
  const { page, context } = await openPage(browser, `${server.url}?speed=3`);
  const asked = [];
  page.on("dialog", (dialog) => {
    asked.push(dialog.type());
    dialog.accept();
  });
  try {
    await openSample(page);
    const holes = await data(page, "holes");
    await page.reload();
    assert.deepEqual(asked, [], "nothing is lost, nothing is asked");
    await page.getByRole("button", { name: "Restore" }).click();
    await until(async () => (await data(page, "holes")) === holes, "the board");
    await drillOnly(page);
    const { start } = await startJob(page);
    await start.click();
    const looks = page.getByRole("list", { name: "Machine status" });
    await looks.waitFor();
    assert.deepEqual(await looks.getByRole("listitem").allInnerTexts(), ["Spindle off", "Z at the change height", "At the change position"]);
    await bit(page).click();
    await until(async () => Number(await data(page, "done")) > 2, "holes");
    await page.reload();
    assert.deepEqual(asked, ["beforeunload"]);
    await tab(page, "Machine").click();
    const job = page.getByRole("region", { name: "Job", exact: true });
    await job.getByRole("heading", { name: "sensor-top" }).waitFor();
    await job.getByRole("button", { name: "Restore" }).click();
    await until(async () => (await data(page, "holes")) === holes, "the board of the job on the map");
    assert.equal(await tab(page, "Machine").getAttribute("aria-current"), "page");
  } finally {
    await context.close();
    server.stop();
  }
});

test("a new version is offered, and taken when the person wants it and no other window is open", async () => {
  let newer = false;
  const boot = Buffer.concat([readFileSync(join(site, "boot.js")), Buffer.from("\nglobalThis.annulusNewer = true;\n")]);
  const digest = (bytes) => createHash("sha256").update(bytes).digest("hex");
  const keeper = () => readFileSync(join(site, "service-worker.js"), "utf8").replace(digest(readFileSync(join(site, "boot.js"))), digest(boot)).replace(/version: "/, '$&b');
  const server = await serveFiles((name) => (!newer ? null : name === "boot.js" ? boot : name === "service-worker.js" ? keeper() : null));
  const { page, problems, context } = await openPage(browser, server.url);
  try {
    await kept(page);
    newer = true;
    await page.reload();
    const take = page.getByRole("button", { name: "Reload to update" });
    await take.waitFor();
    assert.equal(await page.evaluate(() => globalThis.annulusNewer), undefined, "the old one is on show until then");
    const other = await context.newPage();
    await other.goto(server.url);
    await other.getByRole("heading", { name: /Drop the files/ }).waitFor();
    await take.click();
    await page.getByText("Close the other windows of Annulus first, then reload.").waitFor();
    await other.close();
    await page.reload();
    await take.click();
    await until(() => page.evaluate(() => globalThis.annulusNewer === true).catch(() => false), "the new version on show");
    assert.deepEqual(problems, []);
  } finally {
    await context.close();
    server.stop();
  }
});

test("a site whose files are not all of one making is not kept, and what was kept stays", async () => {
  let torn = false;
  const keeper = () => readFileSync(join(site, "service-worker.js"), "utf8").replace(/version: "/, '$&c').replace(/"boot\.js": "[0-9a-f]{8}/, '"boot.js": "00000000');
  const server = await serveFiles((name) => (torn && name === "service-worker.js" ? keeper() : null));
  const { page, context } = await openPage(browser, server.url);
  try {
    await kept(page);
    torn = true;
    const before = server.asked.length;
    const refused = await page.evaluate(async () => {
      const site = await navigator.serviceWorker.getRegistration();
      const coming = new Promise((found) => (site.onupdatefound = () => found(site.installing)));
      await site.update();
      const worker = await coming;
      if (worker.state !== "redundant") await new Promise((over) => (worker.onstatechange = () => worker.state === "redundant" && over()));
      return worker.state;
    });
    assert.equal(refused, "redundant");
    assert.ok(server.asked.length > before, "it was looked at");
    assert.equal(await page.getByRole("button", { name: "Reload to update" }).count(), 0);
    await context.setOffline(true);
    await page.reload();
    await openSample(page);
  } finally {
    await context.close();
    server.stop();
  }
});

/** A foreign server with one board, with and without CORS permission. */
async function serveBoard() {
  const board = readFileSync(join(root, "www/examples/sensor.drl"));
  const server = createServer((request, response) => {
    if (request.url === "/missing.drl") return response.writeHead(404, { "access-control-allow-origin": "*" }).end();
    const leave = request.url === "/open/sensor.drl" ? { "access-control-allow-origin": "*" } : {};
    response.writeHead(200, leave).end(board);
  });
  await new Promise((listening) => server.listen(0, "127.0.0.1", listening));
  return { origin: `http://127.0.0.1:${server.address().port}`, stop: () => (server.closeAllConnections(), server.close()) };
}

test("until the page is there its opening is seen, in the person's language; a file that never comes is told in a sentence", async () => {
  let here = () => {};
  const files = { held: false, missing: false };
  const server = await serveFiles((name) => {
    if (name === "page.js" && files.missing) throw new Error(name);
    return null;
  });
  const context = await browser.newContext({ locale: "pl-PL", serviceWorkers: "block" });
  try {
    const page = await context.newPage();
    await page.route("**/page_bg.wasm", (route) => (files.held ? (here = () => route.continue()) : route.continue()));
    files.held = true;
    await page.goto(server.url);
    await page.getByText("Annulus się otwiera…").waitFor();
    assert.ok(!(await page.getByText("Opening Annulus…").isVisible()), "one language at a time");
    here();
    await page.getByRole("heading", { level: 1 }).first().waitFor();
    assert.equal(await page.locator("#opening").count(), 0, "the opening is gone");
    Object.assign(files, { held: false, missing: true });
    await page.reload();
    await page.getByText(/Nie udało się otworzyć.*page\.not_opened/).waitFor();
    files.missing = false;
    await page.reload();
    await page.getByRole("heading", { level: 1 }).first().waitFor();
  } finally {
    await context.close();
    server.stop();
  }
});

test("a link to a board opens it; one that is missing, shut or no link is told in a sentence", async () => {
  const [server, boards] = [await serveFiles(), await serveBoard()];
  const { page, context } = await openPage(browser, `${server.url}?url=${encodeURIComponent(`${boards.origin}/open/sensor.drl`)}`);
  try {
    await until(async () => Number(await data(page, "holes")) > 0, "the board behind the link");
    assert.equal(new URL(page.url()).search, "", "a reload does not fetch it once more");
    for (const [link, said] of [
      [`${boards.origin}/missing.drl`, /answered 404\./],
      [`${boards.origin}/shut/sensor.drl`, /\(network, address or CORS\)/],
      ["javascript:alert(1)", /is not a link to a file/],
      ["file:///etc/passwd", /is not a link to a file/],
    ]) {
      const other = await context.newPage();
      await other.goto(`${server.url}?url=${encodeURIComponent(link)}&lang=en`);
      await other.getByText(said).waitFor();
      assert.equal(await other.getByRole("heading", { name: /Drop the files/ }).count(), 1, "and the page is as it was");
      await other.close();
    }
    // A pasted link works the same way.
    const other = await context.newPage();
    await other.goto(`${server.url}?lang=en`);
    const field = other.getByLabel("Or paste a link to a board");
    await field.fill(`${boards.origin}/missing.drl`);
    await other.getByRole("button", { name: "Open the link" }).click();
    await other.getByText(/answered 404\./).waitFor();
    await field.fill(`${boards.origin}/open/sensor.drl`);
    await field.press("Enter");
    await until(async () => Number(await data(other, "holes").catch(() => 0)) > 0, "the board behind the link put in");
  } finally {
    await context.close();
    server.stop();
    boards.stop();
  }
});

test("files that another program shares with the page are opened once, and the browser would install the site", async () => {
  const server = await serveFiles();
  const { page, context } = await openPage(browser, server.url);
  try {
    await kept(page);
    const session = await context.newCDPSession(page);
    const { installabilityErrors } = await session.send("Page.getInstallabilityErrors");
    const told = installabilityErrors.map((one) => one.errorId).filter((id) => id !== "in-incognito");
    assert.deepEqual(told, [], "installable");
    const text = readFileSync(join(root, "www/examples/sensor.drl"), "utf8");
    /** Shares this many files with this text, as the system's share dialog does. */
    const share = (text, count) =>
      page.evaluate(
        ([text, count]) => {
          const [form, files, data] = [document.createElement("form"), document.createElement("input"), new DataTransfer()];
          Object.assign(form, { method: "post", action: "share", enctype: "multipart/form-data" });
          Object.assign(files, { type: "file", name: "files", multiple: true });
          for (let number = 0; number < count; number++) data.items.add(new File([text], `shared board ${number}.drl`));
          files.files = data.files;
          form.append(files);
          document.body.append(form);
          form.submit();
        },
        [text, count],
      );
    await share(text, 1);
    await until(async () => Number(await data(page, "holes").catch(() => 0)) > 0, "the board that was shared");
    assert.equal(new URL(page.url()).search, "");
    await share("M48", 2001);
    await page.getByText("More than 2000 files at once.").waitFor();
    assert.equal(new URL(page.url()).search, "");
    await page.goto(`${server.url}?shared`);
    await page.getByText("The shared files are gone.").waitFor();
  } finally {
    await context.close();
    server.stop();
  }
});

test("a tool that is worn in mid-job is asked for anew, and the table says what each has done", async () => {
  const server = await serveFiles();
  const { page, problems, context } = await openPage(browser, `${server.url}?speed=20`);
  try {
    await openSample(page);
    await drillOnly(page);
    await tab(page, "Machine").click();
    await page.getByText("The position is not known. Home first.").waitFor();
    const table = async () => {
      await tab(page, "Settings").click();
      await page.getByRole("button", { name: "Tools", exact: true }).click();
      await page.getByRole("table", { name: "Tools" }).waitFor();
    };
    await table();
    const life = (tool) => page.getByLabel(`T${tool}: Life, holes or m`);
    await life(1).fill("many");
    await life(1).press("Tab");
    await page.getByText(/life cannot be “many”/).waitFor();
    for (const cell of await page.getByLabel(/^T\d+: Life/).all()) {
      await cell.fill("4");
      await cell.press("Tab");
    }
    await page.getByRole("button", { name: "Apply" }).click();
    await until(async () => (await page.getByText(/^0 of 4 holes$/).count()) > 10, "lives that hold");
    await tab(page, "Board").click();
    await page.getByText(/^Planned .* m,/).waitFor();
    const { start } = await startJob(page);
    await start.click();
    // Count inside the page: on a busy computer, the next change can start before a poll sees the end of the
    // last one.
    await page.evaluate(() => {
      globalThis.wornTools = 0;
      let [open, worn] = [false, false];
      const look = () => {
        const dialog = [...document.querySelectorAll("dialog[open]")].find((one) => one.textContent.includes("Start spindle and continue"));
        if (dialog && !open) worn = false;
        open = dialog !== undefined;
        if (worn || !/is worn \(4 of 4 holes\): put in a new one/.test(dialog?.textContent)) return;
        worn = true;
        globalThis.wornTools += 1;
      };
      new MutationObserver(look).observe(document, { childList: true, subtree: true, attributes: true, characterData: true });
    });
    await toTheEnd(page);
    const worn = await page.evaluate(() => globalThis.wornTools);
    const holes = Number(await data(page, "holes"));
    const made = await drilled(page);
    assert.deepEqual([made.length, twice(made)], [holes, 0], "every hole once");
    await table();
    const told = await page.getByText(/^\d of 4 holes$/).allTextContents();
    const counted = told.reduce((sum, words) => sum + Number(words[0]), 0);
    assert.ok(worn > 0, "a tool was worn");
    assert.equal(counted + 4 * worn, holes, "every hole is counted once");
    await page.screenshot({ path: picture("alone-tools-1440") });
    const used = page.getByRole("row").filter({ hasText: /[1-4] of 4 holes/ }).first();
    const left = await page.getByText(/^0 of 4 holes$/).count();
    await used.getByRole("button", { name: "New tool is in" }).click();
    await until(async () => (await page.getByText(/^0 of 4 holes$/).count()) === left + 1, "a new tool");
    assert.deepEqual(problems, []);
  } finally {
    await context.close();
    server.stop();
  }
});
