// The Lab by keyboard alone, and every panel in dark and light without an accessibility problem.

import assert from "node:assert/strict";
import { after, before } from "node:test";
import { atRest, findings, openBrowser, openLinked, openPage, picture, press, show, startBridge, tab, test, until } from "./harness.mjs";

const sheets = ["Inputs and outputs", "Queue", "Phases", "Motion", "Servo", "Faults", "Log"];

let bridge;
before(async () => (bridge = await startBridge({ speed: 50 })));
after(async () => bridge?.stop());

async function lab(browser, options) {
  const opened = await openLinked(browser, bridge, options);
  await opened.page.getByRole("heading", { name: /Drop the files/ }).waitFor();
  await opened.page.getByRole("button", { name: /: (Not homed|Ready)/ }).waitFor();
  await opened.page.keyboard.press("5");
  await opened.page.getByRole("tablist", { name: "Parts of the Lab" }).waitFor();
  return opened;
}

/** Opens a panel by keyboard: to the tabs, along them with the arrows, Enter. */
async function open(page, name) {
  await page.getByRole("tablist", { name: "Parts of the Lab" }).getByRole("tab", { selected: true }).focus();
  await page.keyboard.press("Home");
  for (let step = 0; step < sheets.indexOf(name); step += 1) await page.keyboard.press("ArrowRight");
  await page.keyboard.press("Enter");
  await page.getByRole("tab", { name, selected: true }).waitFor();
}

for (const scheme of ["dark", "light"]) {
  test(`every sheet of the Lab is accessible, ${scheme}`, async () => {
    const browser = await openBrowser("none");
    const { page, problems } = await lab(browser, { scheme });
    try {
      for (const name of sheets) {
        await open(page, name);
        if (name === "Queue") {
          await page.getByRole("button", { name: "Example" }).click();
          await page.getByText(/^It can run/).waitFor();
        }
        if (name === "Inputs and outputs") {
          await page.getByRole("button", { name: "Start the check" }).click();
          await page.getByRole("button", { name: "It does not answer: next" }).waitFor();
        }
        await atRest(page);
        const short = name.split(" ")[0].toLowerCase();
        assert.match(new URL(page.url()).hash, /^#\/lab\/(io|queue|phases|motion|servo|faults|log)$/);
        await page.screenshot({ path: picture(`lab-${short}-${scheme}`) });
        assert.deepEqual(await findings(page), [], name);
      }
      await open(page, "Motion");
      await page.getByRole("button", { name: "Profiles" }).click();
      await atRest(page);
      await page.screenshot({ path: picture(`lab-profiles-${scheme}`) });
      assert.deepEqual(await findings(page), [], "profiles");
      await page.getByRole("button", { name: "Cycle" }).click();
      await atRest(page);
      await page.screenshot({ path: picture(`lab-cycle-${scheme}`) });
      assert.deepEqual(await findings(page), [], "cycle");
      await open(page, "Servo");
      await page.getByRole("button", { name: "Drill cycle" }).click();
      await atRest(page);
      await page.screenshot({ path: picture(`lab-stroke-${scheme}`) });
      assert.deepEqual(await findings(page), [], "stroke");
      await open(page, "Queue");
      await page.getByRole("button", { name: "Text", exact: true }).click();
      await atRest(page);
      assert.deepEqual(await findings(page), [], "queue as text");
      assert.deepEqual(problems, [], "nothing was said on the console");
    } finally {
      await browser.close();
    }
  });
}

test("a phase table by keyboard: toggle, undo, copy, what is wrong cannot be applied", async () => {
  const browser = await openBrowser("none");
  const { page, problems } = await lab(browser, {});
  try {
    await open(page, "Phases");
    const cell = (line, takt) => page.getByRole("gridcell", { name: new RegExp(`^${line}, row ${takt}:`) });
    await page.getByRole("combobox", { name: "Table" }).selectOption({ label: "Twelve rows with forcing" });
    const is = (line, takt, state) =>
      until(async () => (await cell(line, takt).getAttribute("aria-label")).endsWith(state), `${line} ${takt} ${state}`);
    await is("1a", 1, "on");
    await cell("1a", 1).focus();
    await page.keyboard.press("ArrowDown");
    await page.keyboard.press("Space");
    await is("1b", 1, "on");
    await page.getByText(/to fix/).waitFor();
    const apply = page.getByRole("button", { name: "Apply" });
    await until(() => apply.isDisabled(), "a table with both halves of a winding on is not applied");
    await page.keyboard.press("Control+z");
    await is("1b", 1, "off");
    await page.keyboard.press("Control+y");
    await is("1b", 1, "on");
    await page.keyboard.press("Control+z");
    await is("1b", 1, "off");
    // Copies a block of two columns over the next two.
    await cell("1a", 1).focus();
    await page.keyboard.press("Home");
    for (const key of ["ArrowRight", "ArrowDown", "ArrowDown", "ArrowDown"]) await page.keyboard.press(`Shift+${key}`);
    await page.keyboard.press("Control+c");
    await page.keyboard.press("ArrowRight");
    await page.keyboard.press("ArrowRight");
    await page.keyboard.press("ArrowUp");
    await page.keyboard.press("ArrowUp");
    await page.keyboard.press("ArrowUp");
    await page.keyboard.press("Control+v");
    await is("2a", 4, "on");
    await page.keyboard.press("Control+z");
    await is("2a", 4, "off");
    // The motor turns without losing a step, and the machine applies the edits.
    await page.getByRole("button", { name: "Test on virtual motor" }).press("Enter");
    await page.getByText(/none was lost/).waitFor();
    await page.getByRole("button", { name: "Play the table" }).press("Enter");
    await page.getByText(/^Row [2-9]/).waitFor();
    await page.getByRole("button", { name: "Hold" }).press("Enter");
    await until(() => apply.isEnabled(), "a table that can be applied");
    await apply.press("Enter");
    await until(async () => !(await apply.isVisible()), "the machine took the table");
    await page.reload();
    await page.getByRole("tab", { name: "Phases", selected: true }).waitFor();
    await is("1a", 1, "on");
    assert.deepEqual(problems, [], "nothing was said on the console");
  } finally {
    await browser.close();
  }
});

test("motion by keyboard: what is typed changes the plot, wrong tables are refused with a reason", async () => {
  const browser = await openBrowser("none");
  const { page, problems } = await lab(browser, {});
  try {
    await open(page, "Motion");
    const plot = page.getByRole("slider", { name: "Speed of the move: cursor" });
    const before = await plot.getAttribute("aria-valuetext");
    const period = page.getByRole("textbox", { name: "State 3: interrupts per step" });
    await period.focus();
    await page.keyboard.press("Control+a");
    await page.keyboard.type("2");
    await until(async () => (await plot.getAttribute("aria-valuetext")) !== before, "another plot");
    await page.keyboard.press("Control+z");
    await until(async () => (await plot.getAttribute("aria-valuetext")) === before, "the plot of before");
    await plot.focus();
    await page.keyboard.press("ArrowRight");
    await until(async () => /time 0 s/.test(await plot.getAttribute("aria-valuetext")), "the cursor at the beginning");
    // A table that overruns its target.
    const leave = page.getByRole("textbox", { name: /^State 3: left/ });
    await leave.focus();
    await page.keyboard.press("Control+a");
    await page.keyboard.type("0");
    await page.getByText("This table cannot be used.").waitFor();
    await until(() => page.getByRole("button", { name: "Apply" }).isDisabled(), "a wrong table is not applied");
    await page.keyboard.press("Control+z");
    await page.getByText("Every move stops at its target.").waitFor();
    // Above the motor's maximum rate, steps are lost.
    const interrupts = page.getByRole("textbox", { name: /^Interrupts/ });
    await interrupts.focus();
    await page.keyboard.press("Control+a");
    await page.keyboard.type("20000");
    await page.getByRole("button", { name: "Profiles" }).press("Enter");
    const compared = page.getByRole("slider", { name: /under the three laws: cursor/ });
    const words = await compared.getAttribute("aria-valuetext");
    await page.getByRole("textbox", { name: /^Length/ }).focus();
    await page.keyboard.press("Control+a");
    await page.keyboard.type("250");
    await until(async () => (await compared.getAttribute("aria-valuetext")) !== words, "another comparison");
    await page.getByText(/L_S = /).first().waitFor();
    assert.deepEqual(problems, [], "nothing was said on the console");
  } finally {
    await browser.close();
  }
});

test("the queue by keyboard: rows, breakpoints, undo, and a row out of range is refused", async () => {
  const browser = await openBrowser("none");
  const { page, problems } = await lab(browser, {});
  try {
    await open(page, "Queue");
    await page.getByRole("button", { name: "Example" }).press("Enter");
    const rows = page.getByRole("treegrid", { name: "Work commands" }).getByRole("row");
    await until(async () => (await rows.count()) === 9, "eight rows and their heads");
    await rows.nth(1).focus();
    await page.keyboard.press("F9");
    await until(
      async () => (await rows.nth(1).getByRole("button").getAttribute("aria-pressed")) === "true",
      "a breakpoint",
    );
    // The focus follows an edit in the next frame.
    const at = (line) =>
      until(() => page.evaluate((id) => document.activeElement?.id === id, `queue-row-${line - 1}`), `line ${line}`);
    await page.keyboard.press("Control+d");
    await until(async () => (await rows.count()) === 10, "the row twice");
    await at(2);
    await page.keyboard.press("Alt+ArrowDown");
    await at(3);
    await page.keyboard.press("Delete");
    await until(async () => (await rows.count()) === 9, "one of them deleted");
    await at(3);
    await atRest(page);
    for (const count of [10, 10, 9]) {
      await page.keyboard.press("Control+z");
      await until(async () => (await rows.count()) === count, "an edit less");
    }
    await page.getByText(/^It can run/).waitFor();
    // Out of range: rejected, with the row.
    await rows.nth(4).focus();
    await at(4);
    await page.keyboard.press("Enter");
    await until(() => page.evaluate(() => document.activeElement?.tagName === "SELECT"), "the word of the row");
    await page.keyboard.press("Tab");
    await until(() => page.evaluate(() => document.activeElement?.tagName === "INPUT"), "its arguments");
    await page.keyboard.press("Control+a");
    await page.keyboard.type("900000 0");
    await page.getByText(/to fix before it can run/).waitFor();
    await page.getByRole("button", { name: /^Line 4/ }).waitFor();
    await page.keyboard.press("Control+a");
    await page.keyboard.type("200 x");
    await page.getByRole("button", { name: /^Line 4, column/ }).waitFor();
    await page.keyboard.press("Control+z");
    await page.getByText(/^It can run/).waitFor();
    assert.deepEqual(problems, [], "nothing was said on the console");
  } finally {
    await browser.close();
  }
});

test("the queue runs on the machine by its buttons, and outputs are switched under a lease", async () => {
  const browser = await openBrowser("none");
  const { page, problems } = await lab(browser, {});
  try {
    await open(page, "Queue");
    await page.getByRole("button", { name: "Example" }).press("Enter");
    await page.getByRole("button", { name: "On the machine" }).press("Enter");
    const ready = page.getByText("Step and Run move the machine.");
    await ready.waitFor();
    await page.keyboard.press("F10");
    await page.waitForTimeout(500); // long enough for a start, if keys could start it
    assert.ok(await ready.isVisible(), "no key moved the machine");
    const pressed = async (name, inside = page) => {
      const button = inside.getByRole("button", { name, exact: true });
      await until(() => button.isEnabled(), `${name} that may be pressed`);
      await button.press("Enter");
    };
    await pressed("Step");
    await page.getByText("Held before row 2.").waitFor();
    await pressed("Run");
    await page.getByText("The last row is done.").waitFor();
    await open(page, "Inputs and outputs");
    await page.getByRole("button", { name: "Unlock for 5 minutes" }).press("Enter");
    await page.getByText(/^Unlocked for/).waitFor();
    const row = page.getByRole("table", { name: "Outputs" }).getByRole("row").nth(1);
    await pressed("On", row);
    await pressed("Off", row);
    await row.getByRole("button", { name: "On", exact: true }).waitFor();
    await open(page, "Log");
    await open(page, "Inputs and outputs");
    await page.getByText(/^Locked\./).waitFor();
    assert.deepEqual(problems, [], "nothing was said on the console");
  } finally {
    await browser.close();
  }
});

test("a fault is provoked, seen at the machine, and mended", async () => {
  const browser = await openBrowser("none");
  const bridge = await startBridge({ speed: 50 });
  const { page, context } = await openPage(browser, bridge.url);
  try {
    await tab(page, "Lab").click();
    await open(page, "Faults");
    await page.getByText("Nothing is broken.").waitFor();
    const provoke = page.getByRole("button", { name: "Inject these faults" });
    assert.equal(await provoke.isEnabled(), false, "nothing is chosen");
    await page.getByRole("checkbox", { name: "The X limit switch is always on" }).check();
    await press(page, provoke);
    await page.getByText("Broken now: The X limit switch is always on.").waitFor();
    await show(page, "Machine");
    await page.getByText("The position is not known. Home first.").waitFor();
    await press(page, page.getByRole("button", { name: "Home", exact: true }));
    await page.getByText("control.sensor_stuck").waitFor();
    await until(async () => {
      await page.getByRole("button", { name: "Acknowledge" }).click({ timeout: 1000 }).catch(() => {});
      return (await page.getByText("control.sensor_stuck").count()) === 0;
    }, "the alarm acknowledged");
    // Another page and a reload show the active faults too.
    await page.reload();
    await tab(page, "Lab").click();
    await open(page, "Faults");
    assert.equal(await page.getByRole("checkbox", { name: "The X limit switch is always on" }).isChecked(), true);
    await press(page, page.getByRole("button", { name: "Fix all" }));
    await page.getByText("Nothing is broken.").waitFor();
    await show(page, "Machine");
    await press(page, page.getByRole("button", { name: "Home", exact: true }));
    await page.getByText("At rest, position known.").waitFor();
  } finally {
    await context.close();
    await bridge.stop();
    await browser.close();
  }
});
