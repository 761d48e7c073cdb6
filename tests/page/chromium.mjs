// A headless Chromium on the page of a run: what the scripts of the browser tests share. Arguments of each script: the address of the page, a folder for
// pictures, and what it takes itself. Where the browser does not start at all, the exit status is 77.

import { spawn } from "node:child_process";
import { mkdirSync, mkdtempSync, readFileSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

const [url, pictures, ...own] = process.argv.slice(2);

// What the script takes itself.
export const more = own;
const DEADLINE = 60_000;
mkdirSync(pictures, { recursive: true });

const profile = mkdtempSync(join(tmpdir(), "understudy-browser-"));
const chromium = spawn(
  process.env.UNDERSTUDY_BROWSER || "chromium",
  ["--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--remote-debugging-pipe", `--user-data-dir=${profile}`, "about:blank"],
  { stdio: ["ignore", "ignore", "ignore", "pipe", "pipe"] },
);
const [, , , toBrowser, fromBrowser] = chromium.stdio;
// What it does not take is told by its end.
toBrowser.on("error", () => {});
const waiting = new Map();
export const problems = [];
let session;
let started = false;
let number = 0;

const ended = (how) => {
  console.error(`the browser ended: ${how}`);
  process.exit(started ? 1 : 77);
};
chromium.on("error", ended);
chromium.on("exit", (code, signal) => ended(code ?? signal));
let rest = "";

fromBrowser.setEncoding("utf8");
fromBrowser.on("data", (data) => {
  const messages = (rest + data).split("\0");
  rest = messages.pop();
  for (const text of messages) {
    const message = JSON.parse(text);
    started = true;
    if (message.id) {
      const { resolve, reject } = waiting.get(message.id);
      waiting.delete(message.id);
      message.error ? reject(new Error(message.error.message)) : resolve(message.result);
    } else if (message.method === "Runtime.exceptionThrown") {
      const { exceptionDetails: details } = message.params;
      problems.push(details.exception?.description ?? details.text);
    } else if (message.method === "Log.entryAdded" && message.params.entry.level === "error") {
      problems.push(`${message.params.entry.text} ${message.params.entry.url ?? ""}`);
    }
  }
});

export function call(method, params = {}) {
  number += 1;
  toBrowser.write(`${JSON.stringify({ id: number, method, params, sessionId: session })}\0`);
  const id = number;
  return new Promise((resolve, reject) => waiting.set(id, { resolve, reject }));
}

export async function evaluate(expression) {
  const { result, exceptionDetails } = await call("Runtime.evaluate", { expression, awaitPromise: true, returnByValue: true });
  if (exceptionDetails) {
    throw new Error(`${expression}: ${exceptionDetails.exception?.description ?? exceptionDetails.text}`);
  }
  return result.value;
}

export async function until(what, expression) {
  const started = Date.now();
  while (!(await evaluate(expression))) {
    if (Date.now() - started > DEADLINE) {
      await picture("failed");
      throw new Error(`${what} did not come: ${expression}`);
    }
    await new Promise((resolve) => setTimeout(resolve, 100));
  }
}

export async function picture(name) {
  const { data } = await call("Page.captureScreenshot", { format: "png" });
  writeFileSync(join(pictures, `${name}.png`), Buffer.from(data, "base64"));
}

export async function size(width, height, mobile) {
  await call("Emulation.setDeviceMetricsOverride", { width, height, deviceScaleFactor: mobile ? 2 : 1, mobile });
}

export async function scheme(value) {
  await evaluate("localStorage.removeItem('theme')");
  await call("Emulation.setEmulatedMedia", { features: [{ name: "prefers-color-scheme", value }] });
}

export const text = (selector) => `(document.querySelector(${JSON.stringify(selector)})?.textContent ?? "")`;
export const click = (selector) => evaluate(`(() => { const found = document.querySelector(${JSON.stringify(selector)}); if (!found) throw new Error("nothing is there"); found.dispatchEvent(new MouseEvent("click", { bubbles: true })); })()`);

// Fills an entry in, as a person does.
export const change = (selector, value) => evaluate(`(() => { const entry = document.querySelector(${JSON.stringify(selector)}); entry.value = ${JSON.stringify(value)}; for (const name of ["input", "change"]) { entry.dispatchEvent(new Event(name, { bubbles: true })); } })()`);

// Answers who gives a command and why, in the dialog that is open.
export async function answer(owner = "anna", reason = "a test") {
  await change("#command-owner", owner);
  await change("#command-reason", reason);
}

// Checks a view with axe-core, where its file is given.
export async function accessible(view, axe) {
  if (!axe) {
    return;
  }
  await evaluate(`${readFileSync(axe, "utf8")}; 0`);
  const found = await evaluate("axe.run().then(({ violations }) => violations.map(({ id, impact, nodes }) => `${id} (${impact}): ${nodes.slice(0, 3).map((node) => node.target.join(' ')).join(' | ')}`))");
  console.log(`axe ${view}: ${found.length === 0 ? "nothing" : found.join("\n  ")}`);
  if (found.length > 0) {
    problems.push(...found.map((line) => `axe ${view}: ${line}`));
  }
}

async function begin() {
  const { targetId } = await call("Target.createTarget", { url: "about:blank" });
  session = (await call("Target.attachToTarget", { targetId, flatten: true })).sessionId;
  await Promise.all(["Page.enable", "Runtime.enable", "Log.enable"].map((method) => call(method)));
  await size(1280, 900, false);
  await call("Page.navigate", { url });
}

export const open = (view) => evaluate(`location.hash = ${JSON.stringify(view)}`);

// Opens the page, and drives it; ends with 1 where something is not as it has to be.
export function run(drive) {
  begin()
    .then(drive)
    .catch((error) => problems.push(error.stack))
    .finally(() => {
      chromium.removeAllListeners("exit");
      chromium.kill();
      for (const problem of problems) {
        console.error(problem);
      }
      process.exitCode = problems.length > 0 ? 1 : 0;
    });
}
