// The keys that stop: the space bar and Esc.

/** Types of an input in which a space is a character of the text. */
const TEXT_TYPES = ["text", "search", "password", "email", "url", "tel"];
/** The click that belongs to a press arrives within this time after its end. It is no second press. */
const CLICK_MS = 700;

/**
 * Stops with the space bar and Esc, whatever has the focus. In a text field a space is typed while nothing moves.
 * `stop` gets the name of the key; `mayMove` says whether something moves or may move.
 */
export function listenToStopKeys(stop, mayMove) {
  let isTaken = false;
  const onKeyDown = (event) => {
    isTaken = isStopKey(event, mayMove);
    if (!isTaken) return;
    take(event);
    if (!event.repeat) stop(isKey(event, "Escape", "Escape") ? "Escape" : "Space");
  };
  // Some browsers press a focused button when the space bar is released.
  const onKeyUp = (event) => { if (isTaken && isKey(event, " ", "Space")) take(event); };
  // The first that see a key: nothing else can take it.
  window.addEventListener("keydown", onKeyDown, { capture: true });
  window.addEventListener("keyup", onKeyUp, { capture: true });
}

function isStopKey(event, mayMove) {
  if (isKey(event, "Escape", "Escape")) return true;
  return isKey(event, " ", "Space") && (!isTextField(event.target) || mayMove());
}

/** The place of the key counts too: with an input method or another layout the character is another one. */
function isKey(event, character, place) {
  return event.key === character || event.code === place;
}

function take(event) {
  // Esc also closes the open list of a select, in which an option has the focus.
  if (!(event.key === "Escape" && event.target instanceof HTMLOptionElement)) event.preventDefault();
  event.stopImmediatePropagation();
}

function isTextField(element) {
  if (element instanceof HTMLTextAreaElement) return !element.readOnly;
  return element instanceof HTMLInputElement && TEXT_TYPES.includes(element.type) && !element.readOnly;
}

/** The button acts when it is pressed, by the mouse, a finger, Enter or a screen reader. */
export function listenToStopButton(button, stop) {
  let isDown = false, upMs = -Infinity;
  const release = () => {
    if (isDown) upMs = performance.now();
    isDown = false;
  };
  button.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    isDown = true;
    stop();
  });
  window.addEventListener("pointerup", release, { capture: true });
  window.addEventListener("pointercancel", release, { capture: true });
  button.addEventListener("click", () => { if (!isDown && performance.now() - upMs > CLICK_MS) stop(); });
  button.addEventListener("keydown", (event) => { if (event.repeat) event.preventDefault(); });
}

/** While something may move, a report in a frame does not keep the keyboard: its keys do not reach this page. */
export function keepKeysOutOfFrames(mayMove) {
  for (const frame of document.querySelectorAll("iframe")) {
    frame.tabIndex = mayMove ? -1 : 0;
    if (mayMove && document.activeElement === frame) {
      frame.blur();
      window.focus();
    }
  }
}
