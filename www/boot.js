// Starts the page, and until then shows the opening of `index.html` in the colours and the language of last time. The one Trusted
// Types policy, `annulus`, vouches for addresses of our own scripts; markup it never makes, so nothing on the page can be written
// as markup.

const own = (address) => {
  const url = new URL(address, import.meta.url);
  if (url.origin !== location.origin) throw new TypeError(`not a script of ours: ${url}`);
  return url.href;
};
globalThis.annulusPolicy = globalThis.trustedTypes?.createPolicy("annulus", { createScriptURL: own });

/** Does something once; another try where it failed. */
const once = (act) => {
  let done;
  return () =>
    (done ??= act().catch((error) => {
      done = undefined;
      throw error;
    }));
};

/** The engine of the workers, fetched and compiled. */
globalThis.annulusEngine = once(async () => {
  const answer = await fetch(new URL("./engine_bg.wasm", import.meta.url));
  if (!answer.ok) throw new Error(`engine_bg.wasm: ${answer.status}`);
  const streams = answer.headers.get("content-type") === "application/wasm";
  return streams ? WebAssembly.compileStreaming(answer) : WebAssembly.compile(await answer.arrayBuffer());
});

/** What draws on the GPU, fetched when a picture is first drawn. */
const painter = once(async () => {
  const made = await import("./painter.js");
  await made.default({ module_or_path: new URL("./painter_bg.wasm", import.meta.url) });
  return made;
});
globalThis.annulusPainter = async (canvas, kind, whenLost) => (await painter()).open(canvas, kind, whenLost);

const root = document.documentElement;
const opening = document.getElementById("opening");
try {
  const theme = localStorage.getItem("annulus.theme");
  if (["light", "dark", "contrast"].includes(theme)) root.dataset.theme = theme;
  const asked = [new URLSearchParams(location.search).get("lang"), localStorage.getItem("annulus.language"), ...navigator.languages];
  opening.lang = asked.map((tag) => tag?.slice(0, 2)).find((tag) => ["en", "pl", "zh"].includes(tag)) ?? "en";
} catch {
  opening.lang = "en"; // A browser that keeps nothing for this page.
}

const fallen = document.getElementById("fallen");

/** STOP of a page whose program has crashed (`effects/last_stop.rs`). */
function stop(event) {
  event.preventDefault();
  event.stopPropagation();
  const sent = () => (fallen.dataset.stop = "sent");
  const unsent = () => (fallen.dataset.stop = "unsent");
  try {
    // A socket that is closed takes what is sent without a word.
    const { readyState = WebSocket.OPEN } = globalThis.annulusStop.carrier;
    if (readyState !== WebSocket.OPEN) throw new Error("the line is closed");
    Promise.resolve(globalThis.annulusStop()).then(sent, unsent);
  } catch {
    unsent();
  }
}

/** A program that trapped no longer reacts, not even to STOP: says so above all else, with a STOP that needs no program. */
function fall(error) {
  if (fallen.open || !(error instanceof WebAssembly.RuntimeError)) return;
  fallen.lang = root.lang;
  fallen.dataset.stop = globalThis.annulusStop ? "" : "none";
  fallen.addEventListener("cancel", (event) => event.preventDefault());
  document.getElementById("again").addEventListener("click", () => location.reload());
  const button = document.getElementById("last-stop");
  button.addEventListener("pointerdown", stop);
  button.addEventListener("click", (event) => event.detail === 0 && stop(event));
  const key = (event) => event.ctrlKey && event.shiftKey && event.code === "KeyE" && stop(event);
  addEventListener("keydown", key, { capture: true });
  fallen.showModal();
  // What is left of the program can still open a dialog, such as that of a tool change: this one stays above it.
  const above = (changes) => {
    if (!changes.some(({ target }) => target instanceof HTMLDialogElement && target !== fallen && target.open)) return;
    fallen.close();
    fallen.showModal();
  };
  new MutationObserver(above).observe(document.body, { subtree: true, attributeFilter: ["open"] });
}
addEventListener("error", ({ error }) => fall(error));
addEventListener("unhandledrejection", ({ reason }) => fall(reason));

try {
  const { default: init } = await import("./page.js");
  await init({ module_or_path: new URL("./page_bg.wasm", import.meta.url) });
  opening.remove();
} catch (error) {
  console.error(error);
  root.dataset.failed = "true";
}
