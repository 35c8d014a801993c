/**
 * Returns the names that contain all words of a query, best matches first: names in which the words
 * begin parts of the path, then short names, then those that come first in the list.
 *
 * @param {string[]} names
 * @param {string} query  words, separated by spaces; the case of letters is ignored
 * @param {number} limit  largest number of results
 */
export function bestMatches(names, query, limit) {
  const words = query.toLowerCase().split(/\s+/).filter(Boolean);
  const found = [];
  for (const name of names) {
    const lower = name.toLowerCase();
    if (!words.every((word) => lower.includes(word))) continue;
    const inner = words.filter((word) => !lower.startsWith(word) && !lower.includes(`/${word}`)).length;
    found.push({ name, inner });
  }
  if (words.length > 0) found.sort((a, b) => a.inner - b.inner || a.name.length - b.name.length);
  return found.slice(0, limit).map(({ name }) => name);
}
