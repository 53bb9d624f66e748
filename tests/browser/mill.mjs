// What a person does at a GRBL mill that the page drives: a board opened, the port chosen, the head moved, a job begun.
//
// Comes in: a browser, a board. Goes out: a page at its Machine screen, the same after each step. mm. Knows nothing of ports.

import { STEPS, plugInto } from "./grbl.mjs";
import { PATIENCE_MS, openPage, press, settled, tab, until } from "./harness.mjs";

/** How many times faster than life the board runs. */
export const SPEED = 2;
/** Holes in mm, two sizes: the first is the work zero. */
export const HOLES = [0, 3].flatMap((y) => [0, 2, 4, 6, 8, 10].map((x) => [x, y]));

/** A drill file: holes in mm by the diameter of their tools. */
export function drillFile(tools) {
  const all = Object.entries(tools);
  const lines = all.flatMap(([, holes], at) => [`T${at + 1}`, ...holes.map(([x, y]) => `X${x}.0Y${y}.0`)]);
  return ["M48", "METRIC", ...all.map(([mm], at) => `T${at + 1}C${mm}`), "%", ...lines, "M30", ""].join("\n");
}

export const connect = (page) => page.getByRole("button", { name: "Connect a controller…" });
export const shown = (page, text, within = PATIENCE_MS) => page.getByText(text).first().waitFor({ timeout: within });
export const digits = async (page, axis) => Number((await page.locator(`[data-axis="${axis}"]`).textContent()).replace("−", "-"));

/** Whether an axis stands at its zero: the board counts its zero from where it was sent, which may lie between two steps. */
export const isZero = (mm) => Math.abs(mm) <= 0.5 / STEPS + 1e-9;

/** The buttons that move an axis down and up in its numbers. */
export const WAYS = { X: ["Move X to the left", "Move X to the right"], Y: ["Move Y nearer", "Move Y away"], Z: ["Move Z down", "Move Z up"] };

/** Goes to a place by steps, as a person would: the longest first. A step that a busy page let end early is followed by others. */
export async function moveTo(page, axis, to) {
  for (const size of [10, 1, 0.1, 0.01]) {
    await page.getByRole("button", { name: String(size), exact: true }).click();
    for (;;) {
      const way = to - (await settled(() => digits(page, axis), axis, 400));
      if (Math.abs(way) < 0.005) return;
      if (Math.abs(way) < size - 1e-6) break;
      await press(page, page.getByRole("region", { name: "Move by hand" }).getByRole("button", { name: WAYS[axis][way > 0 ? 1 : 0], exact: true }));
    }
  }
}

/** Over the board, zero and height set; steps of the zero. */
export async function ready(page, board) {
  for (const axis of ["X", "Y", "Z"]) await moveTo(page, axis, -21);
  await press(page, page.getByRole("button", { name: /^Set work zero here/ }));
  await until(async () => isZero(await digits(page, "X")), "zero of X");
  await press(page, page.getByRole("button", { name: /^Tip on the board/ }));
  await until(async () => isZero(await digits(page, "Z")), "zero of Z");
  // It is read again before it counts.
  await settled(() => digits(page, "Z"), "the height", 1000);
  return board.steps();
}

/** Reads the pre-flight, ticks what is to be ticked, and begins. */
export async function begin(page, name) {
  const dialog = page.getByRole("dialog", { name: "Before the start" });
  const start = dialog.getByRole("button", { name });
  await until(async () => {
    for (const tick of await dialog.getByRole("checkbox").all()) if (!(await tick.isChecked())) await tick.check();
    return start.isEnabled();
  }, "a pre-flight that lets the job start");
  const rows = await dialog.getByRole("listitem").allTextContents();
  await start.click();
  return rows;
}

/** Has the dialog of the change again, which a line that was lost and found opens by itself, and goes on. */
export async function goOn(page) {
  const [change, show] = [page.getByRole("alertdialog"), page.getByRole("button", { name: "Show", exact: true })];
  await change.or(show).first().waitFor();
  if (!(await change.isVisible())) await show.click();
  await press(page, change.getByRole("button", { name: /^Continue/ }));
  await change.waitFor({ state: "hidden" });
}

/** Touches off the tool that is asked for, and goes on. */
export async function touchOff(page) {
  const change = page.getByRole("alertdialog");
  await change.getByRole("button", { name: "Not yet" }).click();
  await moveTo(page, "Z", 0);
  await press(page, page.getByRole("button", { name: /^Tip on the board/ }));
  await goOn(page);
}

export async function home(page, within = PATIENCE_MS) {
  await press(page, page.getByRole("button", { name: "Home", exact: true }));
  await shown(page, "At rest, position known.", within);
}

/** A page of the site with a board of these holes planned, on its Machine screen. */
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
