import { byId, setPressed } from "./dom.js";
import { loadSetting, saveSetting } from "./settings.js";

const preference = window.matchMedia("(prefers-color-scheme: dark)");

/** Returns whether the theme is dark: as the user has selected, or else as the system prefers. */
export function isDark() {
  const chosen = loadSetting("theme");
  return chosen === null ? preference.matches : chosen === "dark";
}

/**
 * Applies the theme and connects its switch.
 *
 * @param {(dark: boolean) => void} onChange
 */
export function connectTheme(onChange) {
  const button = byId("theme");
  const apply = () => {
    const dark = isDark();
    document.documentElement.dataset.theme = dark ? "dark" : "light";
    setPressed(button, dark);
    onChange(dark);
  };
  button.addEventListener("click", () => {
    saveSetting("theme", isDark() ? "light" : "dark");
    apply();
  });
  preference.addEventListener("change", apply);
  apply();
}
