// Shows a token, and goes to the page where it is accepted.

const problem = document.getElementById("problem");

document.getElementById("form").addEventListener("submit", async (event) => {
  event.preventDefault();
  problem.textContent = "";
  const token = document.getElementById("token").value;
  const answer = await fetch("/api/login", {
    method: "POST",
    headers: { "content-type": "application/json" },
    body: JSON.stringify({ token }),
  });
  if (answer.ok) {
    // A link shows what it names after the login too.
    location.assign(`/${location.hash}`);
    return;
  }
  const content = await answer.json().catch(() => null);
  problem.textContent = content?.error?.message ?? `the page answered ${answer.status}`;
});
