// Short messages that go by themselves; faults stay longer and are read out.

import { byId, el } from "./dom";

const SHOWN_MS = 7000;
const HELD_MOST = 3;

export function toast(message: string): void {
  const root = byId("toasts");
  for (const old of [...root.children]) if (old.textContent === message) old.remove();
  const item = el("p", { class: "toast" }, message);
  root.append(item);
  while (root.children.length > HELD_MOST) root.firstElementChild!.remove();
  setTimeout(() => item.remove(), SHOWN_MS);
}
