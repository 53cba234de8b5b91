/** The Nexys 2 as a drawing: switches, buttons, LEDs and display. */

import { chips, digit, read } from "./drawing.js";
import { bindButton } from "./hold.js";
import { BUTTON_KEYS, bindSwitch } from "./inputs.js";
import { group, label, svg } from "./svg.js";

/** Places and distances of the parts, on a wide page and on a phone. */
const LAYOUTS = {
  wide: {
    size: [680, 372], display: [40, 118], leds: [62, 236, 48], switches: [62, 270, 48],
    buttons: [458, 270, 58], chips: "wide",
  },
  narrow: {
    size: [360, 416], display: [16, 58], leds: [25, 176, 44.3], switches: [25, 212, 44.3],
    buttons: [54, 314, 84], chips: "narrow",
  },
};
const NARROW = 520;

const JOG = ["X +", "X −", "Y +", "Y −", "Z up", "Z down", "", "manual"];
const AUTOMATIC = ["count", "count", "", "", "", "", "", "auto"];
const BUTTON_NAMES = ["reset", "start", "", "stop"];
const LED_NAMES = ["coil", "coil", "coil", "coil", "", "busy", "error", "ready"];
const COUNTS = ["the movement under way", "X", "Y", "Z"];

/**
 * Return the opacity that shows a duty cycle, corrected for the gamma of screens.
 * @param {number} duty - duty cycle, 0 to 255
 */
export function brightness(duty) {
  return (duty / 255) ** (1 / 2.2);
}

/** The drawing of the board. */
export class Board {
  #shown = new Map();
  #layout = null;

  /**
   * @param {HTMLElement} place - the element that it fills
   * @param {Inputs} inputs - changed by its switches and buttons
   */
  constructor(place, inputs) {
    this.place = place;
    this.inputs = inputs;
    this.lights = { leds: new Uint8Array(8), display: new Uint8Array(32) };
    this.root = svg("svg", { role: "group", "aria-label": "Nexys 2 board" });
    place.append(this.root);
    new ResizeObserver(() => this.#draw()).observe(place);
    this.#draw();
  }

  /** Show the levels of switches and buttons, and their meanings in this mode. */
  inputsChanged() {
    const { switches, buttons } = this.inputs;
    const names = switches >> 7 & 1 ? AUTOMATIC : JOG;
    this.switches.forEach((element, bit) => {
      element.setAttribute("aria-checked", String((switches >> bit & 1) === 1));
      element.setAttribute("aria-label", `SW${bit} ${names[bit] || "not used"}`);
      element.querySelector(".meaning").textContent = names[bit] || "–";
    });
    this.buttons.forEach((element, bit) => {
      element.setAttribute("aria-pressed", String((buttons >> bit & 1) === 1));
    });
  }

  /** Show the brightness of LEDs and digits. */
  lightsChanged({ leds, display }) {
    this.lights = { leds, display };
    this.leds.forEach((element, bit) => {
      this.#light(element, leds[bit]);
      name(element.parentElement, `LD${bit} ${LED_NAMES[bit]}: ${leds[bit] ? "on" : "off"}`);
    });
    name(this.display, `Display: ${read(display)}`);
    this.segments.forEach((element, index) => this.#light(element, display[index]));
  }

  #light(element, duty) {
    if (this.#shown.get(element) === duty) return;
    this.#shown.set(element, duty);
    element.style.opacity = brightness(duty);
    element.dataset.duty = duty;
  }

  #draw() {
    const layout = this.place.clientWidth < NARROW ? "narrow" : "wide";
    if (layout === this.#layout) return;
    const focused = this.root.contains(document.activeElement) && document.activeElement.id;
    this.#layout = layout;
    const at = LAYOUTS[layout];
    this.root.setAttribute("viewBox", `0 0 ${at.size.join(" ")}`);
    this.root.replaceChildren(...chips(at.chips, at.size));
    this.segments = this.#drawDisplay(at.display);
    this.leds = row(8, at.leds, (bit, x, y) => this.#drawLed(bit, x, y));
    this.switches = row(8, at.switches, (bit, x, y) => this.#drawSwitch(bit, x, y, at.switches[2]));
    this.buttons = row(4, at.buttons, (bit, x, y) => this.#drawButton(bit, x, y, at.buttons[2]));
    // The highest bit is leftmost, as on the board, also in the order of the Tab key.
    for (const parts of [this.leds, this.switches, this.buttons]) parts.reverse();
    this.#shown.clear();
    this.lightsChanged(this.lights);
    this.inputsChanged();
    if (focused) document.getElementById(focused)?.focus();
  }

  #drawDisplay([x, y]) {
    const lit = [];
    const housing = this.display = group(x, y, { id: "display", role: "img" },
      svg("rect", { width: 216, height: 92, rx: 5, class: "housing" }));
    for (const place of [3, 2, 1, 0]) {
      const parts = digit();
      parts.lit.forEach((segment, index) => {
        segment.dataset.segment = place * 8 + index;
        lit[place * 8 + index] = segment;
      });
      housing.append(group(14 + (3 - place) * 50, 13, {}, ...parts.dark, ...parts.lit));
    }
    this.root.append(housing);
    return lit;
  }

  #drawLed(bit, x, y) {
    const lit = svg("g", { class: "lit", id: `led${bit}` },
      svg("circle", { r: 17, class: "glow" }),
      svg("rect", { x: -8, y: -6, width: 16, height: 12, rx: 2, class: "led-on" }));
    lit.style.opacity = 0;
    const kind = `led led-${LED_NAMES[bit] || "none"}`;
    this.root.append(group(x, y, { class: kind, role: "img" },
      svg("rect", { x: -8, y: -6, width: 16, height: 12, rx: 2, class: "led-off" }), lit,
      label(0, -13, `LD${bit}`), label(0, 21, LED_NAMES[bit], "silk small")));
    return lit;
  }

  #drawSwitch(bit, x, y, pitch) {
    const element = control(x, y, pitch, 84, {
      id: `sw${bit}`, role: "switch", tabindex: 0, "aria-keyshortcuts": bit, class: "switch" },
      svg("rect", { x: -11, y: 16, width: 22, height: 40, rx: 2, class: "body" }),
      svg("rect", { x: -8, y: 19, width: 16, height: 17, rx: 2, class: "knob" }),
      label(0, 11, `SW${bit}`), ...badge(0, 63, bit), label(0, 84, "", "silk small meaning"));
    bindSwitch(element, bit, this.inputs);
    this.root.append(element);
    return element;
  }

  #drawButton(bit, x, y, pitch) {
    const key = BUTTON_KEYS[bit];
    const meaning = BUTTON_NAMES[bit];
    const element = control(x, y, pitch, 84, {
      id: `btn${bit}`, role: "button", tabindex: 0, "aria-keyshortcuts": key, class: "button",
      "aria-label": `BTN${bit} ${meaning || "not used"}` },
      svg("rect", { x: -20, y: 16, width: 40, height: 40, rx: 4, class: "body" }),
      svg("circle", { cy: 36, r: 13, class: "knob" }),
      label(0, 11, `BTN${bit}`), ...badge(0, 63, key.toUpperCase()),
      label(0, 84, meaning || "–", "silk small meaning"));
    bindButton(element, bit, this.inputs);
    this.root.append(element);
    return element;
  }
}

/** Set the name that screen readers read for an element. */
function name(element, text) {
  if (element.getAttribute("aria-label") !== text) element.setAttribute("aria-label", text);
}

/** Describe the meaning of switches and LEDs in the present mode. */
export function legend(switches) {
  if (switches >> 7 & 1) {
    return `SW0 and SW1 choose the count that the display shows in hexadecimal steps: `
      + `now ${COUNTS[switches & 3]}. SW7 off selects manual mode.`;
  }
  return "SW0 to SW5 move an axis for as long as they are on; LD0 to LD3 show its coils. The"
    + " display is dark. SW7 selects automatic mode.";
}

/** Draw a row of parts, the highest bit leftmost. */
function row(count, [x, y, pitch], draw) {
  return Array.from({ length: count }, (_, n) => draw(count - 1 - n, x + n * pitch, y));
}

/** A part that takes clicks on its whole area, and shows when it has the focus. */
function control(x, y, width, height, attributes, ...drawing) {
  const area = { x: -width / 2 + 1, y: -3, width: width - 2, height: height + 7, rx: 6 };
  return group(x, y, attributes, svg("rect", { ...area, class: "area" }), ...drawing);
}

/** The label of the key for the same action. */
function badge(x, y, key) {
  return [svg("rect", { x: x - 8, y: y - 2, width: 16, height: 13, rx: 3, class: "badge" }),
    label(x, y + 8, key, "badge-text")];
}
