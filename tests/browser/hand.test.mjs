// Jogging: a click is one step, a hold continues until release. Control returns automatically. Missing holes
// are reported and can be drilled.

import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { existsSync, mkdtempSync, readFileSync, readdirSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before } from "node:test";
import { atRest, data, drillOnly, openBrowser, openLinked, picture, planned, preflight, press, program, settled, startBridge, startJob, tab, test, until } from "./harness.mjs";

let browser;
before(async () => (browser = await openBrowser("none")));
after(async () => browser?.close());

const SMALL = { width: 1024, height: 768 };
const digits = async (page, axis) => Number(await page.locator(`.digits[data-axis=${axis}]`).innerText());
const still = (page, axis) => settled(() => digits(page, axis), `${axis} at rest`, 700);

/** On the Machine screen, homed. */
async function homed(page) {
  await tab(page, "Machine").click();
  await press(page, page.getByRole("button", { name: "Home", exact: true }));
  await page.getByText("At rest, position known.").waitFor();
}

async function middle(button) {
  const box = await button.boundingBox();
  return [box.x + box.width / 2, box.y + box.height / 2];
}

test("a click is one step, a hold goes on until it is let go, by mouse, finger and armed keys", async () => {
  const bridge = await startBridge({ speed: 1 });
  const { page, context } = await openLinked(browser, bridge, { ...SMALL, hasTouch: true });
  try {
    await homed(page);
    const x = page.getByRole("button", { name: "Move X to the right" });
    const start = await still(page, "X");
    await press(page, x);
    await until(async () => (await digits(page, "X")) !== start, "a step");
    const one = await still(page, "X");
    assert.ok(Math.abs(one - start - 1) < 0.02, `one click, one step of 1 mm: ${start} to ${one}`);

    await x.focus();
    for (let press = 0; press < 6; press += 1) {
      await page.keyboard.down("Enter");
      await page.waitForTimeout(150);
    }
    await page.keyboard.up("Enter");
    const held = await still(page, "X");
    assert.ok(Math.abs(held - one - 1) < 0.02, `Enter held on a button is one step: ${one} to ${held}`);

    const holds = async (begin, end, what) => {
      const from = await still(page, "X");
      await begin();
      await until(async () => (await digits(page, "X")) > from + 2.5, `${what}: more than a step or two`);
      await end();
      const let_go = await digits(page, "X");
      const rest = await still(page, "X");
      assert.ok(rest - let_go < 25, `${what}: it comes to rest, ${let_go} to ${rest}`);
      await page.getByText("At rest, position known.").waitFor();
      await until(() => x.isEnabled(), "a pad that may be pressed");
    };
    const [at, up] = await middle(x);
    await page.mouse.move(at, up);
    await holds(() => page.mouse.down(), () => page.mouse.up(), "mouse");
    await page.mouse.move(at, up);
    await holds(() => page.mouse.down(), () => page.mouse.move(at, up - 300), "off the button");
    await page.mouse.up();
    const session = await context.newCDPSession(page);
    const touch = (type, points) => session.send("Input.dispatchTouchEvent", { type, touchPoints: points });
    await holds(() => touch("touchStart", [{ x: at, y: up }]), () => touch("touchEnd", []), "finger");
    await holds(
      () => touch("touchStart", [{ x: at, y: up }]),
      () => touch("touchStart", [{ x: at, y: up }, { x: 500, y: 500 }]),
      "a second finger",
    );
    await touch("touchEnd", []);

    // Keys move nothing unless armed.
    const before = await still(page, "X");
    await page.locator("#jog-pad").focus();
    await page.keyboard.press("ArrowRight");
    await page.waitForTimeout(600);
    assert.equal(await digits(page, "X"), before, "keys that are not armed move nothing");
    await page.keyboard.press("j");
    await page.getByRole("button", { name: "Keys move the machine" }).waitFor();
    await page.keyboard.press("ArrowRight");
    await until(async () => (await digits(page, "X")) !== before, "a step");
    assert.ok(Math.abs((await still(page, "X")) - before - 1) < 0.02, "one press, one step");
    await holds(() => page.keyboard.down("ArrowRight"), () => page.keyboard.up("ArrowRight"), "key");
    await holds(() => page.keyboard.down("ArrowRight"), () => page.evaluate(() => dispatchEvent(new Event("blur"))), "lost focus");
    await page.keyboard.up("ArrowRight");
    await page.getByRole("button", { name: "Move with the keys" }).waitFor();
  } finally {
    await context.close();
    await bridge.stop();
  }
});

test("the head is parked by its button once it is known where it is", async () => {
  const bridge = await startBridge({ speed: 1 });
  const { page, context } = await openLinked(browser, bridge, SMALL);
  try {
    const park = page.getByRole("button", { name: "Park", exact: true });
    await tab(page, "Machine").click();
    assert.equal(await park.isDisabled(), true, "from an unknown place nothing goes anywhere");
    await homed(page);
    const start = await still(page, "X");
    const right = page.getByRole("button", { name: "Move X to the right" });
    for (const step of [1, 2, 3]) {
      await press(page, right);
      await until(async () => (await digits(page, "X")) > start + step - 0.1, `step ${step}`);
      await page.getByText("At rest, position known.").waitFor();
    }
    await press(page, park);
    await until(async () => Math.abs((await digits(page, "X")) - start) < 0.02, "the head where homing left it");
    await page.getByText("At rest, position known.").waitFor();
  } finally {
    await context.close();
    await bridge.stop();
  }
});

test("a page that was stuck for seconds has control again by itself, and so has one that was loaded anew", async () => {
  const bridge = await startBridge({ speed: 50 });
  const { page, context } = await openLinked(browser, bridge, SMALL);
  try {
    await tab(page, "Machine").click();
    const has = page.getByRole("button", { name: "Release control" });
    await has.waitFor();
    for (let round = 0; round < 2; round += 1) {
      await page.evaluate(() => {
        for (const end = Date.now() + 4500; Date.now() < end; );
      });
      await until(() => has.isVisible(), "control again");
      await until(() => page.getByRole("button", { name: "Home", exact: true }).isEnabled(), "a page that may move the machine");
    }
    await page.reload();
    await has.waitFor();
    // After releasing control, the page doesn't ask for it again.
    await has.click();
    const take = page.getByRole("button", { name: "Take control" });
    await take.waitFor();
    await page.waitForTimeout(1500);
    assert.ok(await take.isVisible());
  } finally {
    await context.close();
    await bridge.stop();
  }
});

test("a board that lacks holes is not told as done, and what is missing can be drilled", async () => {
  const bridge = await startBridge({ speed: 60 });
  const { page, context } = await openLinked(browser, bridge, SMALL);
  try {
    await page.getByRole("button", { name: /Sample board/ }).click();
    await drillOnly(page);
    // A nearly stopped spindle breaks the tool.
    await tab(page, "CAM").click();
    await page.getByRole("button", { name: /Drill/ }).first().click();
    const speed = page.getByRole("textbox", { name: /^Spindle/ });
    await speed.fill("300");
    await speed.press("Enter");
    await planned(page);
    const seen = page.getByRole("button", { name: "Accept all" });
    if (await seen.isEnabled()) await seen.click();
    const { start } = await startJob(page);
    await start.click();
    const go_on = page.getByRole("button", { name: "Start spindle and continue" });
    const alarm = page.getByRole("alert").getByText(/The board is not as programmed\. Holes missing/);
    await until(async () => {
      if (await go_on.isVisible().catch(() => false)) await go_on.click().catch(() => {});
      return alarm.isVisible();
    }, "the end of the job");
    assert.equal(await page.getByText(/The job is done/).count(), 0, "done is not said");
    await page.getByRole("button", { name: "Acknowledge" }).click();
    await page.getByText(/The board is not as programmed: \d+ of \d+/).waitFor();
    await page.getByText(/\d+ of \d+ holes are correct/).waitFor();
    const missing = Number((await page.getByText(/holes? (is|are) missing\./).textContent()).match(/\d+/)[0]);
    assert.ok(missing > 0);
    await until(async () => Number(await data(page, "failed")) === missing, "holes drawn as missing");
    await atRest(page);
    await page.screenshot({ path: picture("missing-1024") });
    const again = page.getByRole("button", { name: `Drill the missing ${missing}…` });
    const dialog = await preflight(page, again);
    await until(async () => (await dialog.getByText(/computed the same steps/).count()) === 1, "the bridge's verdict");
    // Still shown after a reload.
    await page.reload();
    await page.getByText("The board of the last job is not as programmed.").waitFor();
    await again.waitFor();
  } finally {
    await context.close();
    await bridge.stop();
  }
});

test("an executor that died is one clear alarm, STOP is still answered, and it starts again", async (t) => {
  if (!existsSync("/proc/self/task")) return t.skip("no /proc");
  const folder = mkdtempSync(join(tmpdir(), "annulus-card-"));
  const device = join(folder, "card.bin");
  assert.equal(spawnSync(program, ["machines", "--rehearsal", device]).status, 0);
  const file = join(folder, "card.toml");
  const card = `inputs_at = 4\nsensors = [0, -1, 2, -1, 4, -1, -1]\nsensors_low = [0, 0, 0, 0, 1, 0, 0]\nstart_stop_rate = 60`;
  const machine = `name = "Rehearsal"\noutput = "card"\ncard_address = 0`;
  writeFileSync(file, `schema = 1\n[machine]\n${machine}\n[card]\ndevice = ${JSON.stringify(device)}\n${card}\n`);
  const bridge = await startBridge({ speed: 1, args: ["--machine", file] });
  const { page, context } = await openLinked(browser, bridge, SMALL);
  try {
    await tab(page, "Machine").click();
    await page.getByRole("button", { name: "Release control" }).waitFor();
    const threads = () => readdirSync(`/proc/${bridge.pid}/task`);
    const of_thread = (thread) => readFileSync(`/proc/${bridge.pid}/task/${thread}/children`, "utf8").trim().split(/\s+/);
    const children = () => threads().flatMap(of_thread);
    const executors = () => children().filter((pid) => pid && /executor/.test(readFileSync(`/proc/${pid}/cmdline`, "utf8")));
    const all = await until(() => (executors().length > 0 ? executors() : null), "the executor's process");
    for (const pid of all) process.kill(Number(pid), "SIGKILL");
    const alarm = page.getByRole("alert").filter({ hasText: "The pulse process ended" });
    await alarm.waitFor();
    assert.equal(await page.getByRole("alert").count(), 1, "one banner");
    await page.getByRole("button", { name: /STOP/ }).first().dispatchEvent("pointerdown");
    await page.waitForTimeout(1000);
    assert.equal(await page.locator(".not-confirmed").count(), 0, "STOP was answered");
    await press(page, page.getByRole("button", { name: "Acknowledge" }));
    await until(async () => (await alarm.count()) === 0, "a machine that can be homed again");
    await page.getByText("The position is not known. Home first.").waitFor();
  } finally {
    await context.close();
    await bridge.stop();
    rmSync(folder, { recursive: true, force: true });
  }
});
