/** Buttons that are held: by mouse, touch and keyboard. */

/**
 * Hold something for as long as a pointer or a key is down on an element.
 * @param {Element} element
 * @param {*} what - what is held
 * @param {{press: function(*, *), release: function(*, *)}} inputs - told what, and who holds it
 */
export function bindButton(element, what, inputs) {
  element.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    element.setPointerCapture(event.pointerId);
    inputs.press(what, event.pointerId);
  });
  for (const end of ["pointerup", "pointercancel", "lostpointercapture"]) {
    element.addEventListener(end, (event) => inputs.release(what, event.pointerId));
  }
  element.addEventListener("contextmenu", (event) => event.preventDefault());
  element.addEventListener("keydown", (event) => {
    if (!isPress(event)) return;
    event.preventDefault();
    if (!event.repeat) inputs.press(what, "focus");
  });
  element.addEventListener("keyup", (event) => {
    if (isPress(event)) inputs.release(what, "focus");
  });
  element.addEventListener("blur", () => inputs.release(what, "focus"));
  element.addEventListener("click", (event) => {
    // A screen reader clicks without pointer and key.
    if (event.detail > 0) return;
    inputs.press(what, "click");
    inputs.release(what, "click");
  });
}

/** Tell whether a key presses what has the focus. */
export const isPress = ({ key }) => key === " " || key === "Enter";

/** Tell whether keys are for somewhere where text is typed. */
export function isTyping(target) {
  return target.closest("input:not([type=checkbox], [type=range]), select, textarea, dialog")
    !== null;
}
