// A test reporter that prints the duration of each file, one per line.

import { basename } from "node:path";

export default async function* seconds(source) {
  const files = new Map();
  for await (const { type, data } of source) {
    if ((type !== "test:pass" && type !== "test:fail") || data.nesting > 0 || !data.file) continue;
    const name = basename(data.file);
    files.set(name, (files.get(name) ?? 0) + data.details.duration_ms / 1000);
  }
  for (const [name, taken] of files) yield `# ${name}: ${taken.toFixed(0)} s\n`;
}
