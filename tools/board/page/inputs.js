/** Switches that toggle, buttons that are held: by mouse, touch and keyboard. */

import { isPress, isTyping } from "./hold.js";

/** No finger is quicker: the gateware must have time to see a button that was only tapped. */
const LEAST_HOLD = 80;

/** For so long the page trusts its own change, until what the server shows has caught up. */
const OWN = 400;

const SWITCHES = 8;

/** Keys, in the order in which the buttons stand on the board: BTN3 is leftmost. */
export const BUTTON_KEYS = ["r", "e", "w", "q"];

/** The levels of switches and buttons, as this page wants them. */
export class Inputs {
  #holders = [0, 1, 2, 3].map(() => new Set());
  #since = [0, 0, 0, 0];
  #toggled = Array(SWITCHES).fill(-Infinity);

  /**
   * @param {function(string, object)} send - tells the server, see `Link.send`
   * @param {function()} shown - called when what is to be shown has changed
   */
  constructor(send, shown) {
    this.send = send;
    this.shown = shown;
    this.own = { switches: 0, buttons: 0 };
    this.board = { switches: 0, buttons: 0 };
  }

  /** What to show: the board's switches, and this page's where it has just changed them. */
  get switches() {
    const since = performance.now() - OWN;
    const mine = this.#toggled.reduce((mask, at, bit) => mask | (at > since) << bit, 0);
    return this.own.switches & mine | this.board.switches & ~mine;
  }

  get buttons() { return this.own.buttons | this.board.buttons; }

  /** Take over what the board has; another page may have changed it. */
  agree(switches, buttons) {
    this.board = { switches, buttons };
    this.shown();
  }

  /** Put one switch the other way. Only that is told: the others may be another page's by now. */
  toggle(bit) {
    const mask = 1 << bit;
    this.own.switches = this.switches ^ mask;
    this.#toggled[bit] = performance.now();
    this.send("switches", { mask, value: this.own.switches & mask });
    this.shown();
    setTimeout(this.shown, OWN + 1);
  }

  /** Hold a button. Who holds it (a pointer, a key) must let go of it too. */
  press(bit, holder) {
    if (this.#holders[bit].size === 0) this.#since[bit] = performance.now();
    this.#holders[bit].add(holder);
    this.#level(bit, true);
  }

  release(bit, holder) {
    if (!this.#holders[bit].delete(holder) || this.#holders[bit].size) return;
    const left = this.#since[bit] + LEAST_HOLD - performance.now();
    setTimeout(() => {
      if (this.#holders[bit].size === 0) this.#level(bit, false);
    }, Math.max(0, left));
  }

  /** Let go of everything: the window has lost the keyboard, or the connection is gone. */
  releaseAll() {
    for (const holders of this.#holders) holders.clear();
    if (this.own.buttons) {
      this.own.buttons = 0;
      this.send("buttons", { value: 0 });
    }
    this.shown();
  }

  #level(bit, on) {
    const value = on ? this.own.buttons | (1 << bit) : this.own.buttons & ~(1 << bit);
    if (value === this.own.buttons) return;
    this.own.buttons = value;
    this.send("buttons", { value });
    this.shown();
  }
}

/** Make an element toggle a switch. */
export function bindSwitch(element, bit, inputs) {
  element.addEventListener("click", () => inputs.toggle(bit));
  element.addEventListener("keydown", (event) => {
    if (!isPress(event) || event.repeat) return;
    event.preventDefault();
    inputs.toggle(bit);
  });
}

/**
 * Let keys work anywhere on the page, but where text is typed.
 * @param {Inputs} inputs
 * @param {function(): boolean} wanted - whether they shall
 * @param {Object<string, function()>} others - what other keys do
 */
export function bindKeys(inputs, wanted, others) {
  addEventListener("keydown", (event) => {
    if (event.repeat || event.ctrlKey || event.altKey || event.metaKey || !wanted()) return;
    if (isTyping(event.target)) return;
    const key = event.key.toLowerCase();
    const button = BUTTON_KEYS.indexOf(key);
    if (/^[0-7]$/.test(key)) inputs.toggle(Number(key));
    else if (button >= 0) inputs.press(button, key);
    else others[key]?.();
  });
  addEventListener("keyup", ({ key }) => {
    const button = BUTTON_KEYS.indexOf(key.toLowerCase());
    if (button >= 0) inputs.release(button, key.toLowerCase());
  });
  addEventListener("blur", () => inputs.releaseAll());
  document.addEventListener("visibilitychange", () => {
    if (document.hidden) inputs.releaseAll();
  });
}
