/** The guide: the state of the machine in words, and the next step. */

import { BUTTON_KEYS } from "./inputs.js";
import { BUTTON } from "./machine.js";

/**
 * Describe the state of the machine, and the next step to a milled picture.
 * @param {{connected: boolean, state: object, job: object?, machine: Machine,
 *   notice: string?}} now
 * @returns {{step: number, text: string, tone: "calm"|"good"|"bad"}} the step, 1 to 4, to do or
 *   under way; 0 if there is none
 */
export function situation({ connected, state, job, machine, notice }) {
  if (!connected) {
    return { step: 0, tone: "bad", text: "The connection is lost; the page tries again by itself. "
      + "If the program was restarted, open the address that it printed." };
  }
  if (state.building) {
    const what = typeof state.building === "string" ? state.building : "preparing the gateware";
    return { step: 1, tone: "calm", text: `Programming the board: ${what}…` };
  }
  if (notice) return { step: 0, tone: "bad", text: notice };
  if (state.error) return { step: 0, tone: "bad", text: state.error };
  if (!job) return { step: 1, tone: "calm", text: "Choose a picture." };
  const at = standing(machine, state, job);
  const paused = state.advancing ? "One step is under way: Pause ends it."
    : "Time stands still: press Run.";
  return state.running ? at : { ...at, text: `${at.text} ${paused}` };
}

function standing(machine, state, job) {
  if (state.stopped) {
    return { step: 0, tone: "bad", text: "Stopped by BTN3: no step is made. BTN0 resets; raise the "
      + "tool by hand, in manual mode, before anything else." };
  }
  if (state.lost) {
    return { step: 0, tone: "bad", text: "The position is unknown: the machine takes the place where "
      + "the tool was for its origin, and the tool for raised. Clear SW7, raise the tool by hand, "
      + "bring it to the corner, and set SW7 again." };
  }
  if (!machine.automatic) {
    return { step: 2, tone: "calm", text: "Manual mode: SW0 to SW5 move the tool. "
      + "Set SW7 (click it, or press 7) to let the machine mill." };
  }
  if (machine.lit("error")) {
    return { step: 0, tone: "bad", text: "LD6: an order was refused. If it stays lit and nothing "
      + "moves, only BTN0 ends it." };
  }
  if (machine.lit("busy")) return { step: 4, tone: "calm", text: "Milling." };
  if (machine.cut.length >= job.count && state.done) {
    return { step: 4, tone: "good", text: "Done: every pixel is cut and the tool is back. "
      + "BTN1 mills the same again, on a new plate." };
  }
  if (machine.lit("ready")) {
    return { step: 3, tone: "good", text: "Ready. Press BTN1 to start."
      + ` (Its key is ${BUTTON_KEYS[BUTTON.start].toUpperCase()}.)` };
  }
  return { step: 3, tone: "calm", text: "The machine is getting ready: wait for LD7." };
}

/** The four steps and the line below them. */
export class Guide {
  constructor() {
    this.steps = document.querySelectorAll(".steps li");
    this.status = document.getElementById("status");
    this.count = document.getElementById("cut-count");
    this.progress = document.getElementById("progress");
  }

  show(now) {
    const { step, text, tone } = situation(now);
    this.steps.forEach((element) => {
      const own = Number(element.dataset.step);
      element.classList.toggle("over", own < step);
      if (own === step) element.setAttribute("aria-current", "step");
      else element.removeAttribute("aria-current");
    });
    // A screen reader reads this line again each time that it is set.
    if (this.status.textContent !== text) this.status.textContent = text;
    this.status.dataset.tone = tone;
    const total = now.job?.count ?? 0;
    const cut = now.machine.cut.length;
    this.count.textContent = `${cut} of ${total} pixels cut`;
    this.progress.max = Math.max(1, total);
    this.progress.value = cut;
  }
}
