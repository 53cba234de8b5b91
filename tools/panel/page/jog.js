/** Jogging by mouse, touch and keyboard, several axes at once. */

/** Milliseconds between messages that a hold continues. */
const AGAIN = 300;

/** The six directions, with their keys and labels. */
export const DIRECTIONS = [
  { name: "yp", axis: 1, sign: 1, key: "w", label: "Y +", arrow: "↑" },
  { name: "ym", axis: 1, sign: -1, key: "s", label: "Y −", arrow: "↓" },
  { name: "xm", axis: 0, sign: -1, key: "a", label: "X −", arrow: "←" },
  { name: "xp", axis: 0, sign: 1, key: "d", label: "X +", arrow: "→" },
  { name: "zm", axis: 2, sign: -1, key: "q", label: "Z −", arrow: "⇩" },
  { name: "zp", axis: 2, sign: 1, key: "e", label: "Z +", arrow: "⇧" },
];

/** The held directions; an axis with both held stands still. */
export class Jog {
  #holders = new Map(DIRECTIONS.map((direction) => [direction, new Set()]));
  #said = "0,0,0";
  #again = 0;

  /**
   * @param {function(string, object=)} send - sends a request, see `Link.send`
   * @param {function()} shown - called when a shown direction has changed
   */
  constructor(send, shown) {
    this.send = send;
    this.shown = shown;
  }

  /** Whether a direction is held. */
  holds(direction) { return this.#holders.get(direction).size > 0; }

  get directions() {
    const directions = [0, 0, 0];
    for (const direction of DIRECTIONS) {
      if (this.holds(direction)) directions[direction.axis] += direction.sign;
    }
    return directions;
  }

  press(direction, holder) {
    this.#holders.get(direction).add(holder);
    this.#tell();
  }

  release(direction, holder) {
    if (this.#holders.get(direction).delete(holder)) this.#tell();
  }

  /** Release all directions: the window has lost the focus, or the machine is stopped. */
  releaseAll() {
    for (const holders of this.#holders.values()) holders.clear();
    this.#tell();
  }

  #tell() {
    const { directions } = this;
    if (String(directions) !== this.#said) {
      this.#said = String(directions);
      this.send("jog", { directions });
    }
    const held = directions.some((direction) => direction);
    if (held && !this.#again) this.#again = setInterval(() => this.send("holding"), AGAIN);
    if (!held && this.#again) this.#again = clearInterval(this.#again) ?? 0;
    this.shown();
  }
}
