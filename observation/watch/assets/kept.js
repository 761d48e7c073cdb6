// Settings that stay over reloads: in this browser, for each cluster.

let cluster = "";

export function prepare(run) {
  cluster = run.cluster;
}

const keyOf = (name) => `${cluster}/${name}`;

// What was kept; nothing where nothing was, or where the browser keeps nothing.
export function kept(name) {
  try {
    return JSON.parse(localStorage.getItem(keyOf(name)));
  } catch {
    return null;
  }
}

export function keep(name, value) {
  try {
    localStorage.setItem(keyOf(name), JSON.stringify(value));
  } catch {
    // The setting then ends with the page.
  }
}
