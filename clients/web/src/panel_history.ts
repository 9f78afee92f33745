// The scene's log, newest first, and the way back to any of it.

import { type LogEntry } from "../gen/bounced_pb";
import { button, el, field } from "./dom";

import { type Who, nameOf } from "./who";

const SHOWN = 30;

function words(entry: LogEntry): string {
  if (entry.message) return entry.message;
  const [first, ...rest] = entry.changes;
  if (!first) return entry.kind;
  return rest.length > 0 ? `${first} and ${rest.length} more` : first;
}

export class HistoryPanel {
  constructor(
    private readonly root: HTMLElement,
    who: Who,
    onUndoAll: () => void,
    private readonly onRevert: (revision: bigint) => void,
  ) {
    const name = el("input", { type: "text", maxlength: 64, autocomplete: "nickname", spellcheck: "false" });
    name.value = who.by;
    name.addEventListener("change", () => {
      who.by = name.value;
      name.value = who.by;
    });
    const all = button("Undo the last change of anybody", onUndoAll, { class: "quiet" });
    root.before(field("Your name", name, "Goes with what you change; undo takes back what has it"), all);
  }

  show(entries: readonly LogEntry[]): void {
    const rows = [...entries].reverse().slice(0, SHOWN).map((entry, i) => this.row(entry, i === 0));
    this.root.replaceChildren(
      rows.length > 0 ? el("ol", { class: "log" }, ...rows) : el("p", { class: "note" }, "Nothing was changed yet."),
    );
  }

  private row(entry: LogEntry, isCurrent: boolean): HTMLElement {
    const time = entry.timeMs ? new Date(Number(entry.timeMs)) : null;
    const kind = entry.kind === "edit" ? null : el("i", {}, `${entry.kind} `);
    const author = nameOf(entry.author);
    return el("li", { "aria-current": isCurrent ? "true" : null },
      el("span", { class: "rev" }, String(entry.revision)),
      el("span", { class: "what", title: entry.changes.join(", ") }, kind, entry.kind === words(entry) ? "" : words(entry)),
      author ? el("span", { class: "who", title: entry.author }, author) : "",
      time ? el("time", { datetime: time.toISOString() }, time.toLocaleTimeString([], { hour: "2-digit", minute: "2-digit" })) : "",
      isCurrent ? el("span", { class: "now" }, "now")
        : button("Back to", () => this.onRevert(entry.revision), { class: "quiet", "aria-label": `Back to revision ${entry.revision}` }),
    );
  }
}
