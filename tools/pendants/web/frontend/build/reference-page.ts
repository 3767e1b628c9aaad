// Makes the page of reference beside the pendant's own: every message, and what its fields mean.
import type { Plugin } from "vite";
import { MEANINGS } from "../src/field-meanings.ts";

const STYLE =
  ":root { color-scheme: light dark } body { font: 16px/1.5 system-ui, sans-serif; max-width: 60rem;" +
  " margin: 2rem auto; padding: 0 1rem } :target { outline: 3px solid #f28c28; outline-offset: 6px }" +
  " dl { display: grid; grid-template-columns: max-content 1fr; gap: 2px 1rem } dd { margin: 0 }" +
  " dt { font-family: ui-monospace, monospace }";

export function referencePage(): Plugin {
  return {
    name: "reference-page",
    generateBundle() {
      this.emitFile({ type: "asset", fileName: "reference.html", source: referenceHtml() });
    },
  };
}

export function referenceHtml(): string {
  const messages = Object.entries(MEANINGS).map(([name, { number, about, fields }]) => {
    const rows = Object.entries(fields).map(
      ([field, [meaning, unit]]) => `<dt>${field}<dd>${escaped(meaning)}${unit === "" ? "" : ` [${escaped(unit)}]`}`,
    );
    const list = rows.length === 0 ? "" : `\n<dl>\n${rows.join("\n")}\n</dl>`;
    return `<section id="${name}">\n<h2>${number} ${name}</h2>\n<p>${escaped(about)}${list}\n</section>`;
  });
  return `<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<title>openpendant: messages</title>
<link rel="icon" href="data:,">
<style>${STYLE}</style>
<h1>Messages of the pendant protocol</h1>
<p>To the byte they stand in docs/protocol.md, each under the same name.
${messages.join("\n")}
</html>
`;
}

function escaped(text: string): string {
  return text.replaceAll("&", "&amp;").replaceAll("<", "&lt;");
}
