// Questions to the server. Every answer is JSON; what cannot be answered comes as an Error with the server's own words.

export async function ask(path) {
  return answered(await fetch(path));
}

export async function tell(path, body) {
  const answer = await fetch(path, {
    method: "POST",
    headers: { "content-type": "application/json" },
    body: JSON.stringify(body),
  });
  return answered(answer);
}

async function answered(answer) {
  const content = await answer.json().catch(() => null);
  if (answer.ok) {
    return content;
  }
  if (answer.status === 401) {
    location.assign(`/login.html${location.hash}`);
  }
  const error = content?.error;
  throw new Error(error ? `${error.message} (${error.code})` : `the page answered ${answer.status}`);
}

let fading = 0;

// Says what was done, or why not, in the line at the foot of the page. It stays there until the next one.
export function toast(text) {
  const place = document.getElementById("toast");
  place.textContent = `${new Date().toLocaleTimeString()} ${text}`;
  place.dataset.fresh = "true";
  clearTimeout(fading);
  fading = setTimeout(() => { place.dataset.fresh = "false"; }, 8000);
}

// Runs an action and shows its error.
export async function act(work) {
  try {
    return await work();
  } catch (error) {
    toast(`✗ ${error.message}`);
    return undefined;
  }
}
