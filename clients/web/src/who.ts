// Who does what is done here: the name that goes with each edit, so that undo takes back one's own,
// and how the server's authors are said to a person.
//
// An author is the token or user and, behind a space, the name that a client gives itself. Where
// nobody has typed one, each tab has one of its own, which outlives a reload.

const KEY = "bounced.by";
const BYTES_MOST = 64;

interface Store {
  getItem(key: string): string | null;
  setItem(key: string, value: string): void;
  removeItem(key: string): void;
}

// What the server takes: one line, 1 to 64 bytes of UTF-8; "" if nothing is left of it.
export function plainName(typed: string): string {
  let name = typed.replace(/[\p{Cc}\p{Cf}\p{Zl}\p{Zp}\p{Cs}]/gu, "").trim();
  while (new TextEncoder().encode(name).length > BYTES_MOST) name = [...name].slice(0, -1).join("").trim();
  return name;
}

function read(store: Store, key: string): string {
  try {
    return plainName(store.getItem(key) ?? "");
  } catch {
    return ""; // storage is forbidden
  }
}

// Storage that is forbidden throws when it is asked for.
function storage(find: () => Store): Store {
  try {
    return find();
  } catch {
    return { getItem: () => null, setItem: () => {}, removeItem: () => {} };
  }
}

function newName(): string {
  const [a = 0, b = 0] = crypto.getRandomValues(new Uint8Array(2));
  return `viewer ${(256 * a + b).toString(16).padStart(4, "0")}`;
}

export class Who {
  private name: string;

  static ofBrowser(): Who {
    return new Who(storage(() => localStorage), storage(() => sessionStorage));
  }

  constructor(
    private readonly browser: Store, // a name that was typed: of every tab
    private readonly tab: Store,
  ) {
    this.name = read(browser, KEY) || read(tab, KEY) || newName();
    this.keep(tab, this.name);
  }

  get by(): string {
    return this.name;
  }

  // Typed by a person; nothing: this tab alone again.
  set by(typed: string) {
    const name = plainName(typed);
    this.name = name || newName();
    this.keep(this.browser, name);
    this.keep(this.tab, this.name);
  }

  private keep(store: Store, name: string): void {
    try {
      if (name) store.setItem(KEY, name);
      else store.removeItem(KEY);
    } catch {
      // It holds for this visit, then.
    }
  }
}

// "local Anna" is Anna; "alice tablet" of a token is alice (tablet).
export function nameOf(author: string): string {
  const at = author.indexOf(" ");
  if (at < 0) return author === "local" ? "" : author;
  const [principal, name] = [author.slice(0, at), author.slice(at + 1)];
  return principal === "local" ? name : `${principal} (${name})`;
}

export interface Deed {
  readonly batch: string; // edit | undo | redo | revert
  readonly author: string;
  readonly of: bigint; // revision
  readonly changes: readonly string[];
}

// In a line, for who looks on; "" where nobody else has to be told.
export function lineOf({ batch, author, of, changes }: Deed, isMine: boolean): string {
  const verbs: Record<string, string> = {
    edit: "changed", undo: "took back", redo: "did again", revert: "went back to",
  };
  const verb = verbs[batch];
  if (!verb || (isMine && batch === "edit")) return "";
  const who = isMine ? "You" : nameOf(author) || "Somebody";
  const [first, ...rest] = changes;
  const what = rest.length > 0 ? `${first} and ${rest.length} more` : (first ?? "");
  if (batch === "edit") return `${who} ${verb} ${what || "something"}`;
  const whole = batch === "revert" ? "" : " the change";
  return `${who} ${verb}${whole}${whole ? " of" : ""} revision ${of}${what ? `: ${what}` : ""}`;
}
