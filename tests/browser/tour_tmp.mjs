import { readFileSync } from "node:fs";
import { join } from "node:path";
import { openBrowser, startBridge, openLinked, show, SCREENS, atRest, root, until, data } from "./harness.mjs";
const out = process.env.OUT ?? "/tmp/scr/pics";
const [sizesArg, themesArg, screensArg, langArg, board] = process.argv.slice(2);
const SIZES = { d: [1440, 900], t: [820, 1180], p: [390, 844], n: [320, 640] };
const browser = await openBrowser("webgl2");
const bridge = await startBridge({ speed: 50 });
for (const theme of (themesArg ?? "dark").split(",")) {
  const options = theme === "forced" ? { forcedColors: "active", scheme: "light" } : { scheme: theme };
  const { page, context, problems } = await openLinked(browser, bridge, { ...options, locale: langArg || "en-US" });
  if (process.env.MYCSS) await page.route("**/style/*.css*", (route) => { const n = new URL(route.request().url()).pathname.split("/").pop(); route.fulfill({ body: readFileSync(join(root, "www/style", n)), contentType: "text/css" }); }), await page.reload();
  if (board) {
    const chooser = page.waitForEvent("filechooser");
    await page.keyboard.press("Control+o");
    await (await chooser).setFiles(board.split(","));
    await until(async () => Number(await data(page, "holes")) > 0 || (await page.getByRole("button", { name: /Use this board/ }).count()) > 0, "board");
    const use = page.getByRole("button", { name: /Use this board/ });
    if (await use.count()) { await page.screenshot({ path: `${out}/review-${theme}.png` }); for (const b of await page.getByRole("checkbox", { name: /Seen/ }).all()) await b.check(); if (await use.isEnabled()) await use.click(); }
    await page.getByText(/^Planned .* m,/).waitFor().catch(() => {});
  } else {
    await page.screenshot({ path: `${out}/welcome-${theme}.png` });
    await page.locator(".tiles button, button").filter({ hasText: /Sample board|Płytka przykładowa|示例/ }).first().click();
    await until(async () => Number(await data(page, "holes")) > 0, "holes");
    await page.waitForTimeout(6000);
  }
  for (const s of (sizesArg ?? "d").split("")) {
    const [width, height] = SIZES[s];
    await page.setViewportSize({ width, height });
    for (const screen of screensArg ? screensArg.split(",") : SCREENS) {
      await page.evaluate(() => document.activeElement?.blur());
      await page.keyboard.press(String(SCREENS.indexOf(screen)));
      await page.waitForTimeout(400);
      await page.evaluate(() => scrollTo(0, 0));
      await atRest(page);
      await page.screenshot({ path: `${out}/${screen.toLowerCase()}-${theme}-${s}.png`, fullPage: s === "p" || s === "n" });
      const wide = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
      if (wide > 0) console.log(`${screen} ${theme} ${s}: ${wide} px too wide`);
    }
  }
  if (problems.length) console.log(problems.slice(0, 5));
  await context.close();
}
await browser.close(); await bridge.stop();
