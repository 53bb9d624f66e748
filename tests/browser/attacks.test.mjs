// Thirty attacks on the bridge from a real browser: foreign origins, DNS rebinding, frames, forms, replays,
// contention, floods.
//
// The attacker is a server on another port of this computer, the closest that a foreign page can be. The
// bridge needs no built page for this: its error pages have its origin and the same security policy.

import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { createServer } from "node:http";
import { connect } from "node:net";
import { after, before } from "node:test";
import { join } from "node:path";
import { chromium } from "playwright-core";
import { PATIENCE_MS, root, startBridge, test, until } from "./harness.mjs";

let bridge, port, browser, attacker, evil, watch;
const seen = [];

/** A new one-time token of the running bridge. */
function token(scope = "configure", home = bridge.home) {
  const program = process.env.ANNULUS_BIN ?? join(root, "target/debug/annulus");
  const env = { ...process.env, ANNULUS_HOME: home };
  const link = spawnSync(program, ["link", "--scope", scope], { env, encoding: "utf8" });
  return link.stdout.match(/#t=([0-9a-f]+)/)[1];
}

/** The client code of our page, for a page of our origin. */
function helpers() {
  const hex = (bytes) => [...new Uint8Array(bytes)].map((byte) => byte.toString(16).padStart(2, "0")).join("");
  const bytes = (text) => new Uint8Array(text.match(/../g).map((two) => parseInt(two, 16)));
  globalThis.own = {
    async pair(token) {
      const reply = await fetch("/api/pair", { method: "POST", body: JSON.stringify({ token }) });
      return { status: reply.status, ...(await reply.json()) };
    },
    async proof(key, nonce) {
      const algorithm = { name: "HMAC", hash: "SHA-256" };
      const secret = await crypto.subtle.importKey("raw", bytes(key), algorithm, false, ["sign"]);
      return hex(await crypto.subtle.sign("HMAC", secret, new TextEncoder().encode(nonce)));
    },
    /** Opens a socket; `session` sends a hello. `tells` collects all messages. */
    open(session, proof) {
      const socket = new WebSocket(`ws://${location.host}/api/socket`);
      const line = { socket, tells: [], closed: false };
      socket.onclose = () => (line.closed = true);
      socket.onmessage = async ({ data }) => {
        const tell = JSON.parse(data);
        line.tells.push(tell);
        if (tell.t !== "challenge") return;
        line.nonce = tell.nonce;
        if (!session) return;
        line.proof = proof ?? (await own.proof(session.key, tell.nonce));
        line.say({ t: "hello", proto: 1, min: 1, app: "attack", session: session.session, proof: line.proof });
      };
      line.say = (ask) => socket.send(JSON.stringify(ask));
      line.heard = (wanted) => own.wait(() => line.tells.find(wanted));
      line.refusals = () => line.tells.filter((tell) => tell.t === "refused").map((tell) => tell.why.code);
      return line;
    },
    async wait(look) {
      for (let turn = 0; turn < 1800; turn += 1) {
        const found = look();
        if (found) return found;
        await new Promise((next) => setTimeout(next, 50));
      }
      throw new Error("waited in vain");
    },
  };
}

/** A page of the bridge's origin. */
async function ours() {
  const context = await browser.newContext();
  context.setDefaultTimeout(PATIENCE_MS);
  await context.addInitScript(helpers);
  const page = await context.newPage();
  await page.goto(`${bridge.origin}/nothing`);
  return page;
}

/** A page of the attacker with this body; `answers` collects the bridge's responses to it. */
async function theirs(body = "", at = attacker) {
  const context = await browser.newContext();
  context.setDefaultTimeout(PATIENCE_MS);
  const page = await context.newPage();
  const answers = [];
  context.on("response", (response) => {
    if (new URL(response.url()).port === String(port)) answers.push(response.status());
  });
  await page.goto(`${at}/?${encodeURIComponent(body)}`);
  return { page, answers };
}

/** True if a socket from `page` to `url` opens. */
const opens = (page, url) =>
  page.evaluate(
    (address) =>
      new Promise((told) => {
        let socket;
        try {
          socket = new WebSocket(address);
        } catch {
          return told("refused by the browser");
        }
        socket.onopen = () => told("open");
        socket.onerror = () => told("refused");
      }),
    url,
  );

/** The result of a request by `page`. */
const asked = (page, url, options) =>
  page.evaluate(
    async ([address, how]) => {
      try {
        const reply = await fetch(address, how);
        return { type: reply.type, status: reply.status, text: await reply.text() };
      } catch (error) {
        return { failed: String(error) };
      }
    },
    [url, options],
  );

/** Checks that the browser or the bridge blocked the request. */
const denied = (reply) =>
  assert.ok(reply.failed || reply.status === 403 || (reply.type === "opaque" && reply.text === ""), JSON.stringify(reply));

before(async () => {
  bridge = await startBridge({ speed: 1 });
  port = Number(new URL(bridge.url).port);
  const answer = (request, response) => {
    response.setHeader("content-type", "text/html");
    response.end(`<!doctype html><title>elsewhere</title>${decodeURIComponent(request.url.slice(2))}`);
  };
  const server = createServer(answer);
  await new Promise((ready) => server.listen(0, "127.0.0.1", ready));
  server.unref();
  attacker = `http://127.0.0.1:${server.address().port}`;
  evil = `http://evil.example:${port}`;
  browser = await chromium.launch({
    executablePath: process.env.ANNULUS_CHROMIUM ?? "/usr/bin/chromium",
    args: ["--headless", "--no-sandbox", "--no-first-run", "--disable-background-networking",
      "--host-resolver-rules=MAP evil.example 127.0.0.1"],
  });
  // A watcher checks all the time that nothing moves.
  watch = await ours();
  await watch.evaluate(async (fresh) => {
    const session = await own.pair(fresh);
    globalThis.line = own.open(session);
    await line.heard((tell) => tell.t === "status");
  }, token("view"));
});

after(async () => {
  await browser?.close();
  await bridge?.stop();
});

/** Runs one attack; then checks that nothing has moved, and that a legitimate client still gets in. */
function attack(name, what) {
  seen.push(name);
  test(name, async () => {
    await what();
    const states = await watch.evaluate(() => [
      ...new Set(line.tells.filter((tell) => tell.t === "status").map((tell) => tell.state)),
    ]);
    assert.deepEqual(states, ["not-homed"], "nothing moved");
    for (const context of browser.contexts().slice(1)) await context.close();
  });
}

// DNS rebinding.
attack("a name bound anew to 127.0.0.1 is not answered", async () => {
  const { page, answers } = await theirs();
  await page.goto(`${evil}/`);
  assert.deepEqual(answers, [403]);
  assert.match(await page.textContent("body"), /door\.host/);
});
attack("a page of such a name cannot pair", async () => {
  const { page } = await theirs();
  await page.goto(`${evil}/`);
  const fresh = token();
  denied(await asked(page, "/api/pair", { method: "POST", body: JSON.stringify({ token: fresh }) }));
  const own_page = await ours();
  assert.equal((await own_page.evaluate((it) => own.pair(it), fresh)).status, 200, "the token is still good");
});
attack("a page of such a name opens no socket", async () => {
  const { page } = await theirs();
  await page.goto(`${evil}/`);
  assert.notEqual(await opens(page, `ws://evil.example:${port}/api/socket`), "open");
});
attack("0.0.0.0 is no name of ours", async () => {
  const { page } = await theirs();
  denied(await asked(page, `http://0.0.0.0:${port}/`, {}));
  const reply = await page.goto(`http://0.0.0.0:${port}/`).catch(() => null);
  assert.ok(reply === null || reply.status() === 403);
});
attack("other spellings of the loopback address are no names of ours", async () => {
  const { page } = await theirs();
  for (const host of ["[::ffff:127.0.0.1]", "127.0.0.2", "localhost.", "evil.localhost"]) {
    const reply = await page.goto(`http://${host}:${port}/`).catch(() => null);
    assert.ok(reply === null || reply.status() === 403, `${host}: ${reply?.status()}`);
  }
});

// Foreign origins.
for (const host of ["127.0.0.1", "localhost", "[::1]"]) {
  attack(`another page opens no socket at ${host}`, async () => {
    const { page } = await theirs();
    assert.notEqual(await opens(page, `ws://${host}:${port}/api/socket`), "open");
  });
}
attack("a sandboxed frame, whose origin is null, opens no socket", async () => {
  const script = `<script>s=new WebSocket("ws://127.0.0.1:${port}/api/socket");s.onopen=()=>parent.postMessage("open","*");s.onerror=()=>parent.postMessage("refused","*")</scr` + `ipt>`;
  const { page } = await theirs();
  const told = await page.evaluate(
    (text) =>
      new Promise((heard) => {
        addEventListener("message", ({ data }) => heard(data));
        const frame = document.createElement("iframe");
        frame.setAttribute("sandbox", "allow-scripts");
        frame.srcdoc = text;
        document.body.append(frame);
      }),
    script,
  );
  assert.equal(told, "refused");
});
attack("another page reads nothing", async () => {
  const { page } = await theirs();
  for (const path of ["/", "/api/socket", `/api/jobs/${"0".repeat(64)}`]) denied(await asked(page, bridge.origin + path, {}));
});
attack("a request without CORS is answered 403 and stays opaque", async () => {
  const { page, answers } = await theirs();
  denied(await asked(page, `${bridge.origin}/`, { mode: "no-cors" }));
  assert.ok(answers.every((status) => status === 403), String(answers));
});
attack("a simple POST with the right token does not use it up", async () => {
  const { page } = await theirs();
  const fresh = token();
  denied(await asked(page, `${bridge.origin}/api/pair`, { method: "POST", mode: "no-cors", body: JSON.stringify({ token: fresh }) }));
  const own_page = await ours();
  assert.equal((await own_page.evaluate((it) => own.pair(it), fresh)).status, 200);
});
attack("a preflight is refused", async () => {
  const { page } = await theirs();
  const reply = await asked(page, `${bridge.origin}/api/jobs/${"0".repeat(64)}`, {
    method: "PUT",
    headers: { "x-annulus-session": "a", "x-annulus-proof": "b" },
    body: "x",
  });
  assert.ok(reply.failed, JSON.stringify(reply));
});
for (const kind of ["application/x-www-form-urlencoded", "text/plain"]) {
  attack(`a form that sends itself as ${kind} is refused`, async () => {
    const form = `<form method=post enctype="${kind}" action="${bridge.origin}/api/pair"><input name='{"token":"' value='"}'></form>`;
    const { page, answers } = await theirs(form);
    await page.evaluate(() => document.forms[0].submit());
    await until(() => answers.length > 0, "an answer");
    assert.deepEqual(answers, [403]);
  });
}
attack("a beacon is refused", async () => {
  const { page, answers } = await theirs();
  await page.evaluate((to) => navigator.sendBeacon(to, "{}"), `${bridge.origin}/api/link`);
  await page.waitForTimeout(500);
  assert.ok(answers.every((status) => status === 403), String(answers));
});

// Embedding.
attack("our page is shown in no frame", async () => {
  const { page, answers } = await theirs(`<iframe src="${bridge.origin}/"></iframe>`);
  await until(() => answers.length > 0 || page.frames().some((frame) => frame.url().startsWith("chrome-error")), "an end");
  assert.ok(answers.every((status) => status === 403), String(answers));
});
attack("our pictures, scripts and styles are of no use elsewhere", async () => {
  const { page, answers } = await theirs();
  const told = await page.evaluate(
    (from) =>
      Promise.all(
        [["img", "src"], ["script", "src"], ["link", "href"]].map(
          ([name, attribute]) =>
            new Promise((heard) => {
              const element = document.createElement(name);
              if (name === "link") element.rel = "stylesheet";
              element.onload = () => heard("loaded");
              element.onerror = () => heard("refused");
              element[attribute] = `${from}/`;
              document.head.append(element);
            }),
        ),
      ),
    bridge.origin,
  );
  assert.deepEqual(told, ["refused", "refused", "refused"]);
  assert.ok(answers.every((status) => status === 403), String(answers));
});
attack("a worker of ours cannot be begun elsewhere", async () => {
  const { page } = await theirs();
  const told = await page.evaluate((from) => {
    try {
      new Worker(`${from}/worker.js`);
      return "begun";
    } catch (error) {
      return error.name;
    }
  }, bridge.origin);
  assert.equal(told, "SecurityError");
});
attack("a window that another page opens is refused and cut off from it", async () => {
  const { page, answers } = await theirs();
  const [popup] = await Promise.all([
    page.context().waitForEvent("page"),
    page.evaluate((to) => void (globalThis.other = open(to)), `${bridge.origin}/`),
  ]);
  await popup.waitForLoadState();
  await until(() => answers.length > 0, "an answer");
  assert.deepEqual([...new Set(answers)], [403]);
  assert.equal(await popup.evaluate(() => window.opener), null);
});
attack("a scan of ports learns nothing that it can read", async () => {
  const { page } = await theirs();
  for (const path of ["/", "/api/socket", "/favicon.ico"]) {
    const reply = await asked(page, `http://127.0.0.1:${port}${path}`, { mode: "no-cors" });
    assert.ok(reply.failed || (reply.type === "opaque" && reply.text === ""), JSON.stringify(reply));
  }
});

// Injection into our own page.
attack("script in the text of a page of ours does not run, nor is text made code", async () => {
  const page = await ours();
  const told = await page.evaluate(async () => {
    // In a task of the page itself, because code evaluated by the test is exempt from the policy.
    await new Promise((next) => setTimeout(next));
    const script = document.createElement("script");
    const trials = {
      inline: () => {
        script.textContent = "globalThis.ran = true";
        document.head.append(script);
      },
      markup: () => (document.body.innerHTML = "<img src=x onerror='globalThis.ran = true'>"),
      code: () => new Function("return 1")(),
    };
    const failed = Object.entries(trials).map(([name, trial]) => {
      try {
        trial();
        return `${name} went on`;
      } catch {
        return `${name} failed`;
      }
    });
    return { failed, ran: globalThis.ran ?? false };
  });
  assert.equal(told.ran, false, JSON.stringify(told));
  assert.ok(told.failed.includes("markup failed") && told.failed.includes("code failed"), JSON.stringify(told));
});
attack("our own page speaks to nobody else", async () => {
  const page = await ours();
  const reply = await asked(page, `${attacker}/`, { mode: "no-cors" });
  assert.ok(reply.failed, JSON.stringify(reply));
});

// Replays.
attack("a token works once", async () => {
  const page = await ours();
  const fresh = token();
  const both = await page.evaluate(async (it) => [(await own.pair(it)).status, (await own.pair(it)).status], fresh);
  assert.deepEqual(both, [200, 401]);
});
attack("a token in a path or query lets nobody in", async () => {
  const page = await ours();
  const fresh = token();
  for (const path of [`/?t=${fresh}`, `/api/socket?t=${fresh}`, `/api/pair?token=${fresh}`]) {
    const reply = await asked(page, path, {});
    assert.ok(!/session/.test(reply.text ?? "") && !/"key"/.test(reply.text ?? ""), JSON.stringify(reply));
  }
  assert.notEqual(await opens(page, `ws://127.0.0.1:${port}/api/sockets?t=${fresh}`), "open");
});
attack("a hello that was overheard is of no use on another socket", async () => {
  const page = await ours();
  const codes = await page.evaluate(async (fresh) => {
    const session = await own.pair(fresh);
    const good = own.open(session);
    await good.heard((tell) => tell.t === "welcome");
    const replayed = own.open(session, good.proof);
    await own.wait(() => replayed.closed);
    return replayed.refusals();
  }, token("view"));
  assert.deepEqual(codes, ["socket.proof"]);
});
attack("a session of a bridge that was killed is not known to the next", async () => {
  const page = await ours();
  const other = await startBridge({ speed: 1 });
  const context = await browser.newContext();
  await context.addInitScript(helpers);
  const stale = await context.newPage();
  await stale.goto(`${other.origin}/nothing`);
  const session = await stale.evaluate((it) => own.pair(it), new URL(other.url).hash.slice(3));
  await other.kill();
  const again = await startBridge({ speed: 1, home: other.home });
  const codes = await page.evaluate(async (known) => {
    const line = own.open(known);
    await own.wait(() => line.closed);
    return line.refusals();
  }, session);
  await again.stop();
  assert.deepEqual(codes, ["socket.session"]);
});

// Contention and floods.
attack("of two pages that fight for control one has it, and the other moves nothing", async () => {
  const page = await ours();
  const told = await page.evaluate(async (fresh) => {
    const session = await own.pair(fresh);
    const both = [own.open(session), own.open(session)];
    for (const line of both) await line.heard((tell) => tell.t === "welcome");
    for (let turn = 0; turn < 20; turn += 1) both[turn % 2].say({ t: "take_control", force: true });
    // Two sockets are processed independently: the contention ends when the first is done, and then the
    // second takes control.
    both[0].say({ t: "ping", stamp: 6 });
    await both[0].heard((tell) => tell.t === "pong");
    both[1].say({ t: "take_control", force: true });
    both[1].say({ t: "ping", stamp: 7 });
    await both[1].heard((tell) => tell.t === "pong");
    both[0].say({ t: "home" });
    await own.wait(() => both[0].refusals().length > 0);
    const last = both.map((line) => line.tells.filter((tell) => tell.t === "control").at(-1).yours);
    both.forEach((line) => line.socket.close());
    return { last, refused: both[0].refusals() };
  }, token("run"));
  assert.deepEqual(told, { last: [false, true], refused: ["control.needed"] });
});
attack("frames that are too large, too many, not text or nonsense end or move nothing", async () => {
  const page = await ours();
  const told = await page.evaluate(async (fresh) => {
    const session = await own.pair(fresh);
    const say = async (what) => {
      const line = own.open(session);
      await line.heard((tell) => tell.t === "welcome");
      what(line.socket);
      await own.wait(() => line.closed || line.refusals().length > 0);
      const codes = line.refusals();
      line.socket.close();
      return codes[0] ?? "closed";
    };
    return [
      await say((socket) => socket.send(`{"t":"ping","stamp":1${" ".repeat(70_000)}}`)),
      await say((socket) => socket.send(" ".repeat(2_000_000))),
      await say((socket) => socket.send(new Uint8Array(10))),
      await say((socket) => socket.send('{"t":"open_port","address":672}')),
      await say((socket) => {
        for (let turn = 0; turn < 2000; turn += 1) socket.send('{"t":"ping","stamp":0}');
      }),
    ];
  }, token("view"));
  assert.deepEqual(told, ["socket.too_large", "closed", "socket.not_text", "socket.unknown", "socket.too_fast"]);
});
attack("half requests and sockets without a key, by the hundred, keep no page out", async () => {
  const half = Array.from({ length: 300 }, () => {
    const socket = connect(port, "127.0.0.1");
    socket.on("error", () => {});
    socket.write("GET / HTTP/1.1\r\nhost: 127");
    return socket;
  });
  const page = await ours();
  const welcome = await page.evaluate(async (fresh) => {
    const strangers = Array.from({ length: 60 }, () => own.open());
    const session = await own.pair(fresh);
    const line = own.open(session);
    await line.heard((tell) => tell.t === "welcome");
    line.say({ t: "stop" });
    line.say({ t: "ping", stamp: 3 });
    await line.heard((tell) => tell.t === "pong");
    strangers.forEach((stranger) => stranger.socket.close());
    return true;
  }, token("view"));
  half.forEach((socket) => socket.destroy());
  assert.equal(welcome, true);
});

test("there are thirty of them", () => assert.ok(seen.length >= 30, `${seen.length}`));
