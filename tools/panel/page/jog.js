/** Axes that are held: by mouse, touch and keyboard, several at once. */

/** Milliseconds after which the server is told again that something is still held. */
const AGAIN = 300;

/** The six directions to move, the key of each, and what it is called. */
export const DIRECTIONS = [
  { name: "yp", axis: 1, sign: 1, key: "w", label: "Y +", arrow: "↑" },
  { name: "ym", axis: 1, sign: -1, key: "s", label: "Y −", arrow: "↓" },
  { name: "xm", axis: 0, sign: -1, key: "a", label: "X −", arrow: "←" },
  { name: "xp", axis: 0, sign: 1, key: "d", label: "X +", arrow: "→" },
  { name: "zm", axis: 2, sign: -1, key: "q", label: "Z −", arrow: "⇩" },
  { name: "zp", axis: 2, sign: 1, key: "e", label: "Z +", arrow: "⇧" },
];

/** What is held, and what becomes of it: opposite directions of an axis make it stand still. */
export class Jog {
  #holders = new Map(DIRECTIONS.map((direction) => [direction, new Set()]));
  #said = "0,0,0";
  #again = 0;

  /**
   * @param {function(string, object=)} send - tells the server, see `Link.send`
   * @param {function()} shown - called when what is to be shown has changed
   */
  constructor(send, shown) {
    this.send = send;
    this.shown = shown;
  }

  /** Whether a direction is held, whatever becomes of it. */
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

  /** Let go of everything: the window has lost the keyboard, or the machine shall stop. */
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
