// The page as a site of files alone, below a folder of any server: no bridge, no network after the first visit.

import assert from "node:assert/strict";
import { createHash } from "node:crypto";
import { readFileSync } from "node:fs";
import { createServer } from "node:http";
import { extname, join, normalize } from "node:path";
import { after, before, test } from "node:test";
import { data, downloaded, drillOnly, openBrowser, openPage, picture, root, tab, until } from "./harness.mjs";

const site = process.env.ANNULUS_SITE ?? join(root, "target/site");
const kinds = { ".html": "text/html", ".js": "text/javascript", ".wasm": "application/wasm", ".css": "text/css", ".svg": "image/svg+xml" };

/** A server of files that knows nothing of Annulus; `changed` gives other bytes for a file. */
async function serveFiles(changed = () => null) {
  const asked = [];
  const server = createServer((request, response) => {
    const path = decodeURIComponent(new URL(request.url, "http://x").pathname);
    asked.push(`${request.method} ${path}`);
    const name = path.startsWith("/boards/here/") ? normalize(path.slice("/boards/here/".length) || "index.html") : "..";
    try {
      if (name.startsWith("..")) throw new Error(name);
      const bytes = changed(name) ?? readFileSync(join(site, name));
      response.writeHead(200, { "content-type": kinds[extname(name)] ?? "application/octet-stream" }).end(bytes);
    } catch {
      response.writeHead(404).end();
    }
  });
  await new Promise((listening) => server.listen(0, "127.0.0.1", listening));
  const url = `http://127.0.0.1:${server.address().port}/boards/here/`;
  return { url, asked, stop: () => (server.closeAllConnections(), server.close()) };
}

/** Waits until the site is kept and looks after this page. */
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
    await context.setOffline(true);
    server.stop();
    await page.reload();
    await page.getByRole("heading", { name: /Drop the files/ }).waitFor();
    await openSample(page);
    await drillOnly(page);
    await tab(page, "CAM").click();
    const save = page.getByRole("button", { name: "Export files" });
    await until(() => save.isEnabled(), "an export that is allowed");
    const files = await downloaded(page, save);
    assert.ok([...files.values()].some((text) => /X\s*-?\d/.test(text.toString())), "a program with places in it");
    await page.screenshot({ path: picture("alone-cam-1440") });
    await tab(page, "Simulate").click();
    const holes = Number(await data(page, "holes"));
    await page.getByRole("slider", { name: "Time", exact: true }).focus();
    await page.keyboard.press("End");
    await until(async () => Number(await data(page, "done")) === holes, "all holes done in the playback");
    await tab(page, "Machine").click();
    await page.getByText(/This page came from a site without a bridge/).waitFor();
    await page.screenshot({ path: picture("alone-machine-1440") });
    assert.deepEqual(server.asked.filter((one) => !one.startsWith("GET /boards/here/")), [], "nothing but files of the site");
    assert.deepEqual(problems, []);
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
    const take = page.getByRole("button", { name: "Reload with it" });
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
    assert.equal(await page.getByRole("button", { name: "Reload with it" }).count(), 0);
    await context.setOffline(true);
    await page.reload();
    await openSample(page);
  } finally {
    await context.close();
    server.stop();
  }
});
