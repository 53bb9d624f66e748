// Starts the page. One Trusted Types policy, `annulus`, vouches for our own scripts and for the static markup that
// leptos compiles out of `view!` and writes into <template> elements; nothing else may write markup.
import init from "./annulus.js";

const same = (text) => text;
const policy = globalThis.trustedTypes?.createPolicy("annulus", { createHTML: same, createScriptURL: same });

if (policy) {
  const native = Object.getOwnPropertyDescriptor(Element.prototype, "innerHTML");
  Object.defineProperty(HTMLTemplateElement.prototype, "innerHTML", {
    configurable: true,
    get: native.get,
    set(markup) {
      native.set.call(this, policy.createHTML(markup));
    },
  });
  globalThis.annulusPolicy = policy;
}

init({ module_or_path: new URL("./annulus_bg.wasm", import.meta.url) }).catch((error) => {
  console.error(error);
  document.documentElement.dataset.failed = "true";
});
