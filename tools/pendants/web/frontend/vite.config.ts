// Builds the page into ../page: one HTML file with its styles inside, one program, and the parts
// that are asked for only when they are needed (three.js and all that draws with it).
import { readFileSync } from "node:fs";
import { defineConfig } from "vite";
import type { Plugin } from "vite";

/** Puts the style sheet into the page, which saves a request before anything is seen. */
function stylesInside(): Plugin {
  return {
    name: "styles-inside",
    enforce: "post",
    generateBundle(_options, bundle) {
      const page = bundle["index.html"];
      if (page?.type !== "asset") return;
      let html = String(page.source);
      for (const [name, part] of Object.entries(bundle)) {
        if (part.type !== "asset" || !name.endsWith(".css")) continue;
        html = html.replace(
          new RegExp(`\\s*<link[^>]*href="[^"]*${name.replaceAll(".", "\\.")}"[^>]*>`),
          () => `\n    <style>${String(part.source).trim()}</style>`,
        );
        delete bundle[name];
      }
      page.source = html;
    },
  };
}

export default defineConfig({
  base: "./",
  plugins: [stylesInside()],
  define: {
    __VERSION__: JSON.stringify(
      (JSON.parse(readFileSync("package.json", "utf8")) as { version: string }).version,
    ),
  },
  build: {
    outDir: "../page",
    emptyOutDir: true,
    target: "es2022",
    cssCodeSplit: false,
    modulePreload: false,
    assetsInlineLimit: 0,
    chunkSizeWarningLimit: 800,
  },
});
