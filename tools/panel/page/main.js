/** The panel's page: connects its parts to the server. */

import { ask } from "./ask.js";
import { bindButton, isTyping } from "./hold.js";
import { Jog, DIRECTIONS } from "./jog.js";
import { FAILURE, Link, onFailure } from "./link.js";
import { Points } from "./points.js";
import { Switches } from "./switches.js";

/** Milliseconds for which an error message is shown. */
const NOTICE = 8000;

/** What this page is called, to tell it from others that show the same machine. */
const ME = crypto.randomUUID();

const TITLE = document.title;

const find = (id) => document.getElementById(id);
const create = (tag, fields = {}) => Object.assign(document.createElement(tag), fields);

/** What modes mean, where there is no note on an event. */
const MEANINGS = {
  "Idle": "Hold a button or a key to move.", "Going": "", "Jogging": "",
  "Stopped": "Hold a button or a key to move again.",
  "Limit": "Move away from the switch.", "Lost": "",
};

/** The state that the server has sent, and the parts of the page that show it. */
class Panel {
  #fading = 0;

  constructor() {
    this.hello = { axes: ["x", "y", "z"], slowest: 1, fastest: 26, travel: 14000 };
    this.state = { connected: false, doing: "connecting", mode: "Not connected", note: "",
      ports: [], limits: [], directions: [0, 0, 0], controller: null };
    this.place = { known: true, moving: false };
    this.notice = "";
    this.lost = false;
    this.failed = false;
    onFailure(() => {
      this.failed = true;
      this.#status();
    });
    const send = (name, fields) => this.link.send(name, fields);
    this.jog = new Jog(send, () => this.#show());
    this.points = new Points(find("points"), send);
    this.switches = new Switches(find("switches"), send);
    this.#build(send);
    this.#bindKeys();
    this.link = new Link({
      opened: () => this.#linked(true),
      closed: () => this.#linked(false),
      message: (message) => this.#message(message),
    });
  }

  #build(send) {
    this.axes = this.hello.axes.map((axis) => this.#axis(axis));
    this.buttons = DIRECTIONS.map((direction) => this.#jogButton(direction));
    this.speeds = this.hello.axes.map((axis, index) => this.#speed(axis, index, send));
    find("port-form").addEventListener("submit", (event) => {
      event.preventDefault();
      if (this.state.connected) send("disconnect");
      else send("connect", { port: find("port").value });
    });
    find("origin").addEventListener("click", async () => {
      const here = this.axes.map(({ place }, index) => (
        `${this.hello.axes[index].toUpperCase()} ${place.textContent}`)).join(", ");
      if (await ask(`Here is ${here} um. Make this (0, 0, 0)? Points and positions then count from `
        + "here, and there is no undo.", "Make this the origin")) send("origin");
    });
    find("stop").addEventListener("click", () => this.#stop());
  }

  #axis(axis) {
    const row = create("div", { className: "axis" });
    // No <output>: screen readers announce every change of one.
    const place = create("span", { id: `place-${axis}`, className: "place" });
    const unit = create("span", { className: "unit" });
    const mark = create("span", { className: "mark", textContent: "limit switch", hidden: true });
    row.append(create("b", { textContent: axis.toUpperCase() }), place, unit, mark);
    find("axes").append(row);
    return { row, place, unit, mark };
  }

  #jogButton(direction) {
    const button = create("button", { type: "button", id: `jog-${direction.name}` });
    button.style.gridArea = direction.name;
    button.append(create("span", { textContent: `${direction.arrow} ${direction.label}` }),
      create("small", { textContent: direction.key.toUpperCase() }));
    button.setAttribute("aria-keyshortcuts", direction.key);
    button.setAttribute("aria-pressed", "false");
    bindButton(button, direction, this.jog);
    find("jog").append(button);
    return button;
  }

  #speed(axis, index, send) {
    const field = create("div", { className: "field" });
    const slider = create("input", { id: `speed-${axis}`, type: "range", step: 1,
      min: this.hello.slowest, max: this.hello.fastest });
    const shown = create("span");
    shown.setAttribute("aria-hidden", "true"); // the slider has the same text
    const show = (speed) => {
      shown.textContent = `${speed} um/s`;
      slider.setAttribute("aria-valuetext", shown.textContent);
    };
    const label = create("label", { htmlFor: slider.id, textContent: axis.toUpperCase() });
    slider.addEventListener("input", () => {
      show(slider.value);
      send("speed", { axis: index, speed: Number(slider.value) });
    });
    field.append(label, slider, shown);
    find("speeds").append(field);
    return { slider, show };
  }

  #bindKeys() {
    const directions = new Map(DIRECTIONS.map((direction) => [direction.key, direction]));
    addEventListener("keydown", (event) => {
      if (event.key === "Escape") this.#stop();
      const direction = directions.get(event.key.toLowerCase());
      if (!direction || event.repeat || event.ctrlKey || event.altKey || event.metaKey) return;
      if (find("keys").checked && !isTyping(event.target)) this.jog.press(direction, "key");
    });
    addEventListener("keyup", ({ key }) => {
      const direction = directions.get(key.toLowerCase());
      if (direction) this.jog.release(direction, "key");
    });
    addEventListener("blur", () => this.jog.releaseAll());
    document.addEventListener("visibilitychange", () => {
      if (document.hidden) this.jog.releaseAll();
    });
  }

  #stop() {
    this.jog.releaseAll();
    this.link.send("stop");
  }

  #linked(open) {
    document.body.dataset.connection = open ? "open" : "lost";
    this.lost = !open;
    find("connection").textContent = open ? "connected" : "connection lost, trying again";
    find("stop").disabled = this.lost;
    if (open) this.link.send("page", { name: ME });
    else this.jog.releaseAll();
    this.#show();
  }

  #message(message) {
    if (message.error) this.#notice(message.error);
    const handlers = { hello: this.#hello, state: this.#state, place: this.#place,
      settings: this.#settings };
    handlers[message.topic]?.call(this, message);
    this.#show();
  }

  /** Show an error message of the server for a while. */
  #notice(text) {
    this.notice = text;
    clearTimeout(this.#fading);
    this.#fading = setTimeout(() => {
      this.notice = "";
      this.#show();
    }, NOTICE);
  }

  #hello(hello) {
    this.hello = hello;
    this.switches.offer(hello.switches);
    find("switches-panel").hidden = !hello.switches.length;
  }

  #state(state) {
    const before = this.state;
    const taken = before.controller === ME && state.controller !== ME && state.controller;
    if (taken) this.#notice("Another page has taken over; what was held here is released.");
    // What ends the holds of pages in the server: a key that is still down must be pressed anew.
    const ends = state.mode !== before.mode && !["Idle", "Jogging"].includes(state.mode);
    if (taken || ends) this.jog.releaseAll();
    this.state = state;
    this.#ports(state);
    this.switches.show(state.pressed);
  }

  #ports({ ports, port }) {
    const select = find("port");
    if (select.dataset.ports === String(ports)) return;
    const chosen = ports.includes(select.value) ? select.value : port;
    select.replaceChildren(...ports.map((name) => create("option", { textContent: name })));
    if (chosen) select.value = chosen;
    select.dataset.ports = String(ports);
  }

  #place({ um, steps, reports, known, moving }) {
    this.place = { known, moving };
    find("axes").dataset.reports = reports;
    this.axes.forEach(({ place, unit }, index) => {
      place.textContent = um[index].toFixed(2).replace("-", "−");
      unit.textContent = `um, ${steps[index]} steps`;
    });
  }

  #settings({ speeds, points }) {
    this.speeds.forEach(({ slider, show }, index) => {
      if (slider.matches(":active")) return;
      slider.value = speeds[index];
      show(speeds[index]);
    });
    this.points.show(points, this.hello.travel);
  }

  #show() {
    const { state } = this;
    const { connected, silent } = state;
    document.body.dataset.machine = connected ? "on" : "off";
    document.body.dataset.silent = Boolean(silent);
    find("connect").textContent = connected ? "Disconnect" : "Connect";
    find("connect").classList.toggle("primary", !connected);
    find("connect").disabled = this.lost || Boolean(state.doing)
      || (!connected && !state.ports.length);
    find("port").disabled = connected || Boolean(state.doing);
    find("origin").disabled = !connected || ["Going", "Jogging"].includes(state.mode);
    find("place-note").textContent = this.#worth();
    DIRECTIONS.forEach((direction, index) => {
      this.buttons[index].disabled = !connected;
      this.buttons[index].setAttribute("aria-pressed", String(this.jog.holds(direction)));
    });
    this.axes.forEach(({ row, mark }, index) => {
      const limit = state.limits.includes(this.hello.axes[index]);
      row.classList.toggle("limit", limit);
      mark.hidden = !limit;
    });
    if (this.points.points) this.points.enable(connected, state.goal);
    this.#status();
  }

  /** Describe what the position shown is worth. */
  #worth() {
    const { place: { known, moving }, state: { connected } } = this;
    if (!known) return "not from the origin, which a reset has lost";
    if (connected) return "";
    return moving ? "not sure: it was moving" : "last known";
  }

  #status() {
    const { state, notice } = this;
    const waits = state.ports.length ? "Choose the port of the machine, and press Connect."
      : "There is no serial port: plug the machine in.";
    const silence = state.silent ? "The machine does not report: is it on?" : "";
    const mode = this.lost ? "Lost" : state.mode;
    const other = state.controller && state.controller !== ME
      && ["Going", "Jogging"].includes(mode) ? "By another page. " : "";
    const doing = state.doing ? `${state.doing[0].toUpperCase()}${state.doing.slice(1)} …` : "";
    const lost = this.lost ? "The connection is lost, and Stop with it; the page tries again by"
      + " itself. If the program was restarted, open the address that it printed."
      : "";
    const failed = this.failed ? FAILURE : "";
    const text = other + (lost || failed || notice || silence || doing || state.note
      || (state.connected ? MEANINGS[mode] : waits));
    const bad = lost || failed || notice || silence || (!doing && state.bad && state.note);
    // A screen reader reads the line again each time that a part of it is set.
    for (const [id, shown] of [["mode", `${mode}.`], ["note", text]]) {
      if (find(id).textContent !== shown) find(id).textContent = shown;
    }
    find("status").dataset.tone = bad || mode === "Limit" || mode === "Lost" ? "bad" : "";
    const title = `${mode} – ${TITLE}`;
    if (document.title !== title) document.title = title;
  }
}

new Panel();
