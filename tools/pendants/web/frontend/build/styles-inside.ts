// Puts the style sheet into the page, which saves a request before anything is seen.
import type { Plugin } from "vite";

export function stylesInside(): Plugin {
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
