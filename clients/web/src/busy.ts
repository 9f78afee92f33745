// What takes its time: said over the picture until it is done, one thing or several.

import { byId, set } from "./dom";

export type Progress = (text: string, share: number | null) => void;

let underWay = 0;

export async function busy(work: (on: Progress) => Promise<void>): Promise<void> {
  const root = byId("busy");
  underWay++;
  try {
    await work((text, share) => {
      root.hidden = false;
      byId("busy-text").textContent = text;
      set(byId("busy-share"), { value: share });
    });
  } finally {
    root.hidden = --underWay === 0;
  }
}
