/** Run and pause, speed, and its ratio to the real board. */

/** Speeds to choose from, in clocks per second; null is no limit. */
const SPEEDS = [1, 2, 5, 10, 30, 100, 300, 1e3, 3e3, 1e4, 3e4, 1e5, 3e5, 1e6, 3e6, null];

const find = (id) => document.getElementById(id);

/** Format a number with at most three significant digits: 1.25 M. */
export function short(number) {
  const [size, unit] = [[1e9, " G"], [1e6, " M"], [1e3, " k"]].find(([at]) => number >= at)
    ?? [1, " "];
  return `${Number((number / size).toPrecision(3))}${unit}`.trim();
}

/** Compare a speed with that of the real board, in words. */
export function ratio(rate, clock) {
  if (!(rate > 0)) return `The real board makes ${short(clock)} clocks/s.`;
  const slower = clock / rate;
  const times = Number(slower.toPrecision(slower < 1000 ? 2 : 3)).toLocaleString("en");
  return `${short(rate)} clocks/s now: the real board, with ${short(clock)}, is ${times} times as `
    + "fast.";
}

/** Whether clocks are made: it runs, or makes a requested step. */
const moves = ({ running, advancing }) => Boolean(running || advancing);

/** The panel for run, pause and speed. */
export class Time {
  /**
   * @param {function(string, object?)} send - sends a request
   * @param {function(string): Promise<boolean>} mayEnd - whether a running job may be ended
   */
  constructor(send, mayEnd) {
    this.send = send;
    this.state = {};
    this.clockHz = 50e6;
    this.speed = find("speed");
    this.speed.max = SPEEDS.length - 1;
    find("run").addEventListener("click", () => this.toggle());
    find("one-clock").addEventListener("click", () => send("clock", { count: 1 }));
    find("one-step").addEventListener("click", () => send("step"));
    find("power").addEventListener("click", async () => {
      if (await mayEnd("Power off and on")) send("power");
    });
    this.speed.addEventListener("input", () => {
      this.#sayWanted();
      send("speed", { clocks_per_second: SPEEDS[this.speed.value] });
    });
    find("period-form").addEventListener("submit", async (event) => {
      event.preventDefault();
      const clocks = Number(find("period").value);
      if (clocks !== this.period && await mayEnd("Set")) send("step_period", { clocks });
    });
  }

  /** Run if paused, pause if running. */
  toggle() { this.send(moves(this.state) ? "pause" : "run"); }

  /** Set the clock of the real board, its clocks per step, and its step rate. */
  limits({ clock_hz: clock, longest_period: longest, top_speed: topSpeed }) {
    this.clockHz = clock;
    this.topSpeed = topSpeed;
    if (longest) find("period").max = longest;
    this.#sayPeriod();
  }

  stateChanged(state) {
    this.state = state;
    find("run").textContent = moves(state) ? "Pause" : "Run";
    find("run").classList.toggle("primary", !moves(state));
    if (document.activeElement !== this.speed) {
      this.speed.value = nearest(state.speed);
    }
    this.#sayWanted();
  }

  jobChanged(job) {
    if (document.activeElement !== find("period")) find("period").value = job.period;
    this.rate = job.steps_per_second;
    this.period = job.period;
    this.#sayPeriod();
  }

  show({ clock, rate }) {
    find("clock").textContent = `clock ${clock.toLocaleString("en").replaceAll(",", "\u2009")}`;
    find("ratio").textContent = ratio(moves(this.state) ? rate : 0, this.clockHz);
  }

  #sayPeriod() {
    find("period-note").textContent = this.rate && this.topSpeed
      ? `${short(this.rate)} steps/s at ${short(this.clockHz)}Hz; the motors follow `
        + `${Math.floor(this.topSpeed)}`
      : "";
  }

  #sayWanted() {
    const wanted = SPEEDS[this.speed.value];
    const text = wanted === null ? "no limit"
      : `${short(wanted)} ${wanted === 1 ? "clock" : "clocks"}/s`;
    find("speed-wanted").textContent = text;
    this.speed.setAttribute("aria-valuetext", text);
  }
}

/** Return the index of the nearest speed to choose. */
function nearest(speed) {
  if (speed === null || speed === undefined) return SPEEDS.length - 1;
  const far = SPEEDS.map((at) => (at === null ? Infinity : Math.abs(Math.log(at / speed))));
  return far.indexOf(Math.min(...far));
}
