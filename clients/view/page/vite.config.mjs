import { defineConfig } from "vite";

// Relative addresses, so that the page works behind any path; nothing inline, so that the content security policy can forbid it.
export default defineConfig({
  base: "./",
  build: { target: "es2022", assetsInlineLimit: 0, modulePreload: { polyfill: false }, reportCompressedSize: false },
});
