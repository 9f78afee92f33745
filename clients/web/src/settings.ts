// What the person has chosen, kept from visit to visit by this browser.

export interface Settings {
  technique: string; // "" until the server has told which there are
  parameters: Record<string, Record<string, string>>; // of each technique, those that were changed
  layer: string;
  exposure: string; // "auto" or stops
  tonemap: string;
  detail: string; // share of the screen's pixels; "" until the device is known
  coarseInMotion: boolean;
  aa: string; // sub-frames of a picture at rest
  measure: boolean; // the error, at rest
  against: string;
}

export const standard: Settings = {
  technique: "",
  parameters: {},
  layer: "beauty",
  exposure: "auto",
  tonemap: "neutral",
  detail: "",
  coarseInMotion: true,
  aa: "1",
  measure: false,
  against: "full",
};

const KEY = "bounced.settings";

// What was stored by an older page, or by hand, is taken as far as it has the right types.
export function readSettings(text: string | null): Settings {
  const settings = structuredClone(standard) as Settings & Record<string, unknown>;
  let held: unknown;
  try {
    held = JSON.parse(text ?? "{}");
  } catch {
    return settings;
  }
  if (typeof held !== "object" || held === null) return settings;
  for (const [key, value] of Object.entries(standard)) {
    const stored = (held as Record<string, unknown>)[key];
    if (typeof stored === typeof value && stored !== null) settings[key] = stored;
  }
  return settings;
}

export function loadSettings(): Settings {
  try {
    return readSettings(localStorage.getItem(KEY));
  } catch {
    return structuredClone(standard); // storage is forbidden
  }
}

export function saveSettings(settings: Settings): void {
  try {
    localStorage.setItem(KEY, JSON.stringify(settings));
  } catch {
    // It holds for this visit, then.
  }
}
