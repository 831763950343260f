// The WebSocket to the gateway. It comes back by itself after it was lost.
import { decodeFrame, type Frame, type Message } from "./protocol.ts";

const SUBPROTOCOL = "kilotwin-view.1";
const FIRST_RETRY_MS = 300;
const LONGEST_RETRY_MS = 4000;

export interface Listener {
  connected(): void;
  lost(): void;
  message(message: Message): void;
  frame(frame: Frame): void;
}

export class Connection {
  #socket: WebSocket | undefined;
  #retryMs = FIRST_RETRY_MS;
  readonly #listener: Listener;
  readonly #address: string;

  constructor(listener: Listener) {
    this.#listener = listener;
    this.#address = `${location.protocol === "https:" ? "wss:" : "ws:"}//${location.host}/`;
    this.#open();
  }

  get open(): boolean {
    return this.#socket?.readyState === WebSocket.OPEN;
  }

  send(request: object): void {
    if (this.open) this.#socket!.send(JSON.stringify(request));
  }

  #open(): void {
    const socket = new WebSocket(this.#address, SUBPROTOCOL);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      this.#retryMs = FIRST_RETRY_MS;
      this.#listener.connected();
    };
    socket.onmessage = (event: MessageEvent<string | ArrayBuffer>) => {
      if (typeof event.data === "string") return this.#listener.message(JSON.parse(event.data) as Message);
      const frame = decodeFrame(event.data);
      if (frame) this.#listener.frame(frame);
    };
    // An error is always followed by a close.
    socket.onclose = () => {
      if (this.#socket === socket) this.#listener.lost();
      setTimeout(() => this.#open(), this.#retryMs);
      this.#retryMs = Math.min(2 * this.#retryMs, LONGEST_RETRY_MS);
    };
    this.#socket = socket;
  }
}
