// The address of the page has what it shows, so that a link shows the same elsewhere:
//
//   #VIEW?cycle=412&KEY=VALUE
//
// `cycle=live` is the newest one. Without `cycle` the cycle stays as it is, and without other keys a view stays as it was left.

const EVERY_MS = 300;

// Whether the page was opened at an address that another page had: it shows what the link shows, and no tour.
export const openedByLink = location.hash.length > 1;

let written = "";
// The address as it was read or written last. Another one is a step that the page has yet to take, and is not overwritten.
let seen = location.hash;
let waiting = 0;
let current = () => "";

// What the address asks for.
export function wanted() {
  seen = location.hash;
  const [view, query = ""] = seen.slice(1).split("?");
  const keys = Object.fromEntries(new URLSearchParams(query));
  const { cycle, why: reason, ...selection } = keys;
  const number = /^-?\d+$/.test(cycle ?? "") ? Number(cycle) : null;
  return { view, cycle: cycle === "live" ? "live" : number, reason, selection };
}

// The address of a view with a selection: an object of texts; what is empty is left out.
export function addressOf(view, selection = {}) {
  const keys = new URLSearchParams(Object.entries(selection).filter(([, value]) => value !== "" && value !== null && value !== undefined));
  // Commas and slashes stay readable.
  const query = keys.toString().replaceAll("%2C", ",").replaceAll("%2F", "/").replaceAll("%40", "@").replaceAll("%3A", ":");
  return `#${view}${query ? `?${query}` : ""}`;
}

// `address` is what the page shows now.
export function prepare(address) {
  current = address;
}

// What is shown has changed. A browser takes few changes of an address in a second.
export function changed() {
  waiting ||= setTimeout(() => {
    waiting = 0;
    write();
  }, EVERY_MS);
}

function write() {
  const next = current();
  if (next && next !== written && location.hash === seen) {
    written = next;
    history.replaceState(null, "", next);
    seen = location.hash;
  }
}

// The address was changed from outside: it is written anew, even if it is the same.
export function forget() {
  written = "";
  changed();
}
