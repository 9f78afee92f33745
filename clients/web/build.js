// Builds the viewer: gen/ from the protocol's schema, then dist/ from src/.
//
// usage: node build.js [OUT]      OUT is dist/ by default; the test that compares builds elsewhere
//
// Needs npm's packages (npm ci) and protoc. What it writes depends on the sources and on the
// versions in package-lock.json alone.

import { copyFileSync, mkdirSync, rmSync } from "node:fs";
import { dirname, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";
import { generate } from "./generate.js";

const here = dirname(fileURLToPath(import.meta.url));
const out = resolve(process.argv[2] ?? join(here, "dist"));

async function bundle() {
  rmSync(out, { recursive: true, force: true });
  mkdirSync(out, { recursive: true });
  await build({
    absWorkingDir: here,
    entryPoints: { viewer: "src/main.ts" },
    outdir: out,
    bundle: true,
    minify: true,
    format: "esm",
    target: ["es2022", "chrome110", "firefox110"],
    charset: "utf8",
    legalComments: "none", // page/licences.txt has them
    logLevel: "warning",
  });
  await build({
    absWorkingDir: here,
    entryPoints: { viewer: "page/viewer.css" },
    outdir: out,
    minify: true,
    logLevel: "warning",
  });
  for (const name of ["index.html", "icon.svg", "licences.txt"])
    copyFileSync(join(here, "page", name), join(out, name));
}

generate();
await bundle();
