// Starts the page. The one Trusted Types policy, `annulus`, vouches for addresses of our own scripts; markup it never
// makes, so nothing on the page can be written as markup.
import init from "./annulus.js";

const own = (address) => {
  const url = new URL(address, import.meta.url);
  if (url.origin !== location.origin) throw new TypeError(`not a script of ours: ${url}`);
  return url.href;
};
globalThis.annulusPolicy = globalThis.trustedTypes?.createPolicy("annulus", { createScriptURL: own });

init({ module_or_path: new URL("./annulus_bg.wasm", import.meta.url) }).catch((error) => {
  console.error(error);
  document.documentElement.dataset.failed = "true";
});
