/** The connection to the server: lost and found again by itself. */

const FIRST_WAIT = 300;
const LONGEST_WAIT = 4000;

/** A WebSocket that comes back. */
export class Link {
  /**
   * @param {{opened: function(), closed: function(), said: function(object),
   *   frame: function(ArrayBuffer)?}} heard - what to do with what comes
   */
  constructor(heard) {
    this.heard = heard;
    this.wait = FIRST_WAIT;
    this.open();
  }

  get connected() { return this.socket.readyState === WebSocket.OPEN; }

  /** Tell the server to do something; false if there is no connection. */
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
      this.heard.opened();
    };
    this.socket.onmessage = ({ data }) => this.#hear(data);
    this.socket.onclose = () => {
      this.heard.closed();
      setTimeout(() => this.open(), this.wait);
      this.wait = Math.min(2 * this.wait, LONGEST_WAIT);
    };
  }

  #hear(data) {
    try {
      if (typeof data === "string") this.heard.said(JSON.parse(data));
      else this.heard.frame?.(data);
    } catch (error) {
      // A page that has lost the thread starts anew: everything is sent to a new connection.
      if (!(error instanceof RangeError || error instanceof SyntaxError)) throw error;
      console.warn(`starting the connection anew: ${error.message}`);
      this.socket.close();
    }
  }
}
