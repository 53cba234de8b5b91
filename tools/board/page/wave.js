/** The panel for waveforms: record, download and draw a window. */

import { short } from "./time.js";

const find = (id) => document.getElementById(id);

/** Signals selected at first, if the window has them: the pins of the board. */
const FIRST = ["switches", "buttons", "leds", "digits", "axis_x", "axis_y", "axis_z"];

/** The panel of waveforms. */
export class Wave {
  #window = null;
  #state = "";
  #doing = "";

  /** @param {function(string, object?)} send - sends a request */
  constructor(send) {
    find("record-form").addEventListener("submit", (event) => {
      event.preventDefault();
      send("record", { clocks: Number(find("record-clocks").value) });
    });
    find("filter").addEventListener("input", () => this.#filter());
    find("draw").addEventListener("click", () => this.#draw());
    find("wave").addEventListener("error", () => this.#failed());
    find("wave").addEventListener("load", () => this.#show(""));
  }

  /** Set the largest number of clocks of a window. */
  limits({ most_clocks: clocks }) { find("record-clocks").max = clocks; }

  stateChanged({ recording, unrecorded, wave }) {
    find("record").disabled = Boolean(recording);
    this.#state = recording ? "recording" : unrecorded ?? size(wave);
    this.#show(this.#doing);
    if (JSON.stringify(wave) === JSON.stringify(this.#window)) return;
    this.#window = wave;
    find("vcd").hidden = find("wave-view").hidden = !wave;
    if (wave) this.#list();
  }

  /** Show the state, and what is being done. */
  #show(doing) {
    this.#doing = doing;
    find("wave-state").textContent = [this.#state, doing].filter(Boolean).join(", ");
  }

  async #list() {
    find("wave-error").textContent = "";
    this.#show("reading…");
    const response = await fetch("wave.json").catch(() => null);
    if (!response?.ok) return this.#failed(response);
    const { signals } = await response.json();
    const before = this.#chosen();
    const chosen = new Set(before.length ? before : pins(signals));
    find("signals").replaceChildren(
      ...signals.map(({ path, width }) => choice(path, width, chosen.has(path))));
    this.#filter();
    return this.#draw();
  }

  #chosen() {
    return [...find("signals").querySelectorAll("input:checked")].map(({ value }) => value);
  }

  #filter() {
    const wanted = find("filter").value.toLowerCase();
    for (const element of find("signals").children) {
      const hit = element.textContent.toLowerCase().includes(wanted);
      element.hidden = !hit && !element.querySelector("input").checked;
    }
  }

  #draw() {
    const signals = this.#chosen();
    const drawing = find("wave").parentElement;
    find("wave-error").textContent = signals.length ? "" : "Choose a signal.";
    drawing.hidden = find("wave-error").textContent !== "";
    this.#show(drawing.hidden ? "" : "drawing…");
    if (drawing.hidden) return;
    const query = new URLSearchParams({ signals: signals.join(","), at: Date.now() });
    find("wave").alt = `Waveform of ${signals.join(", ")}`;
    find("wave").src = `wave.svg?${query}`;
  }

  /** Request a failed drawing again, to read the server's error message. */
  async #failed(answer) {
    this.#show("");
    find("wave").parentElement.hidden = true;
    const response = answer ?? await fetch(find("wave").src).catch(() => null);
    const { error } = await response?.json().catch(() => ({})) ?? {};
    find("wave-error").textContent = error ?? "The waveform could not be drawn.";
  }
}

/** The paths of the board's pins: the outermost signal of each name. */
function pins(signals) {
  const depth = (path) => path.split(".").length;
  const paths = signals.map(({ path }) => path).sort((a, b) => depth(a) - depth(b));
  return FIRST.map((name) => paths.find((path) => path.split(".").at(-1) === name)).filter(Boolean);
}

/** Describe the length of a window, which may have ended early or grown too large. */
function size(wave) {
  if (!wave) return "";
  const early = wave.clocks < wave.requested ? ` of ${short(wave.requested)}, ended early` : "";
  return `${short(wave.clocks)} clocks${early}`;
}

function choice(path, width, checked) {
  const box = document.createElement("input");
  Object.assign(box, { type: "checkbox", value: path, checked });
  const bits = document.createElement("small");
  bits.textContent = width > 1 ? `${width} bits` : "";
  const element = document.createElement("label");
  element.append(box, ` ${path}`, bits);
  return element;
}
