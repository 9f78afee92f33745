// A file on this machine to a scene of the daemon: blobs by content, then the scene.

import { type Progress } from "./busy";
import { type Named, jsonOfGlb, mainOf, match, urisOf } from "./gltf_files";
import { sha256Hex } from "./sha256";

export interface Upload extends Named {
  readonly file: File;
}

interface Fault {
  message?: string;
  details?: { field?: string };
}

// Of an answer that is not ok, in the server's words where it has some.
export async function faultOf(reply: Response): Promise<Error> {
  const fault = (await reply.json().catch(() => ({}))) as Fault;
  const field = fault.details?.field ? `${fault.details.field}: ` : "";
  return new Error(fault.message ? field + fault.message : `HTTP ${reply.status}`);
}

// fetch tells no progress of what it sends.
function put(url: string, bytes: Uint8Array<ArrayBuffer>, on: (share: number) => void): Promise<void> {
  return new Promise((resolve, reject) => {
    const request = new XMLHttpRequest();
    request.open("PUT", url);
    request.setRequestHeader("Content-Type", "application/octet-stream");
    request.upload.onprogress = (event) => on(event.loaded / Math.max(1, event.total));
    request.onerror = () => reject(new Error("the connection broke during the upload"));
    request.onload = () => {
      if (request.status < 300) resolve();
      else faultOf(new Response(request.responseText, { status: request.status })).then(reject);
    };
    request.send(bytes);
  });
}

// Does the server hold the blob of that name already?
export type IsHeld = (blob: string) => Promise<boolean>;

async function putBlob(bytes: Uint8Array<ArrayBuffer>, isHeld: IsHeld, on: (share: number) => void): Promise<string> {
  const blob = `sha256:${await sha256Hex(bytes)}`;
  if (!(await isHeld(blob))) await put(`/v1/blobs/${blob}`, bytes, on);
  return blob;
}

const bytesOf = async (upload: Upload) => new Uint8Array(await upload.file.arrayBuffer());

function namedIn(path: string, bytes: Uint8Array): string[] {
  const text = /\.gltf$/i.test(path) ? new TextDecoder().decode(bytes) : jsonOfGlb(bytes);
  try {
    return text === null ? [] : urisOf(text);
  } catch {
    return []; // no JSON: the server says so, and where
  }
}

// Resolves to the scene's id. Files that are missing are left to the server to judge: a scene may
// do without a texture, and the error of one that cannot names it.
export async function addScene(files: readonly Upload[], isHeld: IsHeld, on: Progress): Promise<string> {
  const main = mainOf(files);
  if (!main) throw new Error(`${listOf(files)}: there is no .glb or .gltf among the files`);
  try {
    return await add(main, files, isHeld, on);
  } catch (error) {
    throw named(main.file.name, error);
  }
}

const LISTED = 3;

// What was given, for a person who gave something else.
export function listOf(files: readonly Named[]): string {
  const names = files.slice(0, LISTED).map((file) => file.path);
  return names.join(", ") + (files.length > LISTED ? ` and ${files.length - LISTED} more` : "");
}

// A fault that begins with the file that it is about.
export function named(file: string, error: unknown): Error {
  const words = error instanceof Error ? error.message : String(error);
  return words.startsWith(file) ? new Error(words) : new Error(`${file}: ${words}`, { cause: error });
}

async function add(main: Upload, files: readonly Upload[], isHeld: IsHeld, on: Progress): Promise<string> {
  const bytes = await bytesOf(main);
  const wanted = namedIn(main.path, bytes).map((uri) => ({ uri, file: match(main, uri, files) }));
  const table: Record<string, string> = {};
  const found = wanted.filter((one) => one.file !== null);
  for (const [i, { uri, file }] of found.entries()) {
    const text = `Sending ${i + 1} of ${found.length + 1}: ${uri}`;
    on(text, 0);
    try {
      table[uri] = await putBlob(await bytesOf(file!), isHeld, (share) => on(text, share));
    } catch (error) {
      throw named(`${main.file.name}: ${uri}`, error);
    }
  }
  const text = `Sending ${main.file.name}`;
  on(text, 0);
  const blob = await putBlob(bytes, isHeld, (share) => on(text, share));
  on(`Reading ${main.file.name}`, null);
  const reply = await fetch("/v1/scenes", {
    method: "POST",
    headers: { "Content-Type": "application/json" },
    body: JSON.stringify({ blob, files: table, name: main.file.name }),
  });
  if (!reply.ok) throw await faultOf(reply);
  return ((await reply.json()) as { id: string }).id;
}
