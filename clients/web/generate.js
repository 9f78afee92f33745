// gen/bounced_pb.ts from the protocol's schema, by protoc and npm's plug-in for it.
//
// usage: node generate.js

import { execFileSync } from "node:child_process";
import { mkdirSync, mkdtempSync, renameSync, rmSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const here = dirname(fileURLToPath(import.meta.url));

// The file appears whole: several tests may make it at once, and others read it meanwhile.
export function generate() {
  const gen = join(here, "gen");
  mkdirSync(gen, { recursive: true });
  const fresh = mkdtempSync(join(gen, "new-"));
  execFileSync("protoc", [
    `--plugin=protoc-gen-es=${join(here, "node_modules/.bin/protoc-gen-es")}`,
    `--es_out=${fresh}`,
    "--es_opt=target=ts",
    "-I", join(here, "../../protocol"),
    "bounced.proto",
  ]);
  renameSync(join(fresh, "bounced_pb.ts"), join(gen, "bounced_pb.ts"));
  rmSync(fresh, { recursive: true });
}

if (process.argv[1] === fileURLToPath(import.meta.url)) generate();
