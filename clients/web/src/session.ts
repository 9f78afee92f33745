// Who may ask: a token comes in the address's fragment, which no server sees, and is traded for a
// cookie that scripts cannot read.

// A server that takes the connection and says nothing is as good as none: whoever asks, waits for it.
const ANSWER_MS = 5_000;

export function tokenOfFragment(fragment: string): string | null {
  return new URLSearchParams(fragment.replace(/^#/, "")).get("token");
}

// The fragment without its token; the rest stays.
export function withoutToken(fragment: string): string {
  const rest = new URLSearchParams(fragment.replace(/^#/, ""));
  rest.delete("token");
  return rest.size ? `#${rest}` : "";
}

export async function trade(token: string): Promise<boolean> {
  const reply = await fetch("/v1/session", {
    method: "POST",
    headers: { "Content-Type": "application/json", Authorization: `Bearer ${token}` },
    signal: AbortSignal.timeout(ANSWER_MS),
  });
  return reply.ok;
}

// True if the daemon wants a token that we have not shown. One that cannot be reached does not say.
export async function isUnauthorized(): Promise<boolean> {
  try {
    return (await fetch("/v1/scenes", { signal: AbortSignal.timeout(ANSWER_MS) })).status === 401;
  } catch {
    return false;
  }
}
