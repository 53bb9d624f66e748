// Starts the engine: the page sends the wasm it is made of, compiled already, as the first message; what follows goes
// to the engine itself.
import { initSync } from "./annulus.js";

addEventListener("message", (event) => initSync({ module: event.data }), { once: true });
