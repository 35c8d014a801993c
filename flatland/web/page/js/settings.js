/** Preferences that survive a reload of the page. */

const PREFIX = "flatland.";

/**
 * @param {string} name
 * @returns {string | null} null if it is not set, or if the browser denies access
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
    // A page in a frame or in a private window may not store anything; it works without.
  }
}
