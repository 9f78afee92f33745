// The socket to the daemon: hello, requests and their answers, events, and coming back by itself.
//
// A lost connection is taken up again with the session's token: what was answered meanwhile is
// said again by the server. A request that may have been lost on its way is asked again under a
// new id (edits carry a client_edit_id, so that they count once); those that belong to one
// connection alone, as a view's, fail with `Lost`, and whoever holds them listens for `onOpen`.

import { type Device, type HelloReply } from "../gen/bounced_pb";
import { waitBeforeTry } from "./backoff";
import { type Body, type BodyCase, type BodyInit, type BodyOf, decode, encode } from "./wire";

export type State =
  | { kind: "connecting" }
  | { kind: "open"; device: Device | undefined; build: string }
  | { kind: "waiting"; until: number } // performance.now() of the next try
  | { kind: "unauthorized" };

export class Refusal extends Error {
  constructor(
    readonly code: string,
    message: string,
    readonly field: string,
  ) {
    super(message);
  }
}

export class Lost extends Error {}

export interface Event {
  readonly body: Body;
  readonly payload: Uint8Array<ArrayBuffer>;
}

interface Pending {
  readonly body: BodyInit;
  readonly isBound: boolean; // to this connection: not asked again on another
  readonly onEvent: ((event: Event) => void) | undefined;
  readonly resolve: (answer: Event) => void;
  readonly reject: (error: Error) => void;
}

export interface Options {
  readonly isBound?: boolean;
  readonly onEvent?: (event: Event) => void; // of the request's id, before its answer and after
}

// A server that takes the connection and says nothing is as good as none.
const HELLO_MS = 15_000;

type Listener<T> = (value: T) => void;

export class Connection {
  private socket: WebSocket | null = null;
  private readonly pending = new Map<bigint, Pending>();
  private readonly events = new Map<bigint, (event: Event) => void>();
  private readonly stateListeners: Listener<State>[] = [];
  private readonly openListeners: Listener<boolean>[] = [];
  private nextId = 1n;
  private helloId = 0n;
  private session: string | undefined;
  private failures = 0;
  private retry = 0;
  private watchdog = 0;
  state: State = { kind: "connecting" };
  author = ""; // whose edits are this connection's, without a name of their own

  constructor(
    private readonly url: string,
    private readonly isRefused: () => Promise<boolean>, // by a token that is missing
  ) {
    addEventListener("online", () => this.tryNow());
    document.addEventListener("visibilitychange", () => {
      if (!document.hidden) this.tryNow();
    });
  }

  onState(listener: Listener<State>): void {
    this.stateListeners.push(listener);
    listener(this.state);
  }

  // Called at each hello; `true` if the session of before goes on.
  onOpen(listener: Listener<boolean>): void {
    this.openListeners.push(listener);
  }

  connect(): void {
    clearTimeout(this.retry);
    this.setState({ kind: "connecting" });
    const socket = new WebSocket(this.url, "bounced.v1");
    socket.binaryType = "arraybuffer";
    socket.onopen = () => this.sayHello();
    socket.onmessage = (event) => this.receive(event.data);
    socket.onclose = () => void this.onClose(socket);
    this.socket = socket;
    clearTimeout(this.watchdog);
    this.watchdog = window.setTimeout(() => socket.close(), HELLO_MS);
  }

  // Instead of waiting for the next try.
  tryNow(): void {
    if (this.state.kind === "waiting") this.connect();
  }

  request<C extends BodyCase>(answer: C, body: BodyInit, options: Options = {}): Promise<BodyOf<C>> {
    return this.requestWithId(answer, body, options).answer;
  }

  requestWithId<C extends BodyCase>(
    answer: C,
    body: BodyInit,
    options: Options = {},
  ): { id: bigint; answer: Promise<BodyOf<C>>; whole: Promise<Event> } {
    const id = this.nextId++;
    const { isBound = false, onEvent } = options;
    const promise = new Promise<Event>((resolve, reject) => {
      this.pending.set(id, { body, isBound, onEvent, resolve, reject });
    });
    if (onEvent) this.events.set(id, onEvent);
    if (this.state.kind === "open") this.send(id, body);
    else if (isBound) this.settle(id, (one) => one.reject(new Lost("not connected")));
    const expect = (got: Event): unknown => {
      if (got.body.case === answer) return got.body.value;
      throw new Error(`answered by ${got.body.case}, not ${answer}`);
    };
    return { id, answer: promise.then(expect) as Promise<BodyOf<C>>, whole: promise };
  }

  // The answer with its payload; lost with its connection.
  async requestWhole(answer: BodyCase, body: BodyInit): Promise<Event> {
    const asked = this.requestWithId(answer, body, { isBound: true });
    await asked.answer;
    return asked.whole;
  }

  // What has no answer. Said now or never.
  say(body: BodyInit): void {
    if (this.state.kind === "open") this.send(0n, body);
  }

  forget(id: bigint): void {
    this.events.delete(id);
  }

  // --- inside ---

  private send(id: bigint, body: BodyInit): void {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(encode(id, body));
  }

  private sayHello(): void {
    this.helloId = this.nextId++;
    const hello = { min: 1, max: 1, client: "viewer", resume: this.session };
    this.send(this.helloId, { case: "hello", value: hello });
  }

  private receive(data: unknown): void {
    if (!(data instanceof ArrayBuffer)) return;
    const { envelope, payload } = decode(data);
    const { requestId: id, body } = envelope;
    if (id === this.helloId && body.case === "helloReply") {
      this.opened(body.value);
      return;
    }
    if (isEvent(body)) {
      this.events.get(id)?.({ body, payload });
      return;
    }
    if (body.case === "error") {
      const { code, message, details } = body.value;
      const refusal = new Refusal(code, message, details?.field ?? "");
      this.events.delete(id);
      this.settle(id, (one) => one.reject(refusal));
      return;
    }
    this.settle(id, (one) => one.resolve({ body, payload }));
  }

  private settle(id: bigint, how: (one: Pending) => void): void {
    const one = this.pending.get(id);
    if (!one) return;
    // The same request may be under way under two ids.
    for (const [other, its] of this.pending) if (its === one) this.pending.delete(other);
    how(one);
  }

  private opened(hello: HelloReply): void {
    clearTimeout(this.watchdog);
    this.failures = 0;
    this.session = hello.session || undefined;
    this.author = hello.author;
    this.setState({ kind: "open", device: hello.device, build: hello.build });
    for (const one of new Set(this.pending.values())) this.askAgain(one);
    for (const listener of this.openListeners) listener(hello.resumed);
  }

  private askAgain(one: Pending): void {
    const id = this.nextId++;
    this.pending.set(id, one);
    if (one.onEvent) this.events.set(id, one.onEvent);
    this.send(id, one.body);
  }

  private async onClose(socket: WebSocket): Promise<void> {
    if (socket !== this.socket) return;
    this.socket = null;
    clearTimeout(this.watchdog);
    const bound = [...this.pending].filter(([, one]) => one.isBound);
    this.setState({ kind: "connecting" });
    for (const [id] of bound) {
      this.forget(id); // who asked asks anew, and would hear each event twice
      this.settle(id, (one) => one.reject(new Lost("connection lost")));
    }
    this.failures++;
    if (await this.isRefused()) {
      this.setState({ kind: "unauthorized" });
      return;
    }
    const wait = waitBeforeTry(this.failures, Math.random());
    this.setState({ kind: "waiting", until: performance.now() + wait });
    this.retry = window.setTimeout(() => this.connect(), wait);
  }

  private setState(state: State): void {
    this.state = state;
    for (const listener of this.stateListeners) listener(state);
  }
}

function isEvent(body: Body): boolean {
  const events: Body["case"][] = ["progress", "sceneEvent", "viewFrame", "viewEnd"];
  return events.includes(body.case);
}
