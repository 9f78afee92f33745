// Files out of a drop or a file dialog, folders with all that is in them.

import { byId } from "./dom";
import { type Upload } from "./upload";

const FILES_MOST = 4096;

function fileOf(entry: FileSystemFileEntry): Promise<File> {
  return new Promise((resolve, reject) => entry.file(resolve, reject));
}

function someOf(reader: FileSystemDirectoryReader): Promise<FileSystemEntry[]> {
  return new Promise((resolve, reject) => reader.readEntries(resolve, reject));
}

async function walk(entry: FileSystemEntry, into: Upload[]): Promise<void> {
  if (into.length >= FILES_MOST) throw new Error(`more than ${FILES_MOST} files`);
  if (entry.isFile) {
    const file = await fileOf(entry as FileSystemFileEntry);
    into.push({ path: entry.fullPath.replace(/^\//, ""), file });
    return;
  }
  const reader = (entry as FileSystemDirectoryEntry).createReader();
  // A reader hands out its entries some at a time, and none at the end.
  for (let some = await someOf(reader); some.length > 0; some = await someOf(reader))
    for (const child of some) await walk(child, into);
}

// To be called inside the drop's event: the transfer is empty afterwards.
export async function filesOfDrop(transfer: DataTransfer): Promise<Upload[]> {
  const entries = [...transfer.items].map((item) => item.webkitGetAsEntry?.() ?? null);
  const plain = [...transfer.files].map((file) => ({ path: file.name, file }));
  if (!entries.some((entry) => entry?.isDirectory)) return plain;
  const files: Upload[] = [];
  for (const entry of entries) if (entry) await walk(entry, files);
  return files;
}

export function filesOfInput(input: HTMLInputElement): Upload[] {
  return [...(input.files ?? [])].map((file) => ({ path: file.webkitRelativePath || file.name, file }));
}

export function listenForFiles(onFiles: (files: Upload[]) => void, onFault: (error: unknown) => void): void {
  const input = byId<HTMLInputElement>("file");
  for (const id of ["open", "open-first"])
    byId(id).addEventListener("click", () => input.click());
  input.addEventListener("change", () => {
    const files = filesOfInput(input);
    input.value = "";
    onFiles(files);
  });
  const over = (isOver: boolean) => document.body.classList.toggle("is-over", isOver);
  addEventListener("dragover", (event) => {
    event.preventDefault();
    over(true);
  });
  addEventListener("dragleave", (event) => over(event.relatedTarget !== null));
  addEventListener("drop", (event) => {
    event.preventDefault();
    over(false);
    if (event.dataTransfer) filesOfDrop(event.dataTransfer).then(onFiles, onFault);
  });
}
