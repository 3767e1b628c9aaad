// Builds the page into ../page: one HTML file with its styles inside, one program, and
// three.js with all that draws with it, which is asked for only where there is WebGL.
import { readFileSync } from "node:fs";
import { defineConfig } from "vite";
import { plainImports } from "./build/plain-imports.ts";
import { referencePage } from "./build/reference-page.ts";
import { stylesInside } from "./build/styles-inside.ts";

export default defineConfig({
  base: "./",
  plugins: [plainImports(), stylesInside(), referencePage()],
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
