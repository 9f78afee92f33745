// The shown scene as a file, to where the browser keeps what it downloads.
//
// Fetched, not linked to: what the server refuses is then said on the page.

import { el } from "./dom";
import { faultOf } from "./upload";

// A browser may read the bytes after the click.
const HELD_MS = 60_000;

export function fileNameOf(scene: string): string {
  return `${scene.replace(/\.(glb|gltf)$/i, "").trim() || "scene"}.glb`;
}

// Resolves to how the file differs from the scene, in the server's words; "" if it does not.
export async function exportScene(id: string, name: string): Promise<string> {
  const reply = await fetch(`/v1/scenes/${encodeURIComponent(id)}/export`);
  if (!reply.ok) throw await faultOf(reply);
  save(await reply.blob(), fileNameOf(name));
  return reply.headers.get("Bounced-Flag") ?? "";
}

function save(file: Blob, name: string): void {
  const url = URL.createObjectURL(file);
  el("a", { href: url, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(url), HELD_MS);
}
