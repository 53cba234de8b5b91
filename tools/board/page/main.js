/** The board's page: connects its parts to the server. */

import { ask } from "./ask.js";
import { Board, legend } from "./board.js";
import { decode } from "./frames.js";
import { Guide } from "./guide.js";
import { bindButton } from "./hold.js";
import { Inputs, bindKeys } from "./inputs.js";
import { Job } from "./job.js";
import { Link, onFailure } from "./link.js";
import { BUTTON, Machine } from "./machine.js";
import { Gauge, Motors } from "./motors.js";
import { describe, describeReal, title } from "./progress.js";
import { Table, darkPixels } from "./table.js";
import { Time } from "./time.js";
import { Wave } from "./wave.js";

/** Milliseconds for which an error message is shown. */
const NOTICE = 8000;

/** Keys that end a job, and what they stand for. */
const ENDING_KEYS = { 7: "SW7", r: "BTN0" };

const find = (id) => document.getElementById(id);

/** The state that the server has sent, and the parts of the page that show it. */
class Page {
  #fresh = { path: Infinity, cut: Infinity };
  #drawing = 0;
  #undrawn = false;
  #fading = 0;

  constructor() {
    this.machine = new Machine();
    this.hello = { clock_hz: 50e6, pixel_steps: 128, z_travel: 1152, step_mm: 5 / 1152 };
    this.state = {};
    this.progress = { building_s: null, job: null };
    this.job = null;
    this.notice = null;
    this.failed = false;
    onFailure(() => {
      this.failed = true;
      this.#later();
    });
    const send = (name, fields) => this.link.send(name, fields);
    this.inputs = new Inputs(send, () => this.#inputsChanged());
    this.board = new Board(find("board"), this.inputs);
    bindButton(find("stop"), BUTTON.stop, this.inputs);
    this.table = new Table(find("table"));
    this.gauge = new Gauge(find("gauge"));
    this.gauge.measure(this.hello.z_travel, this.hello.step_mm);
    this.motors = new Motors(find("motors"));
    const mayEnd = (what) => this.#mayEnd(what);
    this.time = new Time(send, mayEnd);
    this.wave = new Wave(send);
    this.guide = new Guide();
    this.picker = new Job(mayEnd);
    this.#inputsChanged();
    bindKeys(this.inputs, (key) => this.#keyCounts(key), { p: () => this.time.toggle() });
    this.link = new Link({
      opened: () => this.#connected(true),
      closed: () => this.#connected(false),
      message: (message) => this.#message(message),
      frame: (data) => this.#frame(decode(data)),
    });
  }

  /** Whether a job is under way that could be completed. */
  get #mills() {
    return this.machine.lit("busy") && !this.state.stopped && !this.state.error;
  }

  /** Return whether what ends a job may be done: a running job is asked about. */
  async #mayEnd(what) {
    return !this.#mills || ask("A job is running, and would end. Its plate would be lost.", what);
  }

  /** Return whether a key counts: a stray one does not end a running job. */
  #keyCounts(key) {
    if (!find("keys").checked) return false;
    const clicked = ENDING_KEYS[key];
    if (!clicked || !this.#mills) return true;
    this.#notice(`A job is running, which ${clicked} would end: click it if you want that.`);
    this.#later();
    return false;
  }

  #connected(connected) {
    document.body.dataset.connection = connected ? "open" : "lost";
    if (connected) {
      // A new connection gets the whole state, and has released all buttons.
      this.machine = new Machine();
      this.#fresh = { path: 0, cut: 0 };
    } else {
      find("connection").textContent = "connection lost, trying again";
      this.inputs.releaseAll();
    }
    this.#later();
  }

  #message(message) {
    if (message.error) this.#notice(message.error);
    const handlers = { hello: this.#hello, job: this.#job, state: this.#state,
      progress: this.#progress };
    handlers[message.topic]?.call(this, message);
    // At once: a tab that is behind others draws nothing.
    const tab = title(this.progress, this.job?.count ?? 0, this.state);
    if (document.title !== tab) document.title = tab;
    this.#later();
  }

  /** Show an error message of the server for a while. */
  #notice(text) {
    this.notice = text;
    clearTimeout(this.#fading);
    this.#fading = setTimeout(() => {
      this.notice = null;
      this.#later();
    }, NOTICE);
  }

  #hello(hello) {
    this.hello = { ...this.hello, ...hello };
    const pages = hello.pages > 1 ? `, ${hello.pages} pages` : "";
    find("connection").textContent = `connected, engine ${hello.engine}${pages}`;
    this.time.limits(this.hello);
    this.wave.limits(this.hello);
    this.picker.limits(this.hello);
    this.gauge.measure(this.hello.z_travel, this.hello.step_mm);
  }

  #job(job) {
    this.job = job;
    find("job").dataset.number = job.number;
    find("job").textContent =
      `${job.name ?? "picture"}: ${job.columns} × ${job.rows}, ${job.count} pixels to cut`;
    this.time.jobChanged(job);
    this.#loadTarget(job);
  }

  #loadTarget(job) {
    const image = find("target");
    image.onload = () => {
      image.hidden = false;
      this.table.load(job.rows, job.columns, this.hello.pixel_steps, darkPixels(image));
    };
    image.src = `target.png?at=${Date.now()}`;
  }

  #state(state) {
    this.state = state;
    this.time.stateChanged(state);
    this.wave.stateChanged(state);
  }

  #progress(progress) {
    this.progress = progress;
    const count = this.job?.count ?? 0;
    find("meter").textContent = describe(progress, count);
    find("real").textContent = describeReal(progress, count);
  }

  #frame(frame) {
    this.#undrawn = true;
    this.#later();
    const fresh = this.machine.apply(frame);
    this.#fresh.path = Math.min(this.#fresh.path, fresh.path);
    this.#fresh.cut = Math.min(this.#fresh.cut, fresh.cut);
    if (frame.inputs) this.inputs.agree(this.machine.switches, this.machine.buttons);
  }

  /** Draw with the next animation frame, once for all data received meanwhile. */
  #later() {
    this.#drawing ||= requestAnimationFrame(() => {
      this.#drawing = 0;
      // The server sends the next frame after the last one is drawn: a slow page is not flooded.
      // A part that cannot be drawn must not keep the page from all that follows.
      const answer = this.#undrawn;
      this.#undrawn = false;
      try {
        this.#draw();
      } finally {
        if (answer) this.link.send("next");
      }
    });
  }

  #draw() {
    const { machine } = this;
    const connected = document.body.dataset.connection === "open";
    const { state, job, notice, failed } = this;
    this.guide.show({ connected, state, job, machine, notice, failed });
    this.board.lightsChanged(machine);
    this.motors.show(machine.motors, this.hello.step_mm);
    this.gauge.show(machine.motors[2].position);
    this.table.show(machine, this.#fresh);
    this.#fresh = { path: Infinity, cut: Infinity };
    this.time.show(machine);
    find("table").dataset.cut = machine.cut.length;
    find("table").ariaLabel = "The plate from above, X + down and Y + to the right: "
      + `${machine.cut.length} of ${job?.count ?? 0} pixels cut`;
  }

  #inputsChanged() {
    this.board.inputsChanged();
    const { switches } = this.inputs;
    find("legend").textContent = legend(switches);
    find("mode").textContent = switches >> 7 & 1 ? "automatic mode" : "manual mode";
  }
}

new Page();
