/** The WebSocket connection to the server, which is reopened when it is lost, and failures. */

const FIRST_WAIT = 300;
const LONGEST_WAIT = 4000;

/** What a page shows when a part of it has failed. */
export const FAILURE = "A part of this page has failed, and it may not show the truth: reload it.";

/** Call a function when an exception is not caught: a page must not look as if it were well. */
export function onFailure(failed) {
  // What else is reported as an error, such as a size that changes too often, has no exception.
  addEventListener("error", ({ error }) => { if (error) failed(); });
  addEventListener("unhandledrejection", () => failed());
}

/** A WebSocket that reconnects. */
export class Link {
  /**
   * @param {{opened: function(), closed: function(), message: function(object),
   *   frame: function(ArrayBuffer)?}} handlers - called for events
   */
  constructor(handlers) {
    this.handlers = handlers;
    this.wait = FIRST_WAIT;
    this.open();
  }

  get connected() { return this.socket.readyState === WebSocket.OPEN; }

  /** Send a request to the server; return false without a connection. */
  send(name, fields = {}) {
    if (!this.connected) return false;
    this.socket.send(JSON.stringify({ do: name, ...fields }));
    return true;
  }

  open() {
    const address = new URL("ws", location.href);
    address.protocol = address.protocol.replace("http", "ws");
    this.socket = new WebSocket(address);
    this.socket.binaryType = "arraybuffer";
    this.socket.onopen = () => {
      this.wait = FIRST_WAIT;
      this.handlers.opened();
    };
    this.socket.onmessage = ({ data }) => this.#receive(data);
    this.socket.onclose = () => {
      this.handlers.closed();
      setTimeout(() => this.open(), this.wait);
      this.wait = Math.min(2 * this.wait, LONGEST_WAIT);
    };
  }

  #receive(data) {
    try {
      if (typeof data === "string") this.handlers.message(JSON.parse(data));
      else this.handlers.frame?.(data);
    } catch (error) {
      // After an undecodable message reconnect: everything is sent to a new connection.
      if (!(error instanceof RangeError || error instanceof SyntaxError)) throw error;
      console.warn(`reconnecting: ${error.message}`);
      this.socket.close();
    }
  }
}
