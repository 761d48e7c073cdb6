// The person who gives a command, and the reason. Where the person is not known by a login or keys, both are asked for and never filled in. A typed
// name stays until the page is loaded again.

import { el } from "/element.js";

let person = null;
let typed = "";
const fields = new Set();

export function prepare(run) {
  person = run.person;
}

export const owner = () => person ?? typed.trim();

// Blanks alone are no name and no reason.
const SOME = ".*\\S.*";

// A field for the name; all fields have the same one.
export function nameField(id) {
  const field = el("input", { id, type: "text", maxlength: "40", required: true, pattern: SOME, autocomplete: "off", disabled: Boolean(person) });
  field.value = owner();
  field.addEventListener("input", () => {
    typed = field.value;
    for (const other of fields) {
      if (!other.isConnected && other !== field) {
        fields.delete(other);
      } else if (other !== field) {
        other.value = typed;
      }
    }
  });
  fields.add(field);
  return field;
}

export const reasonField = (id) => el("input", { id, type: "text", maxlength: "120", required: true, pattern: SOME, autocomplete: "off" });

// Whether all fields are filled in; the first that is not gets the focus and says so.
export const complete = (...asked) => asked.every((field) => field.disabled || field.reportValidity());
