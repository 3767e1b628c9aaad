// Builds the pages of the benchmarks, which are no part of the page.
import { defineConfig } from "vite";

export default defineConfig({
  root: "bench",
  base: "./",
  build: {
    target: "es2022",
    modulePreload: false,
    chunkSizeWarningLimit: 1000,
    rolldownOptions: { input: ["bench/plots.html", "bench/empty.html"] },
  },
});
