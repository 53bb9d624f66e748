// Keeps the site in the browser: after the first visit the page opens without a network.
//
//   install    every file is fetched and compared with its digest; one that is missing or of another making refuses them all,
//              and what was there before stays
//   waiting    a new site takes over when the page asks for it and no other window is open, or when all windows are closed
//   fetch      what belongs to the site comes from here; anything else passes by
//   share      files that another program shares with the page are put by until the page takes them
//
// Comes in: the list that `cargo xtask site` writes in; shared files. Goes out: files. Of the person's nothing is kept here but what
// was shared and not taken yet.

const SITE = { version: "", files: {} };

const scope = self.registration.scope;
const PREFIX = `annulus ${scope} `;
const KEPT = PREFIX + SITE.version;
const SHARED = `annulus-shared ${scope}`;
// More the page does not read at once.
const MOST_SHARED = { files: 2000, bytes: 256 * 1024 * 1024 };

const hex = (bytes) => Array.from(new Uint8Array(bytes), (byte) => byte.toString(16).padStart(2, "0")).join("");

/** The file of the site at an address; none for what is not of the site. */
function nameOf(address) {
  const url = new URL(address);
  if (!url.href.startsWith(scope)) return null;
  const name = decodeURIComponent((url.origin + url.pathname).slice(scope.length)) || "index.html";
  return Object.hasOwn(SITE.files, name) ? name : null;
}

async function fetched(name) {
  const address = new URL(name === "index.html" ? "./" : name, scope);
  const answer = await fetch(address, { cache: "no-cache", credentials: "same-origin" });
  if (!answer.ok) throw new Error(`${name}: ${answer.status}`);
  const bytes = await answer.arrayBuffer();
  if (hex(await crypto.subtle.digest("SHA-256", bytes)) !== SITE.files[name]) throw new Error(`${name} is of another making`);
  const headers = { "content-type": answer.headers.get("content-type") ?? "application/octet-stream" };
  return [new URL(name, scope).href, new Response(bytes, { headers })];
}

async function keep() {
  const files = await Promise.all(Object.keys(SITE.files).map(fetched));
  const cache = await caches.open(KEPT);
  await Promise.all(files.map(([address, answer]) => cache.put(address, answer)));
}

async function tidy() {
  const old = (await caches.keys()).filter((name) => name.startsWith(PREFIX) && name !== KEPT);
  await Promise.all(old.map((name) => caches.delete(name)));
  await self.clients.claim();
}

async function answer(name, request) {
  const cache = await caches.open(KEPT);
  return (await cache.match(new URL(name, scope).href)) ?? fetch(request);
}

/** Puts shared files by, each under its name, in place of any from before, and shows the page, which is told how much it was; of what is
 * too much nothing is put by. */
async function share(request) {
  const files = (await request.formData()).getAll("files").filter((file) => file instanceof File);
  await caches.delete(SHARED);
  const cache = await caches.open(SHARED);
  const address = (file, number) => new URL(`shared/${number}/${encodeURIComponent(file.name)}`, scope).href;
  const bytes = files.reduce((sum, file) => sum + file.size, 0);
  if (files.length <= MOST_SHARED.files && bytes <= MOST_SHARED.bytes)
    await Promise.all(files.map((file, number) => cache.put(address(file, number), new Response(file))));
  return Response.redirect(new URL(`./?shared=${files.length}+${bytes}`, scope).href, 303);
}

/** Takes over, unless another window still works with what is there. */
async function takeOver(asking) {
  const windows = await self.clients.matchAll({ type: "window", includeUncontrolled: true });
  if (windows.length > 1) asking.postMessage("others");
  else await self.skipWaiting();
}

self.addEventListener("install", (event) => event.waitUntil(keep()));
self.addEventListener("activate", (event) => event.waitUntil(tidy()));
self.addEventListener("message", (event) => {
  if (event.data === "take over") event.waitUntil(takeOver(event.source));
});
self.addEventListener("fetch", (event) => {
  if (event.request.method === "POST" && event.request.url === new URL("share", scope).href) {
    event.respondWith(share(event.request));
    return;
  }
  const name = event.request.method === "GET" ? nameOf(event.request.url) : null;
  if (name) event.respondWith(answer(name, event.request));
});
