/** Limit switches of a machine in simulation, for which nobody else is there to press them. */

/** A button for each switch, which stays pressed until it is clicked again. */
export class Switches {
  #buttons = new Map();

  /**
   * @param {HTMLElement} body - where the buttons go
   * @param {function(string, object)} send - tells the server, see `Link.send`
   */
  constructor(body, send) {
    this.body = body;
    this.send = send;
  }

  /** Offer the switches at these ends, such as "X+". */
  offer(ends) {
    this.#buttons = new Map(ends.map((end) => [end, this.#button(end)]));
    this.body.replaceChildren(...this.#buttons.values());
  }

  /** Show which are pressed. */
  show(pressed) {
    for (const [end, button] of this.#buttons) {
      button.setAttribute("aria-pressed", String(pressed.includes(end)));
    }
  }

  #button(end) {
    const button = Object.assign(document.createElement("button"), {
      type: "button", id: `limit-${end}`, textContent: end.replace("-", " −").replace("+", " +"),
    });
    button.setAttribute("aria-label", `Limit switch at ${end}`);
    button.addEventListener("click", () => this.send("limit", {
      end, pressed: button.getAttribute("aria-pressed") !== "true",
    }));
    return button;
  }
}
