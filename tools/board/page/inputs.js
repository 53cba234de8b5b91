/** Switches and buttons of the board, by mouse, touch and keyboard. */

import { isPress, isTyping } from "./hold.js";

/** Least milliseconds that a button is down, so that the gateware samples a short tap. */
const LEAST_HOLD = 80;

/** Milliseconds for which a switch shows this page's change, until the server's state follows. */
const OWN = 400;

const SWITCHES = 8;

/** Keys by button; on the board BTN3 is leftmost. */
export const BUTTON_KEYS = ["r", "e", "w", "q"];

/** The levels of switches and buttons that this page sets. */
export class Inputs {
  #holders = [0, 1, 2, 3].map(() => new Set());
  #since = [0, 0, 0, 0];
  #toggled = Array(SWITCHES).fill(-Infinity);

  /**
   * @param {function(string, object)} send - sends a request, see `Link.send`
   * @param {function()} shown - called when a shown level has changed
   */
  constructor(send, shown) {
    this.send = send;
    this.shown = shown;
    this.own = { switches: 0, buttons: 0 };
    this.board = { switches: 0, buttons: 0 };
  }

  /** The levels to show: the board's, and this page's of switches that it has just changed. */
  get switches() {
    const since = performance.now() - OWN;
    const mine = this.#toggled.reduce((mask, at, bit) => mask | (at > since) << bit, 0);
    return this.own.switches & mine | this.board.switches & ~mine;
  }

  get buttons() { return this.own.buttons | this.board.buttons; }

  /** Take over the levels of the board; another page may have changed them. */
  agree(switches, buttons) {
    this.board = { switches, buttons };
    this.shown();
  }

  /** Toggle one switch. Only that is sent: another page may have changed the others. */
  toggle(bit) {
    const mask = 1 << bit;
    this.own.switches = this.switches ^ mask;
    this.#toggled[bit] = performance.now();
    this.send("switches", { mask, value: this.own.switches & mask });
    this.shown();
    setTimeout(this.shown, OWN + 1);
  }

  /** Press a button. The same holder (a pointer, a key) must release it. */
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

  /** Release all buttons: the window has lost the focus, or the connection is lost. */
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

/** Make an element toggle a switch by click and key. */
export function bindSwitch(element, bit, inputs) {
  element.addEventListener("click", () => inputs.toggle(bit));
  element.addEventListener("keydown", (event) => {
    if (!isPress(event) || event.repeat) return;
    event.preventDefault();
    inputs.toggle(bit);
  });
}

/**
 * Bind keys on the whole page, except for text input.
 * @param {Inputs} inputs
 * @param {function(string): boolean} enabled - whether a key is enabled
 * @param {Object<string, function()>} others - actions of other keys
 */
export function bindKeys(inputs, enabled, others) {
  addEventListener("keydown", (event) => {
    if (event.repeat || event.ctrlKey || event.altKey || event.metaKey) return;
    const key = event.key.toLowerCase();
    if (isTyping(event.target) || !enabled(key)) return;
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
