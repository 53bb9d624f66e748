// User actions at a GRBL machine driven by the page: opening a board, choosing the port, jogging, starting a
// job. Lengths in mm.

import assert from "node:assert/strict";
import { STEPS, plugInto } from "./grbl.mjs";
import { mayStart, openPage, PATIENCE_MS, preflight, press, settled, tab, until } from "./harness.mjs";

/** Speed of the simulated board, relative to real time. */
export const SPEED = 2;
/** Holes in mm; the first is the work zero. */
export const HOLES = [0, 3].flatMap((y) => [0, 2, 4, 6, 8, 10].map((x) => [x, y]));

/** A drill file: holes in mm by tool diameter. */
export function drillFile(tools) {
  const all = Object.entries(tools);
  const lines = all.flatMap(([, holes], at) => [`T${at + 1}`, ...holes.map(([x, y]) => `X${x}.0Y${y}.0`)]);
  return ["M48", "METRIC", ...all.map(([mm], at) => `T${at + 1}C${mm}`), "%", ...lines, "M30", ""].join("\n");
}

export const connect = (page) => page.getByRole("button", { name: "Connect a controller…" });
export const shown = (page, text, within = PATIENCE_MS) => page.getByText(text).first().waitFor({ timeout: within });
export const digits = async (page, axis) => Number((await page.locator(`[data-axis="${axis}"]`).textContent()).replace("−", "-"));

/** True if an axis is at its zero, within half a step: GRBL computes zero from the commanded position, which
 *  can be between two steps. */
export const isZero = (mm) => Math.abs(mm) <= 0.5 / STEPS + 1e-9;

/** The buttons that move an axis in negative and in positive direction. */
export const WAYS = { X: ["Move X to the left", "Move X to the right"], Y: ["Move Y nearer", "Move Y away"], Z: ["Move Z down", "Move Z up"] };

/** Postpones the dialog of a tool change. The dialog reopens by itself after a lost connection. */
async function aside(page) {
  const jog = page.getByRole("alertdialog").getByRole("button", { name: "Jog first" });
  if (await jog.isVisible()) await jog.click({ timeout: 2000 }).catch(() => {});
}

/** Moves to a position by jog steps, longest first. Repeats a step that a busy page ended early. */
export async function moveTo(page, axis, to) {
  const end = Date.now() + PATIENCE_MS;
  for (const size of [10, 1, 0.1, 0.01]) {
    await page.getByRole("button", { name: String(size), exact: true }).click();
    for (;;) {
      assert.ok(Date.now() < end, `${axis} does not reach ${to}`);
      await aside(page);
      const way = to - (await settled(() => digits(page, axis), axis, 400));
      if (Math.abs(way) < 0.005) return;
      if (Math.abs(way) < size - 1e-6) break;
      await press(page, page.getByRole("region", { name: "Jog", exact: true }).getByRole("button", { name: WAYS[axis][way > 0 ? 1 : 0], exact: true }), () => aside(page));
    }
  }
}

/** Above the board with zero and height set; returns the zero in steps. */
export async function ready(page, board) {
  for (const axis of ["X", "Y", "Z"]) await moveTo(page, axis, -21);
  await press(page, page.getByRole("button", { name: /^Set work zero here/ }));
  await until(async () => isZero(await digits(page, "X")), "zero of X");
  await press(page, page.getByRole("button", { name: /^Set Z zero here/ }));
  await until(async () => isZero(await digits(page, "Z")), "zero of Z");
  // A value counts only if it is stable.
  await settled(() => digits(page, "Z"), "the height", 1000);
  return board.steps();
}

/** Opens the pre-flight by `button`, accepts it and starts the job. */
export async function begin(page, button, name) {
  const dialog = await preflight(page, button);
  const start = await mayStart(dialog, name);
  const rows = await dialog.getByRole("listitem").allTextContents();
  await start.click();
  return rows;
}

/** Opens the dialog of the tool change if it was postponed, and continues. */
export async function goOn(page) {
  const [change, show] = [page.getByRole("alertdialog"), page.getByRole("button", { name: "Back to tool change", exact: true })];
  await change.or(show).first().waitFor();
  if (!(await change.isVisible())) await show.click();
  await press(page, change.getByRole("button", { name: /^Start spindle/ }));
  await change.waitFor({ state: "hidden" });
}

/** Touches off the wanted tool, and continues. */
export async function touchOff(page) {
  const change = page.getByRole("alertdialog");
  await change.getByRole("button", { name: "Jog first" }).click();
  await moveTo(page, "Z", 0);
  await press(page, page.getByRole("button", { name: /^Set Z zero here/ }), () => aside(page));
  await goOn(page);
}

export async function home(page, within = PATIENCE_MS) {
  await press(page, page.getByRole("button", { name: "Home", exact: true }));
  await shown(page, "At rest, position known.", within);
}

/** Opens the site with a planned board of these holes, on its Machine screen. */
export async function opened(browser, server, board, drill, speed = SPEED) {
  const page = await openPage(browser, "about:blank");
  const port = await plugInto(page.context, board);
  await page.page.goto(`${server.url}?speed=${speed}`);
  const chooser = page.page.waitForEvent("filechooser");
  await page.page.getByRole("button", { name: "Open files…" }).click();
  await (await chooser).setFiles({ name: "twelve.drl", mimeType: "text/plain", buffer: Buffer.from(drill) });
  await page.page.getByText(/^Planned .* m,/).waitFor();
  await tab(page.page, "Machine").click();
  return { ...page, port };
}
