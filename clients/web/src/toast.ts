// Short messages that go by themselves; faults stay longer and are read out.

import { byId, el } from "./dom";

const SHOWN_MS = 7000;
const HELD_MOST = 3;

// What is no fault, and goes sooner.
const TOLD_MS = 4000;

export const tell = (message: string): void => show(message, "toast told", TOLD_MS);
export const toast = (message: string): void => show(message, "toast", SHOWN_MS);

function show(message: string, kind: string, shownMs: number): void {
  const root = byId("toasts");
  for (const old of [...root.children]) if (old.textContent === message) old.remove();
  const item = el("p", { class: kind }, message);
  root.append(item);
  while (root.children.length > HELD_MOST) root.firstElementChild!.remove();
  setTimeout(() => item.remove(), shownMs);
}
