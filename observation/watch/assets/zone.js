// Times of day: those of the cluster's clocks, shown in the zone of this browser or in UTC.

let utc = localStorage.getItem("zone") === "utc";

const two = (number) => String(number).padStart(2, "0");

// The parts of a time of day in the chosen zone, and by how many minutes that is ahead of UTC.
function partsOf(date) {
  const ahead = utc ? 0 : -date.getTimezoneOffset();
  const shown = new Date(date.getTime() + ahead * 60_000);
  return { day: shown.toISOString().slice(0, 10), clock: shown.toISOString().slice(11, 23), ahead };
}

const nameOf = (ahead) => (ahead === 0 ? "UTC" : `UTC${ahead < 0 ? "−" : "+"}${two(Math.floor(Math.abs(ahead) / 60))}:${two(Math.abs(ahead) % 60)}`);

// `14:03:12`, or with milliseconds; empty where no clock was recorded.
export const clock = (at, precise = false) => (at ? partsOf(new Date(at)).clock.slice(0, precise ? 12 : 8) : "");

// `14:03:12 UTC+01:00`.
export const clockAndZone = (at) => (at ? `${clock(at)} ${nameOf(partsOf(new Date(at)).ahead)}` : "");

// `2026-11-26T14:03:12.345+01:00`, as a spreadsheet reads it.
export function stamp(at) {
  const { day, clock: time, ahead } = partsOf(new Date(at));
  const zone = ahead === 0 ? "Z" : nameOf(ahead).replace("UTC", "").replace("−", "-");
  return `${day}T${time}${zone}`;
}

// With the day where it is not that of the shown cycle.
export function clockOf(at, now) {
  if (!at) {
    return "";
  }
  const { day, clock: time } = partsOf(new Date(at));
  return now && partsOf(new Date(now)).day !== day ? `${day} ${time.slice(0, 8)}` : time.slice(0, 8);
}

// The day in the chosen zone, such as `2026-11-26`.
export const dayOf = (at) => partsOf(new Date(at)).day;

// Milliseconds of the clock in the chosen zone: round hours of it are round hours of a person.
export const local = (at) => at.getTime() + partsOf(at).ahead * 60_000;

// The time of a cycle by the stretches of an answer; nothing without a recorded clock.
export function timeOf(times, cycle, periodUs) {
  const [first, at] = times.findLast(([from]) => from <= cycle) ?? times[0] ?? [];
  return at === undefined ? null : new Date(Date.parse(at) + ((cycle - first) * periodUs) / 1000);
}

// The button that changes the zone; it is there where the run has times of day.
export function showSwitch(at) {
  const button = document.getElementById("zone");
  button.hidden = !at;
  if (at) {
    const text = utc ? "Local time" : "UTC";
    button.textContent = text;
    button.setAttribute("aria-label", `Show times of day in ${utc ? "local time" : "UTC"}`);
  }
}

export function prepare() {
  document.getElementById("zone").addEventListener("click", () => {
    utc = !utc;
    localStorage.setItem("zone", utc ? "utc" : "local");
    dispatchEvent(new Event("zone"));
  });
}
