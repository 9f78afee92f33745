// What files a .gltf names, and which of those at hand they are.

export interface Named {
  readonly path: string; // with '/' between folders, as the browser tells it
}

interface GltfJson {
  buffers?: { uri?: unknown }[];
  images?: { uri?: unknown }[];
}

// Each once, as the .gltf writes them; data: holds its bytes itself.
export function urisOf(text: string): string[] {
  const json = JSON.parse(text) as GltfJson;
  const all = [...(json.buffers ?? []), ...(json.images ?? [])].map((entry) => entry?.uri);
  const named = all.filter((uri): uri is string => typeof uri === "string" && uri !== "");
  return [...new Set(named)].filter((uri) => !uri.toLowerCase().startsWith("data:"));
}

// The JSON chunk of a .glb, which may name files too; null if the bytes are no .glb.
export function jsonOfGlb(bytes: Uint8Array): string | null {
  if (bytes.length < 20) return null;
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.length);
  const [magic, size, kind] = [view.getUint32(0, true), view.getUint32(12, true), view.getUint32(16, true)];
  if (magic !== 0x46546c67 || kind !== 0x4e4f534a || size > bytes.length - 20) return null;
  return new TextDecoder().decode(bytes.subarray(20, 20 + size));
}

function decoded(uri: string): string {
  try {
    return decodeURIComponent(uri);
  } catch {
    return uri;
  }
}

// The path that `uri` means for a file at `from`; null if it leaves what was given to us.
export function resolve(from: string, uri: string): string | null {
  const plain = decoded(uri);
  if (/^([a-z][a-z0-9+.-]*:|[/\\])/i.test(plain)) return null;
  const parts = from.split("/").slice(0, -1);
  for (const part of plain.split("/")) {
    if (part === "..") {
      if (parts.length === 0) return null;
      parts.pop();
    } else if (part !== "." && part !== "") {
      parts.push(part);
    }
  }
  return parts.join("/");
}

const nameOf = (path: string) => path.slice(path.lastIndexOf("/") + 1);

// The file that `uri` means. Files picked one by one come without their folders: then the name
// alone decides, if only one has it.
export function match<F extends Named>(main: F, uri: string, files: readonly F[]): F | null {
  const path = resolve(main.path, uri);
  if (path === null) return null;
  const exact = files.find((file) => file.path === path);
  if (exact) return exact;
  const alike = files.filter((file) => nameOf(file.path) === nameOf(path));
  const flat = alike.filter((file) => !file.path.includes("/"));
  return alike.length === 1 && flat.length === 1 ? flat[0]! : null;
}

// The file to open: the only scene there is, the highest in its folders if there are several.
export function mainOf<F extends Named>(files: readonly F[]): F | null {
  const scenes = files.filter((file) => /\.(glb|gltf)$/i.test(file.path));
  const depth = (file: F) => file.path.split("/").length;
  return [...scenes].sort((a, b) => depth(a) - depth(b))[0] ?? null;
}
