/** The state of the machine, accumulated from frames. */

/** Bits of switches, buttons and LEDs. */
export const SWITCH = { automatic: 7 };
export const BUTTON = { start: 1, stop: 3 };
export const LED = { busy: 5, error: 6, ready: 7 };

/** The state after all frames so far. */
export class Machine {
  constructor() {
    this.clock = 0;
    this.rate = 0;
    this.switches = 0;
    this.buttons = 0;
    this.leds = new Uint8Array(8);
    this.display = new Uint8Array(32);
    this.motors = [0, 1, 2].map(() => ({ word: 0, position: 0 }));
    this.path = [];
    this.cut = [];
  }

  /**
   * Apply a frame.
   * @returns {{path: number, cut: number}} the indices from which path and cut are new
   * @throws {RangeError} if a list would have a gap, so that everything must be sent again
   */
  apply(frame) {
    Object.assign(this, frame.time, frame.inputs);
    for (const part of ["leds", "display", "motors"]) {
      if (frame[part]) this[part] = frame[part];
    }
    return { path: join(this.path, frame.path), cut: join(this.cut, frame.cut) };
  }

  get automatic() { return (this.switches >> SWITCH.automatic & 1) === 1; }

  /** Whether an LED is lit at least part of the time. */
  lit(name) { return this.leds[LED[name]] > 0; }
}

function join(list, part) {
  if (!part) return list.length;
  if (part.first > list.length) throw new RangeError("a gap in what was sent");
  list.length = part.first;
  for (const item of part.items) list.push(item);
  return part.first;
}
