// A run in which an online change has replaced inputs and outputs: in replay each cycle has the names that counted in it.

import { evaluate, open, run, text, until } from "./chromium.mjs";

const list = `[...document.querySelectorAll("#signals-list .signal")].map((line) => line.querySelector(".signal-name").textContent + "=" + line.querySelector(".signal-value").textContent).filter((line) => !line.startsWith("program.")).join(" ")`;
const shows = (values) => `${list} === ${JSON.stringify(values)}`;
const watched = `[...document.querySelectorAll("#watch-table tbody tr")].map((row) => row.querySelector("th").textContent + "=" + row.dataset.value).join(" ")`;

run(async () => {
  await until("a page", `${text("#status")}.includes("cycle")`);
  await evaluate(`localStorage.setItem("tour", "done"); document.querySelector("[data-tour=skip]")?.click()`);
  await open("cluster?cycle=99");
  await until("the old points", shows("go=1 step=49 shown=49 done=1"));
  await open("cluster?cycle=100");
  await until("the new points", shows("more=1000 step=0 alarm=1 shown=1000"));
  await open("cluster?cycle=20");
  await until("the old points again", shows("go=1 step=20 shown=20 done=1"));
  // The same signal, whatever its number is.
  await open("watch?cycle=20&signals=0.output.0");
  await until("a value of before", `${watched} === "shown=20"`);
  await open("watch?cycle=120");
  await until("its value after the change", `${watched} === "shown=1020"`);
});
