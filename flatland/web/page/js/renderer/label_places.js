/** Height of a line of text, including the space to the next line [CSS pixels]. */
export const LINE_HEIGHT = 15;

/** Finds places for labels that do not cover each other. */
export class LabelPlaces {
  /** Labels by horizontal bands of one line.
   * @type {Map<number, {left: number, right: number, top: number}[]>} */
  bands = new Map();

  /**
   * Takes the first free line below a point.
   *
   * @param {number} px  centre [CSS pixels]
   * @param {number} py  centre of the first line
   * @param {number} width
   * @param {number} lines  number of lines to try
   * @returns {number | null} distance of the free line from the first one, null if all are taken
   */
  take(px, py, width, lines) {
    const [left, right] = [px - width / 2, px + width / 2];
    for (let line = 0; line < lines; line++) {
      const top = py + line * LINE_HEIGHT;
      const band = Math.floor(top / LINE_HEIGHT);
      const near = [band - 1, band, band + 1].flatMap((each) => this.bands.get(each) ?? []);
      const isTaken = near.some(
        (other) => left < other.right && right > other.left && Math.abs(top - other.top) < LINE_HEIGHT,
      );
      if (isTaken) continue;
      const own = this.bands.get(band);
      if (own) own.push({ left, right, top });
      else this.bands.set(band, [{ left, right, top }]);
      return line * LINE_HEIGHT;
    }
    return null;
  }
}
