// Has a part of the program fetched by a plain `import()`: Vite's own helper would look for styles
// to fetch with it, and all styles are in the page.
import type { Plugin } from "vite";

export function plainImports(): Plugin {
  return {
    name: "plain-imports",
    enforce: "pre",
    load: (id) =>
      id === "\0vite/preload-helper.js" ? "export const __vitePreload = (load) => load();" : null,
  };
}
