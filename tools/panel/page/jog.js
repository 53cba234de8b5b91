/** Axes that are held: by mouse, touch and keyboard, several at once. */

/** Milliseconds after which the server is told again that something is still held. */
const AGAIN = 300;

/** The six ways to move, the key of each, and what it is called. */
export const WAYS = [
  { name: "yp", axis: 1, way: 1, key: "w", label: "Y +", arrow: "↑" },
  { name: "ym", axis: 1, way: -1, key: "s", label: "Y −", arrow: "↓" },
  { name: "xm", axis: 0, way: -1, key: "a", label: "X −", arrow: "←" },
  { name: "xp", axis: 0, way: 1, key: "d", label: "X +", arrow: "→" },
  { name: "zm", axis: 2, way: -1, key: "q", label: "Z −", arrow: "⇩" },
  { name: "zp", axis: 2, way: 1, key: "e", label: "Z +", arrow: "⇧" },
];

/** What is held, and what becomes of it: opposite ways of an axis make it stand still. */
export class Jog {
  #holders = new Map(WAYS.map((way) => [way, new Set()]));
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

  /** Whether a way is held, whatever becomes of it. */
  holds(way) { return this.#holders.get(way).size > 0; }

  get ways() {
    const ways = [0, 0, 0];
    for (const way of WAYS) if (this.holds(way)) ways[way.axis] += way.way;
    return ways;
  }

  press(way, holder) {
    this.#holders.get(way).add(holder);
    this.#tell();
  }

  release(way, holder) {
    if (this.#holders.get(way).delete(holder)) this.#tell();
  }

  /** Let go of everything: the window has lost the keyboard, or the machine shall stop. */
  releaseAll() {
    for (const holders of this.#holders.values()) holders.clear();
    this.#tell();
  }

  #tell() {
    const { ways } = this;
    if (String(ways) !== this.#said) {
      this.#said = String(ways);
      this.send("jog", { ways });
    }
    const held = ways.some((way) => way);
    if (held && !this.#again) this.#again = setInterval(() => this.send("holding"), AGAIN);
    if (!held && this.#again) this.#again = clearInterval(this.#again) ?? 0;
    this.shown();
  }
}
