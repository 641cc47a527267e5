import { defineConfig } from "vite";

// Fixed names: the program embeds these three files.
export default defineConfig({
  base: "/",
  build: {
    assetsInlineLimit: 0,
    chunkSizeWarningLimit: 1500,
    modulePreload: false,
    rollupOptions: {
      output: {
        inlineDynamicImports: true,
        entryFileNames: "assets/studio.js",
        assetFileNames: "assets/studio[extname]",
      },
    },
  },
});
