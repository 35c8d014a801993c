/** Preferences that are kept when the page is reloaded. */

const PREFIX = "flatland.";

/**
 * @param {string} name
 * @returns {string | null} null if the preference is not set, or if the browser denies access
 */
export function loadSetting(name) {
  try {
    return window.localStorage.getItem(PREFIX + name);
  } catch {
    return null;
  }
}

/**
 * @param {string} name
 * @param {string} value
 */
export function saveSetting(name, value) {
  try {
    window.localStorage.setItem(PREFIX + name, value);
  } catch {
    // The browser may deny storage to a page in a frame or in a private window.
  }
}
