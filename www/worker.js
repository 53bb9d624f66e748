// Starts the engine: the page sends it, compiled already, or the reason why it cannot be had. What came before it is given to
// the engine once it runs.
import { initSync } from "./engine.js";

const early = [];
const hear = ({ data }) => {
  if (data instanceof Error) throw data;
  if (!(data instanceof WebAssembly.Module)) {
    early.push(data);
    return;
  }
  removeEventListener("message", hear);
  initSync({ module: data });
  for (const data of early) dispatchEvent(new MessageEvent("message", { data }));
};
addEventListener("message", hear);
