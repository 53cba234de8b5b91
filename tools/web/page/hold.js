/** Press and hold of elements by mouse, touch and keyboard. */

/**
 * Press and release something with a pointer or a key on an element.
 * @param {Element} element
 * @param {*} what - first argument of `press` and `release`
 * @param {{press: function(*, *), release: function(*, *)}} inputs - also given the pointer or key
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
    // A screen reader clicks without a pointer or a key.
    if (event.detail > 0) return;
    inputs.press(what, "click");
    inputs.release(what, "click");
  });
}

/** Return whether a key presses the focused element. */
export const isPress = ({ key }) => key === " " || key === "Enter";

/** Return whether keys on an element are text input. */
export function isTyping(target) {
  return target.closest("input:not([type=checkbox], [type=range]), select, textarea, dialog")
    !== null;
}
