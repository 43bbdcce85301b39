// Dialogs of the page. They are not modal: STOP and everything else can be used while one is open.

let asked = null;

/** Opens a dialog; resolves with true for OK, with false if it is cancelled or another one opens. */
export function askDialog(dialog) {
  cancelDialog();
  dialog.show();
  dialog.querySelector("form").onsubmit = onSubmit;
  return new Promise((resolve) => { asked = { dialog, resolve }; });
}

/** Closes the open dialog. */
export function cancelDialog() { answer(false); }

function onSubmit(event) {
  event.preventDefault();
  answer(event.submitter?.value === "ok");
}

function answer(isOk) {
  const open = asked;
  asked = null;
  open?.dialog.close();
  open?.resolve(isOk);
}
