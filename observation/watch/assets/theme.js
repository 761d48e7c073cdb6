// Light or dark: the setting of the system, or the choice of the user. Runs before the page is painted to avoid flashing.

(() => {
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const root = document.documentElement;
  const show = () => {
    const chosen = localStorage.getItem("theme");
    root.dataset.theme = chosen ?? (dark.matches ? "dark" : "light");
    const button = document.getElementById("theme");
    if (button) {
      button.textContent = root.dataset.theme === "dark" ? "Light" : "Dark";
      button.setAttribute("aria-label", `Change to ${button.textContent.toLowerCase()}`);
    }
  };
  dark.addEventListener("change", show);
  show();
  addEventListener("DOMContentLoaded", () => {
    show();
    document.getElementById("theme").addEventListener("click", () => {
      localStorage.setItem("theme", root.dataset.theme === "dark" ? "light" : "dark");
      show();
      dispatchEvent(new Event("theme"));
    });
  });
})();
