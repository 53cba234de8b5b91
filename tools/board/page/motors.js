/** The three motors and the tool's depth. */

import { group, label, svg } from "./svg.js";

/** Coils by bit of the word, with the colour of their wire and their angle around the rotor. */
const COILS = [
  { name: "yellow", angle: 180 },
  { name: "brown", angle: 90 },
  { name: "orange", angle: 0 },
  { name: "black", angle: 270 },
];

/** Direction of the magnetic field, by coil word: between the two coils that are on. */
const FIELD = new Map([[0b0110, 45], [0b0011, 135], [0b1001, 225], [0b1100, 315]]);

/** Degrees of the shaft per step: 48 steps per turn. */
const SHAFT = 7.5;

/** Most steps between two drawings for which the needle is animated. */
const SMOOTH = 2;

/** A motor, seen along its shaft. */
class Motor {
  constructor(axis) {
    this.axis = axis;
    this.word = null;
    this.position = 0;
    this.angle = null;
    this.coils = COILS.map(coil);
    this.needle = svg("path", { class: "needle", d: "M60 30L69 60L60 90L51 60Z" });
    this.north = svg("path", { class: "north", d: "M60 30L69 60H51Z" });
    this.rotor = svg("g", { class: "rotor" }, this.needle, this.north);
    this.mark = svg("path", { class: "mark", d: "M60 4v9" });
    // No <output>: screen readers announce every change of one.
    this.steps = document.createElement("span");
    this.mm = document.createElement("span");
    this.element = this.#draw();
  }

  /** Show its position. */
  show({ word, position }, stepMm) {
    if (word !== this.word) {
      this.word = word;
      this.coils.forEach((element, bit) => element.classList.toggle("on", word >> bit & 1));
      this.element.dataset.word = word.toString(2).padStart(4, "0");
    }
    if (position === this.position && this.angle !== null) return;
    const smooth = this.angle !== null && Math.abs(position - this.position) <= SMOOTH;
    this.position = position;
    this.element.dataset.position = position;
    this.#turn(word, smooth);
    this.steps.textContent = position.toLocaleString("en").replaceAll(",", "\u2009");
    this.mm.textContent = `${(position * stepMm).toFixed(3)} mm`;
  }

  /** Turn the needle to the field, with the number of whole turns that the position gives. */
  #turn(word, smooth) {
    const field = FIELD.get(word) ?? 45 + 90 * this.position;
    const turns = Math.round((45 + 90 * this.position - field) / 360);
    this.angle = field + 360 * turns;
    this.element.classList.toggle("smooth", smooth);
    this.rotor.style.transform = `rotate(${this.angle}deg)`;
    this.mark.style.transform = `rotate(${SHAFT * this.position}deg)`;
    this.element.dataset.angle = this.angle;
  }

  #draw() {
    const drawing = svg("svg", { viewBox: "0 0 120 120", "aria-hidden": "true" },
      svg("circle", { cx: 60, cy: 60, r: 56, class: "stator" }),
      svg("circle", { cx: 60, cy: 60, r: 45, class: "inside" }),
      ...this.coils, this.mark, this.rotor,
      svg("circle", { cx: 60, cy: 60, r: 5, class: "shaft" }));
    const element = document.createElement("div");
    element.className = "motor";
    element.id = `motor-${this.axis}`;
    const name = document.createElement("strong");
    name.textContent = this.axis.toUpperCase();
    const text = document.createElement("div");
    text.append(name, this.steps, " steps", document.createElement("br"), this.mm);
    element.append(drawing, text);
    return element;
  }
}

function coil({ name, angle }) {
  const turned = svg("g", { transform: `rotate(${angle} 60 60)`, class: `coil coil-${name}` },
    svg("rect", { x: 45, y: 9, width: 30, height: 19, rx: 3, class: "winding" }),
    ...[51, 57, 63, 69].map((x) => svg("path", { d: `M${x} 9v19`, class: "wire" })));
  return turned;
}

/** The three motors, x, y and z. */
export class Motors {
  constructor(place) {
    this.motors = ["x", "y", "z"].map((axis) => new Motor(axis));
    place.append(...this.motors.map(({ element }) => element));
  }

  show(states, stepMm) {
    this.motors.forEach((motor, index) => motor.show(states[index], stepMm));
  }
}

/** The plate seen from the side, and the tool above or in it. */
export class Gauge {
  static FACE = 130;
  static DEEP = 270;

  constructor(place) {
    this.place = place;
    this.travel = 1152;
    this.stepMm = 5 / 1152;
    this.tool = svg("g", { class: "tool" },
      svg("rect", { x: 14, y: -150, width: 32, height: 90, class: "spindle" }),
      svg("path", { d: "M25 -60H35V-14L30 0L25 -14Z", class: "bit" }));
    this.scale = svg("g");
    this.root = svg("svg", { viewBox: "0 0 100 360", "aria-hidden": "true" },
      svg("rect", { y: Gauge.FACE, width: 60, height: 180, class: "stock" }),
      svg("path", { d: `M0 ${Gauge.DEEP}H60`, class: "deep" }), this.tool, this.scale);
    place.append(this.root);
  }

  /** Set the travel in steps and the length of a step. */
  measure(travel, stepMm) {
    Object.assign(this, { travel, stepMm });
    const perMm = (Gauge.DEEP - Gauge.FACE) / travel / stepMm;
    const ticks = [];
    for (let mm = -3; Gauge.FACE + mm * perMm <= Gauge.DEEP + 0.5; mm += 1) {
      const y = Gauge.FACE + mm * perMm;
      ticks.push(svg("path", { d: `M62 ${y}h${mm % 5 ? 5 : 9}`, class: "tick" }));
      if (mm % 5 === 0) ticks.push(svg("text", { x: 74, y: y + 4, class: "number" }, `${mm}`));
    }
    const unit = svg("text", { x: 74, y: Gauge.FACE + 17, class: "number" }, "mm");
    this.scale.replaceChildren(...ticks, unit, group(0, 0, {}, label(30, 350, "Z", "number")));
  }

  show(position) {
    const y = Gauge.FACE + position * (Gauge.DEEP - Gauge.FACE) / this.travel;
    this.tool.style.transform = `translateY(${Math.max(40, Math.min(310, y))}px)`;
    this.place.dataset.position = position;
  }
}
