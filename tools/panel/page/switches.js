/** Limit switches of a simulated machine, to be pressed on the page. */

/** A button per switch, which stays pressed until it is clicked again. */
export class Switches {
  #buttons = new Map();

  /**
   * @param {HTMLElement} body - the parent of the buttons
   * @param {function(string, object)} send - sends a request, see `Link.send`
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

  /** Show which switches are pressed. */
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
